"""The state table is complete, says nothing twice, and keeps its promises in every mode."""

from __future__ import annotations

import ast
from itertools import product

import pytest
from harness.workspace import ROOT
from twin_controller.core.actions import Command
from twin_controller.core.lead.modes import COMMANDS, Mode, Trigger
from twin_controller.core.lead.table import (
    BOTH_STOP,
    DEFAULTS,
    RESUME_ROWS,
    RESUMING,
    ROWS,
    STAY,
    Row,
    look_up,
)
from twin_controller.core.lead.table_page import rows, table_page

CORE = ROOT / "src" / "twin_controller" / "src" / "twin_controller" / "core"
BEGINNINGS = {Command.BEGIN_ALIGN, Command.BEGIN_FOLLOW_TWIN, Command.BEGIN_STREAM}
MOVING = BEGINNINGS | {
    Command.MOVE_TWIN,
    Command.START_STREAM,
    Command.RELEASE_REAL,
    Command.RESUME_TWIN,
}
OPERATORS = {
    *(Trigger[name] for name in COMMANDS),
    *(Trigger.MOVE, Trigger.MOVE_UNALIGNED, Trigger.RESET_BLOCKED, Trigger.RESET_PRESSED),
    *(Trigger.RESUME_BLOCKED, Trigger.RESUME_HELD, Trigger.RESUME_MOVED),
    Trigger.ACKNOWLEDGE_NOTHING,
}
FOLLOWS_TWIN = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
ALL = [(mode, trigger, row) for mode in Mode for trigger, _, row in rows(mode)]


def name(value: object) -> str:
    """Return a short test id."""
    return getattr(value, "name", "") or ""


IN_EACH_MODE = pytest.mark.parametrize("mode", Mode, ids=name)


@IN_EACH_MODE
def test_every_pair_has_a_row(mode: Mode) -> None:
    """Undefined pairs are impossible."""
    for trigger, paused in product(Trigger, (None, *RESUME_ROWS)):
        assert isinstance(look_up(mode, trigger, paused), Row)


def test_every_mode_and_every_command_is_in_the_tables() -> None:
    """A new one cannot be forgotten."""
    assert set(ROWS) == set(Mode)
    assert set(DEFAULTS) >= OPERATORS


@pytest.mark.parametrize(("trigger", "paused"), list(product(RESUMING, RESUME_ROWS)), ids=name)
def test_what_was_paused_comes_back(trigger: Trigger, paused: Mode) -> None:
    """RESUME gives the lead back to whoever had it, whoever says it."""
    assert look_up(Mode.PAUSED, trigger, paused) is RESUME_ROWS[paused]
    assert RESUME_ROWS[paused].to is paused


@IN_EACH_MODE
def test_a_row_that_decides_has_a_reason_and_one_that_does_not_has_nothing(mode: Mode) -> None:
    """`why` is never empty; a silent row changes nothing."""
    for trigger, _, row in rows(mode):
        assert row == Row(silent=True) if row.silent else row.why, trigger


@IN_EACH_MODE
def test_a_refusal_does_nothing(mode: Mode) -> None:
    """Only the operator is refused; RESUME after a side was moved stops both besides."""
    for trigger, _, row in rows(mode):
        if row.refused and (mode, trigger) != (Mode.PAUSED, Trigger.RESUME_MOVED):
            assert row.to is None and row.commands == () and trigger in OPERATORS
    moved = look_up(Mode.PAUSED, Trigger.RESUME_MOVED)
    assert moved.refused and moved.to is Mode.STOPPED and moved.commands == BOTH_STOP


@IN_EACH_MODE
def test_the_operator_is_always_answered(mode: Mode) -> None:
    """No command is swallowed in any mode."""
    assert not [trigger for trigger, _, row in rows(mode) if trigger in OPERATORS and row.silent]


def test_only_a_reset_leaves_the_emergency_stop() -> None:
    """Releasing alone moves nothing; a lost link does not release either."""
    ways = [
        (trigger, row.to)
        for trigger, _, row in rows(Mode.ESTOP)
        if row.to not in (None, Mode.ESTOP)
    ]
    assert ways == [(Trigger.RESET_DONE, Mode.STOPPED)]


MOVES_ON = {
    *(Trigger.LINKS_READY, Trigger.UNSETTLED, Trigger.ALIGN, Trigger.MOVE),
    *(Trigger.REAL_MOVED, Trigger.REAL_TOOK_OVER, Trigger.REAL_WAS_FIRST),
    *(Trigger.TWIN_MOVED, Trigger.TWIN_MOVED_UNALIGNED, Trigger.TWIN_MOVES_TOO),
    *RESUMING,
}


@IN_EACH_MODE
def test_only_what_moves_a_side_has_an_action_that_moves_one(mode: Mode) -> None:
    """What stops or resets, and any new trigger, moves and releases nothing."""
    for trigger in set(Trigger) - MOVES_ON:
        assert not MOVING & set(look_up(mode, trigger, Mode.TWIN_LEADS).commands), trigger


def test_a_reconnect_begins_nothing_but_the_alignment() -> None:
    """The twin's own motion ends first; the real robot gets no command."""
    row = look_up(Mode.OFFLINE, Trigger.LINKS_READY)
    assert (row.to, row.commands) == (Mode.ALIGNING, (Command.STOP_TWIN, Command.BEGIN_ALIGN))
    assert all(
        look_up(mode, Trigger.LINKS_READY).silent for mode in Mode if mode is not Mode.OFFLINE
    )


@IN_EACH_MODE
def test_stops_reach_both_sides_in_every_mode(mode: Mode) -> None:
    """STOP and a lost link stop both, ESTOP switches both off."""
    assert set(BOTH_STOP) <= set(look_up(mode, Trigger.STOP).commands)
    assert set(BOTH_STOP) <= set(look_up(mode, Trigger.LINK_LOST).commands)
    assert {Command.ESTOP_REAL, Command.ESTOP_TWIN} <= set(look_up(mode, Trigger.ESTOP).commands)
    assert look_up(mode, Trigger.ESTOP).to in (Mode.ESTOP, None)


@IN_EACH_MODE
def test_a_twin_that_does_not_obey_is_a_fault_whoever_leads(mode: Mode) -> None:
    """It is said in every mode; a latched mode stays, and the open order tells the twin on."""
    row = look_up(mode, Trigger.TWIN_STOP_IGNORED, Mode.TWIN_LEADS)
    latched = mode in (Mode.ESTOP, Mode.FAULT)
    assert (row.to, row.commands) == ((None, ()) if latched else (Mode.FAULT, BOTH_STOP))
    assert not row.silent and "then RESET" in row.why


@IN_EACH_MODE
def test_a_mode_is_entered_by_what_it_needs(mode: Mode) -> None:
    """Following begins with BEGIN_*, IDLE with agreed positions, a stop with stops of both.

    But a twin that has caught up follows already, and a pair that was stopped before its links
    were lost has been told to: a program that began at the robot meanwhile is that person's.
    """
    told = (Trigger.RESET_DONE, Trigger.CAUGHT_UP, Trigger.LINKS_READY_STOPPED)
    needs: dict[Mode | None, set[Command]] = {
        Mode.ALIGNING: {Command.BEGIN_ALIGN},
        Mode.IDLE: {Command.BASELINE},
        Mode.REAL_LEADS: {Command.BEGIN_FOLLOW_TWIN},
        Mode.TWIN_LEADS: {Command.BEGIN_STREAM, Command.START_STREAM},
        Mode.OPERATOR_LEADS: {Command.BEGIN_STREAM, Command.START_STREAM, Command.MOVE_TWIN},
        Mode.OFFLINE: set(BOTH_STOP),
        Mode.FAULT: set(BOTH_STOP),
        Mode.STOPPED: set(BOTH_STOP),
    }
    for trigger, paused, row in rows(mode):
        if paused is None and trigger not in told:
            assert needs.get(row.to, set()) <= set(row.commands), trigger


@pytest.mark.parametrize("mode", FOLLOWS_TWIN, ids=name)
def test_a_stream_is_ended_when_nobody_feeds_it_any_more(mode: Mode) -> None:
    """Unless a program of the robot's own has ended its stream program."""
    for trigger, _, row in rows(mode):
        if row.to not in (None, mode, Mode.PAUSED) and trigger is not Trigger.REAL_TOOK_OVER:
            ends = {Command.STOP_REAL, Command.ESTOP_REAL, Command.END_AT_REST}
            assert ends & set(row.commands), trigger


@IN_EACH_MODE
def test_no_row_repeats_the_default(mode: Mode) -> None:
    """Nothing is said twice."""
    assert not [each for each, row in ROWS[mode].items() if row == DEFAULTS.get(each, STAY)]


def used_members(kind: str, files: list[str]) -> set[str]:
    """Return the members of an enumeration that these modules mention."""
    found = set()
    for file in files:
        for node in ast.walk(ast.parse((CORE / file).read_text(encoding="utf-8"))):
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == kind
            ):
                found.add(node.attr)
    return found


def test_every_trigger_is_raised_somewhere() -> None:
    """There is no dead trigger."""
    raised = used_members(
        "Trigger", ["lead/triggers.py", "lead/reports.py", "lead/transition.py"]
    ) | set(COMMANDS)
    assert raised >= {trigger.name for trigger in Trigger}


def test_every_trigger_means_something_in_some_mode() -> None:
    """A trigger that is silent everywhere is dead."""
    assert {trigger for _, trigger, row in ALL if not row.silent} == set(Trigger)


def test_every_action_is_used() -> None:
    """There is no dead action. A stream that is paused is let go on instead of started."""
    used = {do for _, _, row in ALL for do in row.commands}
    assert used | {Command.CONTINUE_STREAM} == set(Command)


@IN_EACH_MODE
def test_every_mode_leads_back_to_idle(mode: Mode) -> None:
    """No mode is a trap: the operator and the healing of causes are enough."""
    healing = {Trigger.LINKS_READY, Trigger.ALIGNED, Trigger.RESET_DONE, *OPERATORS}
    reached, new = set(), {mode}
    while new:
        reached |= new
        new = {
            look_up(m, trigger, Mode.REAL_LEADS).to or m for m in reached for trigger in healing
        } - reached
    assert Mode.IDLE in reached


def test_the_page_says_of_a_mode_only_what_is_not_as_in_most_modes() -> None:
    """And all of that."""

    def told(section: str) -> dict[str, str]:
        lines = (line[2:].split(" | ", 1) for line in section.splitlines() if line[:3] == "| `")
        return {trigger: does for names, does in lines for trigger in names.split(", ")}

    _, _, most, *others = table_page().split("\n## ")
    usual, sections = told(most), {}
    for section in others:
        modes, body = section.split("\n", 1)
        sections |= dict.fromkeys(modes.split(", "), body)
    assert usual and set(sections) == {mode.name for mode in Mode}
    for mode, trigger, row in ALL:
        own, key = told(sections[mode.name]), f"`{trigger.name}`"
        assert key not in own or own[key] != usual.get(key)
        nothing = sections[mode.name].partition("Decides nothing: ")[2]
        named = any(each.startswith(key) for each in own) or key in nothing
        assert row.silent or named or key in usual
