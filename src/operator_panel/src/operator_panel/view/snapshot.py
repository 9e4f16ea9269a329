"""What the page knows of the cell now: plain values, filled by the node from ROS messages."""

from __future__ import annotations

import math

import msgspec
from scara_ros.message_struct import struct_of

from industrial_msgs.msg import RobotStatus as RobotStatusMessage
from scara_msgs.msg import LinkState, MotionOutcome, RobotData, TwinControllerState


class Link(struct_of(LinkState)):  # type: ignore[misc]
    """One link of the twin controller: the fields of scara_msgs/LinkState, times in [s]."""

    age: float = math.inf
    round_trip: float = math.nan
    clock_offset: float = math.nan
    clock_uncertainty: float = math.nan


Place = tuple[float, float, float]
NOWHERE: Place = (math.nan, math.nan, math.nan)


class CellState(struct_of(TwinControllerState)):  # type: ignore[misc]
    """The fields of scara_msgs/TwinControllerState; positions in deg or mm, empty while unknown.

    Tools in [m], NaN while unknown.
    """

    deviation_mm: float = math.nan
    path_deviation_mm: float = math.nan
    lag: float = math.nan
    real_tool: Place = NOWHERE
    twin_tool: Place = NOWHERE
    links: tuple[Link, ...] = ()


class RobotPackage(struct_of(RobotData, "name", "position", "unit")):  # type: ignore[misc]
    """The fields of scara_msgs/RobotData; all joints, those too that the twin lacks [deg or mm]."""

    control_type: str = "none"
    name: tuple[str, ...] = ()
    position: tuple[float, ...] = ()


class RobotStatus(struct_of(RobotStatusMessage)):  # type: ignore[misc]
    """The fields of industrial_msgs/RobotStatus: mode 1 by hand, 2 automatic; 1 yes, 0 no, -1."""


class Loop(msgspec.Struct, frozen=True):
    """A PID loop as in control_msgs/JointControllerState, SI; ``received`` is monotonic [s]."""

    set_point: float
    process_value: float
    error: float
    command: float
    received: float


class Made(struct_of(MotionOutcome)):  # type: ignore[misc]
    """A motion that was judged and has ended: the fields of scara_msgs/MotionOutcome."""


class Diagnosis(msgspec.Struct, frozen=True):
    """One diagnostic_msgs/DiagnosticStatus and when it came (monotonic [s])."""

    level: int
    name: str
    message: str
    received: float
    values: dict[str, str] = {}


class Part(msgspec.Struct, frozen=True, array_like=True):
    """A part, a cylinder.

    Position of its middle [m], orientation x, y, z, w, diameter and height [m], colour
    ``#rrggbb``.
    """

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    diameter: float
    height: float
    colour: str


class DecisionLine(msgspec.Struct, frozen=True):
    """One decision of the twin controller; ``time`` is date and time of day, as in ISO 8601."""

    time: str
    mode_before: str
    mode_after: str
    why: str


class Sighting(msgspec.Struct, frozen=True):
    """Where a sensor saw the nearest person, in the base frame [m]; ``seen`` is monotonic [s]."""

    place: tuple[float, float, float]
    seen: float


RECENT_S = 0.5
"""Longer than the time between two looks at a snapshot; our choice."""


class Snapshot(msgspec.Struct, frozen=True):
    """Everything, with the monotonic time at which the state came; -inf: never.

    Attributes:
        master: Whether the panel is a node of a ROS master.
        state: Newest twin_controller/state.
        received: When it came.
        ended: When a stop, a pause, a fault or a lost link was seen last, as a change of the mode.
        apart: Of the last ``RECENT_S``, when each state came in which a side led, and how far the
            tools were apart in it [mm]: a peak is shorter than the time between two looks.
        silent_since: Time of day of the last one, as text, for people.
        package: The real robot's newest; None while the robot is not heard.
        parts: Parts of each side, ``twin`` and ``real``.
        status: The real robot in the words of ROS-Industrial.
        placed: Side to how many parts it has placed since the page's server was started.
        no_stop: Why a STOP of the page would not get through now, or an empty text.
        gate: What what_if.yaml says of the gate: refuse, warn or off; empty: not known.
        moves_unjudged: Whether a motion begins that nobody could judge.
        made: The last motion that was judged and has ended.
        people: Sensor to the nearest person that it saw.
    """

    master: bool = False
    state: CellState | None = None
    received: float = -math.inf
    ended: float = -math.inf
    apart: tuple[tuple[float, float], ...] = ()
    silent_since: str = ""
    package: RobotPackage | None = None
    loops: dict[str, Loop] = {}
    jog: str = ""
    diagnoses: dict[str, Diagnosis] = {}
    decisions: tuple[DecisionLine, ...] = ()
    parts: dict[str, tuple[Part, ...]] = {}
    status: RobotStatus | None = None
    placed: dict[str, int] = {}
    no_stop: str = ""
    gate: str = ""
    moves_unjudged: bool = True
    made: Made | None = None
    people: dict[str, Sighting] = {}

    def __post_init__(self) -> None:
        """Forget the package of a real robot that is not heard: it says nothing of now."""
        if self.state is not None and not self.state.real_position:
            msgspec.structs.force_setattr(self, "package", None)

    def refused(self) -> dict[str, str]:
        """Return for each command why the twin controller refuses it; an empty text: allowed."""
        if self.state is None:
            return {}
        return dict(zip(self.state.command, self.state.refused, strict=True))

    def is_silent(self, now: float, silent_s: float) -> bool:
        """Return whether the twin controller has said nothing for longer than ``silent_s``."""
        return self.state is None or now - self.received > silent_s
