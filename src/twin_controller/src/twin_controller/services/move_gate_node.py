"""The operator's moves are judged before the controller hears of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import rospy
from scara_ros.gate.judge_gate_node import TOLD, JudgeGate
from scara_ros.gate.permit import Permit
from scara_ros.gate.settings import GateSettings

from scara_msgs.msg import Audit
from scara_msgs.srv import JudgeMotion
from twin_controller.core.events import Operator
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.commands.judging import judge_move
from twin_controller.core.lead.modes import MOVES
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState
from twin_controller.services.own_programs_node import OwnPrograms

PASSED = Permit(True, "")


class MoveGate:
    """Asks the judge for MOVE, MOVE_JOINTS and HOME, and hears of all other gates.

    Args:
        setup: Profile and numbers.
        settings: what_if.yaml.
        state: Returns the core's state.
        shown: Told the newest line for ``twin_controller/state``.
        audit: Told who, what, whether it may move, and why.
        pause: Pauses the pair, for ``hold_own_programs``.
    """

    def __init__(
        self,
        setup: Setup,
        settings: GateSettings,
        state: Callable[[], CoreState],
        shown: Callable[[str], None],
        audit: Callable[[str, str, bool, str], None],
        pause: Callable[[], None],
    ) -> None:
        self._setup, self._state, self._shown, self._audit = setup, state, shown, audit
        self._gate = JudgeGate(settings, JudgeMotion, Audit, settings.patience)
        self._own = OwnPrograms(
            JudgeGate(settings, JudgeMotion, Audit, settings.program_patience),
            settings.hold_own_programs,
            lambda: self._state().sides.real.flags,
            pause,
        )
        rospy.Subscriber(TOLD, Audit, self._told, queue_size=100, tcp_nodelay=True)

    def look(self) -> None:
        """Look whether the robot has started a program by itself; called all the time."""
        if not self._gate.is_off:
            self._own.look()

    def judge(self, event: Operator) -> Permit:
        """Return whether a command may go on to the controller; all but moves may.

        What the controller refuses by itself is left to it, also what was stopped while it was
        judged.
        """
        if event.command not in MOVES or self._gate.is_off:
            return PASSED
        before = self._state()
        refused = refusals(self._setup, before, time.monotonic())["MOVE"]
        if refused or judge_move(self._setup, before.sides.twin, event).refusal:
            return PASSED
        target = ", ".join(f"{value:.4g}" for value in event.target)
        words = f"{event.command} ({target})" if target else event.command
        return self._gate.ask(words, **self._request(event))

    def _request(self, event: Operator) -> dict[str, Any]:
        speed = event.speed_percent
        if event.command == "MOVE":
            x, y, z = event.target
            place = {"x": x, "y": y, "z": z, "elbow": event.elbow}
            if event.yaw is not None:
                place |= {"has_yaw": True, "yaw": event.yaw}
            place |= {"path": event.path, "speed_mm_s": event.speed_mm_s}
            return {"motion": "MOVE", "speed_percent": speed, **place}
        target = event.target
        if event.command == "HOME":
            speed = speed or self._setup.config.home.speed_percent
            target = self._setup.home
        asked = {"motion": "MOVE_JOINTS", "speed_percent": speed, "joint_positions": list(target)}
        asked |= {"path": event.path, "speed_mm_s": event.speed_mm_s}
        return asked | {"via": list(event.via), "corner_mm": event.corner_mm}

    def _told(self, said: Audit) -> None:
        """Show and keep what a gate has said, ours too."""
        self._shown(f"{said.what}: {'' if said.success else 'refused: '}{said.outcome}")
        self._audit(said.who, f"judged: {said.what}", said.success, said.outcome)
