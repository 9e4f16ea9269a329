"""What a recording holds that exercises ask for: decisions, motions, and when who stood still."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec
import numpy as np
from scara_config.palletise import Palletise
from twin_experiments.report.record import Run

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
    """

    run: Run
    decisions: tuple[ModeDecision, ...]
    programs: tuple[tuple[float, str], ...] = ()
    work: Palletise | None = None

    def program_at(self, at: float) -> str:
        """Return the program that ran at a time [s]; empty: none."""
        return next((name for since, name in reversed(self.programs) if since <= at), "")

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
