"""Keep what was predicted of each motion beside what then happened, and tell both."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

import rospy
from scara_config.programs.files import ProgramSteps
from scara_control.motion.idle_node import HOLD_S, Attention
from scara_ros.diagnosis import Diagnosis, Level
from sensor_msgs.msg import JointState

from scara_msgs.msg import Audit, MotionOutcome
from what_if.config import LearningConfig
from what_if.learning.course import predict, tool_points
from what_if.learning.drift import Drift
from what_if.learning.pairing import End, MotionWatch
from what_if.motions import Motion
from what_if.verdict import Verdict
from what_if.world import Cell, World

KEPT = 8
"""So many of the last questions may still be let through; our choice: a gate for each node."""
RECENT = 100
"""So many of the last joint states are kept, for a motion that begins while its gate tells; our
choice: a second."""


@dataclass(frozen=True)
class JudgedQuestion:
    """A question and its answer; ``at``: when it was asked."""

    at: float
    world: World
    motion: Motion
    verdict: Verdict

    @property
    def program(self) -> str:
        """Name of the program; empty: a move."""
        return self.motion.name if isinstance(self.motion, ProgramSteps) else ""


class Learning:
    """Hears what gates let through, and what the joints then do.

    While nothing is watched, joint states are read seldom.

    Args:
        cell: The robot.
        config: From when on something is an alarm.
        engine: Held while the dynamics are asked: they serve one question at a time.
    """

    def __init__(self, cell: Cell, config: LearningConfig, engine: threading.Lock) -> None:
        self._cell, self._engine = cell, engine
        self._names = [joint.name for joint in cell.robot.twin_joints]
        self._most = {joint.name: joint.effort for joint in cell.robot.twin_joints}
        self._lock = threading.Lock()
        # The gate tells only in words what it let through; the question is found here again.
        self._asked: deque[JudgedQuestion] = deque(maxlen=KEPT)
        # Before a motion is let through nobody knows that it will be watched: it may have begun.
        self._recent: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=RECENT)
        self._watch: MotionWatch | None = None
        self._drift, self._ended = Drift(config), 0
        # Joint states come 200 times a second and are read only while a motion is expected.
        self._attention = Attention(lambda: self.is_idle, HOLD_S)
        self._outcomes = rospy.Publisher(
            "what_if/outcomes", MotionOutcome, queue_size=20, tcp_nodelay=True
        )
        self._subscribers = [
            rospy.Subscriber(topic, kind, take, queue_size=size, tcp_nodelay=True)
            for topic, kind, take, size in (
                ("what_if/gate", Audit, self._told, 20),
                ("real/joint_states", JointState, self._real, 1),
                ("twin/joint_states", JointState, self._twin, 1),
            )
        ]

    @property
    def is_idle(self) -> bool:
        """Whether no motion is watched."""
        return self._watch is None

    @property
    def diagnosis(self) -> Diagnosis:
        """What has been learnt."""
        with self._lock:
            alarms, medians, ended = self._drift.alarms, self._drift.medians, self._ended
        level = Level.WARN if alarms else Level.OK
        text = "; ".join(alarms) or f"{ended} motions were as predicted, or too few to say"
        values = {f"{name}_ratio": f"{ratio:.4f}" for name, ratio in medians.items()}
        return Diagnosis(level, f"{rospy.get_name()}: predictions", text, values)

    def expect(self) -> float:
        """Look closely from now on: a motion is asked for. Return the time [s] for :meth:`asked`.

        A program that was started at the robot goes on while it is judged.
        """
        self._attention.rouse()
        return float(rospy.get_time())

    def asked(self, at: float, world: World, motion: Motion, verdict: Verdict) -> None:
        """Take in a question that was just answered; perhaps its motion is let through."""
        self._attention.rouse()
        with self._lock:
            self._asked.append(JudgedQuestion(at, world, motion, verdict))

    def _told(self, said: Audit) -> None:
        """A gate has let a motion through, or not."""
        if not said.success:
            return
        with self._lock:
            found = next(
                (a for a in reversed(self._asked) if a.verdict.sentence in said.outcome), None
            )
            if found is None or (self._watch is not None and self._watch.is_same(found.program)):
                return
            # Watched before it is predicted: the joints may move while that is worked out.
            watch = MotionWatch(found.program, rospy.get_time())
            replaced, self._watch = self._watch, watch
            for now, q in self._recent:
                if now >= found.at:
                    watch.joints(now, q)
        self._attention.rouse()
        if replaced is not None and replaced.has_begun and replaced.predicted is not None:
            self._tell(replaced, End.REPLACED)
        # Not under the lock: a judgement may hold the engine for seconds, and joint states go on.
        with self._engine:
            predicted = predict(found.world, found.motion, found.verdict, said.what)
        with self._lock:
            watch.predicted = predicted
            # Meanwhile another motion may have taken its place.
            if predicted is None and self._watch is watch:
                self._watch = None

    def _real(self, message: JointState) -> None:
        q = self._row(message.name, message.position)
        if q is not None:
            self._measured(message.header.stamp.to_sec(), q)
        # Last of all: this holds rospy's thread, and with it the next message.
        self._attention.hold()

    def _measured(self, now: float, q: tuple[float, ...]) -> None:
        with self._lock:
            self._recent.append((now, q))
            watch = self._watch
            if watch is None:
                return
            watch.joints(now, q)
            end = watch.end(now)
            if end is None and not watch.is_hopeless(now):
                return
            self._watch = None
        # Behind the lock, which telling takes itself.
        if end is not None:
            self._tell(watch, end)
        elif watch.is_unheard:
            rospy.logwarn(
                "what_if: the first joint positions that came of a motion are of its middle, so "
                "it is not compared to what was predicted. Does this machine have too much to do?"
            )

    def _twin(self, message: JointState) -> None:
        efforts = self._row(message.name, message.effort)
        with self._lock:
            if self._watch is not None and efforts is not None:
                self._watch.effort([e / self._most[n] for n, e in zip(self._names, efforts)])

    def _row(self, names: list[str], values: list[float]) -> tuple[float, ...] | None:
        """Return values in the order of the twin's joints; None if one is missing."""
        at = dict(zip(names, values))
        return tuple(at[name] for name in self._names) if at.keys() >= set(self._names) else None

    def _tell(self, watch: MotionWatch, end: End) -> None:
        outcome = watch.outcome(end, tool_points(self._cell, watch.rows))
        with self._lock:
            self._drift.take(outcome)
            self._ended += 1
            drift = "; ".join(self._drift.alarms)
        said = outcome.predicted
        message = MotionOutcome(
            what=said.what,
            end=outcome.end.value,
            time_predicted=said.moving_s,
            time_measured=outcome.moving_s,
            way_predicted=said.way_m,
            way_measured=outcome.way_m,
            joint=self._names,
            effort_predicted=[100.0 * share for share in said.effort],
            effort_measured=[100.0 * share for share in outcome.effort],
            drift=drift,
        )
        message.header.stamp = rospy.get_rostime()
        self._outcomes.publish(message)
