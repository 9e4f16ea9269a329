r"""A robot that does again what was recorded.

It has a motion at each period of its own clock, and a controller that shows it.

Between recorded samples, and through a hole too, the motion is the cubic that has their positions
and velocities. Played at a rate :math:`r`, velocities are :math:`r` times and accelerations
:math:`r^2` times the recorded ones, so a rate above 1 holds only where the joints' limits leave
room for it: rests and slow parts are played as fast as asked for, hard moves less. Alarms, drives
and the programs' names are not played: the operator who reset them then is not there now.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import msgspec
import numpy as np
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.controller import Controller
from fanuc_emulator.snapshot import ControlType, Snapshot
from fanuc_emulator.tp.executor import ProgramState
from scara_config import Robot
from twin_experiments.metrics.series import Array, Mask, Motion, interpolate
from twin_experiments.report.record import RecordError

# Our choice: the twin controller believes no joint that is faster than 1.5 times its largest speed.
REPORTED = 1.4
SMOOTH_S = (
    0.02  # our choice: over so long an acceleration is averaged, so that noise does not count
)
AHEAD_S = 0.1  # our choice: so long before and after a hard move the rate is what the move allows
BEFORE_S = (
    0.05  # our choice: a program is shown as running so long before and after the motion itself
)


@dataclass(frozen=True)
class Playback:
    """What the robot shows at each period after the start.

    Args:
        shown: All joints in the order of robot.yaml, as fast as they are played; a row for each
            period of the playing robot, by its clock from the start [s].
        instants: Where in the recording each row is [s], shape ``(k,)``.
        running: Whether a program of the robot's own runs, shape ``(k,)``.
    """

    shown: Motion
    instants: Array
    running: Mask

    @property
    def duration(self) -> float:
        """How long it is played [s]."""
        return float(self.shown.stamps[-1])

    def played_at(self, recorded: float) -> float:
        """Return when an instant of the recording is played [s] after the start."""
        return float(np.interp(recorded, self.instants, self.shown.stamps))

    def motion(self, start: float, columns: list[int]) -> Motion:
        """Return what was played as a motion.

        Args:
            start: When the first row was shown [s].
            columns: Joints, in the order of robot.yaml.
        """
        shown = self.shown
        stamps = start + shown.stamps
        return Motion("real", stamps, shown.positions[:, columns], shown.velocities[:, columns])


def plan_playback(
    robot: Robot, motion: Motion, running: Mask | None, rate: float, period: float
) -> Playback:
    """Plan how a recorded motion is played.

    Args:
        robot: Its joints; those that the twin does not have stay at 0.
        motion: Of the twin's joints, as recorded.
        running: For each sample whether a program ran; None: whenever something moves.
        rate: How much faster than recorded.
        period: Of the playing robot [s].

    Raises:
        RecordError: A joint would be too fast to be believed, or leaves its limits; the text names
            it.
    """
    joints = robot.twin_joints
    instants, rates = _paced(
        motion, [(joint.velocity, joint.acceleration) for joint in joints], rate, period
    )
    positions, velocities = interpolate(motion, instants)
    # Played faster, the same place is passed faster.
    velocities = velocities * rates[:, None]
    fastest = np.abs(velocities).max(axis=0)
    for joint, speed, low, high in zip(
        joints, fastest, positions.min(axis=0), positions.max(axis=0)
    ):
        if speed > REPORTED * joint.velocity:
            raise RecordError(
                f"{joint.name} would move at {speed / joint.scale:.0f} {joint.unit}/s "
                f"at rate {rate:g}, "
                f"its largest speed is {joint.velocity / joint.scale:.0f}"
            )
        margin = 1e-3 * (joint.upper - joint.lower)
        if low < joint.lower - margin or high > joint.upper + margin:
            raise RecordError(
                f"{joint.name} would go from {low:.4g} to {high:.4g}, "
                f"allowed is {joint.lower:.4g} to {joint.upper:.4g}"
            )
    columns = [k for k, joint in enumerate(robot.joints) if joint.twin]
    shown = np.zeros((2, len(instants), len(robot.joints)))
    shown[0][:, columns], shown[1][:, columns] = positions, velocities
    if running is None:
        # A program ran where something moves, and so long before and after.
        window = np.ones(2 * round(BEFORE_S / period) + 1, dtype=np.int64)
        moves = (np.abs(velocities).max(axis=1) > 0.0).astype(np.int64)
        ran = np.asarray(np.convolve(moves, window, mode="same")[: len(moves)] > 0)
    else:
        ran = running[
            np.clip(np.searchsorted(motion.stamps, instants, side="right") - 1, 0, len(running) - 1)
        ]
    stamps = np.asarray(np.arange(len(instants)) * period, dtype=np.float64)
    return Playback(Motion("real", stamps, *shown), instants, ran)


def _paced(
    motion: Motion, limits: list[tuple[float, float]], rate: float, period: float
) -> tuple[Array, Array]:
    """Return where in the recording each period is, and how fast it is played there.

    Args:
        motion: As recorded.
        limits: Largest velocity and acceleration of each joint.
        rate: Asked for.
        period: [s]
    """
    begin, end = float(motion.stamps[0]), float(motion.stamps[-1])
    # A whole number of periods may come out just below it.
    grid = np.minimum(
        begin + np.arange(math.floor((end - begin) / period + 1e-9) + 1) * period, end
    )
    allowed = np.full(len(grid), rate)
    if rate > 1.0:
        _, velocities = interpolate(motion, grid)
        window = np.ones(max(1, round(SMOOTH_S / period))) / max(1, round(SMOOTH_S / period))
        for velocity, (fastest, hardest) in zip(velocities.T, limits):
            bend = np.abs(np.convolve(np.gradient(velocity, period), window, mode="same"))
            allowed = np.minimum(allowed, fastest / np.maximum(np.abs(velocity), 1e-9))
            # Time that runs k times as fast makes accelerations k squared as large.
            allowed = np.minimum(allowed, np.sqrt(hardest / np.maximum(bend, 1e-9)))
        # Smooth and nowhere above what is allowed: the smallest around each place, averaged over
        # as many.
        reach = round(AHEAD_S / period)
        windows = partial(np.lib.stride_tricks.sliding_window_view, window_shape=2 * reach + 1)
        padded = np.pad(np.maximum(allowed, 1.0), 2 * reach, mode="edge")
        allowed = np.asarray(windows(windows(padded).min(axis=1)).mean(axis=1))
    # Between two places the mean of both paces counts.
    played = np.concatenate(([0.0], np.cumsum(np.diff(grid) * 2.0 / (allowed[1:] + allowed[:-1]))))
    instants = np.interp(
        np.arange(math.floor(played[-1] / period + 1e-9) + 1) * period, played, grid
    )
    return instants, np.interp(instants, grid, allowed)


class PlaybackController(Controller):
    """The robot stand-in's controller, except that its joints do what was recorded.

    It obeys no set point and no stop.
    """

    def __init__(self, config: EmulatorConfig, robot: Robot, playback: Playback) -> None:
        """Stand at the first recorded position; nothing is played before :meth:`play`."""
        super().__init__(config, robot, {}, 0.0)
        self._playback = playback
        # The tick of the first row; None: the start is shown, and nothing moves.
        self._begun: int | None = None
        self.write_override(100)

    def play(self) -> None:
        """Begin with the next period."""
        self._begun = self._tick + 1

    @property
    def row(self) -> int:
        """Row of the playback that is shown now."""
        if self._begun is None:
            return 0
        return min(max(self._tick - self._begun, 0), len(self._playback.instants) - 1)

    @property
    def playing(self) -> bool:
        """Whether the first row has been shown as such."""
        return self._begun is not None and self._tick >= self._begun

    @property
    def part(self) -> float:
        """How much has been played, 0 to 1."""
        return self.row / max(len(self._playback.instants) - 1, 1)

    @property
    def ended(self) -> bool:
        """Whether all has been played."""
        return (
            self._begun is not None and self._tick - self._begun >= len(self._playback.instants) - 1
        )

    def snapshot(self) -> Snapshot:
        """Return what can be read now."""
        shown, played, row = super().snapshot(), self._playback.shown, self.row
        moves = self._begun is not None and not self.ended
        running = moves and bool(self._playback.running[row])
        velocities = (
            tuple(played.velocities[row].tolist()) if moves else (0.0,) * played.positions.shape[1]
        )
        positions = tuple(played.positions[row].tolist())
        return msgspec.structs.replace(
            shown,
            measured_positions=positions,
            measured_velocities=velocities,
            positions=positions,
            velocities=velocities,
            control_type=ControlType.PROGRAM if running else ControlType.NONE,
            program_speed=100 if running else 0,
            program_name="REPLAY" if running else "",
            program_state=ProgramState.RUNNING if running else ProgramState.ABORTED,
            alarm=None,
            outputs=msgspec.structs.replace(
                shown.outputs,
                cmdenbl=True,
                sysrdy=True,
                progrun=running,
                paused=False,
                held=False,
                fault=False,
                busy=running,
            ),
        )
