"""A program that the second world refuses is not started from the page, however fast one is."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.page.acts import preview_of
from harness.page.stand_in import StandIn
from harness.processes import Process
from harness.ros import Ros
from harness.wires.browser import chromium
from harness.wires.operator_page import TOKEN, Panel
from harness.yaml_files import copy_configuration
from playwright.sync_api import Page, expect

LOW = """name: LOW
rsr: 8
comment: into the part below P1
positions:
  AWAY: {joint_1_deg: 10, joint_2_deg: 0, joint_3_mm: -160, joint_4_deg: 0, table_joint_deg: 0}
  PART: {joint_1_deg: 0, joint_2_deg: 0, joint_3_mm: -182, joint_4_deg: 0, table_joint_deg: 0}
lines:
  - {do: move, position: AWAY, speed_percent: 50, termination: fine}
  - {do: move, position: PART, speed_percent: 50, termination: fine}
"""


class Watched:
    """A page of the real panel beside the real judge; the test says where the twin stands."""

    def __init__(self, ros: Ros, folder: Path, page: Page) -> None:
        """Start judge and panel with a program that must not be run."""
        import rospy
        from sensor_msgs.msg import JointState

        config = copy_configuration(folder)
        (config / "programs" / "low.yaml").write_text(LOW)
        names = ["joint_1", "joint_2", "joint_3", "table_joint"]
        at_home = JointState(name=names, position=[0.0, 0.0, -0.16, 0.0])
        joints = rospy.Publisher(ros.name("twin/joint_states"), JointState, queue_size=1)
        self.timer = rospy.Timer(rospy.Duration(0.05), lambda _: joints.publish(at_home))
        self.judge: Process = ros.run("what_if", "what_if", f"_config_dir:={config}")
        self.panel = Panel(ros, f"_config_dir:={config}")
        self.page = page
        page.goto(f"http://127.0.0.1:{self.panel.port}/?token={TOKEN}")
        expect(page.locator(".control-text")).to_have_text(re.compile("in control"))
        page.get_by_role("tab", name="Programs", exact=True).click()


@pytest.fixture
def watched(ros_module: Ros, stand_in: StandIn, tmp_path: Path) -> Iterator[Watched]:
    """Give the page."""
    with chromium(tmp_path) as browser:
        made = Watched(ros_module, tmp_path / "config", browser.new_page())
        yield made
        made.timer.shutdown()


def test_refused_program_has_no_button_and_the_gate_refuses_who_is_faster(
    watched: Watched,
) -> None:
    """The question shows the verdict; who confirms before it is there meets the gate."""
    page = watched.page
    gate = page.locator("[data-panel=Programs] .gate-line")
    expect(gate).to_have_text("Judge runs. Gate on: what is REFUSED does not begin.")
    page.get_by_role("button", name="Preview LOW").click()
    preview_of(page, re.compile(r"Program LOW: REFUSED at .*line 2 of LOW: the nozzle would hit"))
    page.locator("[data-motion-close]").click()
    row = page.locator(".row-line").filter(has=page.get_by_role("button", name="Preview LOW"))
    dialog = page.get_by_role("dialog")
    row.get_by_role("button", name="Run", exact=True).click()
    expect(dialog.locator(".verdict")).to_contain_text("REFUSED at")
    expect(dialog.get_by_role("button", name="Run LOW")).to_have_count(0)
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)

    watched.judge.signal(signal.SIGSTOP)
    row.get_by_role("button", name="Run", exact=True).click()
    expect(dialog.locator(".verdict")).to_have_text("Judging ...")
    dialog.get_by_role("button", name="Run LOW").click()
    told = page.locator("[data-command='0']")
    expect(told).to_contain_text("Program LOW")
    watched.judge.signal(signal.SIGCONT)
    expect(told).to_have_attribute("data-outcome", "refused")
    expect(told).to_contain_text("would hit part_")

    watched.judge.signal(signal.SIGKILL)
    watched.judge.wait(10.0)
    expect(gate).to_have_text("No judge runs: motions begin unjudged.")
    page.get_by_role("button", name="Preview LOW").click()
    expect(page.locator("[data-motion-words]")).to_contain_text("Not judged: ")
