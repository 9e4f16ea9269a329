"""Is a robot another one than in its first week? Signs of cycles become findings, in words.

A sign counts as changed where the mean of the last cycles is further from the first week's than
its limit, and than the first week itself scattered; and it has to stay so for some cycles. What
all joints do together (warm grease, a late network) is taken off first. A joint that stood in the
first week is left out; one that stands in a cycle is not judged by it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scara_config import Robot

from twin_analysis.health.signs import Array, Signs, TorqueError

WINDOW, CONFIRMED = 6, 2
"""Cycles whose mean is looked at, and how often in a row it must be far off. Our choice."""
STUDENT = 2.571
"""95 % of Student's distribution with ``WINDOW`` - 1 degrees of freedom."""
FRICTION, INERTIA, LAG_S, PLAY, VACUUM = 0.15, 0.05, 0.0006, 1e-4, 0.15
"""Limits: parts of the first week's, seconds, and a part of a joint's range. Our choice."""
SPREAD = 2.0
"""So many times the first week's own scatter. Our choice."""
LEAST = 12
"""Cycles that a first week has to have."""
RECENT = WINDOW + CONFIRMED - 1
"""Cycles behind the first week from which on a change can be told."""
FEWEST = 3
"""Joints that have to move: of two, what all do together is half of what one does."""
CAUSES = {
    "friction": "friction: look at its grease, its bearings and what rubs on its cables",
    "payload": "the payload: look at what hangs at the tool, and what the robot was told of it",
    "backlash": "backlash: look at its gear, screw or belt for play",
    "stiffness": "a softer drive: look at its belt's tension, its coupling and its servo gains",
    "vacuum": "a leak: look at the suction cup, its hose and the pump's filter",
}
DIRECTIONS = {"forward": "positive", "backward": "negative"}
"""Friction in one direction is looked at where nothing else has changed."""


@dataclass(frozen=True)
class Finding:
    """Something has changed since the first week.

    Attributes:
        kind: Key of ``CAUSES``.
        joint: Its name; empty: no joint's.
        change: By how much: part of the first week's, or s, or rad and m.
        margin: Half of its 95 % interval.
        score: How far beyond its limit; 1 is at it.
        text: In words.
    """

    kind: str
    joint: str
    change: float
    margin: float
    score: float
    text: str


@dataclass(frozen=True)
class JointFacts:
    """What has to be known of a robot's joints.

    Attributes:
        names: Of the joints.
        ranges: From end to end of each joint [rad or m].
        fastest: Greatest speed of each [rad/s or m/s].
        carries: Which of them carry the tool.
        units: Of a robot.yaml, in which their play is told: deg or mm.
    """

    names: tuple[str, ...]
    ranges: Array
    fastest: Array
    carries: tuple[bool, ...]
    units: tuple[str, ...]

    def of(self, names: Sequence[str]) -> JointFacts:
        """Return some of them."""
        places = [self.names.index(name) for name in names]
        return JointFacts(
            tuple(names),
            self.ranges[places],
            self.fastest[places],
            tuple(self.carries[place] for place in places),
            tuple(self.units[place] for place in places),
        )


def facts_of(robot: Robot) -> JointFacts:
    """Return what has to be known of all joints of a robot.yaml."""
    return JointFacts(
        tuple(joint.name for joint in robot.joints),
        np.array([joint.upper - joint.lower for joint in robot.joints]),
        np.array([joint.velocity for joint in robot.joints]),
        tuple(joint.screw_axis is not None for joint in robot.joints),
        tuple(joint.unit for joint in robot.joints),
    )


class Baseline:
    """The first week's signs: means, and how they scatter from cycle to cycle.

    Args:
        joints: Of the robot.
        week: Signs of at least ``LEAST`` cycles.

    Raises:
        ValueError: There are fewer.
        TorqueError: No joint moved in as many of them.
    """

    def __init__(self, joints: JointFacts, week: Sequence[Signs]) -> None:
        if len(week) < LEAST:
            raise ValueError(f"a first week of {len(week)} cycles: needs {LEAST}")
        self.joints = joints
        self._carries = np.array(joints.carries, dtype=bool)
        moved = np.sum([each.moved for each in week], axis=0)
        self._known = moved >= LEAST
        self.left_out = "; ".join(
            f"{name} moved both ways in {count} of {len(week)} cycles of its first week: left out"
            for name, count in zip(joints.names, moved)
            if count < LEAST
        )
        if not self._known.any():
            raise TorqueError(f"the first week has no {LEAST} cycles of a joint: {self.left_out}")
        if (moving := int(self._known.sum())) < FEWEST:
            few = (
                f"joints that moved both ways: {moving}, and {FEWEST} are needed: friction or a "
                "softer drive of one is told late or never"
            )
            self.left_out = "; ".join(filter(None, (self.left_out, few)))
        self.friction = self._mean([each.friction for each in week])
        self.forward = self._mean([each.forward for each in week])
        self.backward = self._mean([each.backward for each in week])
        self.inertia = self._mean([each.inertia for each in week])
        self.lag = self._mean([each.lag for each in week])
        self.play = self._mean([each.play for each in week])
        gripped = np.array([each.vacuum_s for each in week if math.isfinite(each.vacuum_s)])
        self.vacuum_s = float(np.mean(gripped)) if len(gripped) >= LEAST else math.nan
        changes = [self.changes(each) for each in week]
        self.scatter = {
            kind: np.ma.masked_invalid([each[kind] for each in changes]).std(axis=0).filled(np.nan)
            for kind in changes[0]
        }

    def _mean(self, rows: list[Array]) -> Array:
        """Return the mean of each joint that counts, over the cycles in which it moved."""
        means = np.ma.masked_invalid(rows).mean(axis=0).filled(np.nan)
        return np.where(self._known, means, np.nan)

    def changes(self, signs: Signs) -> dict[str, Array]:
        """Return by how much each sign of a cycle differs from the first week's, by kind."""
        # An ideal robot has no friction: there is nothing to compare then.
        with np.errstate(divide="ignore", invalid="ignore"):
            # A joint beside the arm, as the table, does not feel what hangs at the tool.
            heavier = (signs.inertia / self.inertia - 1.0)[self._carries]
            return {
                "friction": _beyond_all(signs.friction / self.friction),
                "payload": np.array([_middle(heavier)]),
                "backlash": signs.play - self.play,
                "stiffness": _beyond_all(signs.lag - self.lag),
                "vacuum": np.array([signs.vacuum_s / self.vacuum_s - 1.0]),
                "forward": _beyond_all(signs.forward / self.forward),
                "backward": _beyond_all(signs.backward / self.backward),
            }

    def limits(self) -> dict[str, Array]:
        """Return how far each may be off."""
        ones = np.ones(len(self.joints.names))
        least = {
            "friction": FRICTION * ones,
            "payload": np.array([INERTIA]),
            "backlash": PLAY * self.joints.ranges,
            "stiffness": LAG_S * ones,
            "vacuum": np.array([VACUUM]),
            "forward": FRICTION * ones,
            "backward": FRICTION * ones,
        }
        return {kind: np.maximum(each, SPREAD * self.scatter[kind]) for kind, each in least.items()}


class Monitor:
    """Looks at one cycle after the other.

    Args:
        baseline: The first week.
    """

    def __init__(self, baseline: Baseline) -> None:
        self._base, self._limits = baseline, baseline.limits()
        self._kept: deque[dict[str, Array]] = deque(maxlen=WINDOW)
        self._suspect, self._times = ("", ""), 0

    def take(self, signs: Signs) -> Finding | None:
        """Take in a cycle and return what has changed, once it has stayed so."""
        self._kept.append(self._base.changes(signs))
        found = None
        if len(self._kept) == WINDOW:
            found = self._worst(CAUSES) or self._worst(DIRECTIONS)
        about = (found.kind, found.joint) if found is not None else ("", "")
        # Noise seldom names the same joint twice in a row; what has worn is named again.
        self._times = self._times + 1 if about == self._suspect else 1
        self._suspect = about
        return found if found is not None and self._times >= CONFIRMED else None

    def _worst(self, kinds: Iterable[str]) -> Finding | None:
        """Return what is furthest beyond its limit."""
        best: Finding | None = None
        for kind in kinds:
            rows = np.array([each[kind] for each in self._kept])
            means = rows.mean(axis=0)
            margins = STUDENT * rows.std(axis=0, ddof=1) / math.sqrt(len(rows))
            # A lighter tool is as wrong as a heavier one; less friction is no wear.
            beyond = np.abs(means) if kind == "payload" else means
            # What is not known of all these cycles is not judged.
            scores = np.nan_to_num(beyond / self._limits[kind], nan=0.0, posinf=0.0)
            at = int(np.argmax(scores))
            if scores[at] > 1.0 and (best is None or scores[at] > best.score):
                joints = self._base.joints
                joint, unit = (joints.names[at], joints.units[at]) if len(means) > 1 else ("", "")
                change, margin = float(means[at]), float(margins[at])
                text = words(kind, joint, change, margin, unit)
                cause = "friction" if kind in DIRECTIONS else kind
                best = Finding(cause, joint, change, margin, float(scores[at]), text)
        return best


def _middle(values: Array) -> float:
    """Return the median of what is known; NaN: nothing is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else math.nan


def _beyond_all(values: Array) -> Array:
    """Return by how much each is beyond what all do together."""
    return values - _middle(values)


def words(kind: str, joint: str, change: float, margin: float, unit: str) -> str:
    """Return a finding in words: what, how much, the likely cause, where to look.

    Example:
        >>> print(words("friction", "joint_2", 0.18, 0.02, "deg"))
        joint_2 needs 18 % (16 to 20) more torque against friction than in its first week; likely \
friction: look at its grease, its bearings and what rubs on its cables
    """
    off, low, high = 100.0 * change, 100.0 * (change - margin), 100.0 * (change + margin)
    match kind:
        case "friction" | "forward" | "backward":
            way = f" in its {DIRECTIONS[kind]} direction" if kind in DIRECTIONS else ""
            said = (
                f"{joint} needs {off:.0f} % ({low:.0f} to {high:.0f}) more torque against friction"
                f"{way}"
            )
        case "payload":
            more = "more"
            if change < 0.0:
                more, low, high = "less", -high, -low
            said = f"the arm moves {abs(off):.0f} % ({low:.0f} to {high:.0f}) {more} inertia"
        case "backlash":
            scale = 1e3 if unit == "mm" else 180.0 / math.pi
            said = (
                f"{joint} goes {scale * change:.2f} {unit} "
                f"({scale * (change - margin):.2f} to {scale * (change + margin):.2f}) without its "
                "load after it has turned, more"
            )
        case "stiffness":
            said = (
                f"{joint} is {1e3 * change:.1f} ms ({1e3 * (change - margin):.1f} to "
                f"{1e3 * (change + margin):.1f}) later behind its set points"
            )
        case _:
            said = f"the vacuum takes {off:.0f} % ({low:.0f} to {high:.0f}) longer"
    return f"{said} than in its first week; likely {CAUSES.get(kind, CAUSES['friction'])}"
