"""The tool of an arm with six joints turned in steps from the operator's page, on a whole cell."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from harness.live_cell import LiveCell
from harness.page.acts import LONG_MS, TOKEN, is_mode, shown
from harness.workspace import ROOT
from playwright.sync_api import Page, expect
from scara_config import load_robot
from scipy.spatial.transform import Rotation

from scara_description.urdf import link_pose, parse_urdf

pytestmark = [pytest.mark.system, pytest.mark.thorough]
"""tests/ros/operator_panel/jogging turns it each time, from the page to what is commanded."""
ROBOT = load_robot(ROOT / "config" / "robots" / "articulated_six")
MODEL = parse_urdf(ROBOT.description.read_text(encoding="utf-8"))
NEAR_DEG = 0.1  # the page shows hundredths of a degree; at rest a twin is as near to its target
NEAR_M = 5e-4


@pytest.fixture(scope="module")
def patient_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell of another robot than the article's."""
    env = {"SCARA_ROBOT": "articulated_six", "OPERATOR_PANEL_TOKEN": TOKEN}
    with LiveCell(tmp_path_factory.mktemp("cell")).ready(env=env) as cell:
        yield cell


def tool_of(page: Page, side: str) -> np.ndarray:
    """Return the pose of a side's tool, shape (4, 4), from the joints that the page shows."""
    joints = {
        joint.name: shown(page, f"{joint.name}.{side}") * joint.scale for joint in ROBOT.twin_joints
    }
    return link_pose(MODEL, ROBOT.tool_frame, joints)


def test_each_step_turns_the_tool_of_both_and_keeps_its_place(operator: Page) -> None:
    """About axes of the base and of the tool; the real robot follows each step."""
    operator.get_by_role("tab", name="Jog").click()
    operator.get_by_role("tab", name="Step tool").click()
    steps = operator.locator("[data-way-panel=steps]")
    steps.get_by_role("tab", name="10", exact=True).click()
    for frame, axis, sign in (("Tool", 1, -1), ("World", 0, 1)):
        steps.get_by_role("tab", name=frame, exact=True).click()
        begin = {side: tool_of(operator, side) for side in ("twin", "real")}
        name = "XYZ"[axis]
        sign_text = "+" if sign > 0 else "\N{MINUS SIGN}"
        steps.get_by_role("button", name=f"Turn {name} {sign_text}", exact=True).click()
        told = operator.locator(
            "[data-command]", has_text=f"Turn {name} {sign_text}10 deg, {frame.lower()}"
        )
        expect(told.first).to_have_attribute("data-outcome", "done", timeout=LONG_MS)
        expect(operator.locator('[data-live="motion"]')).to_have_text("both stand still")
        is_mode(operator, "Ready", LONG_MS)
        wanted = sign * 10.0 * np.eye(3)[axis]
        for side, before in begin.items():
            after = tool_of(operator, side)
            first, second = before[:3, :3], after[:3, :3]
            turned = first.T @ second if frame == "Tool" else second @ first.T
            found = [math.degrees(a) for a in Rotation.from_matrix(turned).as_rotvec()]
            assert found == pytest.approx(wanted, abs=NEAR_DEG), (side, frame, name)
            assert after[:3, 3] == pytest.approx(before[:3, 3], abs=NEAR_M), (side, frame, name)
