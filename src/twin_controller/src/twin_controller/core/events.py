"""What the core is told: one structure for each input, exactly as it is recorded for replay.

Times ending in ``now``, ``sent`` and ``received`` are seconds of the controller's monotonic clock.
Joint tuples are in the order of the twin's joints in robot.yaml, [rad] and [m].
"""

from __future__ import annotations

from typing import Literal

import msgspec
from scara_control.joint_motion import JointMotion, Setpoints

Joints = tuple[float, ...]
SideName = Literal["real", "twin"]


class Event(msgspec.Struct, frozen=True, tag_field="kind", array_like=False):
    """Base of all inputs."""

    now: float


class Tick(Event, frozen=True, tag="tick"):
    """Time has passed; sent at the state rate and whenever nothing else came for a poll period.

    Attributes:
        own_gap: For so long the controller itself did not run before ``now`` [s], and nobody's
            silence is meant by it. Recordings from before this field have none.
        stood: How long it did not run before ``now`` in all [s], forgiven or not.
    """

    own_gap: float = 0.0
    stood: float = 0.0


class LinkChanged(Event, frozen=True, tag="link"):
    """A link came up or went down."""

    side: SideName
    connected: bool
    reason: str


class RealMeasured(Event, frozen=True, tag="real"):
    """One checked answer of the real robot.

    Attributes:
        sent: When the read was sent.
        received: When the answer was complete.
        clock_ms: The robot's own clock when the motion was true; with ``plain_clock`` when it
            answered.
        motion: The twin's joints; its time is that clock [s], with its wrap. Without velocities
            where the robot gives none.
        own_program: The robot moves by a program of its own, not by our set points.
        streaming: The robot's stream program runs and follows our set points.
        paused: A program is paused, or the robot is held.
        drives_on: Servo power is on.
        fault: An alarm stops the robot.
        held_there: Its pendant says that somebody holds it there; a delivered robot does not tell.
        estop_pressed: The emergency stop button at the robot is pressed.
        speed_percent: Override times programmed speed; None: the robot does not tell.
        gripper: The suction is on; None: the robot has no gripper.
        vacuum: It holds a part.
        ring_places: How many set points it takes ahead of their time; 0: none.
        ring_read: Number of the one that it took last, 1..32760; 0 before the first.
        ring_underruns: So often it had none left.
        program: The name of the program that runs or is paused; empty if it has told none yet.
        overtaken: A newer answer has come in already: it is judged, but nobody follows it.
        held: The robot is held, by us or by somebody.
        operation_mode: At what its mode switch stands: AUTO, T1 or T2; empty: it does not tell.
        efforts: Of the twin's joints [N m or N]; empty: it does not tell. Only shown.
    """

    sent: float
    received: float
    clock_ms: int
    motion: JointMotion
    own_program: bool = False
    streaming: bool = False
    paused: bool = False
    drives_on: bool = True
    fault: bool = False
    held_there: bool = False
    estop_pressed: bool = False
    speed_percent: float | None = 0.0
    override_percent: float = 0.0
    gripper: bool | None = None
    vacuum: bool = False
    ring_places: int = 0
    ring_read: int = 0
    ring_underruns: int = 0
    plain_clock: bool = False
    program: str = ""
    overtaken: bool = False
    held: bool = False
    operation_mode: str = ""
    efforts: tuple[float, ...] = ()

    @property
    def loaded(self) -> bool:
        """Whether a program runs or is paused, its own or the stream's."""
        return self.own_program or self.streaming

    @property
    def runs(self) -> bool:
        """Whether a program runs and is not paused."""
        return self.loaded and not self.paused


class RealKnown(Event, frozen=True, tag="real_known"):
    """What earlier starts have learned of the robot at this address.

    Attributes:
        delay: Of each joint [s].
        smoothing: Of each joint [s^2].
        spread: Standard deviation of the delay from one stream to the next [s].
        pace: With what speed it has kept up [percent].
        behind_at: With what speed it has fallen behind [percent].
        noise: Of its readings at rest, border units.
    """

    delay: Joints
    smoothing: Joints
    spread: float
    pace: float
    behind_at: float
    noise: float


class RealAlarm(Event, frozen=True, tag="alarm"):
    """The robot's active alarm.

    Attributes:
        text: In words; empty when there is none.
        stops: It stops the robot. A warning does not: the robot works on.
    """

    text: str
    stops: bool = True


class TwinMeasured(Event, frozen=True, tag="twin"):
    """Joint state of the twin; its time is the ROS time at which it was true."""

    motion: JointMotion


class TwinPlan(Event, frozen=True, tag="plan"):
    """Where the twin is going to be.

    Attributes:
        stamp: The twin's ROS time from which the times of the set points count.
        setpoints: Of all its joints, checked.
        jog: By a jog that waits for the real robot; else by set points.
    """

    stamp: float
    setpoints: Setpoints
    jog: bool = False

    @property
    def end(self) -> float:
        """When the last set point is due, of the twin's ROS time [s]."""
        return self.stamp + self.setpoints.points[-1].time

    @property
    def rows(self) -> tuple[tuple[float, Joints], ...]:
        """Time from the stamp [s] and joint positions of each set point."""
        return tuple((point.time, point.q) for point in self.setpoints.points)


class TwinMotion(Event, frozen=True, tag="motion"):
    """State of the twin's pose controller.

    Attributes:
        target: Where a running move ends, else empty.
        peak_percent: What its fastest joint reaches of its largest speed, unless a cap slows the
            move; 0: not known.
        way: Joint positions along a running move, from where it begins to its target, straight
            between them; none: the whole is straight.
    """

    state: str
    speed_requested_percent: float
    speed_applied_percent: float
    speed_limit_percent: float
    last_command_id: int
    standing_still: bool
    message: str
    target: Joints = ()
    peak_percent: float = 0.0
    way: tuple[Joints, ...] = ()


class TwinGripper(Event, frozen=True, tag="twin_gripper"):
    """State of the twin's gripper: suction, vacuum, which part it holds, what its arm touches."""

    on: bool
    holding: bool
    part: str = ""
    touches: str = ""


class GripAnswered(Event, frozen=True, tag="grip_answered"):
    """A side's answer to an order to its gripper."""

    side: SideName
    success: bool
    message: str


class PersonSeen(Event, frozen=True, tag="person"):
    """Where a sensor sees the nearest person, in the base frame [m], and how old that is [s]."""

    position: tuple[float, float, float]
    age: float = 0.0
    sensor: str = ""


class ClockProbe(Event, frozen=True, tag="probe"):
    """Answer of the twin's clock to a question of ours."""

    sent: float
    received: float
    remote: float


class MoveEnded(Event, frozen=True, tag="move_ended"):
    """The twin's answer to a move that the operator asked for; 0: to the newest one."""

    success: bool
    message: str
    number: int = 0


class Operator(Event, frozen=True, tag="operator"):
    """A command of the operator.

    Attributes:
        target: Joint positions or a point (x, y, z) [m].
        person: Who asks, a name; empty: a program of this machine.
        session: Tells several pages or clients of one person apart.
        unproven: Why the person is not known to be the one that is named; empty: known. Nobody's
            token ever gets here.
        asked: When it was asked for, or the earliest time at which that may have been [s]; 0: now.
        local: The person whose own programs on this machine the caller is one of; empty: nobody's.
        yaw: Of the tool at a point [rad]; None: as the arm's kinematics choose it.
        path: joint or empty; linear: the tool goes along a straight line.
        speed_mm_s: Of the tool along a line, at most; 0: as the joints allow.
        via: MOVE_JOINTS: joint positions at the places that it passes, one after the other, SI.
        corner_mm: How far from them the tool may pass [mm]; 0: it stops at each.
    """

    command: str
    id: int = 0
    speed_percent: float = 0.0
    target: tuple[float, ...] = ()
    elbow: str = ""
    person: str = ""
    session: str = ""
    unproven: str = ""
    asked: float = 0.0
    local: str = ""
    yaw: float | None = None
    path: str = ""
    speed_mm_s: float = 0.0
    via: tuple[float, ...] = ()
    corner_mm: float = 0.0


class ControlAsked(Event, frozen=True, tag="control"):
    """Somebody takes, asks for, hands over, denies, releases or keeps control; as in Operator.

    Attributes:
        action: TAKE, ASK, GIVE, DENY, RELEASE or KEEP; LEND: the twin is about to move for a
            program of this machine.
        moves: The twin's own motion is that of this seat while it holds control.
    """

    action: str
    id: int = 0
    person: str = ""
    session: str = ""
    unproven: str = ""
    moves: bool = False
    local: str = ""


AnyEvent = (
    Tick
    | LinkChanged
    | RealMeasured
    | RealKnown
    | RealAlarm
    | TwinMeasured
    | TwinPlan
    | TwinMotion
    | TwinGripper
    | GripAnswered
    | PersonSeen
    | ClockProbe
    | MoveEnded
    | Operator
    | ControlAsked
)
