"""What the motion nodes share: their start, their clock, their messages."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import rospy
from scara_config import ConfigError, Robot, config_directory, load_robot
from scara_ros.nodes.starting import become_node, until_shutdown
from sensor_msgs.msg import JointState

from scara_control.config import MotionConfig, load_motion
from scara_control.joint_motion import JointMotion

_LOG_PERIOD = 2.0
_LATE_PERIODS = 20.0


def start_node(name: str) -> tuple[Robot, MotionConfig]:
    """Join the ROS graph and read the configuration; end with code 2 if that is wrong."""
    become_node(name)
    try:
        folder = rospy.get_param("~config_dir", "") or config_directory()
        return load_robot(folder), load_motion(folder)
    except ConfigError as error:
        rospy.logfatal("%s: %s", name, error)
        sys.exit(2)


@dataclass
class Guard:
    """Counts and logs what a callback raises unexpectedly; rospy would only log it."""

    failures: int = 0

    def __call__(self, callback: Callable[[Any], Any]) -> Callable[[Any], None]:
        """Wrap a subscriber's callback."""

        def guarded(message: Any) -> None:
            try:
                with until_shutdown():
                    callback(message)
            except Exception as error:
                self._report(callback, error)

        return guarded

    def _report(self, callback: Callable[[Any], Any], error: Exception) -> None:
        self.failures += 1
        name = getattr(callback, "__name__", "callback")
        rospy.logerr(
            "%s failed (%d so far): %r\n%s", name, self.failures, error, traceback.format_exc()
        )


def subscribe(
    name: str, kind: type[Any], callback: Callable[[Any], Any], guard: Guard, queue_size: int = 1
) -> rospy.Subscriber:
    """Subscribe without Nagle's delay.

    The newest message wins unless ``queue_size`` says otherwise.
    """
    return rospy.Subscriber(name, kind, guard(callback), queue_size=queue_size, tcp_nodelay=True)


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

    def now(self) -> float:
        """Return the time of the axis [s]."""
        return float(rospy.get_time()) if self.simulated else time.monotonic()

    def offset(self) -> float:
        """Return ROS time minus the axis, at this moment [s]."""
        return 0.0 if self.simulated else time.time() - time.monotonic()

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
        except rospy.ROSTimeMovedBackwardsException:
            return

    def run(self, period: float, tick: Callable[[float], None]) -> None:
        """Call ``tick`` with each deadline until shut down; what it raises ends the node."""
        deadline = self.now()
        with until_shutdown():
            while not rospy.is_shutdown():
                deadline += period
                self.sleep_until(deadline)
                now = self.now()
                if now < deadline - 2.0 * period or now > deadline + _LATE_PERIODS * period:
                    deadline = now
                tick(deadline)


class JointStateReader:
    """Hands on each JointState in the order of our joints."""

    def __init__(
        self, names: Sequence[str], clock: MotionClock, deliver: Callable[[JointMotion], None]
    ) -> None:
        """Take the joints ``names``; ``deliver`` gets the measurements, in rospy's thread."""
        self._names = tuple(names)
        self._clock = clock
        self._deliver = deliver
        self._first = threading.Event()

    def __call__(self, message: JointState) -> None:
        """Hand a measurement on, on our time axis.

        Leave it out if a joint or a value is missing.
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
        at_time = stamp - self._clock.offset() if stamp else self._clock.now()
        position, velocity = message.position, message.velocity
        self._deliver(
            JointMotion.measured(
                tuple(position[k] for k in columns), tuple(velocity[k] for k in columns), at_time
            )
        )
        self._first.set()

    def wait_for_first(self, timeout: float) -> None:
        """Wait for the first joint states, so that a call right after the start is not refused.

        ``timeout`` [s].
        """
        self._first.wait(timeout)
