"""Run the real robot's stand-in.

Modbus TCP on ``~host``:``~port`` (default: emulator.yaml). ROS is used for one thing, and only once
there is a roscore:

Parameters (as ``_name:=value`` on the command line, so that they hold without roscore too):
    ~config_dir: Folder with the YAML files; default: the package scara_config.
    ~host, ~port: Address to listen on.
    ~plant: How the robot behaves, a file of plants/; default: ``SCARA_PLANT``, else ``ideal``.
    ~settings: How the robot was set up: a file of settings/ and what differs from it, for example
        ``delivered, num_modbus: 8``; default: what ``SCARA_SETTINGS`` says, else ``ready``.
    ~links: ``desk`` for the patience of emulator.yaml with a client on the same machine;
        default: strict.

Topics:
    real/ground_truth (sensor_msgs/JointState, out, 250 Hz while somebody listens): True joint
        positions and speeds, stamped with the nominal time of their servo step. For the report;
        nothing that controls the robot may read it.
    real/plant (std_msgs/String, out, latched): The plant as JSON, with its name: for the report,
        which says by it what its figures are of; nothing that controls the robot may read it.
    real/parts, real/gripper, real/part_events: see :mod:`fanuc_emulator.gripping.parts_truth_node`.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from scara_config import ConfigError, Robot, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.palletise import find_palletise
from scara_config.profile import chosen_plant
from scara_ros.process.scheduling_io import go_first
from scara_ros.shell.program_io import WRONG, ends_with, private_parameters

from fanuc_emulator.config import load_emulator, load_library, on_a_desk
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.parts_truth_node import PartsTruth
from fanuc_emulator.modbus.modbus_server_io import PortError, RobotServer
from fanuc_emulator.plant.config import plant_text
from fanuc_emulator.plant.delays import AnswerTimes
from fanuc_emulator.plant.wear import vacuum_s
from fanuc_emulator.program_files_io import ProgramFiles
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.tp.executor import Program
from fanuc_emulator.uop import with_panel

_GROUND_TRUTH_PERIOD = 0.004
SEED = 1
"""Of what a plant leaves to chance: the stand-in does the same each time."""


class GroundTruth:
    """Publish ``real/ground_truth`` from the moment a roscore is there.

    Args:
        robot: Joint names.
        every: Publish each ``every``-th snapshot.
        stop: Set when the node ends; rospy's own end sets it too.
        parts: The truth about the parts, published beside it.
        plant: The text of ``real/plant``.
    """

    def __init__(
        self,
        robot: Robot,
        every: int,
        stop: threading.Event,
        parts: PartsTruth | None = None,
        plant: str = "",
    ) -> None:
        self._parts, self._plant_text = parts, plant
        self._plant: Any = None
        self._names = [joint.name for joint in robot.joints]
        self._every = every
        self._stop = stop
        self._publisher: Any = None
        self._message: Any = None
        self._time: Any = None
        self._offset = 0.0

    def observe(self, snapshot: Snapshot, due: float) -> None:
        """Publish a snapshot that is true at the monotonic time ``due``, if somebody listens."""
        if snapshot.tick % self._every:
            return
        if self._publisher is None:
            if self._parts is not None:
                self._parts.note(due)
            return
        if self._parts is not None:
            self._parts.publish(snapshot.outputs, due, self._offset)
        if not self._publisher.get_num_connections():
            return
        message = self._message(
            name=self._names, position=snapshot.positions, velocity=snapshot.velocities
        )
        message.header.stamp = self._time(due + self._offset)
        self._publisher.publish(message)

    def serve(self) -> None:
        """Wait for a roscore and advertise.

        Then keep the offset between monotonic and ROS time up to date.
        """
        import rosgraph

        waiting = False
        while not self._stop.is_set() and not rosgraph.is_master_online():
            if not waiting:
                print(
                    "emulator: no roscore yet: running without real/ground_truth, looking "
                    "again each second",
                    flush=True,
                )
                waiting = True
            self._stop.wait(1.0)
        if self._stop.is_set():
            return
        import rospy
        from scara_ros.process.memory_io import keep_for_good
        from scara_ros.starting.registration_node import keep_registered
        from scara_ros.starting.starting_node import send_directly
        from scara_ros.starting.xmlrpc_guard_io import harden_process

        send_directly()
        harden_process()
        # This is not the main thread, and SIGINT and SIGTERM have the stand-in's own handlers.
        rospy.init_node("emulator", disable_signals=True)
        keep_registered()
        rospy.on_shutdown(self._stop.set)
        self._measure_offset(rospy.get_time)
        self.advertise()
        keep_for_good()
        while not self._stop.wait(1.0):
            self._measure_offset(rospy.get_time)

    def advertise(self) -> None:
        """Publish from now on; this process is a node."""
        import rospy
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String

        self._message, self._time = JointState, rospy.Time.from_sec
        if self._parts is not None:
            self._parts.advertise()
        self._plant = rospy.Publisher("real/plant", String, queue_size=1, latch=True)
        self._plant.publish(String(self._plant_text))
        # Last: once it is set the servo loop publishes, and needs all the others.
        self._publisher = rospy.Publisher(
            "real/ground_truth", JointState, queue_size=100, tcp_nodelay=True
        )

    def _measure_offset(self, ros_time: Any) -> None:
        """Take ROS time minus monotonic time from the least disturbed of five readings."""
        readings = []
        for _ in range(5):
            before = time.monotonic()
            now = ros_time()
            after = time.monotonic()
            readings.append((after - before, now - 0.5 * (before + after)))
        self._offset = min(readings)[1]


def main() -> None:
    """Load the configuration, serve until SIGINT or SIGTERM.

    Exit code 2 for a wrong file or a taken port.
    """
    private = private_parameters(sys.argv[1:])
    names = ("config_dir", "host", "port", "links", "plant", "settings")
    with ends_with("emulator", {ConfigError: WRONG, PortError: WRONG}):
        sys.exit(run(*map(private.get, names)))


def _take(
    programs: Mapping[int, Program], library: Mapping[str, Program], controller: Controller
) -> None:
    """Let the controller have other programs."""
    controller.take_programs(programs, library)


def run(
    config_dir: str | None,
    host: str | None,
    port: str | None,
    links: str | None = None,
    plant: str | None = None,
    settings: str | None = None,
) -> int:
    """Run the stand-in until it is told to end and return the exit code.

    Raises:
        ConfigError: A file or parameter is wrong.
        PortError: The address cannot be listened on.
    """
    directory = Path(config_dir) if config_dir else None
    robot, layout = load_robot(directory), with_panel(load_modbus_map(directory))
    config = load_emulator(robot, directory, plant, settings)
    files = ProgramFiles(robot, directory)
    programs, library = load_library(robot, directory)
    if port is not None and not (port.isdigit() and 1 <= int(port) <= 65535):
        raise ConfigError(f"~port = {port}: allowed is 1..65535")
    if links not in (None, "strict", "desk"):
        raise ConfigError(f"~links = {links}: allowed is strict or desk")
    config = on_a_desk(config) if links == "desk" else config
    address = (host or config.host, int(port or config.port))
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    work = find_palletise(directory)
    if work is not None and config.plant.vacuum_leak:
        # Infinite where the leak is too large: a thousand seconds are as good as never.
        slow_ms = min(1e3 * vacuum_s(config.plant, work.gripper.vacuum_ms * 1e-3), 1e6)
        gripper = msgspec.structs.replace(work.gripper, vacuum_ms=slow_ms)
        work = msgspec.structs.replace(work, gripper=gripper)
    parts = CellParts(work, robot) if work else None
    shown = PartsTruth(parts, work, robot.base_frame) if parts and work else None
    named = plant or chosen_plant()
    truth = GroundTruth(
        robot,
        max(1, round(_GROUND_TRUTH_PERIOD / config.dt)),
        stop,
        shown,
        plant_text(named, config.plant),
    )
    chance = np.random.default_rng(SEED)
    ring = layout.ring_places
    controller = Controller(config, robot, programs, time.time(), parts, chance, ring, library)
    # Where no word says whether PR[1] counts, it counts as it stands.
    controller.source.valid = layout.find("setpoint_valid") is None
    # A generator of its own: how often clients ask must not change what the servo draws.
    answers = AnswerTimes(config.plant.answers, np.random.default_rng(SEED))
    image = RegisterImage(layout, robot, config.plant.payload_kg)
    go_first()
    loop = ServoLoop(controller, config.dt, config.plant.clock.drift_ppm, truth.observe)
    with loop, RobotServer(*address, layout, image, loop, answers, settings=config.settings):
        started = {1: config.rsr_programs[0]} | {
            number: program.name for number, program in sorted(programs.items())
        }
        listed = ", ".join(f"RSR{number} {name}" for number, name in started.items())
        print(
            f"emulator is ready: Modbus TCP on {address[0]}:{address[1]}, "
            f"device {layout.device_id}; "
            f"{listed}; plant {named}: {config.plant.description}",
            flush=True,
        )
        threading.Thread(target=truth.serve, name="ground_truth", daemon=True).start()
        while not stop.wait(0.2) and not loop.ended.is_set():
            try:
                newer = files.newer()
            except ConfigError as error:
                print(f"programs stay as they are: {error}", file=sys.stderr, flush=True)
                continue
            if newer is not None:
                loop.post(partial(_take, *newer))
                names = ", ".join(program.name for _, program in sorted(newer[0].items()))
                print(f"programs were read again: {names}", flush=True)
    if "rospy" in sys.modules:
        sys.modules["rospy"].signal_shutdown("the emulator ends")
    if loop.failure is not None:
        raise loop.failure
    return 0
