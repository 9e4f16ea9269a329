"""A program is taught on the page: recorded, changed, tried, kept and taken away."""

from __future__ import annotations

import re

from harness.page.acts import take_control
from harness.page.scenes import SCENES
from harness.page.taught_pallet import Actions, teach_pallet
from harness.page.theatre import Theatre, at_sizes
from harness.yaml_files import CONFIG
from operator_panel.teach.draft import draft_of
from operator_panel.teach.places import stands_at
from playwright.sync_api import Locator, expect
from scara_config import load_robot
from scara_config.programs.files import joint_values
from what_if.cell_files_io import find_program, resting_cell
from what_if.judging import judge
from what_if.verdict import Outcome


def begin(theatre: Theatre) -> None:
    """Open the tab in control, with an empty draft."""
    theatre.page.request.get(f"{theatre.address}/begin")
    take_control(theatre.page)
    theatre.open("Teach")
    expect(rows(theatre)).to_have_count(1)


def rows(theatre: Theatre) -> Locator:
    """Return the lines that are shown, that in front of the first too."""
    return theatre.page.locator("[data-teach-line]")


def press(theatre: Theatre, *names: str) -> None:
    """Press buttons of the tab one after the other."""
    panel = theatre.page.locator('[data-panel="Teach"]')
    for name in names:
        button = panel.get_by_role("button", name=name, exact=True)
        expect(button).to_be_enabled()
        button.click()


@at_sizes()  # test_every_control.py uses each control of the tab each time
def test_program_is_taught_tried_undone_and_taken_away(theatre: Theatre, size: str) -> None:
    """What is exported is what stands there; a reload loses nothing."""
    page = theatre.page
    theatre.resize(size)
    theatre.play("ready")
    begin(theatre)
    press(theatre, "Record J")
    expect(rows(theatre)).to_have_count(2)
    press(theatre, "Record L", "Add grip", "Wait")
    expect(rows(theatre)).to_have_count(6)
    press(theatre, "Loop")
    expect(rows(theatre).nth(1)).to_have_text(re.compile(r"FOR R\[51:round\]=1 TO 2"))
    press(theatre, "Undo")
    expect(rows(theatre)).to_have_count(6)
    press(theatre, "Redo")
    expect(rows(theatre)).to_have_count(8)
    rows(theatre).nth(2).click()
    expect(rows(theatre).nth(2)).to_have_attribute("aria-pressed", "true")
    press(theatre, "Go to line")
    expect(rows(theatre).nth(2).locator(".verdict")).to_contain_text("OK: takes 1.20 s")
    press(theatre, "Up")
    expect(rows(theatre).nth(1)).to_have_text(re.compile(r"J P\[1\] 50% FINE"))
    assert theatre.problems(f"{size}, teach") == []
    page.reload()
    expect(rows(theatre).nth(1)).to_have_text(re.compile(r"J P\[1\] 50% FINE"))
    expect(rows(theatre)).to_have_count(8)
    text = page.request.get(f"{theatre.address}/draft.LS").text()
    robot = load_robot()
    draft = draft_of(text, robot)
    now = stands_at(robot, SCENES["ready"](robot, 0.0))
    for position in draft.program.positions:
        for value, joint in zip(joint_values(position, robot), robot.joints, strict=True):
            assert abs(value - now[joint.name]) / joint.scale <= 0.001


def test_draft_of_a_program_that_the_robot_runs_can_only_be_looked_at(theatre: Theatre) -> None:
    """Until it ends; the pendant shows the same lines then."""
    page, said = theatre.page, theatre.page.locator(".teach-said")
    theatre.resize("low")
    theatre.play("ready")
    begin(theatre)
    page.get_by_label("Program", exact=True).fill("ARTICLE")
    press(theatre, "Rename", "Wait")
    expect(rows(theatre).last).to_contain_text("WAIT")
    count = rows(theatre).count()
    theatre.play("following")
    expect(said).to_contain_text("the robot runs ARTICLE")
    press(theatre, "Wait")
    expect(said).to_contain_text("Wait: the robot runs ARTICLE")
    expect(rows(theatre)).to_have_count(count)
    theatre.play("ready")
    press(theatre, "Undo")
    expect(rows(theatre)).to_have_count(count - 1)


MOST_ACTIONS = 25


def test_palletising_is_taught_in_25_actions_and_places_nine_of_nine(theatre: Theatre) -> None:
    """From an empty draft: each click, each field and each line that is typed counts."""
    theatre.resize("wide")
    theatre.play("ready")
    theatre.page.request.get(f"{theatre.address}/begin")
    actions = Actions(theatre.page)
    teach_pallet(actions, theatre.page)
    assert actions.count <= MOST_ACTIONS
    assert actions.count == 18
    text = theatre.page.request.get(f"{theatre.address}/draft.LS").text()
    file = theatre.runs.parent / "TAUGHT.LS"
    file.write_text(text, encoding="utf-8")
    with resting_cell(CONFIG) as (world, _):
        verdict = judge(world, find_program(world.cell, str(file), CONFIG))
    assert verdict.outcome is Outcome.OK, verdict.sentence
    assert (len(verdict.placed), verdict.dropped) == (9, ())
