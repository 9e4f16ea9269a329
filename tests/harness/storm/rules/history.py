"""What happened in one scene of a storm: plain data, times in ROS time [s], positions in SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from harness.scenes.truth import Row

SIDES = ("real", "twin")


@dataclass(frozen=True)
class Servo:
    """How a drive follows what it is told: natural frequency [rad/s], accelerations SI.

    ``command_acceleration`` is what it takes as command, ``servo_acceleration`` what its motor has.
    """

    frequency: float
    damping: float
    feedforward: float
    command_acceleration: float
    servo_acceleration: float


@dataclass(frozen=True)
class Joint:
    """What a joint may do, SI; ``scale`` leads from deg or mm to SI.

    ``servo`` is that of the robot that is played; None: it is exactly as fast as it is told.
    """

    name: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    jerk: float
    scale: float
    servo: Servo | None = None


@dataclass(frozen=True)
class Deed:
    """One command that was sent.

    Attributes: sent: When it left us. until: When its last part left us, for what is repeated.
    answered: When it was answered, None if it never was. kind: "motion" may begin a motion; "stop"
    ends it; "release" takes back what holds a side; "other" does none of these. success: Whether
    the answer was yes. said: The answer. sides: Whom a stop must stop. waits: It is answered at the
    end of its motion, so that nothing of it can begin afterwards.
    """

    name: str
    kind: str
    sent: float
    until: float
    answered: float | None = None
    success: bool = True
    said: str = ""
    sides: tuple[str, ...] = SIDES
    waits: bool = False

    @property
    def acknowledged(self) -> bool:
        """Whether somebody said that it is done."""
        return self.answered is not None and self.success

    @property
    def refused(self) -> bool:
        """Whether it moves nothing; what is answered at its end may have moved and then failed."""
        return self.answered is not None and not self.success and not self.waits


@dataclass(frozen=True)
class Strike:
    """One fault.

    Attributes: grace: For each side it touches how much longer [s] that may take. seen: Whether
    what it shall break was seen broken: a process that stands or has ended, a line in use.
    """

    name: str
    begun: float
    ended: float
    grace: Mapping[str, float] = field(default_factory=dict)
    seen: bool = True


@dataclass(frozen=True)
class Decided:
    """One decision of the twin controller."""

    at: float
    before: str
    event: str
    after: str
    leader: str
    why: str = ""


@dataclass(frozen=True)
class Told:
    """One state of the twin controller; ``holder`` holds control, empty: nobody."""

    at: float
    mode: str
    leader: str = ""
    holder: str = ""


@dataclass(frozen=True)
class Entry:
    """One entry of the audit."""

    at: float
    who: str
    what: str
    success: bool


@dataclass(frozen=True)
class History:
    """One scene.

    Attributes: truth: For each side its ground truth. births: For each side when its process was
    started again, so that it stands elsewhere. deaths: What ended without us. gaps: When the
    machine stood still. unrecovered: Why the pair was not IDLE in the end, empty if it was.
    """

    begun: float
    joints: Sequence[Joint]
    truth: Mapping[str, Sequence[Row]]
    births: Mapping[str, Sequence[float]] = field(default_factory=dict)
    deeds: Sequence[Deed] = ()
    strikes: Sequence[Strike] = ()
    decisions: Sequence[Decided] = ()
    states: Sequence[Told] = ()
    audit: Sequence[Entry] = ()
    deaths: Sequence[str] = ()
    gaps: Sequence[tuple[float, float]] = ()
    unrecovered: str = ""
    ended: float = 0.0


@dataclass(frozen=True)
class Violation:
    """A rule that was broken between ``begin`` and ``end``, and what shows it."""

    rule: str
    begin: float
    end: float
    evidence: str
