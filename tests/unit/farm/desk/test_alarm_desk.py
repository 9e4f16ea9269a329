"""What people did to alarms is on the disk before it counts."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from farm.desk import alarm_desk_io
from farm.desk.alarm_desk_io import ACKNOWLEDGE, LINKS, MARKS, SHELVE, AlarmDesk, MarksAsked
from farm.desk.alarms import AlarmRow, AlarmStatus, SeenAlarm
from farm.desk.command_line_io import app
from farm.desk.history_io import History, Kept
from farm.desk.lines import alarms_io  # noqa: F401  (adds the words)
from farm.desk.reading_io import of_kinds
from farm.keys import ALARMS, MARK, CellName
from farm.wire import Answer, Event, decode, encode
from harness.processes import wait_until
from typer.testing import CliRunner
from unit.farm.conftest import CELL, Farm, Journal

BODY = {"source": "fan", "level": "error", "active": True, "text": "stands"}
RAISED = Event(1, 5.0, "alarm", False, "fan: stands", BODY)
NAME = "m/a: fan"
SEEN = SeenAlarm(NAME, 5.0, "error")
DEADLINE_S = 10.0


def test_a_desk_that_was_restarted_knows_who_has_looked(tmp_path: Path) -> None:
    """Alarms from the history, marks from their file; a torn mark asks again."""
    file = tmp_path / MARKS
    with History(tmp_path / "events", 4, 16.0) as history:
        history.write([Kept(CELL, 0, RAISED), Kept(CELL, 0, Event(2, 6.0, "audit"))])
        first = AlarmDesk(file, of_kinds(history.folder, ("alarm", "start")))
        assert [row.status for row in first.rows()] == [AlarmStatus.RAISED]
        assert first.mark(MarksAsked(ACKNOWLEDGE, [SEEN]), "ann@desk").accepted
        assert not first.mark(MarksAsked(ACKNOWLEDGE, [SEEN]), "ben@desk").accepted
        assert not first.mark(MarksAsked("forget", [SEEN]), "ben@desk").accepted
        with file.open("ab") as stream:
            stream.write(b'{"id": "\xff"}\n{"id": "m/')
        again = AlarmDesk(file, of_kinds(history.folder, ("alarm", "start")))
        (row,) = again.rows()
        assert (row.status, row.person) == (AlarmStatus.ACKNOWLEDGED, "ann@desk")
        answer = again.mark(MarksAsked(SHELVE, [SEEN], 60.0, "a spare part comes"), "ben@desk")
        assert "shelved by ben@desk until" in answer.text
        third = AlarmDesk(file, of_kinds(history.folder, ("alarm", "start")))
        assert [row.status for row in third.rows()] == [AlarmStatus.SHELVED]


def test_a_full_disk_changes_nothing(tmp_path: Path) -> None:
    """Who has looked is not kept, so nobody has."""
    desk = AlarmDesk(tmp_path / "no_folder" / MARKS, [Kept(CELL, 0, RAISED)])
    answer = desk.mark(MarksAsked(ACKNOWLEDGE, [SEEN]), "ann@desk")
    assert not answer.accepted and "nothing was changed" in answer.text
    assert [row.status for row in desk.rows()] == [AlarmStatus.RAISED]


def test_equal_alarms_are_marked_together(tmp_path: Path) -> None:
    """Those that are named and no others; a refusal does not hold up the rest."""
    cells = [CellName("s", "m", name) for name in "abc"]
    desk = AlarmDesk(tmp_path / MARKS, [Kept(cell, 0, RAISED) for cell in cells])
    seen = [row.seen for row in desk.rows()[:2]]
    assert not desk.mark(MarksAsked(ACKNOWLEDGE, []), "ann@desk").accepted
    answer = desk.mark(MarksAsked(ACKNOWLEDGE, seen), "ann@desk")
    assert answer == Answer(True, "m/a: fan: acknowledged by ann@desk, and 1 more")
    acknowledged = [row.id for row in desk.rows() if row.status is AlarmStatus.ACKNOWLEDGED]
    assert sorted(acknowledged) == ["m/a: fan", "m/b: fan"]
    answer = desk.mark(MarksAsked(ACKNOWLEDGE, [row.seen for row in desk.rows()]), "ben@desk")
    assert not answer.accepted and "m/b: fan: is acknowledged, by ann@desk" in answer.text
    assert {row.status for row in desk.rows()} == {AlarmStatus.ACKNOWLEDGED}


def alarm(number: int, level: str, active: bool = True) -> Event:
    """Return an alarm of the journal."""
    body = BODY | {"level": level, "active": active}
    return Event(number, float(number), "alarm", False, "", body)


@pytest.mark.parametrize(
    ("word", "later", "status"),
    [
        (ACKNOWLEDGE, [alarm(6, "error")], AlarmStatus.RAISED),
        (ACKNOWLEDGE, [alarm(6, "warning", False), alarm(7, "warning")], AlarmStatus.RAISED),
        (SHELVE, [alarm(6, "error")], AlarmStatus.RAISED),
        # What comes and goes all the time could be shelved by nobody.
        (SHELVE, [alarm(6, "warning", False), alarm(7, "warning")], AlarmStatus.SHELVED),
    ],
)
def test_a_mark_does_not_cover_what_came_after_the_look(
    tmp_path: Path, word: str, later: list[Event], status: AlarmStatus
) -> None:
    """A person lists a warning, and something else is there when their mark arrives."""
    desk = AlarmDesk(tmp_path / MARKS, [Kept(CELL, 0, alarm(5, "warning"))])
    asked = MarksAsked(word, [row.seen for row in desk.rows()], 60.0, "a spare part comes")
    for event in later:
        desk.told(CELL, event)
    answer = desk.mark(asked, "ann@desk")
    refused = Answer(False, f"{NAME}: has changed since: look again")
    assert (answer == refused) is (status is AlarmStatus.RAISED)
    assert [row.status for row in desk.rows()] == [status]


def test_alarms_are_asked_for_and_marked_over_the_bus(farm: Farm) -> None:
    """By the words of ./cell farm; each in a person's name."""
    session, client = farm.router(), farm.client()
    farm.desk(session)
    journal = Journal()
    farm.link(client, journal)
    raised = time.time()
    journal.events.append(msgspec.structs.replace(RAISED, time=raised))

    def alarms() -> list[AlarmRow]:
        (reply,) = client.get(f"site/{ALARMS}", timeout=2.0)
        return msgspec.json.decode(bytes(reply.ok.payload), type=list[AlarmRow])

    wait_until(lambda: [row.id for row in alarms()] == [NAME], 10.0, "the alarm")
    asked = encode(MarksAsked(ACKNOWLEDGE, [SeenAlarm(NAME, raised, "error")]))
    (reply,) = client.get(f"site/{MARK}?person=ann@desk_1", payload=asked, timeout=2.0)
    assert decode(bytes(reply.ok.payload), Answer) == Answer(
        True, f"{NAME}: acknowledged by ann@desk_1"
    )
    assert [(row.status, row.person) for row in alarms()] == [
        (AlarmStatus.ACKNOWLEDGED, "ann@desk_1")
    ]
    (reply,) = client.get(f"site/{MARK}", payload=b"{", timeout=2.0)
    assert not decode(bytes(reply.ok.payload), Answer).accepted
    (line,) = (farm.folder.parent / MARKS).read_text(encoding="utf-8").splitlines()
    assert json.loads(line)["person"] == "ann@desk_1"

    def say(alarm: str) -> tuple[int, str]:
        who = ("--router-port", str(farm.config.router.port), "--person", "ben")
        done = CliRunner().invoke(app, ("shelve", alarm, "--why", "a part comes", *who))
        return done.exit_code, done.output

    code, text = say(NAME)
    assert code == 0 and " error " in text and f"{NAME}: shelved by ben@" in text
    code, text = say("m/a: fan is")
    assert code == 1 and "m/a: fan is: is not listed" in text


def test_a_lost_cell_is_an_alarm_until_somebody_has_looked(tmp_path: Path) -> None:
    """The desk raises it itself; others are told to be there."""
    desk = AlarmDesk(tmp_path / MARKS, [])
    name = str(CellName("site", "m", "b"))
    desk.there({name: 7.0}, 8.0)
    assert [(r.cell, r.status) for r in desk.rows()] == [(name, AlarmStatus.RAISED)]
    desk.there({}, 9.0)
    assert [r.status for r in desk.rows()] == [AlarmStatus.CLEARED]


def test_a_cell_that_was_lost_unseen_is_listed_after_a_restart(tmp_path: Path) -> None:
    """No journal knows of it: the desk keeps it, also while it is off; who has looked is kept."""
    file, name = tmp_path / MARKS, "m/b: link"
    first = AlarmDesk(file, [])
    first.there({"m/b": 7.0}, 8.0)
    first.there({"m/b": 7.0}, 8.5)
    first.there({}, 9.0)
    again = AlarmDesk(file, [])
    (row,) = again.rows()
    assert (row.id, row.status, row.times) == (name, AlarmStatus.CLEARED, 1)
    assert (row.raised, row.cleared) == (7.0, 9.0)
    assert again.mark(MarksAsked(ACKNOWLEDGE, [row.seen]), "ann@desk").accepted
    third = AlarmDesk(file, [])
    assert third.rows() == []
    third.there({"m/b": 20.0}, 21.0)
    fourth = AlarmDesk(file, [])
    fourth.there({}, 30.0)
    (row,) = AlarmDesk(file, []).rows()
    assert (row.status, row.raised, row.cleared, row.times) == (AlarmStatus.CLEARED, 20.0, 30.0, 1)
    assert len((tmp_path / LINKS).read_bytes().splitlines()) == 4


def test_a_lost_cell_is_an_alarm_on_a_full_disk_too(tmp_path: Path) -> None:
    """It is kept when there is room."""
    desk = AlarmDesk(tmp_path / "no_folder" / MARKS, [])
    desk.there({"m/b": 7.0}, 8.0)
    assert [row.status for row in desk.rows()] == [AlarmStatus.RAISED]
    (tmp_path / "no_folder").mkdir()
    desk.there({"m/b": 7.0}, 9.0)
    assert len(AlarmDesk(tmp_path / "no_folder" / MARKS, []).rows()) == 1


@pytest.mark.parametrize(
    "write",
    [
        lambda desk: desk.mark(MarksAsked(ACKNOWLEDGE, [SEEN]), "ann@desk"),
        lambda desk: desk.there({"m/b": 7.0}, 8.0),
    ],
    ids=["a mark", "a lost cell"],
)
def test_a_disk_that_hangs_holds_up_nobody_who_asks_or_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[AlarmDesk], object]
) -> None:
    """The desk keeps its lock while it tells alarms, and a STOP of all needs what it shows."""
    begun, hang, ended = threading.Event(), threading.Event(), threading.Event()

    def append(*_: object) -> None:
        begun.set()
        hang.wait(DEADLINE_S)
        ended.set()

    monkeypatch.setattr(alarm_desk_io, "_append", append)
    desk = AlarmDesk(tmp_path / MARKS, [Kept(CELL, 0, RAISED)])
    writing = threading.Thread(target=write, args=(desk,))
    writing.start()
    assert begun.wait(DEADLINE_S)
    desk.told(CellName("s", "m", "c"), RAISED)
    assert "m/c: fan" in {row.id for row in desk.rows()} and not ended.is_set()
    hang.set()
    writing.join()
