"""The page for hands and eyes: what can be touched, read and relied on to stay where it is.

In a real browser, at four sizes, light and dark, with scenes in place of a cell.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from itertools import cycle

import pytest
from harness.page.theatre import SIZES, Theatre, at_sizes, begin_exercise
from harness.processes import wait_until
from harness.running.thorough import SEARCH
from playwright.sync_api import expect

WAYS = ("Hold tool", "Step joint", "Step tool", "Hold joint")
COLOURS = ("light", "dark")
TABS = ("Jog", "Target", "Programs", "Teach", "Charts")
TABS += ("Robot", "Tuning", "Recordings", "Events", "Today")


class Themes:
    """Light and dark: both in a search, else in turns, so that each size and each scene meets both.

    No rule of the page asks for a size and a theme at once.
    """

    def __init__(self, theatre: Theatre, size: str) -> None:
        """Begin with another one for each next size."""
        self._page = theatre.page
        first = list(SIZES).index(size) % 2
        self._turns = cycle(COLOURS[first:] + COLOURS[:first])

    def each(self) -> Iterator[str]:
        """Show the page in one theme after the other; give each name."""
        for colours in COLOURS if SEARCH else (next(self._turns),):
            self._page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            yield colours


@pytest.mark.parametrize("size", SIZES)
def test_everything_can_be_touched_and_read_at_each_size_light_and_dark(
    theatre: Theatre, size: str
) -> None:
    """44 px to touch, 60 for STOP and jog, 14 px to read, nothing cut or covered, WCAG AA."""
    theatre.resize(size)
    theatre.play("following")
    begin_exercise(theatre.runs)
    exercise = theatre.page.locator(".course-card .fold-line")
    expect(exercise).to_be_visible()
    found = []
    themes = Themes(theatre, size)
    for tab in TABS:
        theatre.open(tab)
        for colours in themes.each():
            found += theatre.problems(f"{size}, {colours}, {tab}")
    # The buttons of the views stand on a picture that this browser cannot draw.
    theatre.page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    expect(theatre.page.get_by_role("button", name="Top", exact=True)).to_be_visible()
    found += theatre.problems(f"{size}, views")
    theatre.page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")
    theatre.open("Jog")
    for way in WAYS:
        theatre.open(way)
        found += theatre.problems(f"{size}, {way}")
    fold = theatre.page.locator(".alarms-line")
    for scene in ("asked", "estop", "stopped", "alarmed"):
        theatre.play(scene)
        for colours in themes.each():
            found += theatre.problems(f"{size}, {colours}, {scene}")
    fold.click()
    found += theatre.problems(f"{size}, all alarms", ".alarms-all")
    fold.click()
    exercise.click()
    found += theatre.problems(f"{size}, exercise", ".course-all")
    exercise.click()
    assert found == []


@at_sizes("phone")
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


# Share of the screen [%] on which the picture is seen and nothing else: at least so much.
LEAST = {"phone": 35.0, "tablet": 40.0, "low": 45.0, "wide": 45.0}
UNCOVERED = """() => {
    const over = [...document.querySelectorAll(".scene-body *")];
    const kept = over.map((element) => element.style.pointerEvents);
    for (const element of over) element.style.pointerEvents = "auto";
    // Roberts' sequence covers the plane evenly, without rows that a straight edge lies along.
    const POINTS = 600; // more would stop the page for too long
    let seen = 0;
    for (let k = 0; k < POINTS; k += 1) {
        const [x, y] = [(0.5 + k * 0.7548776662466927) % 1, (0.5 + k * 0.5698402909980532) % 1];
        const found = document.elementFromPoint(x * innerWidth, y * innerHeight);
        if (found?.matches(".scene-body, .scene-card") || found?.closest(".scene")) seen += 1;
    }
    over.forEach((element, k) => { element.style.pointerEvents = kept[k]; });
    return 100 * seen / POINTS;
}"""


@at_sizes("low")
def test_picture_is_the_largest_thing_whatever_happens(theatre: Theatre, size: str) -> None:
    """At rest, moving, paused by an alarm, stopped, in a preview and while somebody looks back."""
    page = theatre.page
    theatre.resize(size)
    themes, found = Themes(theatre, size), list[str]()

    def look(what: str) -> None:
        for colours in themes.each():
            theatre.settle()
            share = page.evaluate(UNCOVERED)
            if share < LEAST[size]:
                found.append(f"{what}, {colours}: {share:.1f} %")

    # This browser cannot draw the model: its place is measured all the same.
    page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    for scene in ("following", "held", "alarmed", "stopped", "estop", "ready"):
        theatre.play(scene)
        look(scene)
    theatre.open("Target")
    page.get_by_role("button", name="Preview Home").click()
    expect(page.locator("[data-motion-play]")).to_be_visible()
    look("preview")
    page.locator("[data-motion-close]").click()
    theatre.remembered()
    page.locator("[data-look-back]").click()
    expect(page.locator("[data-past-text]")).to_contain_text("Past: ")
    look("look back")
    page.get_by_role("button", name="Live", exact=True).click()
    page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")
    assert found == []


def test_measure_finds_what_it_looks_for(theatre: Theatre) -> None:
    """A page that is bad in each way is told so: the test above can fail."""
    theatre.resize("low")
    theatre.page.emulate_media(color_scheme="light")
    theatre.play("ready")
    bad = """
        .commands .button.q-btn { min-height: 30px !important; }
        .stop-button { min-height: 50px !important; }
        .mode-motion { font-size: 12px !important; }
        .joint-apart { color: #b8c0c8 !important; }
        .next-step { width: 80px !important; overflow: hidden !important; white-space: nowrap; }
        .joint-name { position: relative; top: 18px; }
    """
    style = theatre.page.add_style_tag(content=bad)
    found = theatre.problems("bad")
    style.evaluate("element => element.remove()")
    for kind in ("touch", "small", "cut", "contrast", "overlap"):
        assert any(text.startswith(f"bad: {kind}") for text in found), (kind, found)


@at_sizes("low")
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
    """Who leads, and how far the tools are apart, are read beside the camera too."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    theatre.open("Both")
    camera = theatre.page.locator(".camera").bounding_box()
    for place in (".lead-card", ".deviation-card"):
        box = theatre.page.locator(place).bounding_box()
        assert camera and box and box["x"] + box["width"] <= camera["x"], place
    theatre.open("Model")
    theatre.page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")


# Both live charts, where they are shown, have letters of this size of the screen.
DRAWN = """() => ["motion", "loop"].every((name) => {
    const chart = getElement(window.PANEL.charts[name]).chart;
    if (!chart.getDom().offsetParent) return true;
    const size = 0.875 * parseFloat(getComputedStyle(document.documentElement).fontSize);
    const place = chart.getDom();
    const fits = chart.getWidth() === place.clientWidth;
    const isFitted = fits && chart.getHeight() === place.clientHeight;
    return isFitted && Math.abs(chart.getOption().yAxis[0].axisLabel.fontSize - size) < 0.1;
})"""


def drawn(theatre: Theatre, where: str) -> list[str]:
    """Return what is wrong with the drawings once they are drawn; they have 3 s for that."""
    theatre.page.wait_for_function(DRAWN)
    with contextlib.suppress(AssertionError):
        wait_until(lambda: not theatre.drawn_problems(where), 3.0, "letters that have room")
    return theatre.drawn_problems(where)


@at_sizes("tablet")
def test_drawn_letters_are_as_large_as_all_others_and_have_room(
    theatre: Theatre, size: str
) -> None:
    """Axes, units and legends of the live charts, and of the step response in Tuning."""
    page = theatre.page
    page.emulate_media(color_scheme="light")
    theatre.resize("tablet")  # letters grow when a window does
    theatre.play("following")
    page.wait_for_function(DRAWN)
    theatre.resize(size)
    theatre.open("Charts")
    found = drawn(theatre, size)
    for kind in ("Loop", "Motion"):
        tab = page.get_by_role("tab", name=kind, exact=True).locator("visible=true")
        if tab.count():
            tab.click()
            found += drawn(theatre, f"{size}, {kind}")
    theatre.open("Tuning")
    page.get_by_role("button", name="Preview step").click()
    expect(page.locator('[data-panel="Tuning"] .preview').last).to_contain_text("Typed gains")
    expect(page.locator(".step-chart")).to_be_visible()
    page.wait_for_function(
        """() => getElement(Number(document.querySelector(".step-chart").id.slice(1)))
            .chart.getOption()?.series[1].data.length > 0"""
    )
    found += drawn(theatre, f"{size}, Tuning")
    theatre.open("Jog")
    assert found == []


@at_sizes("flat")
def test_reason_of_a_lower_speed_is_read_without_scrolling(theatre: Theatre, size: str) -> None:
    """The longest usual one, and one about a person."""
    theatre.page.set_viewport_size({"width": 1280, "height": 640})
    if size != "flat":
        theatre.resize(size)
    for scene in ("held", "alarmed"):
        theatre.play(scene)
        expect(theatre.page.locator(".speed-reason")).to_contain_text("lowered")
        theatre.settle()
        place = theatre.page.locator(".speed-fact")
        heights = place.evaluate("place => [place.scrollHeight, place.clientHeight]")
        assert heights[0] <= heights[1], (size, scene)
        assert theatre.problems(f"{size}, {scene}") == []
