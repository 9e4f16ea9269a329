"""What a person asks of a journal: since when, and what stopped the cell."""

from __future__ import annotations

import json
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from cell_recorder.journal import why_node
from cell_recorder.journal.day_files_io import DayFiles
from cell_recorder.journal.entries import (
    KINDS,
    Alarm,
    Audit,
    Cycle,
    Decision,
    ExerciseMarked,
    Gap,
    Start,
    Torn,
    start_entry,
)
from cell_recorder.journal.since import Since, SinceError, parse_since
from cell_recorder.journal.story import StoryLine, duration, tell
from cell_recorder.journal.why_node import app
from msgspec.structs import replace
from typer.testing import CliRunner

from scara_msgs.msg import TwinControllerState

ZONE = timezone(timedelta(hours=2))
NOW = datetime(2026, 11, 22, 15, 30, tzinfo=ZONE)
M = TwinControllerState


def at(*fields: int) -> Since:
    """Return a local time."""
    return Since(time=datetime(*fields, tzinfo=ZONE).timestamp())  # type: ignore[arg-type,misc]


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("17", Since(number=17)),
        ("#17", Since(number=17)),
        ("2h", at(2026, 11, 22, 13, 30)),
        ("30m", at(2026, 11, 22, 15, 0)),
        ("1.5h ago", at(2026, 11, 22, 14, 0)),
        ("7d", at(2026, 11, 15, 15, 30)),
        ("2w", at(2026, 11, 8, 15, 30)),
        ("3000w", Since(time=0.0)),
        ("3 min", at(2026, 11, 22, 15, 27)),
        ("60s", at(2026, 11, 22, 15, 29)),
        ("today", at(2026, 11, 22)),
        ("Yesterday", at(2026, 11, 21)),
        ("14:05", at(2026, 11, 22, 14, 5)),
        ("14:05:30", at(2026, 11, 22, 14, 5, 30)),
        ("2026-11-22T14:00", at(2026, 11, 22, 14)),
        ("2026-11-22 14:00:30", at(2026, 11, 22, 14, 0, 30)),
        ("2026-11-22T12:00Z", at(2026, 11, 22, 14)),
        ("2026-11-01", at(2026, 11, 1)),
    ],
)
def test_since_means(text: str, meant: Since) -> None:
    """All forms that the help names, in the zone of the machine."""
    assert parse_since(text, NOW) == meant


@pytest.mark.parametrize(
    "text", ["", "soon", "2x", "25:00", "14:61", "2026-13-01", "-2h", "tomorrow"]
)
def test_since_that_says_no_time_is_refused_with_what_is_allowed(text: str) -> None:
    """The error names every form."""
    with pytest.raises(SinceError, match=r"is none of these: a time ago \(30m, 2h, 3d\), today"):
        parse_since(text, NOW)


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (59.94, "59.9 s"),
        (60.0, "1 min 0 s"),
        (3599.0, "59 min 59 s"),
        (3600.0, "1 h 0 min"),
        (7325.0, "2 h 2 min"),
        (86399.0, "23 h 59 min"),
        (86400.0, "1 d 0 h"),
        (273600.0, "3 d 4 h"),
    ],
)
def test_a_time_is_told_by_its_two_largest_units(seconds: float, said: str) -> None:
    """Nobody counts 7325 seconds."""
    assert duration(seconds) == said


def test_since_in_the_future_is_refused() -> None:
    """A typing error in a date must not look like a quiet night."""
    with pytest.raises(SinceError, match=r"lies in the future, it is 2026-11-22 15:30 now"):
        parse_since("16:00", NOW)


def decision(number: int, time: float, before: str, after: str, **said: str) -> Decision:
    """Return a decision."""
    fields = {"event": "", "why": "", "who": "", "leader": "", **said}
    return Decision(
        number=number,
        time=time,
        seq=number,
        mode_before=before,
        mode_after=after,
        actions=[],
        **fields,
    )


STOP = decision(5, 100.0, M.REAL_LEADS, M.STOPPED, event="STOP by the operator", who="Ada (page 3)")
ALIGN = decision(6, 112.5, M.STOPPED, M.ALIGNING, event="ALIGN by the operator")
IDLE = decision(7, 120.0, M.ALIGNING, M.IDLE, event="the twin reached the real robot's pose")


def test_stop_is_told_with_who_asked_and_what_became_of_it() -> None:
    """The first motion or readiness after it counts, not the way to it."""
    (line,) = tell([STOP, ALIGN, IDLE], stops_only=True)
    assert line == StoryLine(
        5,
        5,
        100.0,
        100.0,
        M.STOPPED,
        "STOP by the operator",
        "Ada (page 3)",
        "went on after 20.0 s: the twin reached the real robot's pose",
        is_stop=True,
    )


@pytest.mark.parametrize(
    ("later", "outcome"),
    [
        ([], f"{M.STOPPED} since then, as far as the journal goes"),
        ([ALIGN], f"{M.ALIGNING} since then, as far as the journal goes"),
        (
            [decision(6, 103.0, M.STOPPED, M.ESTOP, event="ESTOP by the operator")],
            f"{M.ESTOP} after 3.0 s: ESTOP by the operator",
        ),
        (
            [Start(number=6, time=190.0, robot="r", plant="ideal", pid=1), IDLE],
            "the cell was started again 1 min 30 s later",
        ),
        ([decision(6, 101.0, M.STOPPED, M.STOPPED, event="MOVE"), ALIGN, IDLE], "went on after"),
    ],
)
def test_what_became_of_a_stop(later: list[Any], outcome: str) -> None:
    """A refusal is no way on; a worse stop is named."""
    assert tell([STOP, *later])[0].outcome.startswith(outcome)


@pytest.mark.parametrize("mode", [M.ESTOP, M.FAULT, M.STANDSTILL, M.OFFLINE])
def test_the_way_out_of_a_stop_is_no_other_stop(mode: str) -> None:
    """RESET, or links that are up again, lead into STOPPED; from a pause that is a stop."""
    first = decision(5, 100.0, M.IDLE, mode, event="first", who="Ada")
    reset = decision(6, 103.0, mode, M.STOPPED, event="the real robot is reset")
    align = decision(7, 110.0, M.STOPPED, M.ALIGNING)
    held = [first, reset, align, replace(IDLE, number=8)]
    (line,) = tell(held, stops_only=True)
    assert (line.what, line.who) == (mode, "Ada")
    assert line.outcome.startswith("went on after 20.0 s")
    assert tell([replace(reset, mode_before=M.PAUSED)], stops_only=True)


def test_an_alarm_that_was_cleared_is_told_with_how_long_it_lasted() -> None:
    """One that is raised has not lasted yet."""
    raised = Alarm(
        number=1, time=9.0, source="[gateway]", level="error", active=True, text="down", seconds=0.0
    )
    cleared = replace(raised, number=2, time=84.0, active=False, seconds=75.0)
    assert [(line.what, line.words, line.outcome) for line in tell([raised, cleared])] == [
        ("error", "[gateway]: down", ""),
        ("cleared", "[gateway]: down", "after 1 min 15 s"),
    ]


def test_a_robot_elsewhere_is_told_as_no_stand_in() -> None:
    """What behaves like a plant runs on this machine."""
    starts = [start_entry("r", "ideal", host, 1) for host in ("127.0.0.1", "192.0.2.9")]
    assert [line.words for line in tell(starts)] == [
        "the journal began: r, stand-in ideal",
        "the journal began: r",
    ]


def test_repeats_are_one_line() -> None:
    """Numbers in the words do not tell them apart; the outcome of the last one counts."""
    stops = [
        decision(n, 10.0 * n, M.IDLE, M.OFFLINE, event="a link was lost", why=f"silent for 0.{n} s")
        for n in range(1, 13)
    ]
    (line, rest) = tell([*stops, decision(13, 130.0, M.OFFLINE, M.ALIGNING, event="links")])
    assert (line.times, line.first, line.last, line.begun, line.ended) == (12, 1, 12, 10.0, 120.0)
    assert rest.times == 1 and not rest.is_stop


def write(runs: Path, name: str = "milk_2") -> None:
    """Write a journal with an entry of each kind, half an hour old."""
    from cell_recorder.config import load_journal

    now = datetime.now().timestamp() - 1800.0
    files = DayFiles(
        runs / "journal" / name, name, load_journal(Path(__file__).parents[4] / "config")
    )
    entries: list[Any] = [
        Start(time=now, robot="fanuc_sr6ia", plant="ideal", pid=1),
        decision(0, now, M.IDLE, M.REAL_LEADS, event="the real robot moved first", leader="real"),
        Audit(time=now, who="Ada (page 3)", what="STOP", success=True, outcome="accepted"),
        decision(0, now + 5.0, M.REAL_LEADS, M.STOPPED, event="STOP by the operator", who="Ada"),
        Cycle(
            time=now + 5.0,
            start=now,
            end=now + 5.0,
            program="PALLET",
            leader="real",
            who="",
            parts_placed=2,
            parts_dropped=0,
            worst_error_mm=0.31,
            paused_s=0.0,
            outcome="stopped",
            why="STOP by the operator",
        ),
        Alarm(time=now + 6.0, source="[gateway]", level="error", active=True, text="down"),
        Gap(time=now + 7.0, lost=3, since=now, until=now + 6.0, why="not kept: disk full"),
        Torn(time=now + 8.0, file="a.jsonl", kept="a.torn", size=9, text="{"),
        ExerciseMarked(
            time=now + 8.0,
            marked=now,
            learner="ada",
            exercise="e06_stop_and_recover",
            title="6. Stop",
            passed=True,
            reason="STOP at 2.0 s",
            digest="d",
            signature="s",
        ),
    ]
    files.open(now)
    assert files.append(entries, now + 8.0) == len(entries) or now % 86400 > 86390
    files.close()


def run(*words: str, code: int = 0) -> Any:
    """Run the command line."""
    result = CliRunner().invoke(app, list(words))
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(autouse=True)
def no_namespace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever shell runs this."""
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    monkeypatch.delenv("CELL_ROOT", raising=False)


def test_why_tells_every_kind_and_finds_the_only_cell(tmp_path: Path) -> None:
    """Without a cell, a master or a name."""
    write(tmp_path)
    text = run("--since", "1h", "--runs", str(tmp_path)).output
    for words in (
        "#1 ",
        "the journal began: fanuc_sr6ia",
        "STOPPED  STOP by the operator  (asked by Ada)  -> STOPPED since then",
        "PALLET, real led, 5.0 s, 2 parts placed, at most 0.31 mm apart  -> stopped: STOP by",
        "error  [gateway]: down",
        "3 entries are missing here: not kept: disk full",
        "the last line of a.jsonl was torn: 9 bytes, kept in a.torn",
        "passed  ada: 6. Stop  -> STOP at 2.0 s",
        "milk_2: 1 stop in 9 entries since 1h",
    ):
        assert words in text, text


@pytest.mark.parametrize(("day", "hour"), [("2025-01-15", 7), ("2025-07-01", 6)])
@pytest.mark.usefixtures("berlin")
def test_why_means_a_time_as_clocks_showed_it_then(
    day: str, hour: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the other half of the year it is another hour."""
    write(tmp_path)
    asked: list[Since] = []
    monkeypatch.setattr(why_node, "wanted", lambda _, begin: asked.append(begin) or ())
    run("--since", f"{day}T08:00", "--runs", str(tmp_path))
    assert asked == [Since(datetime.fromisoformat(f"{day}T0{hour}:00+00:00").timestamp())]


def test_why_shows_what_is_asked_for(tmp_path: Path) -> None:
    """Only stops, only a kind, from a number on, as JSON."""
    write(tmp_path)
    runs = ("--runs", str(tmp_path), "--name", "milk_2")
    assert len(run("--stops", *runs).output.splitlines()) == 2
    assert "#6" in run("--kind", "alarm", *runs).output
    obeyed = "audit  STOP  (asked by Ada (page 3))  -> accepted"
    assert obeyed not in run(*runs).output, "its decision tells it"
    assert obeyed in run("--all", *runs).output and obeyed in run("--kind", "audit", *runs).output
    lines = run("--since", "4", "--json", *runs).output.splitlines()
    assert [json.loads(line)["number"] for line in lines] == [4, 5, 6, 7, 8, 9]
    kinds = [json.loads(line)["kind"] for line in run("--json", *runs).output.splitlines()]
    assert set(kinds) == set(KINDS)
    assert len(run("--json", "--stops", *runs).output.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--since", "soon"), "why: --since soon: is none of these: a time ago"),
        (("--kind", "stop"), "why: --kind stop: is none of decision, audit, alarm"),
        (("--name", "milk_3"), "no journal of milk_3 in"),
    ],
)
def test_what_is_wrong_is_refused_with_what_is_allowed(
    tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    """Exit code 2."""
    write(tmp_path)
    assert said in run(*words, "--runs", str(tmp_path), code=2).output


def test_several_journals_have_to_be_named(tmp_path: Path) -> None:
    """The error names them."""
    write(tmp_path, "milk_2")
    write(tmp_path, "hall/milk_3")
    text = run("--runs", str(tmp_path), code=2).output
    assert "there are journals of hall/milk_3, milk_2: say --name" in text
    assert "milk_3: 1 stop" in run("--name", "hall/milk_3", "--runs", str(tmp_path)).output
