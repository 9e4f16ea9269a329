"""Positions at rest against the robot's true geometry.

The positioning error takes both tools from the lengths in robot.yaml. A robot was made with other
lengths, and its joints are not quite where its encoders say: where its tool really is, is another
error, and calibration would remove most of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from twin_experiments.metrics.errors import (
    Comparison,
    MetricsSettings,
    ToolFunction,
    deviation_mm,
    find_rests,
)
from twin_experiments.metrics.series import Array


@dataclass(frozen=True)
class TrueArm:
    """The robot as it was made.

    Args:
        tool: Forward kinematics with its true lengths.
        zero_offsets: By how much each joint is further than its encoder says, shape ``(n,)``:
            [rad], prismatic [m].
    """

    tool: ToolFunction
    zero_offsets: Array


@dataclass(frozen=True)
class TruePositioning:
    """Largest error of all rests [mm].

    Args:
        max_mm: With the real side's tool where it really is.
        calibrated_mm: The same if lengths and zero offsets were those that the twin has.
    """

    max_mm: float
    calibrated_mm: float

    @property
    def removable_mm(self) -> float:
        """What calibration of lengths and zero offsets would remove [mm]."""
        return self.max_mm - self.calibrated_mm


def true_positioning(
    comparison: Comparison,
    tool: ToolFunction,
    arm: TrueArm,
    set_positions: Mapping[str, Array],
    settings: MetricsSettings,
) -> TruePositioning | None:
    """Measure the rests of a comparison again, with the real side's tool where it really is.

    Args:
        comparison: Both sides, with the joints of the real side where they really were.
        tool: Forward kinematics with the lengths of robot.yaml.
        arm: The robot as it was made.
        set_positions: Name to tool position [m], shape ``(3,)``.
        settings: How long a rest is, and how near a set position.

    Returns:
        None if both sides never stood still long enough.
    """
    joints = comparison.trace.aligned.real.positions

    def worst(real_tool: Array) -> float | None:
        apart = deviation_mm(real_tool, comparison.trace.twin_tool)
        seen = replace(comparison.trace, real_tool=real_tool, deviation_mm=apart)
        rests = find_rests(seen, set_positions, settings)
        return max((rest.worst_mm for rest in rests), default=None)

    # Without its zero offsets a joint is where its encoder says.
    largest, calibrated = worst(arm.tool(joints)), worst(tool(joints - arm.zero_offsets))
    if largest is None or calibrated is None:
        return None
    return TruePositioning(largest, calibrated)
