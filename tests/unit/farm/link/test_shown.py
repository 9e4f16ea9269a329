"""What the farm is shown of a cell, and how events are told."""

from __future__ import annotations

import pytest
from farm.link.event_text import describe
from farm.link.shown import ShownState, show, silent, told_by
from farm.wire import CellState, Level, decode

from scara_msgs.msg import TwinControllerState as Mode


@pytest.mark.parametrize(
    ("said", "level"),
    [
        (Mode(mode=Mode.IDLE), Level.GOOD),
        (Mode(mode=Mode.ALIGNING), Level.NOTE),
        (Mode(mode=Mode.IDLE, alarm="fan"), Level.WARN),
        (Mode(mode=Mode.STOPPED), Level.WARN),
        (Mode(mode=Mode.FAULT, alarm="fan"), Level.BAD),
        (Mode(mode=Mode.REAL_LEADS, diverged=True), Level.BAD),
    ],
)
def test_the_cell_judges_how_bad_it_is(said: Mode, level: Level) -> None:
    """The desk needs to know no mode."""
    assert told_by(said).level == level


def test_what_the_controller_says_is_told_in_the_same_words() -> None:
    """Only an unknown distance or speed is none, and the speed is the one that is driven."""
    words = {"mode": Mode.IDLE, "leader": "real", "why": "w", "alarm": "a", "holder": "ann"}
    state = told_by(Mode(**words, speed_applied_percent=40.0, deviation_mm=0.3))
    assert {name: getattr(state, name) for name in words} == words
    assert (state.speed_percent, state.deviation_mm) == (40.0, 0.3)
    unknown = told_by(Mode(deviation_mm=float("nan"), speed_applied_percent=float("nan")))
    assert (unknown.deviation_mm, unknown.speed_percent) == (None, None)


def test_revision_follows_what_a_command_is_based_on() -> None:
    """Figures that always change are no change; the sequence counts all."""
    shown, first = show(ShownState(100), told_by(Mode(mode=Mode.IDLE)), False)
    shown, same = show(shown, told_by(Mode(mode=Mode.IDLE, deviation_mm=0.3)), True)
    shown, other = show(shown, told_by(Mode(mode=Mode.PAUSED)), True)
    assert (first.revision, same.revision, other.revision) == (101, 101, 102)
    assert [s.sequence for s in (first, same, other)] == [1, 2, 3] and same.remote


def test_a_silent_controller_is_bad_and_one_state() -> None:
    """The seconds in its text are no new revision."""
    shown, first = silent(ShownState(1), 10.0, 12.0, False)
    _, second = silent(shown, 10.0, 15.0, False)
    assert first.level == Level.BAD and first.mode == "" and "for 2 s" in first.why
    assert first.revision == second.revision
    assert "not heard yet" in silent(ShownState(1), 0.0, 12.0, False)[1].why


@pytest.mark.parametrize(
    ("kind", "body", "stop", "said"),
    [
        (
            "decision",
            {"mode_before": Mode.IDLE, "mode_after": Mode.PAUSED, "why": "PAUSE", "who": "ann"},
            True,
            f"{Mode.IDLE} -> {Mode.PAUSED}: PAUSE, asked for by ann",
        ),
        (
            "decision",
            {"mode_before": Mode.PAUSED, "mode_after": Mode.PAUSED, "why": "refused"},
            False,
            f"{Mode.PAUSED} -> {Mode.PAUSED}: refused",
        ),
        *(
            (
                "decision",
                {"mode_before": mode, "mode_after": Mode.STOPPED, "why": "w"},
                mode == Mode.PAUSED,
                f"{mode} -> {Mode.STOPPED}: w",
            )
            for mode in (Mode.PAUSED, Mode.ESTOP, Mode.FAULT, Mode.STANDSTILL, Mode.OFFLINE)
        ),
        (
            "audit",
            {"who": "/farm/ann@d", "what": "STOP", "success": False, "outcome": "late"},
            False,
            "/farm/ann@d: STOP: refused: late",
        ),
        ("alarm", {"source": "real", "text": "fan", "active": False}, False, "cleared: real: fan"),
        (
            "cycle",
            {"start": 1.0, "end": 3.5, "program": "P", "outcome": "done", "worst_error_mm": 0.5},
            False,
            "P: done after 2.5 s, worst error 0.50 mm",
        ),
        (
            "cycle",
            {"end": 2.0, "leader": "real", "outcome": "done"},
            False,
            "real: done after 2.0 s",
        ),
        ("cycle", {"outcome": "done"}, False, "cycle: done after 0.0 s"),
        (
            "exercise",
            {"learner": "ada", "title": "6. Stop", "passed": False, "reason": "no Reset"},
            False,
            "ada: 6. Stop: not yet: no Reset",
        ),
        ("gap", {"number": 3, "lost": 2, "why": "full\ndisk"}, False, "lost 2, why full disk"),
        ("new_kind", {}, False, ""),
    ],
)
def test_events_are_told_in_one_line(kind: str, body: dict, stop: bool, said: str) -> None:
    """A kind that is not known, or a line that lacks something, is told as far as it goes."""
    assert describe(kind, body) == (stop, said)


def test_a_state_claims_nothing_that_its_link_did_not_say() -> None:
    """An older link leaves fields out: no leader, no speed, and the farm may not move the cell."""
    state = decode(b'{"sequence":1,"stamp":2.0,"revision":3,"level":0,"mode":"IDLE"}', CellState)
    assert (state.leader, state.why, state.alarm, state.holder) == ("",) * 4
    assert (state.speed_percent, state.deviation_mm, state.remote) == (0.0, None, False)
