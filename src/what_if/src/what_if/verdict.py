"""The answer to a motion: may it be made, why not, and the figures."""

from __future__ import annotations

from enum import Enum

import msgspec


class Outcome(Enum):
    """What is to be expected of a motion."""

    OK = "OK"
    LIMITED = "LIMITED"
    """It can be made, but not as it was asked for: slower, or from a start it is not at."""
    REFUSED = "REFUSED"


class Cause(Enum):
    """Why a motion is refused or limited."""

    REACH = "reach"
    LIMIT = "limit"
    ZONE = "zone"
    COLLISION = "collision"
    DROP = "drop"
    GRIP = "grip"
    EFFORT = "effort"
    SPEED = "speed"


class Reason(msgspec.Struct, frozen=True):
    """One reason against a motion.

    Attributes:
        cause: Its kind.
        time_s: When, from the beginning of the motion.
        step: Which part of the motion, for example a line of the program; empty: all of it.
        place_mm: Where it happens, in the base frame; None if it has no place.
        text: In words.
    """

    cause: Cause
    time_s: float
    step: str
    place_mm: tuple[float, float, float] | None
    text: str


class Clearance(msgspec.Struct, frozen=True):
    """The smallest clearance of all bodies.

    Attributes:
        distance_mm: As measured where it is smallest.
        at_least_mm: No two bodies come nearer anywhere on the way.
        between: Their names.
        time_s: When.
    """

    distance_mm: float
    at_least_mm: float
    between: tuple[str, str]
    time_s: float


class JointUse(msgspec.Struct, frozen=True):
    """What a motion asks of one joint at most, in percent of what robot.yaml gives it."""

    joint: str
    speed_percent: float
    acceleration_percent: float
    effort_percent: float


class Verdict(msgspec.Struct, frozen=True):
    """The answer.

    Attributes:
        outcome: OK, LIMITED or REFUSED.
        reasons: Against it, in time; the first one counts.
        duration_s: Time the whole takes, until the robot stands.
        duration_spread_s: Standard deviation of it, by the spread of the robot's lag, of a program
            by that of its rests at FINE; what the acceleration adds is not in it.
        clearance: None if nothing moves against anything.
        joints: What is asked of each.
        tool_speed_mm_s: Largest speed of a watched point.
        fastest_point: Which one.
        zones: Keep-out zones that are entered, or come nearer to than allowed.
        placed: Parts that are set down, with where.
        dropped: Parts that fall.
        energy_j: Mechanical work of the joints, without what braking gives back.
        target: Joint positions at the end [rad] or [m].
    """

    outcome: Outcome
    reasons: tuple[Reason, ...] = ()
    duration_s: float = 0.0
    duration_spread_s: float = 0.0
    clearance: Clearance | None = None
    joints: tuple[JointUse, ...] = ()
    tool_speed_mm_s: float = 0.0
    fastest_point: str = ""
    zones: tuple[str, ...] = ()
    placed: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    energy_j: float = 0.0
    target: tuple[float, ...] = ()

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if not self.reasons:
            return f"OK: takes {self.duration_s:.2f} s"
        first = self.reasons[0]
        where = f", {first.step}" if first.step else ""
        return f"{self.outcome.value} at {first.time_s:.2f} s{where}: {first.text}"
