r"""What one cycle says of a robot's joints: friction, inertia, lag, play, and its vacuum.

Per joint, with q smoothed over a few samples:

.. math::
   \tau = J \ddot q + c^+ [\dot q > 0] - c^- [\dot q < 0] + b \dot q, \qquad
   s - q = T \dot q + A \ddot q + h \,\mathrm{sign}(\dot q) + o

No number of the robot is known: each sign is held against that of its own first week (trend.py).

Source:
    Least squares as in Lynch & Park, Modern Robotics (2017), sec. 8.9; what is looked at: our
    choice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOVES, SLOW = 0.002, 0.03
"""Parts of a joint's greatest speed: below the first it stands; above the second friction grows
with speed again. Our choice."""
SMOOTHED_S = 0.02
"""Speeds and accelerations are those of a parabola through so much to either side. Our choice."""
ROUNDS = 3
"""So often the lag that all joints have is looked for; the third changes nothing that counts."""
AFTER_REVERSAL_S, RESTED_S = 0.3, 0.04
"""Play shows so long after a joint has turned; it has stood at least so long before. Our choice."""


@dataclass(frozen=True)
class CycleSignals:
    """One cycle as it was read; n samples of k joints.

    Attributes:
        times: Of the readings [s], shape ``(n,)``, evenly apart.
        wanted: Wanted joint positions [rad or m], shape ``(n, k)``.
        measured: Where they were, same shape.
        torques: Of the motors, in any unit, same shape.
        vacuum_s: From the suction's start to the vacuum [s]; NaN: nothing was gripped.
    """

    times: Array
    wanted: Array
    measured: Array
    torques: Array
    vacuum_s: float = float("nan")


@dataclass(frozen=True)
class Signs:
    """What a cycle says; each of shape ``(k,)``, in the torque's unit, rad or m, s.

    A joint that stood says nothing: its values are NaN.

    Attributes:
        forward, backward: Friction at a typical speed, by direction.
        coulomb: The part of it that is the same at any speed.
        inertia: Torque by acceleration.
        lag: How late the joint is behind its set point.
        play: Way that a joint that has turned goes with too little torque.
        vacuum_s: As it was read.
    """

    forward: Array
    backward: Array
    coulomb: Array
    inertia: Array
    lag: Array
    play: Array
    vacuum_s: float

    @property
    def friction(self) -> Array:
        """Of both directions."""
        return 0.5 * (self.forward + self.backward)

    @property
    def moved(self) -> NDArray[np.bool_]:
        """Which joints moved enough to say something."""
        return np.isfinite(self.forward)


class TorqueError(ValueError):
    """A cycle has nothing to say; the text says why."""


def signs_of(cycle: CycleSignals, fastest: Array) -> Signs:
    """Return what a cycle says.

    Args:
        cycle: The readings.
        fastest: Greatest speed of each joint [rad/s or m/s], shape ``(k,)``.

    Raises:
        TorqueError: No joint ever moves fast enough both ways, or the robot tells no torque.
    """
    if not np.any(cycle.torques):
        raise TorqueError("the robot tells no motor torque: its map has no motor_torque")
    dt = float(np.median(np.diff(cycle.times)))
    half = max(2, round(SMOOTHED_S / dt))
    moved = [_parabola(column, dt, half) for column in cycle.measured.T]
    goes = [
        min(np.sum(v > SLOW * most), np.sum(v < -SLOW * most)) >= 2 * half
        for (_, v, _), most in zip(moved, fastest)
    ]
    if not any(goes):
        raise TorqueError("no joint moves fast enough in both directions")
    late = 0.0
    # A long lag bends what is in proportion to speed: the lag that all have is taken off first.
    for _ in range(ROUNDS):
        each = zip(moved, _errors(cycle, late).T, fastest, goes)
        # The median: one joint that has worn must not move what the others are held against.
        late += float(np.median([_lag(*joint) for *joint, does in each if does]))
    values = [
        _joint(q, torque, error, late, dt, half, most) if does else [float("nan")] * 6
        for q, torque, error, most, does in zip(
            moved, cycle.torques.T, _errors(cycle, late).T, fastest.tolist(), goes
        )
    ]
    forward, backward, coulomb, inertia, lag, play = np.array(values).T
    return Signs(forward, backward, coulomb, inertia, lag, play, cycle.vacuum_s)


def _errors(cycle: CycleSignals, late: float) -> Array:
    """Return how far the joints are behind where they were wanted ``late`` [s] before."""
    wanted = [np.interp(cycle.times - late, cycle.times, column) for column in cycle.wanted.T]
    return np.asarray(np.stack(wanted, axis=1) - cycle.measured)


def _lag(motion: tuple[Array, Array, Array], error: Array, fastest: float) -> float:
    """Return how late a joint is [s]."""
    _, v, a = motion
    fast = np.abs(v) > SLOW * fastest
    columns = np.stack([v, a, np.sign(v), np.ones_like(v)], axis=1)[fast]
    return float(np.linalg.lstsq(columns, error[fast], rcond=None)[0][0])


def _joint(
    motion: tuple[Array, Array, Array],
    torques: Array,
    error: Array,
    late: float,
    dt: float,
    half: int,
    fastest: float,
) -> list[float]:
    """Return the signs of one joint in the order of :class:`Signs`."""
    _, v, a = motion
    torque = _parabola(torques, dt, half)[0]
    direction = np.sign(v) * (np.abs(v) > MOVES * fastest)
    fast = np.abs(v) > SLOW * fastest
    up, down = fast & (v > 0.0), fast & (v < 0.0)
    columns = np.stack([a, up * 1.0, -1.0 * down, v], axis=1)
    inertia, above, below, viscous = np.linalg.lstsq(columns[fast], torque[fast], rcond=None)[0]
    typical = 0.25 * fastest
    coulomb = 0.5 * (above + below)
    play = _play(v, torque, inertia * a, coulomb, direction, dt, SLOW * fastest)
    rubs = viscous * typical
    return [above + rubs, below + rubs, coulomb, inertia, late + _lag(motion, error, fastest), play]


def _play(
    v: Array,
    torque: Array,
    moved: Array,
    coulomb: float,
    direction: Array,
    dt: float,
    slow: float,
) -> float:
    """Return the way with too little torque after a joint has turned [rad or m], a mean.

    Of slow moves: in a fast one the noise of the torque goes a long way.
    """
    ways, count, before, rested = 0.0, 0, 0.0, 0
    window, least = round(AFTER_REVERSAL_S / dt), round(RESTED_S / dt)
    for start in np.flatnonzero(np.diff(direction != 0.0)) + 1:
        here = direction[start]
        if here == 0.0:
            rested = int(start)
            continue
        if before * here < 0.0 and start - rested >= least:
            part = slice(start, start + window)
            before = here
            if np.max(np.abs(v[part])) > slow:
                continue
            wanted = np.maximum(np.abs(moved[part] * here) + coulomb, coulomb)
            missing = np.clip(1.0 - torque[part] * here / wanted, -1.0, 1.0)
            ways += float(np.sum(missing * np.abs(v[part])) * dt)
            count += 1
        before = here
    return ways / count if count else 0.0


def _parabola(values: Array, dt: float, half: int) -> tuple[Array, Array, Array]:
    """Return value, slope and curvature of the parabola through 2 half + 1 samples each.

    At both ends the first and last samples count as if they went on, slope and curvature as 0.
    """
    at = np.arange(-half, half + 1) * dt
    rows = np.linalg.pinv(np.stack([np.ones_like(at), at, 0.5 * at * at], axis=1))
    padded = np.pad(values, half, mode="edge")
    found = [np.correlate(padded, row, mode="valid") for row in rows]
    # Whoever moves there already did not begin at rest: nothing is known of it.
    for each in found[1:]:
        each[:half] = each[-half:] = 0.0
    return found[0], found[1], found[2]
