"""What two recorded sides did, ready to be held against each other.

They are compared in time from the first motion on, and along the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scara_config import Joint

from twin_experiments.metrics.errors import ToolFunction
from twin_experiments.metrics.series import (
    Array,
    Mask,
    Motion,
    equal_steps,
    find_gaps,
    interpolate,
)

# Our choice: a joint without a profile moves above this share of the largest speed it reached
SLOW_SHARE = 0.01
SLOWEST = 1e-4  # [rad/s] or [m/s], our choice: below this nothing moves, whatever it reached
PICTURED_HZ = 1000.0  # our choice: places along a path are looked for this finely


@dataclass(frozen=True)
class Mechanism:
    """What is known of the joints that are compared.

    Args:
        names: Joints, in the order of all columns.
        joints: Their profile; None for a foreign robot.
        arm: Columns of the joints that move the tool; empty if the tool's place is not known.
        tool: Forward kinematics of those columns; None likewise.
    """

    names: tuple[str, ...]
    joints: tuple[Joint, ...] | None
    arm: tuple[int, ...]
    tool: ToolFunction | None

    @property
    def scales(self) -> Array:
        """What one border unit of each joint is in SI; 1 for a foreign robot."""
        return np.array(
            [joint.scale for joint in self.joints] if self.joints else [1.0] * len(self.names)
        )

    @property
    def units(self) -> tuple[str, ...]:
        """Border unit of each joint."""
        if not self.joints:
            return ("rad or m",) * len(self.names)
        return tuple(joint.unit for joint in self.joints)

    @property
    def place_unit(self) -> str:
        """Unit of what :meth:`places` returns."""
        return "mm" if self.tool is not None else "rad or m"

    def places(self, positions: Array) -> Array:
        """Return where the tool is [mm], shape ``(k, 3)``.

        Without kinematics the joint positions themselves.
        """
        if self.tool is None:
            return positions
        return np.asarray(self.tool(positions[:, list(self.arm)])) * 1e3

    def moving_speeds(self, motions: tuple[Motion, ...], percent: float) -> Array:
        """Return the speed from which each joint moves, shape ``(n,)``.

        Args:
            motions: What is compared.
            percent: Of the joint's largest speed; for a foreign robot :data:`SLOW_SHARE` of what
                was reached.
        """
        if self.joints:
            return np.array([joint.velocity * percent / 100.0 for joint in self.joints])
        reached = np.max([np.abs(motion.velocities).max(axis=0) for motion in motions], axis=0)
        return np.asarray(np.maximum(SLOW_SHARE * reached, SLOWEST))


@dataclass(frozen=True)
class Track:
    """One experiment of one recording.

    Args:
        label: Of the recording.
        experiment: Its name.
        leader: The side that led.
        real: The real side during the experiment.
        twin: The twin likewise.
        notes: What had to be assumed.
        start: When the experiment began [s]; -inf where nobody marked it.
        end: When it ended [s]; likewise.
        finished: The recording did not end first.
    """

    label: str
    experiment: str
    leader: str
    real: Motion
    twin: Motion
    notes: tuple[str, ...] = ()
    start: float = -math.inf
    end: float = math.inf
    finished: bool = True

    @property
    def marked(self) -> bool:
        """Whether somebody marked when the experiment was."""
        return math.isfinite(self.end - self.start)

    @property
    def common(self) -> tuple[float, float]:
        """From when to when both sides have samples [s]."""
        sides = (self.real, self.twin)
        begin = max(float(side.stamps[0]) for side in sides)
        return begin, min(float(side.stamps[-1]) for side in sides)

    def side(self, name: str) -> Motion:
        """Return one side's motion."""
        return self.real if name == "real" else self.twin


def moving(velocities: Array, speeds: Array) -> Mask:
    """Return for each instant whether any joint moves."""
    return np.asarray((np.abs(velocities) >= speeds).any(axis=1))


def onset(motion: Motion, speeds: Array) -> float | None:
    """Return when a motion begins [s]; None if nothing moves."""
    places = np.flatnonzero(moving(motion.velocities, speeds))
    return float(motion.stamps[places[0]]) if len(places) else None


def first_to_move(real: Motion, twin: Motion, speeds: Array) -> str:
    """Return the side that moved first after both had rested; the real robot if both did at once.

    Where neither ever moved after that, it is the one that moved alone as the time common to both
    began; else nobody knows, and it is the real robot.
    """
    instants = np.union1d(real.stamps, twin.stamps)
    instants = instants[instants >= max(real.stamps[0], twin.stamps[0])]
    real_moves, twin_moves = (
        moving(side.velocities, speeds)[np.searchsorted(side.stamps, instants, side="right") - 1]
        for side in (real, twin)
    )
    rests = ~real_moves & ~twin_moves
    begins = np.flatnonzero(rests[:-1] & ~rests[1:]) + 1
    at = begins[0] if len(begins) else 0
    return "twin" if twin_moves[at] and not real_moves[at] else "real"


def travelled(places: Array) -> Array:
    """Return how far each place is from the first one along the path, shape ``(k,)``."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps)))


def along_path(
    mechanism: Mechanism, motion: Motion, count: int, longest_gap: float
) -> tuple[Array, Array, float]:
    """Return where a side was at equal parts of its own path, when, and the path's length.

    Args:
        mechanism: For the places.
        motion: Of the side.
        count: How many places; the first is the start, the last the end.
        longest_gap: Across samples further apart than this [s] the path is straight.

    Returns:
        Places of shape ``(count, d)``, times of shape ``(count,)`` [s], length in the unit of the
        places.
    """
    start, end = float(motion.stamps[0]), float(motion.stamps[-1])
    instants = equal_steps(start, end, PICTURED_HZ, find_gaps(motion, longest_gap))
    places = mechanism.places(interpolate(motion, instants)[0])
    distance = travelled(places)
    length = float(distance[-1])
    wanted = np.linspace(0.0, length, count)
    # While the tool rests several instants have one distance: the first of them counts.
    rising = np.concatenate(([True], np.diff(distance) > 0.0))
    columns = [
        np.interp(wanted, distance[rising], places[rising, k]) for k in range(places.shape[1])
    ]
    return np.stack(columns, axis=1), np.interp(wanted, distance[rising], instants[rising]), length


def distance_from_path(places: Array, reference: Array, window: int) -> Array:
    """Return how far each place is from a path that is near it, whatever the speed along it.

    Args:
        places: Of one path at equal parts of its length, shape ``(k, d)``.
        reference: The other path, as finely as wished, at equal parts of its length, shape ``(m,
            d)``.
        window: How many places further along or back the nearest one of the reference is looked
            for.

    Returns:
        Distances from the nearest point of the reference's polyline, shape ``(k,)``.
    """
    start, step = reference[:-1], np.diff(reference, axis=0)
    # A reference that does not move has steps without a length.
    length = np.maximum(np.einsum("ij,ij->i", step, step), 1e-30)
    middle = np.round(np.linspace(0.0, len(start) - 1, len(places))).astype(int)
    near = np.clip(middle[:, None] + np.arange(-window, window + 1), 0, len(start) - 1)
    away = places[:, None, :] - start[near]
    share = np.clip(np.einsum("kwd,kwd->kw", away, step[near]) / length[near], 0.0, 1.0)
    return np.asarray(np.linalg.norm(away - share[..., None] * step[near], axis=2).min(axis=1))
