"""What the motion nodes share: their start, their clock, their messages."""

from __future__ import annotations

import functools
import math
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import rospy
from scara_config import Joint, Robot, load_robot
from scara_ros.shell.ros_node import starting
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import JointState

from scara_control.config import MotionConfig, load_motion
from scara_control.joint_motion import JointMotion
from scara_control.motion.feedback import standstill_speeds
from scara_control.motion.idle_node import HOLD_S, IDLE_S, Attention, IdleWait

_LOG_PERIOD = 2.0
_LATE_PERIODS = 20.0
_CLOCK_SET_S = 0.02
"""A system clock that has gone so far from the monotonic one was set; our choice. Slewing takes
40 s for it."""
_LOOKS, _QUICK_S = 5, 5e-5
"""So often two clocks are looked at one after the other, until a look is so quick; our choice."""
_DOUBT_S = 2.0
"""So long after that no stamp is believed; our choice: what waits is read by then."""


def start_node(name: str) -> tuple[Robot, MotionConfig]:
    """Join the ROS graph and read the configuration; end with code 2 if that is wrong."""
    with starting(name) as folder:
        return load_robot(folder), load_motion(folder)


@dataclass
class CallbackGuard:
    """Counts and logs what a callback raises unexpectedly; rospy would only log it."""

    failures: int = 0

    def __call__(self, callback: Callable[[Any], Any]) -> Callable[[Any], None]:
        """Wrap a subscriber's callback."""

        def guarded(message: Any) -> None:
            try:
                with until_shutdown():
                    callback(message)
            except Exception as error:
                self.failures += 1
                name, where = getattr(callback, "__name__", "callback"), traceback.format_exc()
                rospy.logerr("%s failed (%d so far): %r\n%s", name, self.failures, error, where)

        return guarded


def subscribe(
    name: str,
    kind: type[Any],
    callback: Callable[[Any], Any],
    guard: CallbackGuard,
    queue_size: int = 1,
) -> rospy.Subscriber:
    """Subscribe without Nagle's delay.

    The newest message wins unless ``queue_size`` says otherwise.
    """
    return rospy.Subscriber(name, kind, guard(callback), queue_size=queue_size, tcp_nodelay=True)


def subscribe_attentively(
    name: str,
    kind: type[Any],
    callback: Callable[[Any], Any],
    guard: CallbackGuard,
    attention: Attention,
) -> rospy.Subscriber:
    """Subscribe to what comes all the time, and look at all of it only when it is needed."""

    @functools.wraps(callback)
    def take(message: Any) -> None:
        callback(message)
        attention.hold()

    return subscribe(name, kind, take, guard)


def offer(name: str, kind: type[Any], answer: Callable[[Any], Any]) -> rospy.Service:
    """Offer a service whose unexpected failure is logged and answered, not only raised."""

    def handle(request: Any) -> Any:
        try:
            return answer(request)
        except Exception as error:
            rospy.logerr("%s failed:\n%s", name, traceback.format_exc())
            return kind._response_class(
                success=False, message=f"{name} failed: {type(error).__name__}: {error}"
            )

    return rospy.Service(name, kind, handle)


class MotionClock:
    """The axis of all core times: monotonic, or ROS time where /clock rules."""

    def __init__(self) -> None:
        """Look whether time is simulated."""
        self.simulated = bool(rospy.get_param("/use_sim_time", False))
        self._kept, self._doubt_until = self.offset(), 0.0

    def now(self) -> float:
        """Return the time of the axis [s]."""
        return float(rospy.get_time()) if self.simulated else time.monotonic()

    def offset(self) -> float:
        """Return ROS time minus the axis, at this moment [s].

        Who is held between two looks at two clocks is wrong by as long: on a busy machine a set
        point's stamp was off by 0.1 s. Of a few looks the quickest counts.
        """
        if self.simulated:
            return 0.0
        quickest, found = math.inf, 0.0
        for _ in range(_LOOKS):
            before, at, after = time.monotonic(), time.time(), time.monotonic()
            if after - before < quickest:
                quickest, found = after - before, at - 0.5 * (before + after)
            if quickest < _QUICK_S:
                break
        return found

    def asked(self, stamp: rospy.Time) -> float:
        """Return when a message was stamped, by the monotonic clock [s]; 0: that is not known.

        It is not while time is simulated, nor right after the system's clock was set.
        """
        if self.simulated or stamp.is_zero():
            return 0.0
        offset, now = self.offset(), time.monotonic()
        if abs(offset - self._kept) > _CLOCK_SET_S:
            self._doubt_until = now + _DOUBT_S
        self._kept = offset
        return 0.0 if now < self._doubt_until else float(stamp.to_sec()) - offset

    def stamp(self, asked: float) -> rospy.Time:
        """Return the stamp for a message of what was asked for then; see :meth:`asked`."""
        if self.simulated:
            return rospy.Time.now()
        return rospy.Time.from_sec(asked + self.offset())

    def sleep_until(self, deadline: float) -> None:
        """Sleep to an absolute deadline."""
        left = deadline - self.now()
        if left <= 0.0:
            return
        if not self.simulated:
            time.sleep(left)
            return
        try:
            rospy.sleep(left)
        # The simulation was reset: run() sees that by itself and begins its deadlines anew.
        except rospy.ROSTimeMovedBackwardsException:
            return

    def run(
        self, period: float, tick: Callable[[float], None], rest: IdleWait, idle_s: float = IDLE_S
    ) -> None:
        """Call ``tick`` with each deadline until shut down; what it raises ends the node.

        While ``rest`` waits, deadlines are left out, and each ``idle_s`` is one. Simulated time is
        followed without rest.
        """
        deadline = self.now()
        longest = max(0, round(idle_s / period) - 1) * period
        with until_shutdown():
            while not rospy.is_shutdown():
                deadline += period
                if not self.simulated and rest.wait(deadline - self.now() + longest):
                    # The deadline that is nearest, so that what was begun goes on at once.
                    deadline += max(0, round((self.now() - deadline) / period)) * period
                self.sleep_until(deadline)
                now = self.now()
                # After a reset or a long standstill no missed deadline is made up for.
                if now < deadline - 2.0 * period or now > deadline + _LATE_PERIODS * period:
                    deadline = now
                tick(deadline)


class JointStateReader:
    """Hands on JointStates in the order of our joints: each one, or few while nobody needs them."""

    def __init__(
        self,
        joints: Sequence[Joint],
        config: MotionConfig,
        clock: MotionClock,
        deliver: Callable[[JointMotion], None],
        is_idle: Callable[[], bool],
    ) -> None:
        """Take ``joints``.

        Args:
            joints: Those that are handed on.
            config: What counts as standstill.
            clock: Our time axis.
            deliver: Gets the measurements, in rospy's thread.
            is_idle: Whether the node has nothing to do.
        """
        self._names = tuple(joint.name for joint in joints)
        self._clock = clock
        self._deliver = deliver
        self._first = threading.Event()
        self._attention = Attention(is_idle, HOLD_S, standstill_speeds(joints, config))
        self.rouse = self._attention.rouse
        self.catch_up = self._attention.catch_up

    def __call__(self, message: JointState) -> None:
        """Hand a measurement on, on our time axis.

        Leave it out if a joint or a value is missing or not finite.
        """
        at = {name: k for k, name in enumerate(message.name)}
        if any(name not in at for name in self._names) or min(
            len(message.position), len(message.velocity)
        ) < len(at):
            rospy.logwarn_throttle(
                _LOG_PERIOD,
                f"joint states without position and velocity of {', '.join(self._names)}: left out",
            )
            return
        columns = [at[name] for name in self._names]
        stamp = message.header.stamp.to_sec()
        # A publisher that gives no stamp leaves only the time of arrival.
        at_time = stamp - self._clock.offset() if stamp else self._clock.now()
        position = tuple(message.position[k] for k in columns)
        velocity = tuple(message.velocity[k] for k in columns)
        for name, q, qdot in zip(self._names, position, velocity):
            # No comparison holds for NaN, so nothing would ever seem to be away from its target.
            if not (math.isfinite(q) and math.isfinite(qdot)):
                rospy.logwarn_throttle(
                    _LOG_PERIOD,
                    f"joint states: {name} is at {q} and moves at {qdot}, which is not finite: "
                    "left out",
                )
                return
        self._deliver(JointMotion.measured(position, velocity, at_time))
        self._first.set()
        if not self._clock.simulated:  # simulated time may pass much faster than we read
            self._attention.hold(velocity)

    def wait_for_first(self, timeout: float) -> None:
        """Wait for the first joint states, so that a call right after the start is not refused.

        ``timeout`` [s].
        """
        self._first.wait(timeout)
