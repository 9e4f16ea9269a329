"""Steps that turn the tool of an arm with six axes, in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby, product
from operator import itemgetter
from pathlib import Path

import pytest
from harness.page.hand import ACCEPTED, Hand
from harness.page.theatre import SIZES, Theatre, open_theatre

MINUS = "\N{MINUS SIGN}"
TURNS = (("world", "tool"), ("0.1", "1", "10"), "XYZ", (MINUS, "+"))
"""What a turn is about, and how far: by day tested on the function that finds it, in
tests/unit/operator_panel/control/test_turns.py."""


@pytest.fixture
def theatre(tmp_path: Path) -> Iterator[Theatre]:
    """Give the page of another robot than the article's."""
    with open_theatre(tmp_path, robot="articulated_six") as made:
        yield made


@pytest.mark.thorough
def test_arm_of_six_axes_turns_its_tool_in_steps(theatre: Theatre) -> None:
    """About each axis, 0.1, 1 and 10 degrees, in both frames; the move is sent and accepted."""
    hand = Hand(theatre)
    theatre.resize("phone")
    theatre.play("ready")
    panel = hand.panel("Jog")
    hand.choose(panel.get_by_role("tab", name="Step tool", exact=True))
    steps = panel.locator("[data-way-panel=steps]")
    for axis, sign in product("XYZ", (MINUS, "+")):
        step = hand.button(f"Step {axis} {sign}", steps)
        hand.command(step, f"Step {axis} {sign}1 mm, world", *ACCEPTED)
    for (frame, size), rows in groupby(product(*TURNS), itemgetter(0, 1)):
        for chosen in (frame.capitalize(), size):
            hand.choose(steps.get_by_role("tab", name=chosen, exact=True))
        for *_, axis, sign in rows:
            told = f"Turn {axis} {sign}{size} deg, {frame}"
            hand.command(hand.button(f"Turn {axis} {sign}", steps), told, *ACCEPTED)
    only = steps.get_by_role("switch", name="Only preview")
    only.click()
    hand.button("Turn Z +", steps).click()
    hand.page.locator("[data-motion-play]").wait_for()
    hand.page.locator("[data-motion-close]").click()
    only.click()
    assert [left for left in hand.left() if left.startswith("steps")] == []
    problems = []
    for size in SIZES:
        theatre.resize(size)
        problems += theatre.problems(f"{size}, turns")
    assert problems == []
