"""The journal node: what the cell says is in its files, whatever happens to it."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from cell_recorder.journal.course_results_io import RESULTS
from cell_recorder.journal.entries import (
    Alarm,
    AnyEntry,
    Audit,
    Cycle,
    Decision,
    ExerciseMarked,
    Start,
    Torn,
)
from cell_recorder.journal.reader_io import read
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from harness.ros import Ros
from std_msgs.msg import UInt64

from scara_msgs.msg import Audit as AuditMessage
from scara_msgs.msg import Decision as DecisionMessage
from scara_msgs.msg import PartEvent, RobotData, TwinControllerState

M = TwinControllerState


class Cell:
    """The rest of a cell, as far as the journal hears it."""

    def __init__(self, ros: Ros) -> None:
        """Start the node and connect to it."""
        self._ros = ros
        self.folder = ros.folder / "runs" / "journal" / ros.namespace[1:]
        self.node = self.start()
        self._decisions = ros.publisher("twin_controller/decisions", DecisionMessage)
        self._audit = ros.publisher("twin_controller/audit", AuditMessage)
        self._parts = ros.publisher("real/part_events", PartEvent)
        self._state = ros.publisher("twin_controller/state", M, subscribers=0)
        self._data = ros.publisher("real/robot_data", RobotData, subscribers=0)

    def start(self) -> Any:
        """Start the node."""
        return self._ros.run("cell_recorder", "journal", f"_directory:={self._ros.folder}/runs")

    def node_pid(self) -> int:
        """Return the process of the node, as its newest start says."""
        return max((e for e in self.entries() if isinstance(e, Start)), key=lambda e: e.number).pid

    def has_started(self, times: int) -> bool:
        """Return whether the journal was started so many times."""
        return len(self.of(Start)) == times

    def decide(self, before: str, after: str, leader: str = "", event: str = "") -> None:
        """Publish a decision."""
        self._decisions.publish(
            mode_before=before, mode_after=after, leader=leader, event=event, why=event, who="Ada"
        )

    def command(self, what: str, who: str = "/page") -> None:
        """Publish an entry of the audit."""
        self._audit.publish(who=who, what=what, success=True, outcome="accepted")

    def entries(self) -> list[AnyEntry]:
        """Return what the journal holds; its numbers have no gap."""
        bad: list[str] = []
        found = list(read(self.folder, 0, bad.append))
        assert not bad and [each.number for each in found] == list(range(1, len(found) + 1))
        return found

    def of(self, kind: type[Any]) -> list[Any]:
        """Return the entries of a kind."""
        return [entry for entry in self.entries() if isinstance(entry, kind)]

    def wait_for(self, condition: Callable[[], Any], what: str) -> None:
        """Wait until something is in the journal."""
        self._ros.wait_until(condition, 20.0, what)

    def move(self) -> None:
        """Let the real robot run a program that places a part, the tools 0.7 mm apart."""
        self.decide(M.IDLE, M.REAL_LEADS, "real", "the real robot moved first")
        self.wait_for(lambda: self.of(Decision), "the decision in the journal")
        for publisher in (self._state, self._data):
            self.wait_for(publisher.get_num_connections, "a journal that listens to motion")
        self._parts.publish(kind=PartEvent.PLACED, part="part_1")
        rounds = iter(range(11))

        def said() -> bool:
            # As a cell does, again and again: topics overtake each other.
            self._data.publish(program="PALLET line 3 running", running=True)
            for deviation in (0.2, 0.7, 0.4):
                self._state.publish(mode=M.REAL_LEADS, leader="real", deviation_mm=deviation)
            return next(rounds) == 10

        self.wait_for(said, "some time of motion")


def test_what_the_cell_says_is_in_the_journal(ros: Ros) -> None:
    """Decisions, commands, one alarm for repeats, a cycle, a result; nothing of another cell."""
    cell = Cell(ros)
    numbers = ros.collect("journal/number", UInt64)
    alarms = ros.publisher("/diagnostics", DiagnosticArray)
    cell.command("SPEED 50")
    cell.command("stop the twin", who="twin_controller")  # the decision says it
    cell.move()
    for _ in range(5):
        # This process has no namespace: it is another cell's.
        alarms.publish(status=[DiagnosticStatus(level=2, name="other", message="down")])
    cell.wait_for(lambda: cell.of(Decision), "a decision")
    ros.wait_until(lambda: cell.folder.exists(), 5.0, "a folder")
    cell.decide(M.REAL_LEADS, M.STOPPED, event="STOP by the operator")
    cell.wait_for(lambda: cell.of(Cycle), "a cycle")
    (start,) = cell.of(Start)
    assert (start.robot, start.plant, start.cell) == ("fanuc_sr6ia", "ideal", ros.namespace[1:])
    assert [entry.what for entry in cell.of(Audit)] == ["SPEED 50"]
    assert [entry.mode_after for entry in cell.of(Decision)] == [M.REAL_LEADS, M.STOPPED]
    (cycle,) = cell.of(Cycle)
    assert (cycle.program, cycle.leader, cycle.outcome) == ("PALLET", "real", "stopped")
    assert (cycle.parts_placed, cycle.worst_error_mm, cycle.who) == (1, 0.7, "Ada")
    assert not [alarm for alarm in cell.of(Alarm) if alarm.source == "other"]
    line = {"number": 1, "time": 1.5, "learner": "ada", "exercise": "e06", "title": "6. Stop"}
    line |= {"passed": True, "reason": "", "evidence": "", "digest": "", "signature": "s"}
    (cell.folder.parents[1] / "course").mkdir()
    (cell.folder.parents[1] / RESULTS).write_text(json.dumps(line) + "\n")
    cell.wait_for(lambda: cell.of(ExerciseMarked), "what a learner has passed")
    assert [each.learner for each in cell.of(ExerciseMarked)] == ["ada"]
    newest = cell.entries()[-1].number
    ros.wait_until(lambda: numbers and numbers[-1].data == newest, 5.0, "the newest number")
    told = ros.shell(
        "rosrun", "cell_recorder", "why", "--stops", "--runs", f"{ros.folder}/runs", "--since", "1h"
    )
    assert "STOPPED  STOP by the operator  (asked by Ada)" in told, told


def test_killed_journal_goes_on_without_a_gap(ros: Ros) -> None:
    """A kill -9 in the middle of a flood: what was read before is there, a torn line is told."""
    cell = Cell(ros)
    for life in (1, 2):
        sent = iter(range(100_000))

        def flooded(life: int = life, sent: Iterator[int] = sent) -> bool:
            for _ in range(100):
                cell.command(f"life {life} entry {next(sent)}")
            return len([e for e in cell.of(Audit) if e.what.startswith(f"life {life}")]) >= 100

        cell.wait_for(flooded, "a part of the flood")
        before = cell.entries()
        newest = max(cell.folder.glob("*.jsonl"))
        os.kill(cell.node_pid(), signal.SIGKILL)
        cell.node.wait(10.0)
        with newest.open("ab") as stream:
            stream.write(b'{"kind":"audit","number":')  # what a power cut leaves
        ros.stage.processes.remove(cell.node)
        cell.node = cell.start()
        cell.wait_for(partial(cell.has_started, life + 1), "the next start")
        assert cell.entries()[: len(before)] == before
        torn = cell.of(Torn)[-1]
        assert torn.text.endswith('{"kind":"audit","number":') and torn.size >= 25
        kept = (cell.folder / torn.kept).read_bytes()
        assert kept.endswith(b'{"kind":"audit","number":\n')
    assert len(cell.of(Torn)) == 2


def test_folder_that_cannot_be_written_is_an_error_and_nothing_ends(ros: Ros) -> None:
    """It is on /diagnostics with the reason; when it can be written, what waited is."""
    way = Path(ros.folder / "runs" / "journal")
    way.parent.mkdir()
    way.write_text("a file in the way")
    cell = Cell(ros)
    cell.command("while it cannot be written")
    found: list[DiagnosticStatus] = []

    def told() -> bool:
        found[:] = [
            status
            for array in said
            for status in array.status
            if status.name == ros.name("journal") and status.level == 2
        ]
        return bool(found)

    said = ros.collect("/diagnostics", DiagnosticArray)
    ros.wait_until(told, 10.0, "an error on /diagnostics")
    assert "not written: " in found[0].message and "entries wait" in found[0].message
    way.unlink()
    cell.wait_for(lambda: cell.of(Audit), "what waited")
    assert cell.of(Start)
