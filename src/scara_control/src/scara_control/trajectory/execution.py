"""The execution of one trajectory.

It gives set points each period, slowed by the cap, frozen by PAUSE, watched by tolerances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scara_config import Joint

from scara_control.config import MotionConfig, in_si
from scara_control.dynamics.effort import Load
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.drive import ALONE, Drive, Follower
from scara_control.motion.time_scaling import ScaleBounds, SpeedCap, TimeBase
from scara_control.trajectory.goal import (
    Code,
    Goal,
    GoalError,
    check_efforts,
    check_goal_size,
    check_way,
    named_joints,
    plan_path,
    tolerances,
)


@dataclass(frozen=True, slots=True)
class Ended:
    """How an execution ended: ``code`` and text; ``cancelled`` if somebody asked for it."""

    code: Code
    text: str
    cancelled: bool = False


@dataclass(frozen=True, slots=True)
class TrajectoryFeedback:
    """The fields of control_msgs/FollowJointTrajectoryFeedback.

    They hold one instant and three motions of the named joints.
    """

    names: tuple[str, ...]
    desired: JointMotion
    actual: JointMotion
    error: JointMotion
    elapsed: float


class Execution:
    """One trajectory that was found right. Not thread-safe: its owner holds one lock.

    Attributes:
        goal: What was asked for.
        names: Its joints.
        planned_at: When it was planned, from where the joints were then [s].
        peak_percent: Its peak speed in percent of the joints' largest.
        paused: Whether it stands on its path.
    """

    def __init__(
        self,
        joints: Sequence[Joint],
        goal: Goal,
        config: MotionConfig,
        measured: JointMotion,
        now: float,
        follower: Follower = ALONE,
        load: Load | None = None,
    ) -> None:
        """Check the goal and plan it, to begin now or later: see :meth:`begin`.

        Args:
            joints: All joints of the twin.
            goal: What was asked for.
            config: motion.yaml.
            measured: All joints, fresh.
            now: [s]
            follower: Who is to do the same.
            load: The arm with its payload; None: it carries nothing.

        Raises:
            GoalError: It cannot be followed; the text says why.
        """
        check_goal_size(goal, config.trajectory)
        self._joints = named_joints(joints, goal.names)
        self.goal, self.names, self.planned_at = goal, goal.names, now
        self._columns = [[joint.name for joint in joints].index(name) for name in goal.names]
        self._config = config
        there = tuple(measured.q[column] for column in self._columns)
        self._path = plan_path(self._joints, there, goal.points)
        self.peak_percent = check_way(self._joints, self._path, config.period, there)
        if load is not None:
            check_efforts(joints, load, self._path, self._columns, measured.q, config.period)
        own = config.trajectory
        self._on_path = tolerances(
            self._joints,
            goal.path_tolerance,
            own.path_tolerance_deg,
            own.path_tolerance_mm,
            "path_tolerance",
        )
        self._at_goal = tolerances(
            self._joints,
            goal.goal_tolerance,
            own.goal_tolerance_deg,
            own.goal_tolerance_mm,
            "goal_tolerance",
        )
        self._late = goal.goal_time_tolerance or own.goal_time_tolerance
        self._bounds = ScaleBounds(config.move.time_scale_ramp, config.move.time_scale_jerk)
        self._arrived: float | None = None
        self._ending: Ended | None = None
        self.paused = False
        self._cap = SpeedCap()
        self.begin(measured, now, follower)

    def begin(self, measured: JointMotion, now: float, follower: Follower) -> None:
        """Begin now: the check of a long goal takes time, and joints and clock have gone on.

        Args:
            measured: All joints, fresh.
            now: [s]
            follower: Who is to do the same.

        Raises:
            GoalError: The joints are not where it begins, or it is too late for it.
        """
        self._check_start(tuple(measured.q[column] for column in self._columns))
        self._follower = follower
        self._begun = self._begin_time(self.goal, now)
        self._drive = Drive(self._path, now, self._begun, TimeBase(0.0, 1.0))

    @property
    def scale(self) -> float:
        """How fast the path is driven, 0 to 1."""
        return self._drive.base.scale

    @property
    def place(self) -> tuple[float, ...]:
        """Where the path is now; at rest once the execution has ended."""
        return self._drive.motion.q

    def end(self, ended: Ended) -> None:
        """Ramp down on the path; the first reason counts."""
        self._ending = self._ending or ended

    def limit_speed(self, percent: float, now: float) -> None:
        """Cap the program speed [percent], where the follower has not been sent yet."""
        if percent != self._cap.newest:
            self._cap.set(percent, now + self._follower.delay)

    def tick(self, measured: JointMotion, now: float) -> tuple[Setpoints | None, Ended | None]:
        """Go on to ``now``.

        Args:
            measured: All joints, fresh.
            now: [s]

        Returns:
            The set points to publish, if any, and how it ended, once it has.
        """
        period = self._config.period
        while self._drive.time <= now - 0.5 * period:
            self._drive = self._step(self._drive)
        # Our own time may be half a period behind: a cap may begin between the two.
        self._cap.forget(self._drive.time)
        if self._ending is None:
            self._watch(measured)
        if self._ending is not None and (
            self._drive.frozen or self._drive.announcing or self._drive.done
        ):
            return None, self._ending
        if self._drive.done:
            return self._settle(measured, now)
        ahead = [self._drive]
        horizon = self._follower.delay + self._follower.ahead + self._config.move.horizon
        while len(ahead) <= round(horizon / period) and not ahead[-1].done:
            ahead.append(self._step(ahead[-1]))
        times, motions = (d.time for d in ahead), (d.motion for d in ahead)
        return Setpoints.due(self.names, times, motions), None

    def feedback(self, measured: JointMotion) -> TrajectoryFeedback:
        """Return where the joints shall be, where they are, and the difference.

        All are true at the instant of the measurement.
        """
        desired = self._drive.motion.after(measured.time - self._drive.time)
        actual = measured.select(self._columns)
        error = JointMotion(
            tuple(a - b for a, b in zip(desired.q, actual.q)),
            tuple(a - b for a, b in zip(desired.qdot, actual.qdot)),
            (0.0,) * len(self.names),
        )
        elapsed = max(0.0, measured.time - self._begun)
        return TrajectoryFeedback(self.names, desired, actual, error, elapsed)

    def _step(self, drive: Drive) -> Drive:
        """Return the drive one period later."""
        if self._ending is not None or self.paused:
            wanted = 0.0
        else:
            # A trajectory has no program speed: its peak stands for it, and one at rest has none.
            wanted = min(1.0, self._cap.at(drive.time) / max(self.peak_percent, 1e-9))
        return drive.step(self._config.period, wanted, self._bounds, self._joints)

    def _begin_time(self, goal: Goal, now: float) -> float:
        """Return when the motion begins [s].

        That is as asked for, but not before followers could take aim.
        """
        earliest = now + self._follower.delay + self._config.move.announce
        if goal.start is None:
            return earliest
        age = now - goal.start
        if age > self._config.follow.timeout:
            raise GoalError(
                Code.OLD_HEADER_TIMESTAMP,
                f"the trajectory should have begun {age * 1e3:.0f} ms ago",
            )
        if -age > self._config.trajectory.longest:
            raise GoalError(
                Code.INVALID_GOAL,
                (
                    f"the trajectory begins in {-age:.0f} s, allowed "
                    f"{self._config.trajectory.longest:g}"
                ),
            )
        return max(goal.start, earliest)

    def _check_start(self, there: tuple[float, ...]) -> None:
        """Refuse a trajectory that begins where the joints are not."""
        for joint, wanted, q in zip(self._joints, self._path.at(0.0).q, there):
            allowed = in_si(
                joint, self._config.move.start_tolerance_deg, self._config.move.start_tolerance_mm
            )
            if abs(wanted - q) > allowed:
                way = "begin where it is, or give the first point some time"
                if self.goal.points[0].time > 0.0:
                    way = "it has moved since the goal came: send it again once it stands"
                raise GoalError(
                    Code.INVALID_GOAL,
                    f"{joint.name} is {abs(wanted - q) / joint.scale:.2f} {joint.unit} from "
                    f"the first point, allowed {allowed / joint.scale:g}: {way}",
                )

    def _watch(self, measured: JointMotion) -> None:
        """End when a joint leaves the path by more than its tolerance."""
        if self._drive.announcing or self._drive.done:
            return
        error = self.feedback(measured).error
        for joint, gap, allowed in zip(self._joints, error.q, self._on_path):
            if abs(gap) > allowed:
                text = (
                    f"{joint.name} is {abs(gap) / joint.scale:.3f} {joint.unit} off the "
                    f"path, allowed {allowed / joint.scale:.3g}"
                )
                self.end(Ended(Code.PATH_TOLERANCE_VIOLATED, text))

    def _settle(self, measured: JointMotion, now: float) -> tuple[Setpoints | None, Ended | None]:
        """Hold the end until the joints are there, or not in time."""
        rest = JointMotion.at_rest(self._path.end)
        resting = Setpoints.due(self.names, [self._drive.time], [rest])
        if self._arrived is None:
            self._arrived = now
            return resting, None
        away = [
            (
                f"{joint.name} is {abs(q - measured.q[column]) / joint.scale:.3f} {joint.unit} "
                "from its goal"
            )
            for joint, column, q, allowed in zip(
                self._joints, self._columns, self._path.end, self._at_goal
            )
            if abs(q - measured.q[column]) > allowed
        ]
        if not away:
            return None, Ended(Code.SUCCESSFUL, f"reached in {now - self._begun:.2f} s")
        if now - self._arrived > self._late:
            return None, Ended(
                Code.GOAL_TOLERANCE_VIOLATED,
                f"not reached {self._late:g} s after the end: {'; '.join(away)}",
            )
        return resting, None
