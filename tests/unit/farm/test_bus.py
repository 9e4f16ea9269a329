"""Link and desk on a real bus."""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import pytest
from farm.bus_io import BusError, open_client, open_router, wait_for_desk
from farm.desk.alarms import LINK
from farm.desk.command_line_io import app
from farm.desk.commands_io import cells_there, order
from farm.desk.history_io import History, HistoryError, Kept
from farm.desk.intake import Progress
from farm.desk.reading_io import AskingError, ask
from farm.desk.roster import LOST, Row, clock_warning
from farm.link.newest_io import Newest
from farm.wire import (
    Answer,
    CellState,
    Command,
    Configuration,
    Event,
    Events,
    Health,
    Joints,
    Level,
    decode,
    encode,
)
from harness.processes import wait_until
from harness.workspace import ROOT
from msgspec.structs import replace
from scara_ros.journal_files_io import JournalBounds
from typer.testing import CliRunner
from unit.farm.conftest import CELL, Farm, Journal

from bench.synthetic.invented import Invented
from bench.synthetic.running import Practice
from farm import keys

DEADLINE_S = 10.0


def state(sequence: int) -> CellState:
    """Return a state."""
    return CellState(sequence, float(sequence), 7, Level.GOOD, "working")


def test_a_cell_comes_is_shown_and_is_lost(farm: Farm) -> None:
    """Its token tells, before any time-out."""
    session, client = farm.router(), farm.client()
    desk = farm.desk(session)
    link = farm.link(client, Journal())
    link.show(state(1))
    wait_until(lambda: [r.status for r in desk.rows()] == ["working"], DEADLINE_S, "the state")
    link.close()
    wait_until(lambda: desk.rows()[0].status == LOST, DEADLINE_S, "the loss")
    assert time.time() - desk.rows()[0].since < DEADLINE_S


NOT_UTF_8 = b'{"number":2,"time":1,"kind":"\xff"}'
TOO_DEEP = b'{"number":2,"time":1,"kind":"x","body":{"a":' + b"[" * 5000 + b"]" * 5000 + b"}}"


def test_a_lost_cell_whose_clock_was_ahead_is_an_alarm(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The history knows by the cell's own clock when it was there last."""
    from farm.desk import desk_io as module

    monkeypatch.setattr(module, "COMING_S", 0.0)
    with History(farm.folder, 4, 16.0) as history:
        history.write([Kept(CELL, 0, Event(1, time.time() + 3600.0, "audit"))])
    desk = farm.desk(farm.router())
    wait_until(lambda: [row.source for row in desk.alarm_rows()] == [LINK], DEADLINE_S, "the alarm")


class Sample(NamedTuple):
    """A message as the bus gives it."""

    key_expr: str
    payload: bytes


def test_a_message_is_what_its_key_says(farm: Farm, capsys: pytest.CaptureFixture[str]) -> None:
    """Whichever subscription brings it, and whatever it looks like."""
    desk = farm.desk(farm.router())
    event = Event(1, 1.0, "audit", False, "event 1", {})
    desk._on_messages(
        [
            Sample(CELL.key(keys.STATE), encode(state(1))),
            Sample(CELL.key(keys.EVENT), encode(event)),
            Sample(CELL.key(keys.EVENT), encode(state(2))),
            Sample("site/m/a/joints", encode(state(3))),
            Sample("site/other", b"{}"),
            Sample(CELL.key(keys.EVENT), NOT_UTF_8),
            Sample(CELL.key(keys.EVENT), TOO_DEEP),
            Sample(CELL.key(keys.STATE), encode(state(4))),
        ]
    )
    assert desk.counted()[CELL][0] == 2 and desk.progress()[CELL].last == 1
    assert desk.unreadable == 5
    assert "site/m/a/event: Event:" in capsys.readouterr().err


def test_joints_are_sent_only_while_somebody_looks(farm: Farm) -> None:
    """And the desk itself does not look."""
    session, client = farm.router(), farm.client()
    farm.desk(session)
    link = farm.link(client, Journal())
    link.show_joints(Joints(0.0, {}, {}))
    assert farm.watched == []
    got: list[bytes] = []
    looking = session.declare_subscriber(
        CELL.key(keys.JOINTS), lambda sample: got.append(bytes(sample.payload))
    )
    wait_until(lambda: farm.watched == [True], DEADLINE_S, "somebody who looks")
    link.show_joints(Joints(1.0, {"joint_1": 0.5}, {}))
    # The one of before may come late, if the thread that sends was late.
    wait_until(lambda: bool(got) and decode(got[-1], Joints).stamp == 1.0, DEADLINE_S, "the joints")
    assert decode(got[-1], Joints).real == {"joint_1": 0.5}
    looking.undeclare()
    wait_until(lambda: farm.watched == [True, False], DEADLINE_S, "the end of looking")


def test_a_stop_reaches_each_cell_and_is_answered(farm: Farm) -> None:
    """In the name of who asked."""
    session = farm.router()
    names = [keys.CellName("site", "m", name) for name in "abc"]
    for name in names:
        farm.link(farm.client(), Journal(), cell=name)
    wait_until(lambda: cells_there(session, "site", 1.0) == names, DEADLINE_S, "the cells")
    answers = list(order(session, names, "STOP", "ann", "desk_1", 2.0))
    assert {a.cell for a in answers} == set(names)
    assert all(a.answer == Answer(True, "STOP received") for a in answers)
    assert [(c.person, c.desk, c.command) for c in farm.obeyed] == [("ann", "desk_1", "STOP")] * 3
    assert len({c.id for c in farm.obeyed}) == 3


def test_a_stop_of_all_fails_while_somebody_is_lost_or_nobody_knows(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the exit code of the command line; whoever stops one cell asks for no other."""
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(ROOT / "config"))
    monkeypatch.setenv("FARM_KEYS", str(farm.folder.parent / "keys"))

    def say(cell: str) -> tuple[int, str]:
        words = ("stop", cell, "--router-port", str(farm.config.router.port), "--person", "ann")
        done = CliRunner().invoke(app, words)
        return done.exit_code, done.output

    session = farm.router()
    farm.link(farm.client(), Journal())
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), DEADLINE_S, "the cell")
    code, text = say("all")
    assert code == 1 and "STOP received" in text and "who is lost is not known" in text
    with History(farm.folder, 4, 16.0) as history:
        history.write([Kept(keys.CellName("site", "m", "b"), 0, Event(1, 1.0, "audit"))])
    farm.desk(session)
    code, text = say("all")
    assert code == 1 and "STOP m/b: NOT REACHED: Lost" in text and "1 not reached" in text
    code, text = say("a")
    assert code == 0 and text.endswith("1 cells asked, 0 did not accept\n")


def test_a_refused_command_reaches_nothing(farm: Farm) -> None:
    """The answer says why."""
    session = farm.router()
    link = farm.link(farm.client(), Journal())
    link.show(state(1))
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), DEADLINE_S, "the cell")
    (answer,) = order(session, [CELL], "RESUME", "ann", "desk_1", 2.0)
    assert answer.answer is not None and "may only STOP and PAUSE" in answer.answer.text
    late = Command("1", "RESUME", "ann", "d", time.time() - 1.0)
    for data, said in (
        (encode(late), "expired"),
        (b"{", "this is no command"),
        (b"", "no command"),
    ):
        (reply,) = session.get(CELL.key(keys.COMMAND), payload=data, timeout=2.0)
        assert said in decode(bytes(reply.ok.payload), Answer).text
    assert farm.obeyed == []


DIFFERENCES = (-3600.0, -62.0, -2.1, 0.0, 0.06, 2.1, 62.0, 3600.0)


def ahead_of(cell: str) -> float:
    """Return how far the clock of an invented cell is ahead [s]: its name has the number."""
    return DIFFERENCES[int(cell[-3:])]


def test_a_stop_is_taken_by_cells_with_any_clock(farm: Farm) -> None:
    """The desk shows each difference; what may move a cell is refused with it."""
    session = farm.router()
    desk = farm.desk(session)
    for number, ahead in enumerate(DIFFERENCES):
        cells = [Invented(number, time.time() + ahead - 60.0)]
        practice = farm.ends.enter_context(Practice(farm.config, "m", cells, ahead_s=ahead))
        assert practice.join()
        threading.Thread(target=practice.run, args=(5.0, 0.0), daemon=True).start()
    # A token is on its way for some milliseconds when its cell has joined.
    names = wait_until(
        lambda: len(found := cells_there(session, "site", 1.0)) == len(DIFFERENCES) and found,
        DEADLINE_S,
        "all cells",
    )
    for command in ("STOP", "PAUSE"):
        answers = list(order(session, names, command, "ann", "desk_1", 2.0))
        assert [a.text for a in answers if a.answer is None or not a.answer.accepted] == []
        assert len(answers) == len(DIFFERENCES)
    begun = time.monotonic()
    for answered in order(session, names, "RESUME", "ann", "desk_1", 2.0):
        ahead, took = ahead_of(answered.cell.cell), time.monotonic() - begun
        assert answered.answer is not None and not answered.answer.accepted
        # All are asked with one time, one after the other: it is older when the last ones hear it.
        found = re.search(r"desk_1's clock is ([\d.]+) s ", answered.text)
        assert found is None or abs(float(found[1]) - abs(ahead)) < took + 0.06, answered.text
        # A cell whose clock is behind the desk's sees the desk's ahead, and the other way round.
        told = [seen < -0.5 or seen > 2.0 for seen in (ahead, ahead + took)]
        assert (found is not None) in told, answered.text

    def is_known(row: Row) -> bool:
        return row.clock_s == pytest.approx(ahead_of(row.name), abs=0.3)

    # A message that was long on its way makes a clock look behind, until others have come.
    wait_until(lambda: all(is_known(row) for row in desk.rows()), DEADLINE_S, "the clocks")
    for row in desk.rows():
        assert bool(clock_warning(row.clock_s)) == (abs(ahead_of(row.name)) > 0.5)


def test_a_stop_waits_for_no_other_command(farm: Farm) -> None:
    """A cell that hangs in one question answers the next."""
    session, hang = farm.router(), threading.Event()
    farm.ends.callback(hang.set)

    def forward(command: Command) -> Answer:
        if command.command == "PAUSE":
            hang.wait(DEADLINE_S)
        return Answer(True, command.command)

    farm.link(farm.client(), Journal(), forward)
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), DEADLINE_S, "the cell")
    silent: list[object] = []
    waiting = threading.Thread(
        target=lambda: silent.extend(order(session, [CELL], "PAUSE", "ann", "d", 0.5))
    )
    waiting.start()
    (answer,) = order(session, [CELL], "STOP", "ann", "d", 2.0)
    assert answer.answer == Answer(True, "STOP")
    waiting.join()
    assert [a.answer for a in silent] == [None] and "NO ANSWER" in silent[0].text  # type: ignore[attr-defined]


def test_no_fault_of_a_journal_ends_what_the_link_tells(farm: Farm) -> None:
    """Health says so, goes on, and events come when the fault has gone."""
    faults = [ValueError("no number"), OSError(24, "Too many open files")] * 2

    class Faulty(Journal):
        def bounds(self) -> JournalBounds:
            if faults and threading.current_thread().name == "journal":
                raise faults.pop()
            return super().bounds()

    session = farm.router()
    told: list[str] = []
    looking = session.declare_subscriber(
        CELL.key(keys.HEALTH),
        lambda sample: told.append(decode(bytes(sample.payload), Health).journal),
    )
    desk, journal = farm.desk(session), Faulty()
    farm.link(farm.client(), journal)
    wait_until(lambda: not faults and told and not told[-1], DEADLINE_S, "the end of the faults")
    assert {"no number", "[Errno 24] Too many open files"} & set(told)
    journal.add(1)
    wait_until(lambda: CELL in desk.progress(), DEADLINE_S, "the event")
    looking.undeclare()


def test_a_stop_waits_for_no_disk(farm: Farm) -> None:
    """Anybody may have the file of changes read, whose disk may hang."""
    session, hang, reads = farm.router(), threading.Event(), threading.Event()
    farm.ends.callback(hang.set)

    class Hanging:
        @property
        def number(self) -> int:
            reads.set()
            hang.wait(DEADLINE_S)
            return 0

        def shown(self) -> Configuration:
            return Configuration()

    farm.link(farm.client(), Journal(), changes=Hanging())  # type: ignore[arg-type]
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), DEADLINE_S, "the cell")
    examining = threading.Thread(
        target=lambda: list(order(session, [CELL], "EXAMINE", "ann", "d", 0.5))
    )
    examining.start()
    assert reads.wait(DEADLINE_S)
    (answer,) = order(session, [CELL], "STOP", "ann", "d", 2.0)
    assert answer.answer == Answer(True, "STOP received")
    examining.join()


def test_a_desk_that_was_off_catches_up(farm: Farm) -> None:
    """By number, in pieces, over two lives, and nothing twice."""
    journal = Journal()
    journal.add(1300)
    session = farm.router()
    farm.link(farm.client(), journal)
    for more in (40, 7):
        history = History(farm.folder, 4, 16.0)
        from farm.desk.desk_io import Desk

        with history, Desk(session, farm.config, history) as desk:
            journal.add(more)
            done = len(journal.events)
            wait_until(
                lambda done=done, desk=desk: (
                    desk.progress().get(CELL, None) is not None
                    and desk.progress()[CELL].last == done
                ),
                DEADLINE_S,
                "all events",
            )
        journal.add(100)
    found = ask(farm.folder, "SELECT number, body FROM events")
    assert [row[0] for row in found.rows] == list(range(1, 1300 + 40 + 100 + 7 + 1))
    assert found.rows[-1][1] == '{"n": 1447}'


def test_a_power_cut_at_a_cell_loses_and_doubles_nothing(farm: Farm) -> None:
    """Its journal has lost its end, which the desk has, and gives those numbers again."""

    def kept() -> list[tuple[int, int, float]]:
        columns = "era, number, epoch(time)"
        return ask(farm.folder, f"SELECT {columns} FROM events ORDER BY era, number").rows

    journal, expected = Journal(), [(0, n, float(n)) for n in range(1, 301)]
    journal.add(300)
    desk = farm.desk(farm.router())
    # The first time more is written before the desk asks, the second time nothing is.
    for era, has, more in ((1, 298, 6), (2, 302, 0)):
        link = farm.link(farm.client(), journal)
        wait_until(lambda expected=expected: kept() == expected, DEADLINE_S, "all events")
        link.close()
        wait_until(lambda: desk.rows()[0].status == LOST, DEADLINE_S, "the power cut")
        del journal.events[has:]
        for number in range(has + 1, has + more + 1):
            journal.events.append(Event(number, number + 0.5 * era, "audit"))
            expected.append((era, number, number + 0.5 * era))
    farm.link(farm.client(), journal)
    wait_until(lambda: desk.progress()[CELL].era == 2, DEADLINE_S, "the shorter journal")
    journal.events.append(Event(303, 400.0, "audit"))
    expected.append((2, 303, 400.0))
    wait_until(lambda: kept() == expected, DEADLINE_S, "what comes behind it")


@pytest.mark.parametrize("kind", [HistoryError, MemoryError])
def test_a_full_disk_loses_nothing(
    kind: type[Exception], farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What could not be written is asked for again, told and counted once; the desk says so."""
    from farm.desk import desk_io as module

    monkeypatch.setattr(module, "AGAIN_S", 0.2)
    whole = History.write

    class Dropped(Journal):
        def read(self, since: int, limit: int) -> Events:
            return super().read(max(since, 10), limit)

    journal = Dropped()
    session = farm.router()
    farm.link(farm.client(), journal)
    desk = farm.desk(session)

    tries: list[int] = []

    def full(_: History, batch: list[Kept]) -> None:
        if batch:
            tries.append(len(batch))
            raise kind("No space left on device")

    monkeypatch.setattr(History, "write", full)
    journal.add(15)
    wait_until(lambda: len(tries) > 2, DEADLINE_S, "the trouble")
    assert "No space left" in desk.trouble
    journal.add(5)
    numbers = list(range(11, 21))
    monkeypatch.setattr(History, "write", whole)
    wait_until(lambda: not desk.trouble, DEADLINE_S, "the disk")
    wait_until(
        lambda: [r[0] for r in ask(farm.folder, "SELECT number FROM events").rows] == numbers,
        DEADLINE_S,
        "all events",
    )
    assert [event.number for _, event in desk.recent] == numbers
    assert desk.rows()[0].missing == 10


def test_a_full_disk_forgets_no_journal_that_has_to_be_checked() -> None:
    """A cell's link came again, as after a power cut, and what was asked then was not written."""
    from farm.desk.desk_io import Desk

    def full(_: list[Kept]) -> None:
        raise HistoryError("No space left on device")

    desk = object.__new__(Desk)
    desk._config = SimpleNamespace(desk=SimpleNamespace(flush_ms=0.0))  # type: ignore[assignment]
    desk._history = SimpleNamespace(write=full)  # type: ignore[assignment]
    desk._lock, desk._ended, desk._began = threading.Lock(), threading.Event(), time.monotonic()
    desk._written = {CELL: Progress(0, 300, 300.0)}
    desk._progress, desk._queue = {CELL: Progress(1, 302, 302.5)}, []
    desk._ended.set()  # the writer takes one turn
    desk._write()
    assert desk.progress() == {CELL: Progress(0, 300, 300.0, checked=False)}


def test_a_link_finds_the_desk_that_comes_later_and_again(farm: Farm) -> None:
    """Whoever is there first waits; a desk that was restarted is found."""
    found: list[object] = []
    ended = threading.Event()
    waiting = threading.Thread(
        target=lambda: found.append(wait_for_desk(farm.config.router, 1000.0, ended))
    )
    waiting.start()
    router = farm.router()
    waiting.join(DEADLINE_S)
    session = found[0]
    farm.link(session, Journal())  # type: ignore[arg-type]
    wait_until(lambda: bool(cells_there(router, "site", 1.0)), DEADLINE_S, "the cell")
    router.close()
    again = farm.router()
    wait_until(lambda: bool(cells_there(again, "site", 1.0)), DEADLINE_S, "the cell again")
    farm.ends.callback(session.close)  # type: ignore[attr-defined]


def test_a_second_desk_is_refused_with_what_to_do(farm: Farm) -> None:
    """Neither port nor folder is taken by two."""
    farm.router()
    with pytest.raises(BusError, match="does another desk run here"):
        open_router(farm.config.router, 1000.0)
    with History(farm.folder, 4, 16.0):
        from farm.desk.history_io import HistoryError

        with pytest.raises(HistoryError, match="another desk keeps its history there"):
            History(farm.folder, 4, 16.0)


def test_the_network_is_refused(farm: Farm) -> None:
    """Before anything is opened."""
    everywhere = replace(farm.config.router, host="0.0.0.0")
    for begin in (lambda: open_router(everywhere, 1000.0), lambda: open_client(everywhere, 1e3, 1)):
        with pytest.raises(BusError, match="only this machine"):
            begin()
    with pytest.raises(BusError, match="no desk answers"):
        open_client(farm.config.router, 1000.0, 0.1)


def test_who_puts_never_waits() -> None:
    """Nobody takes, and each name keeps its newest value."""
    newest: Newest[int] = Newest()
    for value in range(1000):
        newest.put("a", value)
    newest.put("b", 1)
    assert newest.take(0.0) == {"a": 999, "b": 1} and newest.replaced == 999
    assert newest.take(0.0) == {}


@pytest.mark.parametrize(
    "statement",
    [
        "DROP VIEW events",
        "COPY events TO 'x.csv'",
        "SELECT 1; SELECT 2",
        "INSTALL httpfs",
        "SELECT * FROM read_csv('/etc/passwd')",
        "SELECT * FROM '/etc/passwd'",
        "SET enable_external_access = true",
        "SELECT nothing FROM events",
        "",
    ],
)
def test_sql_only_reads_the_history(statement: str, tmp_path: Path) -> None:
    """Whatever else is asked for is refused with a reason, and changes nothing."""
    with pytest.raises(AskingError):
        ask(tmp_path, statement)
    assert list(tmp_path.iterdir()) == []
