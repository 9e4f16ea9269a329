"""Node ``health_watch``: says which joint of the robot wears, by its daily cycles.

Parameters: ``~config_dir``; ``~directory`` (the runs folder, as the journal's); ``~every_s`` (3600:
no cycle is taken that begins sooner after the one before); ``~week_s`` (604800: how long the first
week is). It keeps the first week below ``health/<cell>/`` there; who removes that file begins anew.

Subscribes to ``twin_controller/decisions``; while a cycle is taken to ``real/joint_states``,
``twin/joint_states``, ``twin_controller/state`` and ``real/robot_data``. Publishes
``/diagnostics``: WARN with what wears and where to look. It commands nothing. On a robot whose map
has no ``motor_torque`` it says so and ends.
"""

from __future__ import annotations

import os
import threading
import time
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rospy
from scara_config import load_robot
from scara_config.loader import load_keys
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import DEFAULT_PLANT, chosen_plant, locate
from scara_config.quantities import is_this_machine
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.names import cell_of, own_program
from scara_ros.pacing import Pace
from scara_ros.process.memory_io import give_back, keep_for_good
from scara_ros.shell.program_io import runs_folder
from scara_ros.shell.ros_node import starting
from scara_ros.starting.registration_node import wait_for_end
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import JointState

from scara_msgs.msg import Decision, RobotData, TwinControllerState
from twin_analysis.health.live.taking import HeardCycle, Taking
from twin_analysis.health.live.telling import WearStatus, diagnose, worst_of
from twin_analysis.health.live.weeks import judged, kept_signs, shape_of, with_cycle
from twin_analysis.health.live.weeks_io import read_weeks, write_weeks
from twin_analysis.health.readings import JointReadings, cycle_of
from twin_analysis.health.signs import TorqueError, signs_of
from twin_analysis.health.trend import JointFacts, facts_of

FOLDER = "health"
"""In the runs folder."""
EVERY_S, WEEK_S = 3600.0, 7 * 24 * 3600.0
NICENESS = 10
"""Below everything that moves the pair; our choice, as for the judge."""
QUEUE = 1000  # our choice: messages that rospy may hold per topic
REAL, TWIN, STATE = "real/joint_states", "twin/joint_states", "twin_controller/state"


class HealthWatch:
    """Takes cycles as they end; a thread of its own looks at each."""

    def __init__(
        self, joints: JointFacts, file: Path, every_s: float, week_s: float, longest_gap: float
    ) -> None:
        """Read what is kept, then subscribe."""
        self._joints, self._file, self._week_s = joints, file, week_s
        self._longest_gap = longest_gap
        self._lock = threading.Lock()
        self._taking = Taking(every_s)
        self._taken: HeardCycle | None = None
        self._watched = WearStatus()
        self._said: set[str] = set()
        # What was heard while a cycle is taken, as it came: who looks at it takes it apart.
        self._heard: dict[str, list[bytes]] = {}
        self._listening: list[rospy.Subscriber] = []
        self._woken = threading.Event()
        self._diagnostics = Diagnostics("health_watch")
        self._guarded(self._remember)
        rospy.Subscriber(
            *("twin_controller/decisions", Decision, self._decided),
            queue_size=QUEUE,
            tcp_nodelay=True,
        )
        threading.Thread(target=self._watch, name="watch", daemon=True).start()

    def _decided(self, said: Decision) -> None:
        with self._lock:
            self._end(self._taking.decided(time.time(), said.mode_after, said.leader))
        self._woken.set()

    def _robot_data(self, said: RobotData) -> None:
        program, runs = own_program(said.control_type, said.program, said.running)
        with self._lock:
            self._end(self._taking.program(time.time(), program, runs))

    def _end(self, taken: HeardCycle | None) -> None:
        """Take that a cycle has ended; the caller has the lock."""
        if taken is not None:
            self._taken = taken
            self._woken.set()

    def _watch(self) -> None:
        """Begin and end listening, let a cycle be looked at, tell once a second."""
        pace = Pace(PERIOD_S)
        with until_shutdown():
            while not rospy.is_shutdown():
                self._woken.wait(PERIOD_S)
                self._woken.clear()
                now = time.time()
                with self._lock:
                    self._end(self._taking.look(now))
                    taken, self._taken = self._taken, None
                    listens = self._taking.listens(now) and taken is None
                heard = self._heard
                self._listen(listens)
                if taken is not None:
                    self._woken.set()  # to listen again at once, where that is due
                    look = partial(self._guarded, partial(self._look, taken, heard))
                    threading.Thread(target=look, name="look", daemon=True).start()
                found = diagnose(self._watched, f"{rospy.get_name()}: wear", time.time())
                if pace.is_due(time.monotonic(), (found.level, found.message, self._watched.taken)):
                    self._diagnostics.publish(found)

    def _listen(self, wanted: bool) -> None:
        """Hear the joints while a cycle is taken: nothing of it is for any other time."""
        if wanted and not self._listening:
            heard: dict[str, list[bytes]] = {REAL: [], TWIN: [], STATE: []}
            self._heard = heard
            options = {"queue_size": QUEUE, "tcp_nodelay": True}

            def keep(message: rospy.AnyMsg, into: list[bytes]) -> None:
                into.append(message._buff)

            self._listening = [
                rospy.Subscriber(name, rospy.AnyMsg, partial(keep, into=heard[name]), **options)
                for name in heard
            ]
            self._listening.append(
                rospy.Subscriber("real/robot_data", RobotData, self._robot_data, **options)
            )
        elif not wanted and self._listening:
            for subscriber in self._listening:
                subscriber.unregister()
            self._listening, self._heard = [], {}

    def _guarded(self, what: Callable[[], str]) -> None:
        """Do something that returns a note; a fault in it is told, and stops nothing."""
        try:
            note, problem = what(), ""
        except OSError as error:
            note = ""
            problem = f"the first week is not kept: {error}: make room, or give this user the file"
        except Exception as error:
            rospy.logerr("health_watch: a cycle is not looked at:\n%s", traceback.format_exc())
            note, problem = "", f"a cycle is not looked at: {type(error).__name__}: {error}"
        told = self._watched.told
        self._watched = WearStatus(told, self._watched.taken, note, problem)
        self._log(rospy.loginfo, *(each.left_out for each in told))
        worst = worst_of(told)
        wears = "" if worst is None or worst.finding is None else worst.finding.text
        self._log(rospy.logwarn, problem, wears)
        # The verdict is told at once, not up to a second later.
        self._woken.set()

    def _log(self, say: Any, *lines: str) -> None:
        """Say lines that were not said before."""
        for line in lines:
            if line and line not in self._said:
                self._said.add(line)
                say("health_watch: %s", line)

    def _remember(self) -> str:
        """Judge what was kept."""
        weeks = read_weeks(self._file)
        self._watched = WearStatus(tuple(judged(kind, self._joints) for kind in weeks.kinds))
        return ""

    def _look(self, taken: HeardCycle, heard: dict[str, list[bytes]]) -> str:
        """Look at a cycle, keep it, and judge; return why it says nothing, or an empty text."""
        try:
            states = [TwinControllerState().deserialize(raw) for raw in heard[STATE]]
            grips = [(said.header.stamp.to_sec(), said.real_gripper) for said in states]
            sides = joints_of(heard[REAL]), joints_of(heard[TWIN])
            names, cycle = cycle_of(*sides, self._longest_gap, grips)
            signs = signs_of(cycle, self._joints.of(names).fastest)
        except TorqueError as error:
            return str(error)
        weeks, told = with_cycle(
            read_weeks(self._file),
            self._joints,
            shape_of(taken, self._joints, names, cycle),
            kept_signs(time.time(), signs),
            self._week_s,
        )
        # By identity: what has just been judged is not judged twice.
        others = [each for each in weeks.kinds if each is not told.kind]
        found = (*(judged(kind, self._joints) for kind in others), told)
        self._watched = WearStatus(found, self._watched.taken + 1)
        write_weeks(self._file, weeks)
        give_back()
        return ""


def joints_of(raw: list[bytes]) -> JointReadings:
    """Return what JointStates say, as they came."""
    said = [JointState().deserialize(each) for each in raw]
    has_efforts = all(len(each.effort) == len(each.name) for each in said)
    return JointReadings(
        tuple(said[0].name) if said else (),
        np.array([each.header.stamp.to_sec() for each in said]),
        np.array([each.position for each in said]),
        np.array([each.effort if has_efforts else () for each in said]),
    )


def week_file(robot: str, plant: str, host: str) -> str:
    """Return the name of the file with a robot's first week.

    Another address is another robot, and so is a stand-in that behaves in another way.

    Args:
        robot: Name of its profile.
        plant: How a stand-in behaves; it counts on this machine alone.
        host: Where the twin controller looks for the robot.
    """
    which = "" if plant == DEFAULT_PLANT else f"_{plant}"
    if not is_this_machine(host):
        which = f"_{host}"
    return f"{robot}{which}.json".replace(":", "_")


def main() -> None:
    """Watch until shut down."""
    with starting("health_watch", ValueError) as folder:
        robot, layout = load_robot(folder), load_modbus_map(folder)
        (host,) = load_keys(locate("twin_controller.yaml", folder), {"real.host": str})
        (gap,) = load_keys(locate("experiments.yaml", folder), {"metrics.longest_gap_s": float})
        every_s = float(rospy.get_param("~every_s", EVERY_S))
        week_s = float(rospy.get_param("~week_s", WEEK_S))
    if layout.find("motor_torque") is None:
        rospy.loginfo("wear is not watched: the robot's map has no motor_torque")
        return
    os.nice(NICENESS)
    runs = runs_folder(rospy.get_param("~directory", "")).resolve()
    name = week_file(robot.name, chosen_plant(), host)
    file = runs / FOLDER / cell_of(rospy.get_namespace()) / name
    HealthWatch(facts_of(robot), file, every_s, week_s, gap)
    rospy.loginfo("health_watch is ready")
    keep_for_good()
    wait_for_end()
