"""Move the robot a hair over Modbus, and swing its joints."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from scara_config import Joint, Robot
from scara_config.modbus_map import ModbusMap, number_after
from scara_control.keep_out.points import watched_points
from scara_control.limits import inside
from twin_controller.config import TwinControllerConfig
from twin_controller.estimation.delay import Fit
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.modbus.port_io import LinkLostError
from twin_controller.robot.intake import stands
from twin_controller.robot.signals import GIVE_HOLD_BACK, STOP, Pulse
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramStatus,
    RobotSample,
    WatchdogState,
)

from robot_doctor.delay_checks import DelayStretch, check_delays
from robot_doctor.finding import Finding, Group, note, wrong
from robot_doctor.free_space import free_way, moved
from robot_doctor.link_checks import MOVED_LEAST, Nudge, check_nudge, least_time

HAIR = {"deg": 0.5, "mm": 1.0}
SWING, SWING_S, LISTEN_S = {"deg": 10.0, "mm": 20.0}, 0.8, 0.5
SWING_PERCENT = 20.0
PEAK = 1.875
"""Largest speed of a swing over its mean speed."""
RAMP_S = 0.5
SETTLE_S = 3.0
CLOSE = 0.1
JOG_AWAY = "jog the robot away from there, and ask again"
PERIOD_S = 0.01
FIRST_S = 3.0
REST_S = 2.0
"""A robot that was stopped has so long to stand, its program not running; our choice."""
AHEAD_S = 0.04
"""So far ahead of their time set points are sent to a robot that takes them so; our choice."""
SPEED_PERCENT = 10.0
SLOW = {"deg": 5.0, "mm": 5.0}
"""Where it is first tried to move the robot: so far, within a second [deg or mm]."""


def link_to(
    robot: Robot,
    layout: ModbusMap,
    config: TwinControllerConfig,
    address: tuple[str, int],
    take: Callable[[RobotSample, float, float], None],
    told: Callable[[ProgramStatus, AlarmStatus], None],
    changed: Callable[[bool, str], None],
    refused: Callable[[str], None] | None = None,
    **times: Any,
) -> ModbusLink:
    """Return a link to the robot that is not open yet.

    Args:
        robot: The profile.
        layout: Its map.
        config: Times of the link.
        address: Of the robot's Modbus server.
        take: Hears each sample.
        told: Hears of program and alarm.
        changed: Hears that the link is up or lost, and why.
        refused: Hears of a sample that is not believed, and of a write that did not go through.
        times: What else of ModbusSettings is not as usual.
    """
    period = config.real.poll_period_ms * 1e-3
    settings = ModbusSettings(*address, period, timeout=0.2, **times)
    return ModbusLink(settings, layout, robot, take, changed, told, refused)


class Mover:
    """Streams small set points to the robot; a context manager that ends the stream.

    Attributes:
        rests: It did not start the stream, or at the end the robot was seen to stand, its program
            not running. Else HOLD stays away.

    Args:
        robot: The profile.
        layout: Its map.
        config: Address and times of the link.
        host: The robot's address.
        port: Of its Modbus server.
    """

    def __init__(
        self, robot: Robot, layout: ModbusMap, config: TwinControllerConfig, host: str, port: int
    ) -> None:
        self._robot, self._joints = robot, robot.twin_joints
        # A sample has all joints of robot.yaml, those without a twin too.
        self._columns = [k for k, joint in enumerate(robot.joints) if joint.twin]
        self._config = config
        self._points = watched_points(robot) if robot.keep_out else ()
        # The newest answer, and when it came [s].
        self._newest: tuple[RobotSample, float] | None = None
        # Of the last set point ahead of its time; 0 before the first.
        self._number = 0
        self._stretch: DelayStretch | None = None
        self._came = threading.Event()
        self._alarm = ""
        # Why the link was lost first; empty: it was not.
        self._lost = ""
        self.rests, self._stops = True, False
        # What was not believed, or did not go through: the newest.
        self._refused: deque[str] = deque(maxlen=1)
        hears = self._take, self._told, self._changed, self._refused.append
        self._link = link_to(robot, layout, config, (host, port), *hears)

    def __enter__(self) -> Mover:
        """Connect."""
        self._link.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop what it started, as the twin controller does, and see the robot stand; disconnect.

        Not every controller ends a program by CSTOPI, and one that nobody watches may go on: then
        the watchdog stays armed.
        """
        try:
            if not self.rests:
                self._stops = True
                self._link.send(*STOP)
                self.rests = self._comes_to_rest()
                if self.rests:
                    self._link.send(*GIVE_HOLD_BACK)
        finally:
            # Also where somebody interrupts it: heartbeats would keep the watchdog from acting.
            self._link.close(disarm=self.rests)

    @property
    def reached(self) -> bool:
        """The link is up, or was when it ended: what was left for the robot has gone out."""
        return self._link.connected

    def _comes_to_rest(self) -> bool:
        """Return whether the next answers show the robot at rest, its program not running."""
        end, before = time.monotonic() + REST_S, None
        while time.monotonic() < end:
            self._came.clear()
            if not self._came.wait(end - time.monotonic()):
                break
            sample = self._sample
            if (
                before is not None
                and "progrun" not in sample.outputs
                and stands(before, sample.motion, self._robot.joints)
            ):
                return True
            before = sample.motion
        return False

    def nudge_all(self) -> Iterator[Finding]:
        """Send each joint of the twin a hair away and back, then swing it to see how late it is.

        A joint that comes near a keep-out zone on both ways stays. End at the first that cannot be
        moved.

        Raises:
            LinkLostError: The link was lost; it may be back.
        """
        if reason := self._start():
            advice = "end what commands it, reset it, and ask again"
            yield wrong(Group.LINKS, f"the robot cannot be moved: {reason}", advice)
            return
        begun, fits = self._positions(), []
        for index, joint in enumerate(self._joints):
            way, why = free_way(self._robot, self._points, self._here(), index, HAIR)
            if why:
                yield note(Group.LINKS, f"{joint.name} is not moved: {why}", JOG_AWAY)
                continue
            nudge = self._nudge(index, joint, way)
            if ended := self._ended(joint):
                yield ended
                return
            yield check_nudge(nudge, self._joints)
        for index, joint in enumerate(self._joints):
            way, why = free_way(self._robot, self._points, self._here(), index, SWING)
            if why:
                yield note(Group.LINKS, f"{joint.name} is not swung: {why}", JOG_AWAY)
            fits.append((joint, None if why else self._measure(index, joint, way)))
            if not why and (ended := self._ended(joint)):
                yield ended
                return
        yield from check_delays(fits, self._config)
        for joint, before, after in zip(self._joints, begun, self._positions()):
            if abs(after - before) > HAIR[joint.unit] * joint.scale:
                left = f"{(after - before) / joint.scale:+.2f} {joint.unit}"
                what = f"{joint.name} is not back: it stands {left} from where it began"
                yield note(Group.LINKS, what, "jog it back: the next --move begins where it stands")

    def _ended(self, joint: Joint) -> Finding | None:
        """Return that the robot has ended the stream while a joint was moved; None: it has not."""
        if self._sample.control_type is ControlType.STREAM:
            return None
        what = f"{joint.name}: the robot ended the stream {self._alarm or '(it tells no alarm)'}"
        advice = "a heartbeat that came late on a busy machine? Reset the robot and ask again"
        return wrong(Group.LINKS, what, advice)

    def try_stream(self) -> tuple[str, float]:
        """Start the stream program and send a joint away and back, at 5 deg/s or mm/s at most.

        It is the first that comes near no keep-out zone.

        Returns:
            Why that is not possible, or an empty text; how far the joint went [deg or mm].

        Raises:
            LinkLostError: As above.
        """
        if reason := self._start():
            return reason, 0.0
        start = self._here()
        for index in range(len(self._joints)):
            asked, why = free_way(self._robot, self._points, start, index, SLOW)
            if not why:
                break
        else:
            return f"no joint is moved: {why}", 0.0
        joint = self._joints[index]
        away = moved(start, index, asked)
        self._go(start, away, index, 1.0, 100.0)
        there = self._positions()[index] - start[index]
        self._go(away, start, index, 1.0, 100.0)
        missed = abs(there - asked) > (1.0 - MOVED_LEAST) * abs(asked)
        way = there / joint.scale
        return f"{joint.name} went {way:+.2f} only" if missed else "", way

    def _take(self, sample: RobotSample, sent: float, received: float) -> None:
        self._newest = sample, received
        if self._stretch is not None:
            self._stretch.take(sample, sent, received)
        self._came.set()

    def _changed(self, up: bool, why: str) -> None:
        if up and self._stops:
            # What was left while there was no link is dropped.
            self._link.send(*STOP)
        # The first connection may take a few attempts.
        elif not up and self._newest is not None:
            self._lost = self._lost or why

    def _told(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        self._alarm = (
            f"with {alarm.facility}-{alarm.number:03d} {alarm.message}" if alarm.facility else ""
        )

    @property
    def _heard(self) -> tuple[RobotSample, float]:
        assert self._newest is not None
        return self._newest

    @property
    def _sample(self) -> RobotSample:
        return self._heard[0]

    def _positions(self) -> tuple[float, ...]:
        return tuple(self._sample.motion.q[k] for k in self._columns)

    def _here(self) -> tuple[float, ...]:
        """Return where it stands; a reading may be a hair outside its range, a set point not."""
        return inside(self._joints, self._positions())

    def _start(self) -> str:
        """Start the stream program; return why that is not possible, or an empty text."""
        if not self._came.wait(FIRST_S):
            return ": ".join(["it sends no sample that is believed", *self._refused])
        sample = self._sample
        if (
            sample.watchdog_state is WatchdogState.ARMED
            and sample.control_type is not ControlType.NONE
        ):
            return "somebody streams to it"
        if "fault" in sample.outputs:
            return "FAULT is on"
        if sample.control_type is not ControlType.NONE:
            return "it runs a program"
        if "cmdenbl" not in sample.outputs:
            return "it does not allow a remote start (CMDENBL is off)"
        start = self._here()
        self.rests = False
        self._refused.clear()
        # Behind a set point: with the old one the stream program would go where it went last.
        self._tell(start, SPEED_PERCENT)
        self._link.send(Pulse("rsr1", behind=True))
        end = time.monotonic() + FIRST_S
        while self._sample.control_type is not ControlType.STREAM and time.monotonic() < end:
            self._tell(start, SPEED_PERCENT)
            time.sleep(PERIOD_S)
        if self._sample.control_type is ControlType.STREAM:
            return ""
        return ": ".join(["its stream program does not start", *self._refused])

    def _tell(self, positions: Sequence[float], speed_percent: float) -> int | None:
        """Send one set point [rad or m].

        Returns:
            When it counts, on the robot's clock without its wrap [ms]; None: as soon as it comes.

        Raises:
            LinkLostError: Also where the link is back: nothing goes on by itself.
        """
        if self._lost:
            raise LinkLostError(self._lost)
        sample, received = self._heard
        if not sample.ring_places:
            self._link.write_now(positions, speed_percent)
            return None
        if not self._number:
            # The robot goes on from the number that it took last, whoever gave it.
            self._number = sample.ring_read
        self._number = number_after(self._number)
        # The robot's clock as it is now: the newest stamp is as old as its answer.
        clock_ms = sample.clock_ms + round(1e3 * (time.monotonic() - received + AHEAD_S))
        self._link.write_at(positions, speed_percent, self._number, clock_ms)
        return clock_ms

    def _nudge(self, index: int, joint: Joint, asked: float) -> Nudge:
        """Send one joint away and back."""
        start = self._here()
        away = moved(start, index, asked)
        speed = self._go(start, away, index)
        there = self._positions()
        self._go(away, start, index)
        return Nudge(
            joint.name, asked, {j.name: b - a for j, a, b in zip(self._joints, start, there)}, speed
        )

    def _measure(self, index: int, joint: Joint, way: float) -> Fit | None:
        """Swing one joint smoothly away and back; return how late it was on its way there."""
        start = self._here()
        # A robot runs its program at its override; a swing at its limit would be late for that.
        override = max(float(self._sample.override), 1.0)
        percent = min(100.0, 100.0 * SWING_PERCENT / override)
        duration = max(SWING_S, PEAK * least_time(joint, way, percent, override))
        stretch = DelayStretch(joint, self._columns[index], self._config)
        self._stretch = stretch
        begun = time.monotonic()
        while (passed := time.monotonic() - begun) < duration + LISTEN_S:
            share = min(passed / duration, 1.0)
            q = list(start)
            # At both ends speed and acceleration are 0, so nothing rings on.
            q[index] += way * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            sent = time.monotonic()
            clock_ms = self._tell(q, percent)
            if clock_ms is None:
                stretch.tell(sent, q[index])
            else:
                stretch.tell_ahead(clock_ms, q[index])
            time.sleep(PERIOD_S)
        self._stretch = None
        # Back as it came: at a low override it needs as long, and as many percent.
        self._go(tuple(q), start, index, duration, percent)
        return stretch.fit()

    def _go(
        self,
        begin: tuple[float, ...],
        end: tuple[float, ...],
        index: int,
        ramp_s: float = RAMP_S,
        percent: float = SPEED_PERCENT,
    ) -> float:
        """Stream from one pose to another, wait until the robot stands there or the time is over.

        Return the largest speed.
        """
        way = end[index] - begin[index]
        least = least_time(self._joints[index], way, percent, float(self._sample.override))
        ramp_s = max(ramp_s, least)
        speed, started = 0.0, time.monotonic()
        while (passed := time.monotonic() - started) < ramp_s + SETTLE_S:
            share = min(passed / ramp_s, 1.0)
            self._tell([a + share * (b - a) for a, b in zip(begin, end)], percent)
            motion, column = self._sample.motion, self._columns[index]
            # Only its sign counts, which the way also has where the robot tells no speeds.
            here = motion.qdot[column] if motion.qdot else motion.q[column] - begin[index]
            speed = here if abs(here) > abs(speed) else speed
            rest = abs(self._positions()[index] - end[index])
            if share == 1.0 and rest < CLOSE * abs(way) and passed > ramp_s + 0.2:
                break
            time.sleep(PERIOD_S)
        return speed
