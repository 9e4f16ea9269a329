"""A cell as it first starts: its page, and a shell of this machine beside the open page.

The shell is the same person as the page; others are not.
"""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.live_cell import LiveCell
from harness.page.acts import (
    TOKEN,
    cell_with_pages,
    is_mode,
    patient_configuration,
    press,
    preview_of,
)
from harness.processes import Process, wait_until
from harness.wires.browser import chromium
from harness.wires.gateway_client import command_over, connect
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.system, pytest.mark.thorough]

ACTIONLIB = Path(__file__).parents[1] / "clients" / "actionlib_client.py"
PATIENT_MS = 120_000  # on a machine that does other things too
MINUTE_S = 60.0
JOG = "{joint_names: [joint_1], velocities: [0.05]}"


@pytest.fixture(scope="module")
def begun() -> float:
    """Give the time at which the start begins [s, monotonic]."""
    return time.monotonic()


@pytest.fixture(scope="module")
def bringup(
    begun: float, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[LiveCell, Process, int]]:
    """Start a cell as ``./cell up`` does; give what it prints and its page's port too."""
    folder = tmp_path_factory.mktemp("cell")
    config = patient_configuration(folder / "patient")  # nobody judges times here
    with cell_with_pages(folder, env={"SCARA_CONFIG_DIR": str(config)}) as started:
        yield started


@pytest.fixture(scope="module")
def cell(bringup: tuple[LiveCell, Process, int]) -> LiveCell:
    """Give the cell."""
    return bringup[0]


@pytest.fixture(scope="module")
def page(
    bringup: tuple[LiveCell, Process, int], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Page]:
    """Give the operator's page, opened and not touched."""
    with chromium(tmp_path_factory.mktemp("browser")) as browser:
        made = browser.new_page(viewport={"width": 390, "height": 844})
        made.set_default_timeout(PATIENT_MS)
        made.goto(f"http://127.0.0.1:{bringup[2]}/?token={TOKEN}")
        expect(made.locator("[data-panel].shown")).to_be_visible(timeout=PATIENT_MS)
        nobody_in_control(made)
        is_mode(made, "Ready", PATIENT_MS)
        yield made


def printed(process: Process) -> list[str]:
    """Return the lines that one may type in another shell."""
    lines = process.output.partition("after `source env.sh`:\n")[2].partition("\n\n")[0]
    return [line.strip() for line in lines.splitlines()]


def last_motion(cell: LiveCell) -> str:
    """Return the newest decision by which a side began to lead."""
    told: list[str] = cell.call("/twin_controller/why", "{count: 10}")["decisions"]
    return [line for line in told if "_LEADS:" in line][-1]


def until(cell: LiveCell, *modes: str) -> None:
    """Wait for one of these modes of the pair."""
    wait_until(lambda: cell.mode() in modes, 60.0, " or ".join(modes), period=0.2)


def aligned(cell: LiveCell) -> bool:
    """Align the pair where it is stopped, from a shell; return whether it is ready."""
    mode = cell.mode()
    if mode == "STOPPED":
        assert cell.call("/twin_controller/command", "{command: ALIGN}")["success"]
    return mode == "IDLE"


def in_control(page: Page) -> None:
    """Expect the page to hold control."""
    words = re.compile(r"^Operator \d+: in control$")
    expect(page.locator(".control-text")).to_have_text(words, timeout=PATIENT_MS)


def command(page: Page) -> None:
    """Give a command that moves nothing; the page holds control by it."""
    page.get_by_role("button", name="Set", exact=True).first.click()
    in_control(page)


def nobody_in_control(page: Page) -> None:
    """Expect nobody to hold control."""
    words = page.locator(".control-text")
    expect(words).to_have_text("Nobody is in control", timeout=PATIENT_MS)


def typed(cell: LiveCell, page: Page, lines: list[str]) -> None:
    """Type each line unchanged, as one who reads it would, and see that it did what it says."""
    settings = "; ".join(line for line in lines if line.startswith("export "))
    move, program, decisions = (line for line in lines if not line.startswith("export "))

    def type_line(line: str) -> str:
        return cell.tool("bash", "-c", f"{settings}; {line}", timeout=120.0)

    assert "move_to" in move and "success: True" in type_line(move)
    until(cell, "IDLE")
    assert "run ARTICLE" in program
    type_line(program)
    until(cell, "REAL_LEADS")
    assert "decisions" in type_line(decisions)
    assert cell.call("/twin_controller/command", "{command: STOP}")["success"]
    wait_until(lambda: aligned(cell), 60.0, "a pair that is ready again", period=0.2)


def test_preview_of_article_plays_in_the_first_minute(begun: float, page: Page) -> None:
    """Start, page, button, verdict and ghost, without another command in between."""
    page.get_by_role("tab", name="Programs", exact=True).click()
    page.get_by_role("button", name="Preview ARTICLE").click()
    preview_of(page, re.compile("Program ARTICLE: OK"))
    slider = page.locator("[data-motion-range]")
    first = slider.input_value()
    expect(slider).not_to_have_value(first)
    assert time.monotonic() - begun < MINUTE_S


def test_each_printed_line_works_while_a_page_that_moved_the_pair_holds_control(
    bringup: tuple[LiveCell, Process, int], page: Page
) -> None:
    """Its person and the shell's are one; the page stays in control."""
    cell, process, _ = bringup
    press(page, "Home")
    in_control(page)
    until(cell, "IDLE")
    lines = printed(process)
    typed(cell, page, lines)
    in_control(page)
    told = cell.call("/twin_controller/why", "{count: 30}")["decisions"]
    assert any("-> TWIN_LEADS" in line and "[by operator, this machine]" in line for line in told)


def test_jog_action_and_command_of_a_shell_work_beside_the_holders_page(
    cell: LiveCell, page: Page
) -> None:
    """Without a token: a topic, an action, and the controller's own service."""
    command(page)
    jog = ("rostopic", "pub", "-r", "20", "/joint_vel_controller/command", "control_msgs/JointJog")
    with cell.stage.start(*jog, JOG):
        until(cell, "TWIN_LEADS")
    until(cell, "IDLE")
    # Not far: where the machine stands still for a moment, the joints keep to their path.
    near = [f"{math.radians(joint) + 0.05:.3f}" for joint in cell.real_joints()[:2]]
    goal = (sys.executable, str(ACTIONLIB), "2.0", *near)
    said = cell.tool("env", "GOAL_LISTENERS=1", *goal, timeout=90.0)
    assert '"state": 3' in said, said  # it succeeds: a stranger's is rejected or not followed
    until(cell, "IDLE")
    assert "-> TWIN_LEADS" in (led := last_motion(cell)) and "[by operator, this machine]" in led
    assert cell.call("/twin_controller/command", "{command: STOP}")["success"]
    assert cell.call("/twin_controller/command", "{command: ALIGN}")["success"]
    until(cell, "IDLE")
    in_control(page)


def test_strangers_of_the_gateway_are_refused_and_stopped_while_the_page_holds_control(
    cell: LiveCell, page: Page
) -> None:
    """A client without a token is nobody's shell, though it runs on this machine too."""
    command(page)
    for word in ("HOME", "ALIGN", "SPEED"):
        refused = command_over(cell.gateway_port, word)
        assert not refused["success"] and "holds control" in refused["message"]
    with connect(cell.gateway_port, 60.0) as client:
        lent = {"action": "LEND", "by": "/rosservice"}
        move = {"x": 0.51, "y": -0.16, "z": 0.10, "speed_percent": 5.0}
        for service, arguments in (("/twin_controller/control", lent), ("/move_to", move)):
            answer = client.call(service, arguments)
            assert not answer["values"]["success"], answer
    until(cell, "STOPPED")
    told = cell.call("/twin_controller/why", "{count: 5}")["decisions"]
    assert any("who holds control did not move it" in decision for decision in told), told
