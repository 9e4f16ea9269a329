"""Makes steps on a running simulator, through the controllers' command and state topics."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy
from scara_control.pid import PidGains
from scara_ros.starting.master_io import MasterClient
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from typing_extensions import Self

from control_msgs.msg import JointControllerState
from twin_analysis.step.response import Kind, LoopSample, Step, step_of
from twin_analysis.step.trial import BEFORE_S, Trial

_POLL_S = 0.02
_DEADLINE_S = 5.0
_STILL = 1e-3
"""[rad/s] or [m/s] that counts as standing still before a step. Our choice."""


class LiveError(RuntimeError):
    """The steps cannot be made on the running simulator; the text says why."""


def simulator_answers(joint: str) -> bool:
    """Say whether somebody on this master publishes the joint's controller state."""
    return _published(f"twin/{joint}_position_controller/state_each_step")


def _published(topic: str) -> bool:
    master = MasterClient(rosgraph.get_master_uri(), "/step_response")
    publishers, _, _ = master.ask("getSystemState")
    resolved = rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), topic)
    return any(name == resolved for name, nodes in publishers if nodes)


class LiveBench:
    """One joint of the running simulator.

    A context manager: leaves the joint holding its position.
    """

    def __init__(self, joint: str, kind: Kind, *, with_robot: bool) -> None:
        """Connect.

        Raises:
            LiveError: A robot would follow and was not asked for, or nobody answers.
        """
        if not with_robot and _published("twin_controller/state"):
            raise LiveError(
                "a twin controller is running: the real robot would follow each step; add "
                "--with-robot if it shall"
            )
        self._joint, self._kind = joint, kind
        self._lock = threading.Lock()
        self._samples: list[LoopSample] = []
        self._state: JointState | None = None
        self._epoch: Any = None
        names = f"twin/{joint}_{kind}_controller"
        self._commands = {
            each: rospy.Publisher(
                f"twin/{joint}_{each}_controller/command", Float64, queue_size=1, tcp_nodelay=True
            )
            for each in ("position", "velocity")
        }
        self._listeners = [
            rospy.Subscriber(
                f"{names}/state_each_step", JointControllerState, self._on_loop, tcp_nodelay=True
            ),
            rospy.Subscriber(
                "twin/joint_states", JointState, self._on_state, queue_size=1, tcp_nodelay=True
            ),
        ]
        self._wait(
            lambda: self._state is not None,
            f"a message on {rospy.resolve_name('twin/joint_states')}: is the simulation paused?",
        )
        self._wait(
            lambda: all(publisher.get_num_connections() for publisher in self._commands.values()),
            "the simulator to listen",
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Stop a velocity that is still commanded."""
        if self._kind == "velocity":
            self._send("velocity", 0.0)
            time.sleep(_POLL_S)  # the message is on its way before the node ends
        for listener in self._listeners:
            listener.unregister()

    def position(self) -> float:
        """Return where the joint stands [rad] or [m]."""
        return self._now()[0]

    def run(self, trial: Trial) -> list[Step]:
        """Make the steps of a trial, one after the other, each from standstill.

        Raises:
            LiveError: The simulator does not do what it is told.
        """
        if trial.kind == "position":
            self._send("position", self.position())
        return [self._step(trial, target) for target in trial.targets]

    def _step(self, trial: Trial, target: float) -> Step:
        if trial.kind == "velocity":
            self._send("velocity", 0.0)
        self._wait(lambda: abs(self._now()[1]) < _STILL, f"{self._joint} to stand still")
        with self._lock:
            self._samples.clear()
        self._wait(
            lambda: self._recorded() >= 2.0 * BEFORE_S,
            "the controller's states: is the simulation paused?",
        )
        begin = self._recorded()
        self._send(trial.kind, target)

        def recorded() -> bool:
            # The simulator ends a velocity that nobody repeats.
            if trial.kind == "velocity":
                self._send("velocity", target)
            return self._recorded() >= begin + trial.seconds

        self._wait(
            recorded,
            f"{trial.seconds:g} s of states",
            trial.seconds + _DEADLINE_S,
        )
        with self._lock:
            return step_of(list(self._samples), target, BEFORE_S)

    def _send(self, kind: Kind, value: float) -> None:
        self._commands[kind].publish(Float64(value))

    def _recorded(self) -> float:
        """Return how much time is recorded [s]."""
        with self._lock:
            return self._samples[-1].time - self._samples[0].time if len(self._samples) > 1 else 0.0

    def _now(self) -> tuple[float, float]:
        """Return the joint's position and velocity."""
        state = self._state
        assert state is not None
        column = list(state.name).index(self._joint)
        return float(state.position[column]), float(state.velocity[column])

    def _on_state(self, message: JointState) -> None:
        self._state = message

    def _on_loop(self, message: JointControllerState) -> None:
        stamp = message.header.stamp
        self._epoch = self._epoch or stamp
        gains = PidGains(
            p=message.p,
            i=message.i,
            d=message.d,
            i_clamp=message.i_clamp,
            antiwindup=message.antiwindup,
        )
        sample = LoopSample(
            (stamp - self._epoch).to_sec(),
            message.set_point,
            message.process_value,
            message.command,
            gains,
        )
        with self._lock:
            self._samples.append(sample)

    def _wait(
        self, condition: Callable[[], bool], what: str, deadline: float = _DEADLINE_S
    ) -> None:
        """Wait for ``condition``.

        Raises:
            LiveError: It does not come within ``deadline`` [s].
        """
        end = time.monotonic() + deadline
        while not condition():
            if time.monotonic() > end:
                raise LiveError(f"waited {deadline:g} s in vain for {what}")
            time.sleep(_POLL_S)
