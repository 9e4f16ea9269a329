"""What a recording holds that exercises ask for: decisions, motions, and when who stood still."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

import msgspec
import numpy as np
from scara_config import Robot
from scara_config.palletise import Palletise
from scara_control.kinematics.screws import ScrewModel, tool_positions
from twin_experiments.metrics.errors import MetricsSettings, Trace, trace
from twin_experiments.report.record import Run, cut

T = TypeVar("T")
SLOW_SHARE = 0.002
"""Of its largest speed; a slower joint stands. As `moving_speed_percent` of experiments.yaml."""

SHIPPED = ("ARTICLE", "PALLETISE", "TWO_POINT", "VEHICLE", "DOCKWTCH", "RSR0101", "BGTWIN")
"""Programs that are no learner's own."""
STILL = 0.002
"""[rad/s] and, of joint_3, [m/s]: a joint that is slower stands. Our choice: the shipped loops at
rest, as recorded, are five times slower."""


class ModeDecision(msgspec.Struct, frozen=True):
    """One decision of the twin controller.

    Attributes:
        at: When, from the start of the recording [s].
        before: Mode before it.
        event: Name of the trigger.
        after: Mode after it.
    """

    at: float
    before: str
    event: str
    after: str


class CourseRecording(msgspec.Struct, frozen=True):
    """A recording.

    Attributes:
        run: Motions of both sides, parts, configuration.
        decisions: In order.
        programs: From when on [s] the real robot ran which program; empty: none.
        work: What palletise.yaml says; None: the cell has no parts.
        payloads: From when on [s] the twin was told which mass, and had which mounted [kg].
        overrides: From when on [s] the real robot had which override [percent].
    """

    run: Run
    decisions: tuple[ModeDecision, ...]
    programs: tuple[tuple[float, str], ...] = ()
    work: Palletise | None = None
    payloads: tuple[tuple[float, tuple[float, float]], ...] = ()
    overrides: tuple[tuple[float, float], ...] = ()

    def program_at(self, at: float) -> str:
        """Return the program that ran at a time [s]; empty: none."""
        return held_at(self.programs, at, "")

    def seen(self, robot: Robot, start: float, end: float) -> Trace:
        """Return where both tools were in a time [s], with whole joints and who moved.

        Raises:
            MetricsError: The motions do not overlap there.
            RecordError: Less than two samples lie there.
        """
        names, arm = self.run.joint_names, ScrewModel.from_robot(robot)
        speeds = SLOW_SHARE * np.array([robot.joint(name).velocity for name in names])
        # A recording holds the table too, and the tool does not move with it.
        columns = [names.index(joint.name) for joint in robot.arm_joints]
        return trace(
            cut(self.run.real, start, end),
            cut(self.run.twin, start, end),
            lambda q: tool_positions(arm, q[:, columns]),
            MetricsSettings(robot.reach_mm, speeds),
        )

    def changes(self) -> list[ModeDecision]:
        """Return the decisions that changed the mode."""
        return [each for each in self.decisions if each.before != each.after]

    def moves(self, start: float, end: float) -> dict[str, bool]:
        """Return for each side whether it moved in a time [s]."""
        return {
            motion.side: bool(
                (
                    np.abs(motion.velocities[(motion.stamps >= start) & (motion.stamps <= end)])
                    > STILL
                ).any()
            )
            for motion in (self.run.real, self.run.twin)
        }


def held_at(values: Sequence[tuple[float, T]], at: float, otherwise: T) -> T:
    """Return what held at a time [s], of values with the times from which on they held."""
    return next((value for since, value in reversed(values) if since <= at), otherwise)


def after(
    decisions: Sequence[ModeDecision], start: int, event: str, modes: Sequence[str]
) -> int | None:
    """Return the place of the first decision from ``start`` on that led from one of ``modes``.

    Args:
        decisions: In order.
        start: Where to begin.
        event: Name of the trigger; empty: any.
        modes: Of which one it must lead to.
    """
    places: Iterator[int] = (
        k
        for k in range(start, len(decisions))
        if decisions[k].after in modes and event in ("", decisions[k].event)
    )
    return next(places, None)
