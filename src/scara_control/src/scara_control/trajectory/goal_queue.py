"""Who may move the twin by a trajectory, and when.

Goals are accepted, run one after the other, and ended.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from scara_config import Joint

from scara_control.config import MotionConfig
from scara_control.dynamics.effort import Load
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import Command, State
from scara_control.motion.drive import Follower, believed, went_back
from scara_control.motion.epoch import ENDING
from scara_control.trajectory.execution import Ended, Execution, TrajectoryFeedback
from scara_control.trajectory.goal import Code, Goal, GoalError
from scara_msgs.msg import TwinControllerState as Mode

BLOCKING = (
    Mode.OFFLINE,
    Mode.ALIGNING,
    Mode.REAL_LEADS,
    Mode.OPERATOR_LEADS,
    Mode.PAUSED,
    Mode.STOPPED,
    Mode.STANDSTILL,
    Mode.ESTOP,
    Mode.FAULT,
)
"""Modes of the twin controller in which a trajectory may not begin."""

LEADING = Mode.TWIN_LEADS

_WAYS_OUT: dict[str, str] = {
    State.ESTOPPED: "RESET it first",
    State.PAUSED: "RESUME or STOP first",
    State.FOLLOWING: "STOP what it follows first",
}
QUIET = 1.5
"""After a stop joint_pose_controller listens to no stream that has not paused for its time-out; so
many of these we pause."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A goal that waits since a time [s]; ``own``: it is that of whoever holds control."""

    key: Hashable
    goal: Goal
    since: float
    own: bool


@dataclass(frozen=True, slots=True)
class Turn:
    """What one period brings.

    Attributes:
        packet: Set points to publish.
        end_stream: Tell joint_pose_controller that the stream has ended.
        ended: Goals that have ended, and how.
        due: The waiting goal may begin: check it anew, for the joints have moved, and hand it to
            :meth:`GoalQueue.begin`.
        rejected: Waiting goals that cannot begin any more, and why.
    """

    packet: Setpoints | None = None
    end_stream: bool = False
    ended: list[tuple[Hashable, Ended]] = field(default_factory=list)
    due: Waiting | None = None
    rejected: list[tuple[Hashable, GoalError]] = field(default_factory=list)


@dataclass(slots=True)
class _Running:
    """The goal that runs.

    It notes whether it was seen to be followed, whether it was stopped so that it sends nothing
    more, how it has ended, since when its end is held, and when its stream was ended.
    """

    key: Hashable
    execution: Execution
    since: float
    followed: bool = False
    stopped: bool = False
    verdict: Ended | None = None
    held_since: float = 0.0
    closed_at: float | None = None


class GoalQueue:
    """The core of trajectory_server. Not thread-safe: its owner holds one lock."""

    def __init__(self, joints: Sequence[Joint], config: MotionConfig) -> None:
        """Start without a goal, and without having heard anything."""
        self._joints, self._config = tuple(joints), config
        self._measured: JointMotion | None = None
        self._state, self._message, self._limit = "", "", 100.0
        self._mode, self._why, self._mode_at = "", "", -float("inf")
        self._others_only = ""
        self._follower = Follower()
        self._load: Load | None = None
        self._time = -float("inf")
        # Until then no goal begins, nor one that was planned before: the joints have moved since.
        self._quiet_until = -float("inf")
        self._running: _Running | None = None
        self._waiting: Waiting | None = None
        self._refused: list[tuple[Hashable, GoalError]] = []
        # Since PAUSE, until RESUME or a stop: it outlives the goal that ran.
        self._paused = False

    def measure(self, measured: JointMotion) -> None:
        """Take in what the joints were measured to do."""
        self._measured = measured

    def hear_motion(self, state: str, message: str, limit_percent: float, now: float) -> None:
        """Take in what joint_pose_controller says of itself, heard at ``now`` [s]."""
        self._state, self._message, self._limit = state, message, limit_percent
        running = self._running
        if running is None:
            return
        running.execution.limit_speed(limit_percent, now)
        running.followed = running.followed or state == State.FOLLOWING
        if running.followed and state != State.FOLLOWING and running.verdict is None:
            self._give_up(running, f"joint_pose_controller is {state}: {message}")

    def look_ahead(self, delay: float, ahead: float = 0.0) -> None:
        """Announce coming goals to a :class:`scara_control.motion.drive.Follower`."""
        self._follower = believed(delay, ahead)

    def carry(self, load: Load | None) -> None:
        """Judge coming goals for what hangs at the tool; None: nothing."""
        self._load = load

    def hear_mode(self, mode: str, why: str, now: float, others_only: str = "") -> None:
        """Take in the twin controller's mode.

        Args:
            mode: Its mode.
            why: Its reason.
            now: When it was heard [s].
            others_only: Why only somebody else may move the twin; empty: nobody else holds control.
        """
        self._mode, self._why, self._mode_at, self._others_only = mode, why, now, others_only

    def command(self, command: Command, reason: str = "") -> None:
        """Obey a motion command.

        What waits never begins after a stop or a pause, nor does a goal of which
        joint_pose_controller has seen nothing yet. One that it follows ends there, on its ramp: it
        gets no set points after a stop, which would begin a new stream if it has ended the old one.
        After a pause none is accepted until RESUME or a stop.
        """
        if command is not Command.RESET:
            self._paused = command is Command.PAUSE
        if command in ENDING and self._waiting is not None:
            text = f"cancelled by {command.text(reason)}, before it began"
            self._refused.append((self._waiting.key, GoalError(Code.INVALID_GOAL, text)))
            self._waiting = None
        if self._running is None:
            return
        if command in (Command.PAUSE, Command.RESUME):
            self._running.execution.paused = command is Command.PAUSE
        elif command in ENDING and not self._running.followed:
            self._give_up(self._running, f"aborted by {command.text(reason)}")
        elif command in (Command.STOP, Command.ESTOP):
            self._running.stopped = True
            self._give_up(self._running, f"aborted by {command.text(reason)}")

    def draft(self, goal: Goal, now: float, own: bool = False) -> Callable[[], Execution]:
        """Return what checks and plans a goal against all that is known now.

        To be called without the lock: a long trajectory takes a second, and what runs, measurements
        and stops must not wait for it. It raises GoalError, too.

        Args:
            goal: What is asked for.
            now: Time [s].
            own: It is that of whoever holds control.

        Raises:
            GoalError: None is accepted now; the text says why.
        """
        self._go_on_to(now)
        self._judge(now, own)
        known = self._fresh(now), now, self._follower, self._load
        return partial(Execution, self._joints, goal, self._config, *known)

    def accept(
        self, key: Hashable, checked: Execution | GoalError, now: float, own: bool = False
    ) -> bool:
        """Take a checked goal in; return whether it begins at once, else it waits.

        It waits for the running one to ramp down, or after a stop. Its caller knows of a stop or a
        cancellation that came while it was checked.

        Args:
            key: Names it.
            checked: What its :meth:`draft` came to.
            now: Time after that [s].
            own: It is that of whoever holds control.

        Raises:
            GoalError: It is rejected; the text says why.
        """
        self._go_on_to(now)
        if isinstance(checked, GoalError):
            raise checked
        self._judge(now, own)
        # Only a goal that is taken ends the one that runs, and none takes a waiting one's place.
        if self._waiting is not None:
            raise GoalError(Code.INVALID_GOAL, "another goal is waiting already")
        if self._running is not None:
            replaced = Ended(Code.SUCCESSFUL, "replaced by a newer goal", cancelled=True)
            self._running.execution.end(replaced)
        if self._running is not None or checked.planned_at < self._quiet_until:
            self._waiting = Waiting(key, checked.goal, now, own)
            return False
        checked.begin(self._fresh(now), now, self._follower)
        # Nothing of it was sent to anybody yet: this cap holds at once.
        checked.limit_speed(self._limit, now - self._follower.delay)
        self._running = _Running(key, checked, now)
        return True

    def begin(self, waiting: Waiting, checked: Execution | GoalError, now: float) -> bool:
        """Begin the goal that a turn has called due, once it is checked; return whether it begins.

        It does not behind a stop, a pause or a cancellation that came meanwhile.
        """
        if self._waiting is not waiting:
            return False
        self._waiting = None
        try:
            return self.accept(waiting.key, checked, now, waiting.own)
        except GoalError as error:
            self._refused.append((waiting.key, error))
            return False

    def cancel(self, key: Hashable) -> bool:
        """Ramp a goal down; return True if it was waiting and is gone at once."""
        if self._waiting is not None and self._waiting.key == key:
            self._waiting = None
            return True
        if self._running is not None and self._running.key == key:
            self._running.execution.end(Ended(Code.SUCCESSFUL, "cancelled", cancelled=True))
        return False

    @property
    def is_idle(self) -> bool:
        """Whether there is no goal, nor one that its client has not been told of."""
        return self._running is None and self._waiting is None and not self._refused

    def feedback(self) -> tuple[Hashable, TrajectoryFeedback] | None:
        """Return where the running goal is; None if there is none."""
        if self._running is None or self._measured is None:
            return None
        return self._running.key, self._running.execution.feedback(self._measured)

    def tick(self, now: float) -> Turn:
        """Go on to ``now``."""
        self._go_on_to(now)
        turn = replace(self._turn(now), rejected=self._refused)
        self._refused = []
        return turn

    def _go_on_to(self, now: float) -> None:
        """Keep the time; where the clock went back all goals end, for no time of before comes."""
        before, self._time = self._time, now
        if not went_back(before, now):
            return
        self._quiet_until = self._mode_at = -float("inf")
        if self._waiting is not None:
            gone = GoalError(Code.INVALID_GOAL, "cancelled before it began: the clock went back")
            self._refused.append((self._waiting.key, gone))
            self._waiting = None
        if self._running is not None:
            self._give_up(self._running, "the clock went back")
            self._running.held_since = now
            self._running.closed_at = None if self._running.closed_at is None else now

    def _turn(self, now: float) -> Turn:
        running = self._running
        if running is None:
            return self._next(now)
        trouble = self._trouble(now)
        if trouble:
            self._give_up(running, trouble)
        if running.verdict is None:
            assert self._measured is not None
            packet, running.verdict = running.execution.tick(self._measured, now)
            if running.verdict is None:
                return Turn(packet)
            running.held_since = now
        return self._hold(running, now)

    def _hold(self, running: _Running, now: float) -> Turn:
        """Hold the end until the twin controller has seen the pair at rest.

        A stream that ends earlier counts as a stop. The client is told once it has ended, so that
        its next command finds a free twin.
        """
        assert running.verdict is not None
        if running.closed_at is None:
            following = self._state == State.FOLLOWING and running.followed
            leads = (
                self._mode == LEADING
                and now - self._mode_at <= self._config.trajectory.mode_timeout
            )
            if (
                following
                and leads
                and not running.stopped
                and now - running.held_since < self._config.trajectory.goal_time_tolerance
            ):
                place = JointMotion.at_rest(running.execution.place)
                due = now + self._config.period
                return Turn(Setpoints.due(running.execution.names, [due], [place]))
            running.closed_at = now
            if running.stopped or not following:  # a stop may be heard before its state
                self._quiet_until = now + QUIET * self._config.follow.timeout
            if following:
                return Turn(end_stream=True)
        ending = self._state in (State.FOLLOWING, "stopping") and running.followed
        if ending and now - running.closed_at < self._config.trajectory.stream_timeout:
            return Turn()
        self._running, self._quiet_until = None, max(self._quiet_until, now)
        return Turn(ended=[(running.key, running.verdict)])

    def _next(self, now: float) -> Turn:
        """Let the waiting goal begin as soon as the stream of the one before has ended."""
        if self._waiting is None:
            return Turn()
        # After so long it is tried all the same: the refusal then says what stands in the way.
        config = self._config.trajectory
        late = now - self._waiting.since > config.goal_time_tolerance + config.stream_timeout
        if now < self._quiet_until or (self._state != State.IDLE and not late):
            return Turn()
        return Turn(due=self._waiting)

    def _fresh(self, now: float) -> JointMotion:
        """Return where the joints are; refuse while that is not known."""
        measured = self._measured
        if measured is None or now - measured.time > self._config.state_timeout:
            raise GoalError(
                Code.INVALID_GOAL, "no fresh twin/joint_states: where the joints are is not known"
            )
        return measured

    def _judge(self, now: float, own: bool) -> None:
        """Refuse while no goal may begin, nor wait for the one that runs."""
        self._judge_mode(now, own)
        if self._paused:
            raise GoalError(Code.INVALID_GOAL, f"paused: {_WAYS_OUT[State.PAUSED]}")
        if self._running is None and self._state != State.IDLE:
            state, way = "has not said anything yet", ""
            if self._state:
                way = f": {_WAYS_OUT.get(self._state, 'wait, or STOP it first')}"
                state = f"is {self._state}"
            said = f"joint_pose_controller {state}{_reason(self._message)}{way}"
            raise GoalError(Code.INVALID_GOAL, said)

    def _judge_mode(self, now: float, own: bool) -> None:
        """Refuse while the twin controller does something else, or would stop the motion."""
        # Without a twin controller, or with a silent one, the twin is anybody's.
        if now - self._mode_at > self._config.trajectory.mode_timeout:
            return
        if self._mode in BLOCKING:
            remedy = ": ALIGN first" if self._mode == Mode.STOPPED else ""
            said = f"the twin controller is in {self._mode}{_reason(self._why)}{remedy}"
            raise GoalError(Code.INVALID_GOAL, said)
        if self._others_only and not own:
            raise GoalError(Code.INVALID_GOAL, self._others_only)

    def _trouble(self, now: float) -> str:
        """Say why the running goal cannot go on."""
        running = self._running
        if running is None or running.verdict is not None:
            return ""
        if self._measured is None or now - self._measured.time > self._config.state_timeout:
            return "twin/joint_states fails to come"
        if not running.followed and now - running.since > self._config.trajectory.stream_timeout:
            return (
                "joint_pose_controller does not follow: it is "
                f"{self._state}{_reason(self._message)}"
            )
        return ""

    def _give_up(self, running: _Running, text: str) -> None:
        """End a goal that somebody else has ended already."""
        running.verdict = running.verdict or Ended(Code.INVALID_GOAL, f"aborted: {text}")


def _reason(text: str) -> str:
    return f" ({text})" if text else ""
