"""The cell as the page sees it, over ROS."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import rosgraph
import rospy
from nicegui import run
from scara_config import ConfigError, Robot
from scara_config.modbus_map import load_modbus_map
from scara_ros.gate.settings import Unjudged
from scara_ros.names import Seat
from scara_ros.services.service_client_node import look_up
from scara_ros.services.service_connection_io import ServiceError
from scara_ros.starting.registration_node import keep_registered
from std_srvs.srv import SetBool, Trigger

from control_msgs.msg import JointJog
from operator_panel.config import PanelConfig, Surroundings
from operator_panel.control.authority import ENDING
from operator_panel.control.calling_node import Lane, as_answer
from operator_panel.control.program_gate_node import ProgramGate, tried, with_note
from operator_panel.control.stop_line_io import StopLine
from operator_panel.door import Answer, Gains
from operator_panel.link.camera_link_node import CameraLink
from operator_panel.link.listening_node import Listening
from operator_panel.link.pendant_io import Pendant
from operator_panel.link.register_reader_io import (
    RegisterReadError,
    read_frames,
    read_registers,
)
from operator_panel.link.reporter_io import Reporter
from operator_panel.link.tuning_link_node import TuningLink
from operator_panel.view.robot.registers import Entry
from operator_panel.view.snapshot import Snapshot
from scara_msgs.srv import (
    Control,
    ConvertProgram,
    JudgeMotion,
    JudgeMove,
    Shadow,
    StartRecording,
    StopRecording,
    TwinCommand,
)

ENDS = Answer(False, "the page's server ends")
NODE, COMMAND = "operator_panel", "twin_controller/command"
MASTER_PERIOD_S = 1.0
CAMERA_PERIOD_S = 0.25  # our choice: so late the first picture is at most
STOP_LOOKUP_S = 0.25  # our choice: a press that must ask the master is still sent within 0.4 s
RECORDER_TIMEOUT_S = (
    15.0  # our choice: the recorder connects to all topics before it answers, and closes the bag
)


class CellLink:
    """Implements :class:`operator_panel.door.CellDoor`.

    ``connect`` waits for a ROS master in a thread of its own.
    """

    def __init__(
        self,
        robot: Robot,
        config: PanelConfig,
        around: Surroundings,
        config_dir: Path,
        tokens: Mapping[str, str],
    ) -> None:
        """Build everything that needs no ROS master; ``tokens`` prove the persons, by name."""
        self._tokens = tokens
        self._listening = Listening(robot)
        self._pendant = Pendant(around.real, config_dir, config.program_timeout_s)
        self._program_gate = ProgramGate(config_dir)
        self._reporter = Reporter(config_dir, config.report_timeout_s)
        self._real, self._layout = around.real, load_modbus_map(config_dir)
        self._reading = asyncio.Lock()
        timeout = config.call_timeout_s
        self._commands = Lane(COMMAND, TwinCommand, timeout)
        # What ends a motion does not wait until what begins one was answered.
        self._endings = Lane(COMMAND, TwinCommand, timeout)
        self._control = Lane("twin_controller/control", Control, timeout)
        self._stops = StopLine(TwinCommand, rosgraph.names.make_caller_id(NODE), _find_command)
        self._judge = Lane("twin_controller/judge", JudgeMove, timeout)
        patience = self._program_gate.settings.program_patience
        self._second_world = Lane("what_if/judge", JudgeMotion, patience)
        self._convert = Lane("what_if/convert", ConvertProgram, patience)
        self._shadow = Lane("twin_controller/shadow", Shadow, timeout)
        self._start = Lane("recorder/start", StartRecording, RECORDER_TIMEOUT_S)
        self._stop = Lane("recorder/stop", StopRecording, RECORDER_TIMEOUT_S)
        self._gripper = Lane("gripper", SetBool, timeout)
        self._parts_back = {
            side: Lane(f"{side}/put_parts_back", Trigger, timeout) for side in ("real", "twin")
        }
        self._tuning = TuningLink([joint.name for joint in robot.twin_joints], timeout)
        self._camera = CameraLink()
        # When a page has pressed a stop or a pause last: a mode shows that later, or never.
        self._stopped_at = float("-inf")
        self._jog: Any = None

    def connect(self, ended: threading.Event) -> None:
        """Become a ROS node once a master runs; stay one with later masters, until ``ended``."""
        waiting = False
        while not rosgraph.is_master_online():
            if not waiting:
                print("operator_panel: no ROS master yet: looking again each second", flush=True)
                waiting = True
            if ended.wait(MASTER_PERIOD_S):
                return
        # Signals are the web server's; this is a thread beside it, where none can be caught.
        rospy.init_node(NODE, disable_signals=True)
        keep_registered()
        self._jog = rospy.Publisher(
            "joint_vel_controller/command", JointJog, queue_size=1, tcp_nodelay=True
        )
        self._program_gate.connect()
        self._tuning.subscribe()
        self._listening.subscribe()
        while not ended.wait(CAMERA_PERIOD_S):
            self._camera.look()

    def keep_stop(self, ended: threading.Event) -> None:
        """Keep the connection for STOP tested until ``ended``; for a thread of its own."""
        self._stops.keep(ended)

    def say(self, text: str) -> None:
        """Log who commanded what."""
        if rospy.core.is_initialized():
            rospy.loginfo("%s", text)

    def snapshot(self) -> Snapshot:
        """Return what is known now."""
        gate = self._program_gate.settings
        return msgspec.structs.replace(
            self._listening.snapshot(),
            no_stop=self._stops.trouble(),
            gate=gate.gate.value,
            moves_unjudged=gate.gate_without_judge is Unjudged.MOVE,
        )

    def watch(self, watched: bool) -> None:
        """Listen closely while a page is open."""
        self._listening.watch(watched)

    async def command(self, seat: Seat, command: str, **fields: Any) -> Answer:
        """Send a command to the twin controller; it is as old as this call, not as its turn."""
        who, asked = self._who(seat), fields.pop("asked", time.monotonic())
        lane = self._commands
        if command in ENDING:
            self._stopped_at, lane = asked, self._endings
        # The page shows by itself when both stand; what comes behind a PAUSE does not wait for it.
        response = await lane.call(command=command, asked=asked, at_once=True, **who, **fields)
        if isinstance(response, Answer):
            return response
        return Answer(response.success or response.sent, response.message)

    async def control(self, seat: Seat, action: str, moves: bool) -> Answer:
        """Ask the twin controller who may move the pair."""
        who = self._who(seat)
        return as_answer(await self._control.call(action=action, moves=moves, **who))

    def stop(self, seat: Seat, command: str) -> Awaitable[Answer]:
        """Send STOP or ESTOP now, over connections of its own."""
        self._stopped_at = time.monotonic()
        return asyncio.wrap_future(self._stops.send(command, **self._who(seat)))

    def _who(self, seat: Seat) -> dict[str, str]:
        """Return the fields of a request that say who asks, and prove it."""
        token = self._tokens.get(seat.person, "")
        return {"person": seat.person, "token": token, "session": seat.session}

    async def judge(self, **fields: Any) -> Answer:
        """Ask the twin controller, over a connection of its own: STOP never waits for it."""
        answer = await self._judge.call(command="MOVE", **fields)
        return as_answer(answer, "name", "target", "elbow", "refused_now")

    async def try_motion(self, motion: str, **fields: Any) -> Answer:
        """Ask the second world, over a connection of its own: neither gate nor STOP waits."""
        return tried(await self._second_world.call(motion=motion, **fields))

    async def convert(self, text: str, to: str, frame: int = -1) -> Answer:
        """Ask the second world likewise."""
        return as_answer(await self._convert.call(text=text, to=to, frame=frame), "text")

    async def shadow(self, time: float) -> Answer:
        """Ask the twin controller's memory."""
        return as_answer(await self._shadow.call(time=time), "document")

    async def picture(self, after: str) -> tuple[str, bytes] | None:
        """Wait for a picture of the camera."""
        return await self._camera.picture(after)

    async def record(self, path: str) -> Answer:
        """Start a recording."""
        return _with_path(as_answer(await self._start.call(path=path), "path"), "recording")

    async def stop_recording(self) -> Answer:
        """Stop the recording."""
        return _with_path(as_answer(await self._stop.call(), "path"), "complete:")

    async def report(self, bag: Path) -> Answer:
        """Write the report of a bag, in a program of its own."""
        self.say(f"report of {bag.parent.name}")
        return await self._reporter.make(bag)

    def reporting(self) -> str:
        """Return whose report is being made."""
        return self._reporter.running

    def gains(self, joint: str) -> Gains | None:
        """Return what the joint's tuning server has published."""
        return self._tuning.gains(joint)

    async def tune(
        self, joint: str, values: Mapping[str, float], switches: Mapping[str, bool]
    ) -> Answer:
        """Set the joint's parameters; what the server made of them is in the answer."""
        return await self._tuning.set(joint, values, switches)

    async def undo_tuning(self) -> Answer:
        """Take the last change of gains back, in the simulator and in its file."""
        return await self._tuning.undo()

    def jog(self, velocities: Mapping[str, float]) -> None:
        """Publish a jog command."""
        if self._jog is not None:
            message = JointJog(joint_names=list(velocities), velocities=list(velocities.values()))
            message.header.stamp = rospy.get_rostime()
            self._jog.publish(message)

    def _stopped(self, asked: float) -> str:
        """Return why what was asked for at ``asked`` may no longer begin, or an empty text."""
        if max(self._stopped_at, self._listening.snapshot().ended) < asked:
            return ""
        return "a stop or a pause came after it was pressed: press it again"

    async def grip(self, close: bool, asked: float) -> Answer:
        """Switch the twin's gripper; the twin controller passes it on to the real robot."""
        if why := self._stopped(asked):
            return Answer(False, why)
        self.say(f"gripper {'closed' if close else 'opened'}")
        return as_answer(await self._gripper.call(data=close))

    async def registers(self) -> tuple[Sequence[Entry], str]:
        """Read the robot over a connection of its own, which is closed again."""
        async with self._reading:
            try:
                found = await run.io_bound(read_registers, self._real, self._layout)
            except RegisterReadError as error:
                return (), str(error)
        return found or (), "" if found else "the page's server ends"

    async def robot_frames(self) -> Answer:
        """Read them likewise."""
        async with self._reading:
            try:
                found = await run.io_bound(read_frames, self._real, self._layout)
            except (RegisterReadError, ConfigError) as error:
                return Answer(False, str(error))
        return Answer(True, "", {"frames": found}) if found else ENDS

    async def put_parts_back(self) -> Answer:
        """Put the parts of both sides back; the first side that does not do it is the answer."""
        self.say("parts put back")
        for side, lane in self._parts_back.items():
            answer = as_answer(await lane.call())
            if not answer.success:
                return Answer(False, f"{side}: {answer.message}", lost=answer.lost)
        return Answer(True, "the parts of both cells stand where they stood at the start")

    async def pendant(self, *words: str, asked: float, barred: Callable[[], str]) -> Answer:
        """Press a key of the real robot's pendant."""

        def stopped() -> str:
            return (self._stopped(asked) or barred()) if words[0] == "run" else ""

        self.say(f"pendant {' '.join(words)}")
        found = await self._program_gate.judge(*words)
        if not found.allowed:
            return Answer(False, found.text)
        # The judge takes seconds; nothing else asks whether a stop came meanwhile, or whether the
        # page has handed control over.
        if why := stopped():
            return Answer(False, why)
        return with_note(await self._pendant.press(words, stopped), found)


def _find_command() -> tuple[str, str]:
    """Return the command service's absolute name and address.

    Raises:
        ServiceError: No master answers, or it knows no such service.
    """
    if not rospy.core.is_initialized():
        raise ServiceError("no ROS master has answered yet")
    service = rospy.resolve_name(COMMAND)
    return service, look_up(service, STOP_LOOKUP_S)


def _with_path(answer: Answer, what: str) -> Answer:
    path = answer.values.get("path", "")
    return Answer(True, f"{what} {path}", answer.values) if answer.success else answer
