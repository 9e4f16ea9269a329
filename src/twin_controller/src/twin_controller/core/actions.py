"""What the core decides: data that the shell carries out."""

from __future__ import annotations

import msgspec
from scara_config.text_enum import StrEnum
from scara_control.joint_motion import JointMotion

from twin_controller.core.events import Joints, SideName


class Command(StrEnum):
    """What the state table tells a side or the core; a command has no arguments."""

    STOP_REAL = "stop the real robot"
    HOLD_REAL = "hold the real robot"
    GIVE_HOLD_BACK = "give the real robot's HOLD back"
    RELEASE_REAL = "let the real robot go on"
    END_AT_REST = "end the real robot's program at rest"
    END_STREAM = "take the real robot's set point back"
    ESTOP_REAL = "switch the real robot's drives off"
    RESET_REAL = "reset the real robot"
    START_STREAM = "start the real robot's stream program"
    CONTINUE_STREAM = "let the real robot's paused stream program go on"
    STOP_TWIN = "stop the twin"
    PAUSE_TWIN = "pause the twin"
    RESUME_TWIN = "resume the twin"
    ESTOP_TWIN = "freeze the twin"
    RESET_TWIN = "reset the twin"
    YIELD_TWIN = "end the twin's own motion"
    RELEASE_TWIN = "end the twin's following"
    BEGIN_ALIGN = "align the twin"
    BEGIN_FOLLOW_TWIN = "let the twin follow"
    BEGIN_STREAM = "let the real robot follow"
    BASELINE = "take the positions as agreed"
    MOVE_TWIN = "send the operator's move to the twin"


class Action(msgspec.Struct, frozen=True, tag_field="kind"):
    """Base of all actions."""


class Send(Action, frozen=True):
    """Send one command of the state table; its type says to which side."""

    command: Command
    reason: str


class SendReal(Send, frozen=True, tag="send_real"):
    """Send it to the real robot."""


class SendTwin(Send, frozen=True, tag="send_twin"):
    """Send it to the twin, which reports ``id`` back; 0: it is not asked to."""

    id: int = 0


class FollowTwin(Action, frozen=True, tag="follow_twin"):
    """Set points for the twin; their times count from ``stamp`` (the twin's ROS time) [s].

    The first is what was true at the stamp, the others how a robot that repeats itself goes on.
    """

    stamp: float
    points: tuple[JointMotion, ...]


class RobotSetpoint(msgspec.Struct, frozen=True):
    """One set point for the real robot, as it is decided, remembered and written."""

    # Joint positions, SI: no faster than allowed. Of the twin's joints; on the wire of all.
    q: Joints
    # Of a robot that takes set points ahead: its number, and its time by the robot's clock.
    number: int = 0
    clock_ms: int = 0
    # When the robot takes it, by our clock [s].
    t: float = 0.0
    # What the twin asked for.
    asked: Joints = ()


class StreamReal(Action, frozen=True, tag="stream_real"):
    """Set point for the real robot, validated and limited; to be sent at ``send_at`` [s]."""

    setpoint: RobotSetpoint
    speed_percent: float
    send_at: float


class StreamAhead(Action, frozen=True, tag="stream_ahead"):
    """Set points for the robot's ring; what stood under their numbers no longer counts.

    Nothing behind number ``newest`` counts any longer.
    """

    points: tuple[RobotSetpoint, ...]
    newest: int
    speed_percent: float


class MoveTwin(Action, frozen=True, tag="move_twin"):
    """Ask the twin to move; fields as in the operator's command, its end brings ``number`` back."""

    command: str
    target: tuple[float, ...]
    speed_percent: float
    elbow: str
    asked: float = 0.0
    yaw: float | None = None
    path: str = ""
    speed_mm_s: float = 0.0
    via: tuple[float, ...] = ()
    corner_mm: float = 0.0
    number: int = 0


class CapTwin(Action, frozen=True, tag="cap_twin"):
    """Cap the twin's program speed; its time base is stretched."""

    speed_percent: float


class OverrideReal(Action, frozen=True, tag="override_real"):
    """Set the real robot's override."""

    speed_percent: float


class Grip(Action, frozen=True, tag="grip"):
    """Switch the suction of one side."""

    side: SideName
    on: bool


class Reply(Action, frozen=True, tag="reply"):
    """Answer to the operator's command ``id``."""

    id: int
    success: bool
    message: str


class Decided(Action, frozen=True, tag="decided"):
    """One decision, for the log, the topic and ``why``; ``who`` is the person behind it."""

    seq: int
    now: float
    mode_before: str
    trigger: str
    mode_after: str
    leader: str
    actions: tuple[str, ...]
    why: str
    onset_real: float | None = None
    onset_twin: float | None = None
    onset_uncertainty: float = 0.0
    who: str = ""


AnyAction = (
    SendReal
    | SendTwin
    | FollowTwin
    | StreamReal
    | StreamAhead
    | MoveTwin
    | CapTwin
    | OverrideReal
    | Grip
    | Reply
    | Decided
)
