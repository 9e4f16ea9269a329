"""Everything the core knows: frozen structures, replaced as a whole by each step."""

from __future__ import annotations

from functools import cached_property

import msgspec
import numpy as np
from scara_config import Robot
from scara_control.kinematics.screws import ScrewModel

from twin_controller.config import TwinControllerConfig
from twin_controller.core.actions import Decided, Do
from twin_controller.core.events import Joints, RealMeasured, TwinMotion, TwinPlan
from twin_controller.core.following.blend import Blend
from twin_controller.core.observing.change import ChangeState
from twin_controller.core.observing.clock import ClockEstimate
from twin_controller.core.observing.divergence import DivergenceState
from twin_controller.core.observing.echo import EchoTube
from twin_controller.core.rules.table import Mode
from twin_controller.core.safety.guard import Guard
from twin_controller.core.safety.points import watched_points
from twin_controller.core.safety.separation import Distance
from twin_controller.core.safety.sightings import Person
from twin_controller.core.safety.speed import SpeedState, fastest_speed
from twin_controller.core.safety.zones import Way, speed_cap

HISTORY = 48


class Setup:
    """What never changes while the controller runs: profile, numbers and what follows from them."""

    def __init__(self, robot: Robot, config: TwinControllerConfig) -> None:
        """Derive the joint tables.

        Args:
            robot: The profile.
            config: The numbers of twin_controller.yaml.
        """
        self.config = config
        self.joints = robot.twin_joints
        self.names = tuple(joint.name for joint in self.joints)
        self.scale = tuple(joint.scale for joint in self.joints)
        self.lower = tuple(joint.lower for joint in self.joints)
        self.upper = tuple(joint.upper for joint in self.joints)
        self.velocity = tuple(joint.velocity for joint in self.joints)
        self.acceleration = tuple(joint.acceleration for joint in self.joints)
        share = config.cell.braking_acceleration_percent * 1e-2
        self.braking = tuple(joint.acceleration * share for joint in self.joints)
        self.points = watched_points(robot)
        self.arm = ScrewModel.from_robot(robot)
        self.arm_columns = np.array([k for k, joint in enumerate(self.joints) if joint.screw_axis is not None])
        self.home = tuple(robot.home_positions)
        self.keep_out = tuple(robot.keep_out)

    @cached_property
    def fastest(self) -> float:
        """Largest speed that a watched point can have [m/s], in any pose and with all joints at their largest speed."""
        return fastest_speed(self.points, self.lower, self.upper, self.velocity)

    @property
    def safe_percent(self) -> float:
        """Program speed at which no motion whatever exceeds the Cartesian limit [percent]; 100 without a limit."""
        limit = self.config.cell.cartesian_speed_mm_s
        return 100.0 if limit is None else speed_cap(self.fastest, limit)

    def to_border(self, q: Joints) -> Joints:
        """Convert SI joint positions to degrees and millimetres."""
        return tuple(value / scale for value, scale in zip(q, self.scale))

    def align_speeds(self) -> Joints:
        """Return the speed of each joint while the twin aligns, SI."""
        share = self.config.align.speed_percent * 1e-2
        return tuple(velocity * share for velocity in self.velocity)


class Sample(msgspec.Struct, frozen=True):
    """One side's joints at one instant; ``t`` is the controller's clock [s], q and qdot are SI."""

    t: float
    q: Joints
    qdot: Joints


class Side(msgspec.Struct, frozen=True):
    """What is known of one side.

    Attributes:
        connected: Its link is up.
        echoed: Samples of this lead that were taken for the answer to our own commands.
        reason: Why not.
        seen: When the newest sample was true at the latest [s]; None before the first one since the link came up.
        history: Samples, newest last.
        change: Agreed position, onset and standstill.
        tube: Our own last commands to it.
        clock: Its clock against ours.
    """

    connected: bool = False
    reason: str = "not connected yet"
    seen: float | None = None
    history: tuple[Sample, ...] = ()
    change: ChangeState = ChangeState()
    tube: EchoTube = EchoTube()
    echoed: int = 0
    clock: ClockEstimate = ClockEstimate()

    @property
    def last(self) -> Sample:
        """The newest sample; only where one is known to exist."""
        return self.history[-1]


class Follow(msgspec.Struct, frozen=True):
    """The twin follows the real robot: the remaining offset, and from when on (the twin ignores packets just after a stop)."""

    blend: Blend | None
    since: float


class StreamState(msgspec.Struct, frozen=True):
    """The real robot follows the twin.

    Attributes:
        blend: Remaining offset real - twin; None until the first set point.
        last: Last set point sent and when; None before the first.
        starting: The stream program is asked for as soon as a set point has been sent: never with an old one.
        started: When it was asked for last [s].
        attempts: How often.
        ending: The robot still reports the stream before, which it has been told to end; this one is asked for after it.
        seen: The stream program has been seen running, not held.
        loaded: It was there, held, when it was let go on: if it is gone after that, somebody ended it.
        onset: When the twin's motion begins, by its announcement [s]; a robot that moved before it was first.
    """

    blend: Blend | None = None
    last: Sample | None = None
    starting: bool = False
    started: float = 0.0
    attempts: int = 0
    ending: bool = False
    seen: bool = False
    loaded: bool = False
    onset: float | None = None


class Gripper(msgspec.Struct, frozen=True):
    """What a side shows of its gripper: ``on`` is None while it is not known; ``part`` only the twin tells."""

    on: bool | None = None
    holding: bool = False
    part: str = ""


class GripOrder(msgspec.Struct, frozen=True):
    """An order to a side's gripper that the side does not show yet: when it was sent last [s], and how often."""

    on: bool
    sent: float
    attempts: int


class Owed(msgspec.Struct, frozen=True):
    """A stop or hold that the real robot does not show yet: what it was told, when last [s], and how often."""

    do: Do
    sent: float
    attempts: int = 1


class CoreState(msgspec.Struct, frozen=True):
    """The whole state of the controller.

    Attributes:
        lag: How far the real robot follows behind its set points [s], measured.
        flags: Newest answer of the real robot.
        clock_ms: Its clock, unwrapped.
        links_up: Both sides were usable at the last look.
        command_id: Last id given to a command to the twin.
        asked: What the twin reported when that was sent; until it takes effect the twin goes on reporting so.
        asked_at: When it was sent [s].
        way: The twin's running move as the watched points see it.
        people: Where each sensor saw the nearest person last.
        separation: Distance to the nearest of them and what follows from it.
        guard: What the real robot's motion means for zones and people.
        paused_mode: The mode that PAUSE interrupted.
        paused_seen: Whether the real robot and the twin have shown that they paused since.
        real_busy: The real robot's last answer showed a program or a stream; kept while its link is down.
        owed: The stop that the real robot must still show; kept while its link is down.
        must_align: A latched stop was reset: before ALIGN the twin may not lead.
        estop_at: When the emergency stop was sent last [s].
        reset_since: When the real robot was asked to reset [s], None if it was not.
        program_was_off: The real robot's own program was seen ended since the last stop.
        move_pending: The twin has not answered the operator's move yet.
        grip_real: The real robot's gripper, as it shows it; ``grip_twin`` the twin's.
        order_real: What the real robot's gripper was told and does not show yet; ``order_twin`` the twin's.
        grip_differ: Since when the grippers have not done the same [s]; None: they do, or one is not known.
        grip_trouble: What was not passed on, not obeyed, or differs; empty once they do the same.
    """

    lag: float
    mode: Mode = Mode.OFFLINE
    leader: str = ""
    why: str = "started; no link is up yet"
    mode_since: float = 0.0
    seq: int = 0
    real: Side = Side()
    twin: Side = Side()
    flags: RealMeasured | None = None
    clock_ms: int | None = None
    motion: TwinMotion | None = None
    plan: TwinPlan | None = None
    alarm: str = ""
    follow: Follow | None = None
    stream: StreamState | None = None
    speed: SpeedState = SpeedState()
    divergence: DivergenceState = DivergenceState()
    links_up: bool = False
    command_id: int = 0
    asked: TwinMotion | None = None
    asked_at: float = 0.0
    way: Way = Way()
    people: tuple[Person, ...] = ()
    separation: Distance = Distance()
    guard: Guard = Guard()
    twin_stopped_at: float = -1e9
    paused_mode: Mode | None = None
    paused_seen: tuple[bool, bool] = (False, False)
    needs_acknowledge: bool = False
    real_busy: bool = False
    owed: Owed | None = None
    must_align: bool = False
    estop_at: float = -1e9
    reset_since: float | None = None
    program_was_off: bool = True
    move_pending: bool = False
    grip_real: Gripper = Gripper()
    grip_twin: Gripper = Gripper()
    order_real: GripOrder | None = None
    order_twin: GripOrder | None = None
    grip_differ: float | None = None
    grip_trouble: str = ""
    decisions: tuple[Decided, ...] = ()

    @property
    def resume_blocked(self) -> bool:
        """Whether a paused motion may not go on, whoever lets it: a divergence is not acknowledged, a person is too close."""
        return self.needs_acknowledge or self.separation.too_close


def initial_state(config: TwinControllerConfig) -> CoreState:
    """Return the state before the first input."""
    return CoreState(lag=config.real.follow_lag_ms * 1e-3)
