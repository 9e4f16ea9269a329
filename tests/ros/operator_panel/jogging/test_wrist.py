"""The tool of a SCARA with a wrist, in a real browser: turned in steps, held, and by a yaw."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.page.hand import ACCEPTED, Hand
from harness.page.theatre import SIZES, Theatre, open_theatre
from playwright.sync_api import expect

MINUS = "\N{MINUS SIGN}"


@pytest.fixture
def theatre(tmp_path: Path) -> Iterator[Theatre]:
    """Give the page of a robot whose twin has joint 4."""
    with open_theatre(tmp_path, robot="scara_4axis") as made:
        yield made


@pytest.mark.thorough
def test_a_scara_with_a_wrist_turns_its_tool_about_the_vertical(theatre: Theatre) -> None:
    """Steps and a held button about Z alone; a target with a yaw, and along a line."""
    hand = Hand(theatre)
    theatre.resize("phone")
    theatre.play("ready")
    panel = hand.panel("Jog")
    hand.choose(panel.get_by_role("tab", name="Step tool", exact=True))
    steps = panel.locator("[data-way-panel=steps]")
    for sign in (MINUS, "+"):
        told = f"Turn Z {sign}1 deg, world"
        hand.command(hand.button(f"Turn Z {sign}", steps), told, *ACCEPTED)
    hand.choose(panel.get_by_role("tab", name="Hold tool", exact=True))
    held = panel.locator("[data-way-panel=hold_tool]")
    expect(hand.button("Jog Turn Z +", held)).to_be_enabled()
    for way in (steps, held):
        assert way.get_by_text("Turn X").count() == way.get_by_text("Not on this").count() == 0
    target = hand.panel("Target")
    for name, value in (("X", "400"), ("Y", "100"), ("Z", "100"), ("Yaw", "90,0")):
        target.get_by_label(name, exact=True).fill(value)
    expect(target.get_by_text("write the decimal with a point")).to_be_visible()
    target.get_by_label("Yaw", exact=True).fill("90")
    expect(target.locator(".preview")).to_contain_text("90.00 deg")
    place = "Move to x 400 y 100 z 100 mm"
    hand.command(hand.button("Move", target), f"{place}, yaw 90.0 deg at 50 %", *ACCEPTED)
    target.get_by_label("Yaw", exact=True).fill("")
    hand.command(hand.button("Move", target), f"{place} at 50 %", "done")
    tool_speed = target.get_by_label("Tool speed", exact=True)
    expect(tool_speed).to_be_hidden()
    target.get_by_label("Way", exact=True).click()
    theatre.page.get_by_role("option", name="Line", exact=True).click()
    tool_speed.fill("0")
    expect(target.get_by_text("0 mm/s is outside 1 to 5000 mm/s")).to_be_visible()
    tool_speed.fill("150")
    line = place.replace("Move to", "Move in a line to")
    hand.command(hand.button("Move", target), f"{line}, tool 150 mm/s at 50 %", "done")
    hand.button("Clear", target).click()
    expect(target.get_by_label("X", exact=True)).to_have_value("")
    problems = []
    for size in SIZES:
        theatre.resize(size)
        problems += theatre.problems(f"{size}, yaw")
    assert problems == []
