"""Held jog buttons in a real browser: they move while they are held, and by nothing else."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.page.acts import take_control
from harness.page.hand import Hand
from harness.page.theatre import SIZES, Theatre, kept_theatre
from harness.processes import wait_until
from harness.running.thorough import SEARCH
from playwright.sync_api import Locator, expect

NAMES = {"joint_1", "joint_2", "joint_3"}


@pytest.fixture
def button(theatre: Theatre) -> Iterator[Locator]:
    """Give the button that jogs the tool along x, on a page that has the focus."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.open("Jog")
    theatre.open("Hold tool")
    found = theatre.page.get_by_role("button", name="Jog X +", exact=True)
    expect(found).to_be_enabled()
    jogged(theatre, keep=False)  # what the test before has moved is not of this one
    yield found
    theatre.page.mouse.up()
    theatre.page.mouse.move(5, 5)


def jogged(theatre: Theatre, keep: bool = True) -> list[dict[str, float]]:
    """Return what was jogged since the last rest: a page that stutters ends a jog by itself."""
    asked = theatre.page.request.get(f"{theatre.address}/jogged?keep={keep}")
    told: list[dict[str, float]] = asked.json()
    return told


def moves(theatre: Theatre) -> dict[str, float]:
    """Wait until something moves; return the first velocities."""

    def first() -> dict[str, float]:
        return next((each for each in jogged(theatre) if any(each.values())), {})

    return wait_until(first, 10.0, "a jog")


def rests(theatre: Theatre) -> None:
    """Wait for an explicit zero, and look that nothing comes behind it."""

    def ended() -> list[dict[str, float]]:
        told = jogged(theatre)
        return [] if told and any(told[-1].values()) else told

    known = len(wait_until(ended, 10.0, "the end of a jog"))
    theatre.page.wait_for_timeout(400)  # longer than the dead man's time
    assert not any(any(each.values()) for each in jogged(theatre, keep=False)[known:])


def test_tool_moves_while_its_button_is_held(theatre: Theatre, button: Locator) -> None:
    """All joints of the arm together; fast is faster, and the tool's own axes are others."""
    told: dict[str, dict[str, float]] = {}
    for choice in ("World", "Fast", "Tool"):
        shown = theatre.page.locator("[data-way-panel=hold_tool]")
        shown.get_by_role("tab", name=choice, exact=True).click()
        button.hover()
        theatre.page.mouse.down()
        told[choice] = moves(theatre)
        theatre.page.mouse.up()
        rests(theatre)
    slow, fast, own = (told[name] for name in ("World", "Fast", "Tool"))
    assert set(slow) == NAMES
    assert fast == {name: pytest.approx(8.0 * value, rel=1e-3) for name, value in slow.items()}
    assert own != pytest.approx(fast)


@pytest.mark.parametrize("how", ["leave", "blur", "space", "escape"])
def test_held_tool_stops_when_the_hand_or_the_page_is_gone(
    theatre: Theatre, button: Locator, how: str
) -> None:
    """The finger leaves, another window comes, STOP is pressed: each ends it for good."""
    button.hover()
    theatre.page.mouse.down()
    moves(theatre)
    if how == "leave":
        theatre.page.mouse.move(5, 5)
    elif how == "blur":
        theatre.page.evaluate("window.dispatchEvent(new Event('blur'))")
    else:
        theatre.page.keyboard.press(how.capitalize())
        expect(theatre.page.locator("[data-stop-answer=STOP]")).to_have_text("confirmed")
    rests(theatre)


def test_page_that_stutters_stops_the_tool_and_the_same_press_never_moves_it_again(
    theatre: Theatre, button: Locator
) -> None:
    """After 0.25 s without a sign; the button is still held when the page goes on."""
    button.hover()
    theatre.page.mouse.down()
    moves(theatre)
    theatre.page.evaluate(
        "() => { const until = performance.now() + 400; while (performance.now() < until); }"
    )
    rests(theatre)
    assert "held" in str(button.get_attribute("class")), "the hand has not let go"
    theatre.page.mouse.up()
    theatre.page.mouse.down()
    moves(theatre)


def test_enter_key_holds_a_button_too(theatre: Theatre, button: Locator) -> None:
    """Without a mouse; its end is the key that goes up, or the focus that goes away."""
    for end in ("up", "tab"):
        button.focus()
        theatre.page.keyboard.down("Enter")
        moves(theatre)
        if end == "up":
            theatre.page.keyboard.up("Enter")
        else:
            theatre.page.keyboard.press("Tab")
        rests(theatre)
        theatre.page.keyboard.up("Enter")


# Where the twin's tool is in the browser's window.
TOOL = """() => {
    const { view, tool } = window.panel.scene;
    const box = view.renderer.domElement.getBoundingClientRect();
    const at = view.camera.position.clone().set(...tool).project(view.camera);
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
}"""
FROM_ABOVE = "() => window.panel.scene.view.camera.position.z > 1.5"


@pytest.mark.thorough
def test_the_twin_goes_after_a_pointer_that_drags_its_tool() -> None:
    """In the picture, while Guide is pressed; let go, a lost pointer and STOP end it for good.

    A picture of the past moves nothing: the tool is elsewhere now.
    """
    with kept_theatre(draws=True) as drawn:
        drawn.resize("low")
        drawn.play("ready")
        page = drawn.page
        take_control(page)
        guide = page.locator("[data-guide]")
        page.wait_for_function("() => window.panel?.scene.tool")
        for end in ("no guide", "release", "past", "leave", "blur", "escape"):
            if end == "release":
                Hand(drawn).switch(guide)
                guide.click()
                page.wait_for_function(FROM_ABOVE)
                drawn.settle()
            if end == "past":
                page.locator("[data-look-back]").click()
                expect(guide).to_have_attribute("aria-pressed", "false")
                guide.click()
                jogged(drawn, keep=False)
            x, y = page.evaluate(TOOL)

            def drag(x: float = x, y: float = y) -> dict[str, float]:
                page.mouse.up()
                page.mouse.move(x, y)
                page.mouse.down()
                page.mouse.move(x - 30.0, y, steps=3)
                page.wait_for_timeout(300)
                return next((each for each in jogged(drawn) if any(each.values())), {})

            if end in ("no guide", "past"):
                assert drag() == {} and jogged(drawn) == []
            else:
                # A page that stutters lets a press die before the pointer has left the tool.
                assert set(wait_until(drag, 20.0, "a dragged tool")) == NAMES
            if end == "past":
                page.locator("[data-look-back]").click()
                drawn.settle()
            if end == "leave":
                page.mouse.move(5, 5)
            elif end == "blur":
                page.evaluate("window.dispatchEvent(new Event('blur'))")
            elif end == "escape":
                page.keyboard.press("Escape")
                expect(page.locator("[data-stop-answer=STOP]")).to_have_text("confirmed")
            page.mouse.up()
            if end not in ("no guide", "past"):
                rests(drawn)
        problems = []
        for size in SIZES if SEARCH else ("phone",):  # where its words have the least room
            drawn.resize(size)
            problems += drawn.problems(f"{size}, guide")
        assert problems == []
