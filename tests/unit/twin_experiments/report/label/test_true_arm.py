"""The robot as it was made, against the closed form of a SCARA."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.plant.config import load_plant, plant_text
from scara_config import load_robot
from twin_experiments.report.label.plant import (
    RecordedPlant,
    ScrewGeometry,
    ZeroOffset,
    parse_plant,
)
from twin_experiments.report.label.true_arm import true_arm, zero_offsets
from twin_experiments.report.record import RecordError

CONFIG = Path(__file__).resolve().parents[5] / "config"
HOME = ((0.0, -1.0, 0.0, 0.64), (-1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.16), (0.0, 0.0, 0.0, 1.0))
SHORT = ScrewGeometry({"joint_2": (0.0, 0.0, 1.0, 0.0, -0.34, 0.0)}, HOME)


def plant(
    geometry: ScrewGeometry | None, axes: dict[str, ZeroOffset] | None = None
) -> RecordedPlant:
    """Return a plant with this geometry."""
    return RecordedPlant("made", "as it was made", 0.0, geometry, axes or {})


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0), (0.5, -1.2, -0.05), (-1.0, 0.7, -0.1)])
def test_the_tool_is_where_the_true_lengths_put_it(q: tuple[float, float, float]) -> None:
    """An upper arm of 340 and a forearm of 300 mm: the plane's two links."""
    arm = true_arm(plant(SHORT), load_robot(CONFIG))
    assert arm is not None
    expected = (
        0.34 * math.cos(q[0]) + 0.3 * math.cos(q[0] + q[1]),
        0.34 * math.sin(q[0]) + 0.3 * math.sin(q[0] + q[1]),
        0.16 + q[2],
    )
    assert arm.tool(np.array([q]))[0] == pytest.approx(expected)


def test_zero_offsets_are_in_si_units() -> None:
    """0.018 deg and 0.02 mm; a joint that is not named has none."""
    axes = {"joint_1": ZeroOffset(zero_offset_deg=0.018), "joint_3": ZeroOffset(0.0, 0.02)}
    offsets = zero_offsets(plant(None, axes), load_robot(CONFIG).arm_joints)
    assert offsets == pytest.approx([math.pi / 1e4, 0.0, 2e-5])


def test_the_field_robot_reaches_as_far_as_its_file_says() -> None:
    """349.97 and 300.02 mm, stretched out."""
    robot = load_robot(CONFIG)
    arm = true_arm(parse_plant(plant_text("field", load_plant(robot, CONFIG, "field"))), robot)
    assert arm is not None
    assert arm.tool(np.zeros((1, 3)))[0] == pytest.approx([0.64999, 0.0, 0.16])


def test_without_a_plant_nothing_is_known() -> None:
    """Of a real robot."""
    assert true_arm(None, load_robot(CONFIG)) is None


def test_a_plant_without_a_geometry_is_made_as_the_robot_is_told() -> None:
    """350 and 300 mm, stretched out, and an encoder that is 0.018 deg wrong all the same."""
    arm = true_arm(plant(None, {"joint_1": ZeroOffset(zero_offset_deg=0.018)}), load_robot(CONFIG))
    assert arm is not None
    assert arm.tool(np.zeros((1, 3)))[0] == pytest.approx([0.65, 0.0, 0.16])
    assert arm.zero_offsets == pytest.approx([math.pi / 1e4, 0.0, 0.0])


@pytest.mark.parametrize(
    ("geometry", "error"),
    [
        (
            ScrewGeometry({"elbow": (0.0, 0.0, 1.0, 0.0, -0.34, 0.0)}, HOME),
            r"real/plant: geometry.screw_axes.elbow: is no joint of robot.yaml \(joint_1, joint_2",
        ),
        (
            ScrewGeometry({"joint_2": (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)}, HOME),
            "real/plant: geometry: ",
        ),
    ],
)
def test_a_geometry_that_does_not_fit_the_robot_is_refused(
    geometry: ScrewGeometry, error: str
) -> None:
    """A position against the wrong arm is no position."""
    with pytest.raises(RecordError, match=error):
        true_arm(plant(geometry), load_robot(CONFIG))
