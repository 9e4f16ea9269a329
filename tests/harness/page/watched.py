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
from harness.wires.browser import LOAD_MS
from harness.wires.operator_page import TOKEN, Panel
from harness.yaml_files import add_program, changed_yaml, copy_configuration

LOW = """/PROG LOW
/ATTR
COMMENT = "into a part";
/MN
  1:J P[1] 50% FINE ;
  2:J P[2] 50% FINE ;
/POS
P[1]{ GP1: UF : 0, UT : 1, J1= 10 deg, J2= 0 deg, J3= -160 mm, J4= 0 deg, E1= 0 deg
};
P[2]{ GP1: UF : 0, UT : 1, J1= 0 deg, J2= 0 deg, J3= -182 mm, J4= 0 deg, E1= 0 deg
};
/END
"""
"""A program that must not be run: the nozzle would hit a part."""
JUDGE = "what_if.yaml"
PATIENCE_MS = 20_000.0
"""For a verdict: what is shown is tested, not how soon."""


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
        add_program(config, LOW)
        patient = {("gate_program_timeout_ms",): PATIENCE_MS}
        for path, value in {**patient, **(changes or {})}.items():
            changed_yaml(config / JUDGE, config, list(path), value)
        self.robot = PlayedRobot(ros)
        self.judge: Process = ros.run("what_if", "what_if", f"_config_dir:={config}")
        self.panel = Panel(ros, f"_config_dir:={config}")
        self.page = page
        page.goto(f"http://127.0.0.1:{self.panel.port}/?token={TOKEN}", timeout=LOAD_MS)
        expect(page.locator(".control-text")).to_have_text(re.compile("is in control"))

    def open(self, tab: str) -> None:
        """Choose a tab."""
        self.page.get_by_role("tab", name=tab, exact=True).click()

    def close(self) -> None:
        """Say no longer where the joints are."""
        self.robot.close()
