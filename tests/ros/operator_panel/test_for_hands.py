"""The page for hands and eyes: what can be touched, read and relied on to stay where it is.

In a real browser, at four sizes, light and dark, with scenes in place of a cell.
"""

from __future__ import annotations

import pytest
from harness.page.theatre import SIZES, Theatre
from playwright.sync_api import expect

WAYS = ("Hold tool", "Step joint", "Step tool", "Hold joint")
TABS = ("Jog", "Target", "Programs", "Robot", "Tuning", "Recordings", "Events", "Today")


@pytest.mark.parametrize("size", SIZES)
def test_everything_can_be_touched_and_read_at_each_size_light_and_dark(
    theatre: Theatre, size: str
) -> None:
    """44 px to touch, 60 for STOP and jog, 14 px to read, nothing cut or covered, WCAG AA."""
    theatre.resize(size)
    theatre.play("following")
    found = []
    for tab in TABS:
        theatre.open(tab)
        for colours in ("light", "dark"):
            theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            found += theatre.problems(f"{size}, {colours}, {tab}")
    # The buttons of the views stand on a picture that this browser cannot draw.
    theatre.page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    expect(theatre.page.get_by_role("button", name="Side", exact=True)).to_be_visible()
    found += theatre.problems(f"{size}, views")
    theatre.page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")
    theatre.open("Jog")
    for way in WAYS:
        theatre.open(way)
        found += theatre.problems(f"{size}, {way}")
    for scene in ("asked", "alarmed"):
        theatre.play(scene)
        for colours in ("light", "dark"):
            theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            found += theatre.problems(f"{size}, {colours}, {scene}")
    assert found == []


@pytest.mark.parametrize("size", SIZES)
def test_nothing_moves_when_alarms_commands_and_troubles_come(theatre: Theatre, size: str) -> None:
    """0 px: who presses a button presses the one that he saw."""
    theatre.resize(size)
    theatre.open("Jog")
    theatre.play("ready")
    theatre.settle()
    before = theatre.places()
    for scene in ("alarmed", "no_stop", "asked", "stopped", "aligning"):
        theatre.play(scene)
        theatre.settle()
        moved = {
            name: (before.get(name), place)
            for name, place in theatre.places().items()
            if before.get(name) != place
        }
        assert moved == {}, f"{scene}: (left, top, width, height) before and after"


def test_measure_finds_what_it_looks_for(theatre: Theatre) -> None:
    """A page that is bad in each way is told so: the test above can fail."""
    theatre.resize("low")
    theatre.page.emulate_media(color_scheme="light")
    theatre.play("ready")
    bad = """
        .commands .button.q-btn { min-height: 30px !important; }
        .stop-button { min-height: 50px !important; }
        .mode-motion { font-size: 12px !important; }
        .card-title, .joint-name { color: #b8c0c8 !important; }
        .bar-mode { width: 80px !important; overflow: hidden !important; white-space: nowrap; }
        .link-figures { position: relative; top: -14px; }
    """
    style = theatre.page.add_style_tag(content=bad)
    found = theatre.problems("bad")
    style.evaluate("element => element.remove()")
    for kind in ("touch", "small", "cut", "contrast", "overlap"):
        assert any(text.startswith(f"bad: {kind}") for text in found), (kind, found)


@pytest.mark.parametrize("size", SIZES)
def test_usual_command_is_read_without_scrolling(theatre: Theatre, size: str) -> None:
    """Its title with three numbers, its outcome, who sent it and when."""
    theatre.resize(size)
    theatre.play("ready")
    theatre.open("Target")
    theatre.page.get_by_role("button", name="P3", exact=True).click()
    theatre.page.get_by_role("button", name="Move", exact=True).click()
    line = theatre.page.locator("[data-command='0']")
    expect(line).to_have_attribute("data-outcome", "done")
    expect(line).to_contain_text("Move to x")
    assert line.evaluate("line => line.scrollHeight <= line.clientHeight"), size


def test_words_on_the_model_do_not_reach_into_the_camera_beside_it(theatre: Theatre) -> None:
    """A legend that ends in the middle of a word explains nothing."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    theatre.open("Both")
    camera = theatre.page.locator(".camera").bounding_box()
    for place in (".legend", ".scene-tools"):
        box = theatre.page.locator(place).bounding_box()
        assert camera and box and box["x"] + box["width"] <= camera["x"], place
    theatre.open("Model")
    theatre.page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")
