"""The operator's page beside a real judge, without a cell: a test says where the twin stands."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, expect

from harness.processes import Process
from harness.ros import Ros
from harness.second_world.played_robot import PlayedRobot
from harness.wires.operator_page import TOKEN, Panel
from harness.yaml_files import changed_yaml, copy_configuration

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
"""A program that must not be run: the nozzle would hit a part."""
JUDGE = "what_if.yaml"


class Watched:
    """A page of the real panel beside the real judge; both sides of the pair are played.

    Args:
        ros: A namespace in which a stand-in of the twin controller runs.
        folder: For the configuration.
        page: Of a browser.
        changes: Values of what_if.yaml by the way to their key.
    """

    def __init__(
        self,
        ros: Ros,
        folder: Path,
        page: Page,
        changes: Mapping[tuple[str, ...], Any] | None = None,
    ) -> None:
        config = copy_configuration(folder)
        (config / "programs" / "low.yaml").write_text(LOW)
        for path, value in (changes or {}).items():
            changed_yaml(config / JUDGE, config, list(path), value)
        self.robot = PlayedRobot(ros)
        self.judge: Process = ros.run("what_if", "what_if", f"_config_dir:={config}")
        self.panel = Panel(ros, f"_config_dir:={config}")
        self.page = page
        page.goto(f"http://127.0.0.1:{self.panel.port}/?token={TOKEN}")
        expect(page.locator(".control-text")).to_have_text(re.compile("is in control"))

    def open(self, tab: str) -> None:
        """Choose a tab."""
        self.page.get_by_role("tab", name=tab, exact=True).click()

    def close(self) -> None:
        """Say no longer where the joints are."""
        self.robot.close()
