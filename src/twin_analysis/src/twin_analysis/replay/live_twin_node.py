"""A live twin and its controller as a replay sees them.

It shows mode and joint states; each wait has a deadline.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
import rospy
from sensor_msgs.msg import JointState
from twin_experiments.metrics.series import Motion
from twin_experiments.report.record import build_side
from twin_experiments.run.cell_node import ENDED_MODES, POLL_S, RunError

from scara_msgs.msg import TwinControllerState

STOPPED = TwinControllerState.STOPPED


class LiveTwin:
    """Listens to the twin and its controller."""

    def __init__(self, names: tuple[str, ...]) -> None:
        """Subscribe; nothing is waited for."""
        self._names = names
        self._lock = threading.Lock()
        self._rows: list[tuple[float, tuple[float, ...], tuple[float, ...]]] = []
        self._keep = False
        self._state: TwinControllerState | None = None
        self._begun = 0.0
        self.stops: list[str] = []
        rospy.Subscriber(
            "twin/joint_states", JointState, self._on_joints, queue_size=1000, tcp_nodelay=True
        )
        rospy.Subscriber(
            "twin_controller/state",
            TwinControllerState,
            self._on_state,
            queue_size=10,
            tcp_nodelay=True,
        )

    def _on_joints(self, message: JointState) -> None:
        at = {name: k for k, name in enumerate(message.name)}
        if all(name in at for name in self._names):
            columns = [at[name] for name in self._names]
            row = (
                tuple(message.position[k] for k in columns),
                tuple(message.velocity[k] for k in columns),
            )
            with self._lock:
                if self._keep:
                    self._rows.append((message.header.stamp.to_sec(), *row))

    def _on_state(self, message: TwinControllerState) -> None:
        if self._keep and message.mode == STOPPED != self._mode:
            self.stops.append(
                f"{time.monotonic() - self._begun:.2f} s: the twin controller stopped the "
                f"pair: {message.why}"
            )
        self._state = message

    def wait_idle(
        self, deadline: float, tell: Callable[[str], None], check: Callable[[], None]
    ) -> None:
        """Wait until the twin is aligned with the robot that is shown, and nobody leads.

        ``check`` raises what makes it vain to wait on.

        Raises:
            RunError: It is not within ``deadline`` [s]; the controller's reason is in the text.
        """

        def idle() -> bool:
            check()
            return bool(self._mode == TwinControllerState.IDLE)

        self._wait(idle, deadline, "the twin controller in IDLE", tell)

    def wait_played(
        self, ended: Callable[[], bool], deadline: float, tell: Callable[[str], None]
    ) -> None:
        """Wait until all is played.

        After a STOP the twin follows again from the robot's next move on.

        Raises:
            RunError: Only an operator could let the twin go on, or it takes longer than
                ``deadline`` [s].
        """

        def done() -> bool:
            if self._mode in (*ENDED_MODES, TwinControllerState.PAUSED) and self._mode != STOPPED:
                raise RunError(f"the twin controller ended the motion: {self._described}")
            return ended()

        self._wait(done, deadline, "the end of the recording", tell)

    def record(self) -> None:
        """Keep the twin's joint states, and when the pair was stopped, from now on."""
        self._begun = time.monotonic()
        with self._lock:
            self._rows, self._keep = [], True

    def recorded(self) -> Motion:
        """Return the twin's motion since :meth:`record`, in ROS time.

        Raises:
            RecordError: Less than two samples came.
        """
        with self._lock:
            self._keep, rows = False, self._rows
        stamps, positions, velocities = (
            (np.array(column) for column in zip(*rows)) if rows else (np.zeros(0),) * 3
        )
        return build_side("twin", stamps, positions, velocities)

    @property
    def _mode(self) -> str:
        return str(self._state.mode) if self._state is not None else ""

    @property
    def _described(self) -> str:
        if self._state is None:
            return "it has not said anything"
        return (
            f"it is in {self._state.mode}: "
            f"{self._state.alarm or self._state.why or 'no reason given'}"
        )

    def _wait(
        self, done: Callable[[], bool], deadline: float, what: str, tell: Callable[[str], None]
    ) -> None:
        end, told = time.monotonic() + deadline, ""
        while not done():
            text = f"waiting for {what} ({self._described})"
            if text != told:
                tell(text)
                told = text
            if time.monotonic() > end:
                raise RunError(f"waited {deadline:g} s in vain for {what}; {self._described}")
            time.sleep(POLL_S)
