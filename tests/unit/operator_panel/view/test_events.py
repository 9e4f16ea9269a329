"""Events: what comes, what goes, who has seen it."""

from __future__ import annotations

import csv
import io

import pytest
from operator_panel.view.alarms import Alarm
from operator_panel.view.events import COLUMNS, KEPT, EventLog
from operator_panel.view.progress import Command, Fate
from operator_panel.view.snapshot import DecisionLine

AT = "2026-03-01T14:03:22"
ALARM = Alarm("error", "link real", "no fresh data for 0.31 s", "")


def said(log: EventLog) -> list[tuple[str, str]]:
    """Return severity and text of the events, oldest first."""
    return [(event.severity, event.text) for event in reversed(log.shown)]


def test_alarm_is_noted_when_it_comes_and_when_it_goes_not_while_it_counts() -> None:
    """Its number grows all the time."""
    log = EventLog()
    log.alarms([ALARM], AT)
    log.alarms([Alarm("error", "link real", "no fresh data for 1.7 s", "")], AT)
    log.alarms([], AT)
    assert said(log) == [
        ("fault", "No fresh data for 0.31 s"),
        ("info", "Over: No fresh data for 1.7 s"),
    ]


def test_decisions_are_noted_once_in_their_order_with_the_modes_as_words() -> None:
    """The newest comes first in the snapshot."""
    log = EventLog()
    first = DecisionLine("2026-03-01T14:03:20", "IDLE", "REAL_LEADS", "the real robot moved")
    second = DecisionLine(
        "2026-03-01T14:03:22", "REAL_LEADS", "STOPPED", "STOP: the target is cleared"
    )
    log.decisions((first,))
    log.decisions((second, first))
    log.decisions((second, first))
    assert said(log) == [
        ("info", "Ready \N{RIGHTWARDS ARROW} Real robot leads: The real robot moved"),
        ("warning", "Real robot leads \N{RIGHTWARDS ARROW} Stopped: The target is cleared"),
    ]
    assert log.shown[0].time == AT


@pytest.mark.parametrize(
    ("outcome", "severity"),
    [
        (Fate.DONE, "info"),
        (Fate.STOPPED, "warning"),
        (Fate.REFUSED, "warning"),
        (Fate.LOST, "fault"),
    ],
)
def test_ended_command_is_an_event(outcome: Fate, severity: str) -> None:
    """A lost one is the worst: nobody knows."""
    log = EventLog()
    log.ended([Command(1, "HOME", "14:03:22", "operator 1", "Home", outcome, "why")], AT)
    assert said(log) == [(severity, f"Home: {outcome}. Why")]


def test_acknowledged_event_says_by_whom_and_information_needs_none() -> None:
    """One alone, then all."""
    log = EventLog()
    for severity in ("fault", "warning", "info"):
        log.note(AT, severity, "simulator", severity)
    assert log.waiting == 2
    version = log.version
    log.acknowledge(1, "operator 1", AT)
    assert log.waiting == 1 and log.version > version
    log.acknowledge(0, "fitter 2", AT)
    assert [event.by for event in log.shown] == ["", "fitter 2", "operator 1"]
    assert log.waiting == 0


def test_old_events_go_and_numbers_stay() -> None:
    """The list cannot grow without end."""
    log = EventLog()
    for _ in range(KEPT + 10):
        log.note(AT, "info", "simulator", "x")
    rows = list(csv.reader(io.StringIO(log.csv())))
    assert len(rows) == KEPT + 1 and rows[1][0] == "11"


def test_csv_has_a_heading_and_survives_commas_quotes_and_formulas() -> None:
    """A spreadsheet reads texts, and calculates none of them."""
    log = EventLog()
    log.note(AT, "fault", "=evil()", 'said "no", and left')
    heading, row = csv.reader(io.StringIO(log.csv()))
    assert tuple(heading) == COLUMNS
    assert row == ["1", AT, "fault", "'=evil()", 'said "no", and left', "", ""]
