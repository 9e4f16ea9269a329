"""The services of the twin controller that command, and who asks for what.

``command``, ``control`` and ``judge``; ``stop``, ``pause``, ``resume`` and ``reset`` are commands
without words, for buttons and scripts.

Tokens are judged here and go no further: the core gets the name, and why it is not proven.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
import rosgraph.network
import rospy
from scara_config import ConfigError
from scara_config.frames import find_frames
from scara_control.errors import ScaraControlError
from scara_control.kinematics.base_targets import BaseTargets
from scara_ros.names import Seat, is_remote
from scara_ros.page.persons_io import LONGEST, Persons
from scara_ros.shell.ros_node import config_folder
from std_srvs.srv import Trigger, TriggerResponse

from scara_msgs.srv import (
    Control,
    ControlResponse,
    JudgeMove,
    JudgeMoveResponse,
    TwinCommand,
    TwinCommandResponse,
)
from twin_controller.core.actions import Reply
from twin_controller.core.control import ENDING
from twin_controller.core.events import ControlAsked, Operator
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.commands.judging import judge_move
from twin_controller.core.setup import Setup
from twin_controller.engine.engine_io import Engine
from twin_controller.services.move_gate_node import MoveGate

Audit = Callable[[str, str, bool, str], None]
TRIGGERS = ("stop", "pause", "resume", "reset")
LAST_MEANS = "look at the robot, and press its own emergency stop if it moves"
SILENT = ("KEEP", "LEND")
"""Signs of life, and of a motion that goes on: they come each second and are not in the audit."""


class CommandServices:
    """Judges who asks, hands the command to the engine, and tells the audit."""

    def __init__(
        self, setup: Setup, engine: Engine, persons: Persons, audit: Audit, gate: MoveGate
    ) -> None:
        """Remember who is asked; ``offer`` opens the services."""
        self._setup, self._gate = setup, gate
        self._places = BaseTargets(setup.robot, setup.tool)
        self._engine, self._persons, self._audit = engine, persons, audit
        # rosgraph binds to all addresses, unless ROS_IP or ROS_HOSTNAME names the loopback.
        self._hears_network = not rosgraph.network.get_bind_address().startswith("127.")

    def offer(self) -> list[rospy.Service]:
        """Offer the services."""
        return [
            rospy.Service("twin_controller/command", TwinCommand, self._command),
            rospy.Service("twin_controller/control", Control, self._control),
            rospy.Service("twin_controller/judge", JudgeMove, self._judge),
            *(
                rospy.Service(
                    f"twin_controller/{command}", Trigger, partial(self._trigger, command)
                )
                for command in TRIGGERS
            ),
        ]

    def _trigger(self, command: str, trigger: Trigger._request_class) -> TriggerResponse:
        """Take a command without words the way of all others; its caller is the audit's."""
        request = TwinCommand._request_class(command=command)
        request._connection_header = trigger._connection_header
        answer = self._command(request)
        return TriggerResponse(answer.success, answer.message)

    def _command(self, request: TwinCommand._request_class) -> TwinCommandResponse:
        # First of all: reading tokens, judging and the way to the engine take their time, and a
        # stop may come meanwhile.
        now = time.monotonic()
        asked = self._engine.asked(request.asked, now)
        command = request.command.strip().upper()
        try:
            target, turned = self._target(command, request)
        except (ScaraControlError, ConfigError) as error:
            self._audit(_caller(request), command, False, str(error))
            return TwinCommandResponse(False, str(error), False)
        event = Operator(
            now,
            command,
            asked=asked,
            speed_percent=request.speed_percent,
            target=target,
            elbow=request.elbow,
            yaw=turned,
            path=request.path,
            speed_mm_s=request.speed_mm_s,
            via=tuple(request.via),
            corner_mm=request.corner_mm,
            # A stop waits for no disk: its person is compared with what is known.
            **self._who(request, read=command not in ENDING),
        )
        answer = self._judged(event)
        sent = command in ENDING and answer.success
        if sent and request.at_once:
            answer = Reply(answer.id, False, f"sent: {answer.message}")
        elif sent:
            # A stop has come to something once both are seen to stand.
            trouble = self._engine.wait_to_stand(now, self._setup.config.stop.answer_ms * 1e-3)
            said = f"{answer.message}; both stand"
            if trouble:
                said = f"sent: {answer.message}; but {trouble}: {LAST_MEANS}"
            answer = Reply(answer.id, not trouble, said)
        speed = f"speed {request.speed_percent:g} %" if target else f"{request.speed_percent:g} %"
        how = "" if event.yaw is None else f" yaw {event.yaw:g} rad"
        if target and (request.frame or request.tool):
            how += f", asked in user frame {request.frame} for tool frame {request.tool}"
        what = f"{command} target {list(target)}{how} {speed}" if target else f"{command} {speed}"
        self._audit(_name(request, event), what, answer.success or sent, answer.message)
        return TwinCommandResponse(answer.success, answer.message, sent)

    def _judged(self, event: Operator) -> Reply:
        """Hand a command to the engine once the gate lets it through."""
        found = self._gate.judge(event)
        if not found.allowed:
            return Reply(0, False, found.text)
        # Judging took its time: the command is as old as its way to the engine.
        answer = self._ask(msgspec.structs.replace(event, now=time.monotonic()))
        if answer.success and found.note:
            return Reply(answer.id, True, f"{answer.message}; {found.note}")
        return answer

    def _control(self, request: Control._request_class) -> ControlResponse:
        action = request.action.strip().upper()
        event = ControlAsked(
            time.monotonic(), action, moves=request.moves, **self._who(request, read=True)
        )
        answer = self._ask(event)
        if action not in SILENT:
            self._audit(_name(request, event), action, answer.success, answer.message)
        holder = self._engine.state.lead.control.holder.name
        return ControlResponse(answer.success, answer.message, holder)

    def _judge(self, request: JudgeMove._request_class) -> JudgeMoveResponse:
        """Judge a move by the state as it is; the engine is not asked, so nothing waits for it."""
        command, now, state = request.command.strip().upper(), time.monotonic(), self._engine.state
        try:
            target, turned = self._target(command, request)
        except (ScaraControlError, ConfigError) as error:
            return JudgeMoveResponse(success=False, message=str(error))
        event = Operator(
            now,
            command,
            speed_percent=request.speed_percent,
            target=target,
            elbow=request.elbow,
            yaw=turned,
            path=request.path,
        )
        judged = judge_move(self._setup, state.sides.twin, event)
        return JudgeMoveResponse(
            success=not judged.refusal,
            message=judged.refusal or "reachable",
            refused_now=refusals(self._setup, state, now)["MOVE"],
            name=list(self._setup.names),
            target=list(judged.target),
            elbow=judged.elbow,
        )

    def _target(self, command: str, request: Any) -> tuple[tuple[float, ...], float | None]:
        """Return where a command leads, in the base, and how the tool is turned there [rad].

        Raises:
            ConfigError: A frame was never taught.
            ScaraControlError: It has no meaning for this target.
        """
        if command != "MOVE":
            return (tuple(request.joint_positions) if command == "MOVE_JOINTS" else ()), None
        point, yaw = (request.x, request.y, request.z), request.yaw if request.has_yaw else None
        if not (request.frame or request.tool):
            return point, yaw
        setup, twin = self._setup, self._engine.state.sides.twin
        if not twin.history:
            raise ScaraControlError("where the twin stands is not known: wait for its link")
        seed = [twin.last.q[setup.names.index(joint.name)] for joint in setup.tool.joints]
        frames = request.frame, request.tool
        return self._places.in_base(find_frames(config_folder()), point, yaw, frames, seed)

    def _who(self, request: Any, read: bool) -> dict[str, Any]:
        """Return the fields of an event that say who asks."""
        person, session = request.person[:LONGEST], request.session[:LONGEST]
        return {
            "person": person,
            "session": session,
            "unproven": self._persons.unproven(request.person, request.token, read),
            "local": "" if person or session else self._local(request),
        }

    def _local(self, request: Any) -> str:
        """Return the person whose own program on this machine asks, or asks a node of ours.

        Where nodes hear the network nobody knows from which machine a call comes.
        """
        callers = [str(request._connection_header.get("callerid", ""))]
        if hasattr(request, "by"):  # a node of ours asks for somebody
            callers.append(request.by)
        remote = self._setup.config.control.remote
        if self._hears_network or any(is_remote(caller, remote) for caller in callers):
            return ""
        return self._persons.local

    def _ask(self, event: Operator | ControlAsked) -> Reply:
        try:
            return self._engine.ask(event)
        except TimeoutError:
            return Reply(0, False, "the controller did not answer in time")


def _name(request: Any, event: Operator | ControlAsked) -> str:
    """Return who asked for the audit: the person if proven, and the node that called."""
    caller, name = _caller(request), Seat(event.person, event.session).name
    if not name:
        return caller
    return f"{name}{', not proven' if event.unproven else ''} by {caller}"


def _caller(request: Any) -> str:
    return str(request._connection_header.get("callerid", "unknown"))
