"""Node ``farm_link``: shows this cell to the farm, and takes its commands.

Parameters: ``~config_dir`` (farm.yaml), ``~directory`` (the runs folder, where the journal is;
default: runs of the environment's CELL_ROOT, else of the working folder), ``~router_port`` (a desk
of this machine; default: the farm that this machine has joined, else farm.yaml). Service:
``farm/remote`` (std_srvs/SetBool), the local switch that lets the farm move this cell; it is off at
the start unless farm.yaml says otherwise. Subscribes to ``twin_controller/state``, and to
``real/joint_states`` and ``twin/joint_states`` while somebody of the farm looks at the joints.
Calls ``twin_controller/command`` in the name ``/farm/PERSON@DESK``. Publishes ``/diagnostics``, and
to ``twin_controller/audit`` who asked for a change of the configuration. It waits for the desk and
outlives it; its own death ends nothing.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import threading
import time
from datetime import datetime, timezone
from pathlib import Path

import rospy
from msgspec.structs import replace
from scara_config import config_directory
from scara_config.rollout.kept import kept_file
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.process.memory_io import keep_for_good
from scara_ros.services.service_client_node import ServiceClient, look_up
from scara_ros.services.service_connection_io import ServiceError
from scara_ros.shell.program_io import command_of, runs_folder
from scara_ros.shell.ros_node import refusing, starting
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, SetBoolResponse

from farm import keys
from farm.bus_io import BusError, wait_for_desk
from farm.config import FarmConfig, load_farm
from farm.link.cell_link_io import CellLink
from farm.link.changes_io import CellChanges
from farm.link.commands import caller_id
from farm.link.journal_io import JournalFiles
from farm.link.recordings_io import RecordingFiles
from farm.link.shown import ShownState, show, silent, told_by
from farm.security.invitation_io import SecurityError, keys_folder
from farm.security.membership_io import as_member
from farm.wire import Answer, CellState, Command, Joints
from scara_msgs.msg import Audit, TwinControllerState
from scara_msgs.srv import TwinCommand

NAME = "farm_link"
COMMAND = "twin_controller/command"
JOURNAL = "journal"
DOCTOR_S = 20.0
"""Our choice: it takes 1.4 s on an idle machine."""
DOCTOR_LINES = 12
"""Of what it says, the last so many are told."""
LOWEST = 19
"""Niceness of the doctor: the cell comes first."""


class CellTopics:
    """What the cell's topics say, for the link on the bus."""

    def __init__(self, config: FarmConfig) -> None:
        """Subscribe and offer the switch; the bus comes later."""
        self._config = config.link
        self._shown = ShownState(revision=int(time.time()))
        self._raw: bytes | None = None
        self._heard = 0.0
        # Where the controller was last: a STOP must not need a master, which may have gone since.
        self._address = ""
        self._remote = config.link.remote_at_start
        self._link: CellLink | None = None
        # Of each side what it said last, and when that came [s], monotonic.
        self._joints: dict[str, tuple[JointState, float]] = {}
        # Of the joints, while somebody at a desk looks at them.
        self._listeners: list[rospy.Subscriber] = []
        self._lock = threading.Lock()
        self._turning = threading.Lock()
        self._diagnostics = Diagnostics("farm")
        self._audit = rospy.Publisher("twin_controller/audit", Audit, queue_size=10)
        self._service = rospy.Service("farm/remote", SetBool, self._switch)
        # Only what is sent is read: 5 of the controller's 20 states a second.
        self._subscriber = rospy.Subscriber(
            "twin_controller/state", rospy.AnyMsg, self._keep, queue_size=1, tcp_nodelay=True
        )

    def forward(self, command: Command) -> Answer:
        """Hand a command on to the twin controller, once."""
        client = ServiceClient(
            COMMAND,
            TwinCommand,
            self._config.answer_ms * 1e-3,
            caller=caller_id(command),
            address=self._address,
        )
        try:
            # The desk sees in the cell's state when both stand.
            answer = client(
                command=command.command, speed_percent=command.speed_percent, at_once=True
            )
        except ServiceError as error:
            return Answer(False, str(error))
        return Answer(bool(answer.success or answer.sent), str(answer.message))

    def tell(self, command: Command, answer: Answer) -> None:
        """Tell the audit who asked for a change of the configuration, and what came of it."""
        what = command.command
        if command.change is not None:
            what += f" {command.change.text}"
        entry = Audit(
            who=caller_id(command), what=what, success=answer.accepted, outcome=answer.text
        )
        entry.header.stamp = rospy.Time.now()
        self._audit.publish(entry)

    def watched(self, somebody: bool) -> None:
        """Listen to both sides' joints only while somebody looks."""
        with self._lock:
            for listener in self._listeners:
                listener.unregister()
            self._listeners = []
            self._joints = {}
            if somebody:
                self._listeners = [
                    rospy.Subscriber(
                        f"{side}/joint_states",
                        JointState,
                        self._keep_joints,
                        callback_args=side,
                        queue_size=1,
                        tcp_nodelay=True,
                    )
                    for side in ("real", "twin")
                ]

    def say(self) -> None:
        """Publish on /diagnostics what the link does, and find where the controller is now."""
        with contextlib.suppress(ServiceError):
            self._address = look_up(rospy.resolve_name(COMMAND), PERIOD_S)
        told = "shown to the farm" if self._link is not None else "waits for the desk"
        switch = "the farm may move this cell" if self._remote else "the farm may only stop it"
        name = rospy.resolve_name(NAME)
        self._diagnostics.publish(Diagnosis(Level.OK, name, f"{told}; {switch}"))

    def run(self, link: CellLink) -> None:
        """Show the cell until the node ends."""
        self._link = link
        state_period, joints_period = (
            1.0 / rate for rate in (self._config.state_rate_hz, self._config.joints_rate_hz)
        )
        state_due = joints_due = 0.0
        while not rospy.is_shutdown():
            now = time.monotonic()
            if now >= state_due:
                state_due = max(state_due + state_period, now)
                # A state that was made before the switch was turned must not undo it.
                with self._turning:
                    link.show(self._state(time.time()))
            if self._listeners and now >= joints_due:
                joints_due = max(joints_due + joints_period, now)
                self._show_joints(link)
            due = min(state_due, joints_due) if self._listeners else state_due
            time.sleep(max(0.0, due - time.monotonic()))

    def _keep(self, message: rospy.AnyMsg) -> None:
        self._raw, self._heard = message._buff, time.monotonic()

    def _keep_joints(self, message: JointState, side: str) -> None:
        self._joints[side] = message, time.monotonic()

    def _state(self, now: float) -> CellState:
        # Not by the time of day: set back, it would let what is dead look alive.
        raw, age = self._raw, time.monotonic() - self._heard
        if raw is None or age > self._config.silent_ms * 1e-3:
            since = now - age if raw is not None else 0.0
            self._shown, state = silent(self._shown, since, now, self._remote)
            return state
        message = TwinControllerState()
        message.deserialize(raw)
        self._shown, state = show(self._shown, told_by(message), self._remote)
        return state

    def _show_joints(self, link: CellLink) -> None:
        with self._lock:
            known = dict(self._joints)
        # What a side that is not heard said last must not look as if it were of now.
        oldest = time.monotonic() - self._config.silent_ms * 1e-3
        joints = {side: message for side, (message, heard) in known.items() if heard >= oldest}
        if not joints:
            return
        stamp = max(message.header.stamp.to_sec() for message in joints.values())
        places = {side: dict(zip(m.name, m.position)) for side, m in joints.items()}
        link.show_joints(Joints(stamp, places.get("real", {}), places.get("twin", {})))

    def _switch(self, request: SetBool._request_class) -> SetBoolResponse:
        with self._turning:
            self._remote = bool(request.data)
            if self._link is not None:
                self._link.switch(self._remote)
        text = "the farm may move this cell" if self._remote else "the farm may only stop this cell"
        rospy.loginfo("%s: %s, by %s", NAME, text, request._connection_header.get("callerid", ""))
        return SetBoolResponse(True, text)


def main() -> None:
    """Wait for the desk, then show the cell until shut down."""
    with starting(NAME, SecurityError, keys.CellNameError) as folder:
        config = load_farm(folder)
        port = rospy.get_param("~router_port", None)
        if port is not None:
            config = replace(config, router=replace(config.router, port=int(port)))
        else:
            keys_there = keys_folder(os.environ)
            config = as_member(config, keys_there, datetime.now(timezone.utc))
        namespace = rospy.get_namespace().strip("/")
        machine = config.machine or keys.as_name(socket.gethostname())
        cell = keys.checked(config.site, machine, keys.as_name(namespace) or "cell")
        runs = runs_folder(rospy.get_param("~directory", "")).resolve()
    journal = JournalFiles(runs / JOURNAL / (namespace or "cell"))
    link = CellTopics(config)
    with refusing():
        kept = kept_file(runs, namespace or "cell")
        changes = CellChanges(kept, config_directory(), examined, link.tell)
    rospy.loginfo("%s is ready: %s, desk at %s", NAME, cell, config.router.endpoint)
    keep_for_good()
    with until_shutdown():
        _serve(config, cell, journal, link, RecordingFiles(runs), changes)


def examined(folder: Path) -> list[str]:
    """Return what the doctor finds wrong with a configuration, a line each."""
    doctor = command_of("robot_doctor", "doctor", os.environ)
    try:
        done = subprocess.run(
            ["nice", f"-n{LOWEST}", *doctor, "--offline", "--config-dir", str(folder)],
            capture_output=True,
            text=True,
            timeout=DOCTOR_S,
            # It prints for a terminal; here its lines are read as text.
            env={**os.environ, "NO_COLOR": "1", "TERM": "dumb"},
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return [f"the doctor did not answer: {error}"]
    if done.returncode == 0:
        return []
    said = (done.stdout + done.stderr).replace(f"{folder}/", "")
    lines = [line.strip() for line in said.splitlines()]
    return [line for line in lines if line and not line.startswith("ok ")][-DOCTOR_LINES:]


def _serve(
    config: FarmConfig,
    cell: keys.CellName,
    journal: JournalFiles,
    link: CellTopics,
    recordings: RecordingFiles,
    changes: CellChanges,
) -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    threading.Thread(target=_keep_saying, args=(link, ended), daemon=True).start()
    with refusing(BusError):
        session = wait_for_desk(config.router, config.lease_ms, ended)
    if session is None:
        return
    with (
        session,
        CellLink(
            session, cell, config.link, journal, link.forward, link.watched, recordings, changes
        ) as bus,
    ):
        rospy.loginfo("%s: the desk is there", NAME)
        link.run(bus)


def _keep_saying(link: CellTopics, ended: threading.Event) -> None:
    """Publish what the link does until the node ends; a master that hangs holds no state up."""
    with until_shutdown():
        while not ended.is_set():
            link.say()
            ended.wait(PERIOD_S)
