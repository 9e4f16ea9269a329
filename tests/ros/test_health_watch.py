"""The node health_watch: cycles of a stand-in that wears become an alarm in words, for everybody.

The stand-in moves in virtual time; its readings are published as the twin controller would.
"""

from __future__ import annotations

import signal
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import rospy
from cell_recorder.journal.entries import WARNING, Alarm
from cell_recorder.journal.reader_io import read
from diagnostic_msgs.msg import DiagnosticArray
from fanuc_emulator.plant.config import load_plant
from fanuc_emulator.plant.wear import Wear
from harness.processes import Process
from harness.ros import Ros
from harness.workspace import ROOT
from scara_config import load_robot
from sensor_msgs.msg import JointState
from twin_analysis.health.live.weeks import CycleKind, Weeks
from twin_analysis.health.signs import CycleSignals
from twin_analysis.health.trend import CONFIRMED, LEAST, WINDOW
from twin_analysis.health.virtual_cycles import Condition, run_cycle

from scara_msgs.msg import Decision, RobotData, TwinControllerState

M = TwinControllerState
ROBOT = load_robot(ROOT / "config")
WORN = Wear("friction", 3.0, "joint_2")
AT_ONCE = 10
"""So many readings are published with no pause between them."""
AT_REST = 200
"""And so many behind the cycle, one at a time: a monitor that is late misses none of its motion."""


class WearingCell:
    """The rest of a cell, as far as the monitor hears it; its robot runs a program."""

    def __init__(self, ros: Ros) -> None:
        """Start journal and monitor."""
        self._ros, self.runs = ros, ros.folder / "runs"
        ros.run("cell_recorder", "journal", f"_directory:={self.runs}")
        self.node = self.start()
        self._decisions = ros.publisher("twin_controller/decisions", Decision, subscribers=2)

    def _topics(self) -> tuple[Any, Any, Any]:
        """Return the joints of each side and the robot's data, once journal and monitor listen.

        New for each cycle: a publisher counts whoever has gone as a listener until it has written
        to it in vain, and a cycle whose beginning nobody heard is another one.
        """
        return (
            self._ros.publisher("real/joint_states", JointState),
            self._ros.publisher("twin/joint_states", JointState),
            self._ros.publisher("real/robot_data", RobotData, subscribers=2),
        )

    def start(self) -> Process:
        """Start the monitor; each cycle is taken, and the first week has no length."""
        options = (f"_directory:={self.runs}", "_every_s:=0", "_week_s:=0")
        return self._ros.run("twin_analysis", "health_watch", *options)

    def kill(self) -> None:
        """End the monitor without a farewell, and start it again."""
        self.node.signal(signal.SIGKILL)
        self.node.wait(5.0)
        self.node = self.start()
        self._ros.wait_until(lambda: "is ready" in self.node.output, 20.0, "a monitor")

    def run_program(self, cycle: CycleSignals) -> None:
        """Publish a cycle from its first motion to its end; return once it is kept."""
        before = self.cycles()
        self._decisions.publish(mode_before=M.IDLE, mode_after=M.REAL_LEADS, leader="real")
        real, twin, data = topics = self._topics()
        names, begun = [joint.name for joint in ROBOT.joints], time.time()
        efforts = np.array([1e-2 * joint.effort for joint in ROBOT.joints])
        dt = cycle.times[1] - cycle.times[0]
        rest = cycle.times[-1] + dt * np.arange(1, AT_REST + 1)
        for k, at in [*enumerate(cycle.times), *((-1, at) for at in rest)]:
            for topic, q, effort in (
                (real, cycle.measured[k], cycle.torques[k] * efforts),
                (twin, cycle.wanted[k], ()),
            ):
                said = JointState(name=names, position=list(q), effort=list(effort))
                said.header.stamp = rospy.Time.from_sec(begun + at)
                topic.publish(said)
            if k < 0 or k % AT_ONCE == 0:
                # As a cell does, again and again: topics overtake each other.
                data.publish(program="FLICK line 1 running", running=True)
                time.sleep(0.005)
        data.publish(program="", running=False)
        self._decisions.publish(mode_before=M.REAL_LEADS, mode_after=M.IDLE)
        self._ros.wait_until(lambda: self.cycles() > before, 20.0, "a cycle that is kept")
        for topic in topics:
            topic.unregister()

    @property
    def file(self) -> Path | None:
        """Where the first week is kept, once it is."""
        return next(self.runs.glob("health/*/*.json"), None)

    def cycles(self) -> int:
        """Return how many cycles are kept, of the one kind that there is."""
        if self.file is None:
            return 0
        (kind,) = msgspec.json.decode(self.file.read_bytes(), type=Weeks).kinds
        return len(kind.week) + len(kind.recent)

    def alarms(self) -> list[Alarm]:
        """Return the monitor's alarms in the journal."""
        entries = [entry for cell in (self.runs / "journal").iterdir() for entry in read(cell)]
        return [
            entry
            for entry in entries
            if isinstance(entry, Alarm) and entry.source.endswith("/health_watch: wear")
        ]


def test_a_stand_in_that_rubs_is_told_after_the_monitor_was_killed(ros: Ros) -> None:
    """joint_2 by name, in /diagnostics and the journal, once two cycles in a row have said so.

    The first week outlives a kill. It is one healthy cycle, as often as a week needs it.
    """
    plant, random = load_plant(ROBOT, ROOT / "config", "field"), np.random.default_rng(1)
    cell, diagnosed = WearingCell(ros), ros.collect("/diagnostics", DiagnosticArray)
    cell.run_program(run_cycle(ROBOT, plant, Condition(), random))
    assert cell.file is not None
    (kind,) = msgspec.json.decode(cell.file.read_bytes(), type=Weeks).kinds
    (first,) = kind.week
    kind = CycleKind(kind.shape, [first] * LEAST, complete=True, recent=[first] * (WINDOW - 1))
    cell.file.write_bytes(msgspec.json.encode(Weeks([kind])))
    cell.kill()
    for _ in range(CONFIRMED):
        assert not cell.alarms()
        cell.run_program(run_cycle(ROBOT, plant, Condition(wears=(WORN,)), random))
    ros.wait_until(cell.alarms, 20.0, f"an alarm in the journal:\n{cell.node.output}")
    (alarm,) = cell.alarms()
    assert alarm.level == WARNING and alarm.text.startswith("joint_2 needs")
    assert "likely friction: look at its grease" in alarm.text
    texts = {status.message for array in list(diagnosed) for status in array.status}
    assert alarm.text in texts
