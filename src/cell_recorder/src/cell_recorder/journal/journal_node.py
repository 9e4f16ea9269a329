"""Node ``journal``: writes down what happens in the cell, from its start to its end.

Parameters: ``~config_dir`` (journal.yaml, and ``real.host`` of twin_controller.yaml),
``~directory`` (the runs folder; default: runs of the environment's CELL_ROOT, else of the working
folder). It writes below ``journal/<cell>/`` there, one file a day. Subscribes to decisions, audit,
part events and what became of judged motions, to ``/diagnostics`` of its own cell, and while
something moves to ``twin_controller/state`` and ``real/robot_data``; of what learners have passed
it reads the course's file. Publishes ``journal/number``, the number of the newest entry, and
``/diagnostics``. What is written: docs/interfaces.md. ``rosrun cell_recorder why`` reads it.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from scara_config import load_robot
from scara_config.loader import load_keys
from scara_config.profile import chosen_plant, locate
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.names import cell_of, own_program
from scara_ros.pacing import Pace
from scara_ros.process.memory_io import keep_for_good
from scara_ros.shell.program_io import runs_folder
from scara_ros.shell.ros_node import is_own, starting
from scara_ros.starting.registration_node import wait_for_end
from scara_ros.starting.starting_node import until_shutdown
from std_msgs.msg import UInt64

from cell_recorder.config import JournalSettings, load_journal
from cell_recorder.journal.alarms import ActiveAlarms
from cell_recorder.journal.course_results_io import CourseResults
from cell_recorder.journal.cycles import REAL, TWIN, Cycles
from cell_recorder.journal.day_files_io import DayFiles
from cell_recorder.journal.entries import (
    Audit,
    Decision,
    Entry,
    Start,
    outcome_entry,
    start_entry,
)
from cell_recorder.journal.health import diagnose, lost_at_close
from cell_recorder.journal.reader_io import JOURNAL
from cell_recorder.journal.repeats import Repeats
from cell_recorder.journal.writer_io import JournalWriter
from scara_msgs.msg import Audit as AuditMessage
from scara_msgs.msg import Decision as DecisionMessage
from scara_msgs.msg import MotionOutcome, PartEvent, RobotData, TwinControllerState

OWN_ENTRIES = "twin_controller"
"""Who is behind the audit's entries of decisions: the decisions themselves are in the journal."""
NUMBER_PERIOD_S = 0.1  # our choice: listeners to the number hear of new entries so soon
QUEUE = 1000  # our choice: messages that rospy may hold per topic


class JournalKeeper:
    """Makes entries of what the cell says; the writer has a thread of its own."""

    def __init__(
        self, settings: JournalSettings, folder: Path, start: Start, course: CourseResults
    ) -> None:
        """Advertise and subscribe; write to ``folder``, ``start`` first."""
        self._lock = threading.Lock()
        self._alarms = ActiveAlarms(settings.alarm_hold_s, settings.silent_s)
        self._cycles = Cycles(settings.cycle_rest_s)
        self._repeats = Repeats(settings.repeat_entries, settings.repeat_s)
        self._woken = threading.Event()
        self._number = rospy.Publisher(
            "journal/number", UInt64, queue_size=2, latch=True, tcp_nodelay=True
        )
        self._diagnostics = Diagnostics("journal")
        files = DayFiles(folder, cell_of(rospy.get_namespace()), settings)
        self._writer = JournalWriter(files, settings, lambda number: self._woken.set())
        self._writer.put(start)
        self._course = course
        self._moving: list[rospy.Subscriber] = []
        # What moves now is not known before the first state.
        self._knows_state = False
        self._hear("twin_controller/decisions", DecisionMessage, self._decision)
        self._hear("twin_controller/audit", AuditMessage, self._audit)
        self._hear("what_if/outcomes", MotionOutcome, self._outcome)
        self._hear("real/part_events", PartEvent, lambda said: self._part(REAL, said))
        self._hear("twin/part_events", PartEvent, lambda said: self._part(TWIN, said))
        self._hear("/diagnostics", DiagnosticArray, self._diagnosed)
        threading.Thread(target=self._watch, name="watch", daemon=True).start()

    def close(self) -> None:
        """Write what is known and let go of the files."""
        with self._lock:
            self._put(self._cycles.close(time.time()))
            for entry in self._repeats.close():
                self._writer.put(entry)
        if lost := lost_at_close(self._writer.close()):
            rospy.logerr("journal: %s", lost)

    def _hear(self, name: str, kind: type[Any], callback: Any) -> rospy.Subscriber:
        return rospy.Subscriber(name, kind, callback, queue_size=QUEUE, tcp_nodelay=True)

    def _put(self, entries: list[Any]) -> None:
        """Leave entries with the writer, unless they are the same again; the caller has the lock.

        Those without a time get the present one there.
        """
        now = time.time()
        for entry in entries:
            assert isinstance(entry, Entry)
            for kept in self._repeats.take(now, entry):
                self._writer.put(kept)

    def _decision(self, said: DecisionMessage) -> None:
        """Write a decision down; it may begin or end a cycle, which is written before it."""
        entry = Decision(
            time=time.time(),
            seq=said.seq,
            mode_before=said.mode_before,
            event=said.event,
            mode_after=said.mode_after,
            leader=said.leader,
            actions=list(said.actions),
            why=said.why,
            who=said.who,
        )
        with self._lock:
            self._knows_state = True
            ended = self._cycles.decided(
                entry.time, said.mode_after, said.leader, said.why, said.who
            )
            self._put([entry, *ended])
        self._woken.set()

    def _audit(self, said: AuditMessage) -> None:
        """Write down who commanded what."""
        if said.who != OWN_ENTRIES:
            entry = Audit(who=said.who, what=said.what, success=said.success, outcome=said.outcome)
            with self._lock:
                self._put([entry])

    def _outcome(self, said: MotionOutcome) -> None:
        """Write down what became of a motion beside what was predicted."""
        with self._lock:
            self._put([outcome_entry(said)])

    def _part(self, side: str, said: PartEvent) -> None:
        with self._lock:
            self._cycles.part(side, said.kind)

    def _diagnosed(self, said: DiagnosticArray) -> None:
        """Look for alarms in what a node of this cell says."""
        if not is_own(said):
            return
        now, node = time.time(), said._connection_header.get("callerid", "")
        with self._lock:
            self._alarms.heard(now, node)
            for status in said.status:
                # A subscriber gets a level as a byte string of one sign.
                level = status.level if isinstance(status.level, int) else ord(status.level)
                self._put(self._alarms.say(now, node, status.name, level, status.message))

    def _state(self, said: TwinControllerState) -> None:
        """Measure a cycle; the first state says whether one is under way."""
        with self._lock:
            if not self._knows_state:
                self._knows_state = True
                self._put(self._cycles.decided(time.time(), said.mode, said.leader, said.why))
            self._cycles.measured(said.deviation_mm, said.follower_lag)

    def _robot_data(self, said: RobotData) -> None:
        program, runs = own_program(said.control_type, said.program, said.running)
        with self._lock:
            self._put(self._cycles.program(time.time(), program, runs))

    def _watch(self) -> None:
        """Look at what time brings, tell the newest number, listen to motion while there is any."""
        pace, told, problem = Pace(PERIOD_S), -1, ""
        with until_shutdown():
            while not rospy.is_shutdown():
                self._woken.wait(PERIOD_S)
                self._woken.clear()
                now = time.time()
                with self._lock:
                    self._put([*self._alarms.look(now), *self._cycles.look(now)])
                    for entry in self._repeats.look(now):
                        self._writer.put(entry)
                    active = self._alarms.active
                    moves = self._cycles.is_open or not self._knows_state
                self._listen_to_motion(moves)
                status = self._writer.status
                for result in self._course.look(not status.waiting):
                    self._writer.put(result)
                if status.number != told:
                    told = status.number
                    self._number.publish(told)
                if status.problem != problem:
                    problem = status.problem
                    say = rospy.logerr if problem else rospy.loginfo
                    say("journal: %s", f"not written: {problem}" if problem else "written again")
                found = diagnose(status, active, rospy.resolve_name("journal"))
                if pace.is_due(time.monotonic(), (found.level, status.problem)):
                    self._diagnostics.publish(found)
                time.sleep(NUMBER_PERIOD_S)  # the most that a flood of entries makes of this

    def _listen_to_motion(self, moves: bool) -> None:
        """Hear state and program of the robot while a cycle is open: nothing of it is for rest."""
        if moves and not self._moving:
            self._moving = [
                self._hear("twin_controller/state", TwinControllerState, self._state),
                self._hear("real/robot_data", RobotData, self._robot_data),
            ]
        elif not moves and self._moving:
            for subscriber in self._moving:
                subscriber.unregister()
            self._moving = []


def main() -> None:
    """Write until shut down."""
    with starting("journal") as folder:
        settings = load_journal(folder)
        (host,) = load_keys(locate("twin_controller.yaml", folder), {"real.host": str})
        start = start_entry(load_robot(folder).name, chosen_plant(), host, os.getpid())
    runs = runs_folder(rospy.get_param("~directory", "")).resolve()
    cell = cell_of(rospy.get_namespace())
    journal = JournalKeeper(settings, runs / JOURNAL / cell, start, CourseResults(runs, cell))
    rospy.on_shutdown(journal.close)
    rospy.loginfo("journal is ready")
    keep_for_good()
    wait_for_end()
