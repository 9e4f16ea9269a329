"""Numbered commands: each counts once, in order, repeated until the robot confirms it."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from scara_config.modbus_map import CommandWord, SignalCode, load_modbus_map
from twin_controller.modbus.signalling import (
    CommandLostError,
    CommandQueue,
    following,
    may_write_signal,
    patience,
    signal_names,
)

WORD = CommandWord(
    "command",
    "sequence",
    "echo",
    {
        "hold": SignalCode(low=3, high=4),
        "cstopi": SignalCode(pulse=10),
        "rsr1": SignalCode(pulse=21),
    },
)

PATIENCE = patience(0.1, 5)


def queue(echo: int = 0) -> CommandQueue:
    """Return an empty queue that has seen the robot's number."""
    found = CommandQueue(WORD, PATIENCE)
    found.confirm(echo)
    return found


def test_nothing_is_written_before_the_robots_number_is_known() -> None:
    """A number that the robot has already obeyed would be no command."""
    waiting = CommandQueue(WORD, PATIENCE)
    waiting.put("cstopi", True, True)
    assert waiting.next(0.0) is None and waiting.due() is None
    waiting.confirm(7)
    first = waiting.next(0.0)
    assert first is not None and (first.code, first.sequence) == (10, 9)


def test_commands_go_one_after_the_other_in_their_order() -> None:
    """The next is written when the one before has come back, with another number."""
    commands = queue()
    commands.put("hold", False, False)
    commands.put("cstopi", True, True)
    first = commands.next(0.0)
    assert first is not None and first.code == 3 and commands.next(0.01) is None
    commands.confirm(first.sequence)
    second = commands.next(0.02)
    assert second is not None and second.code == 10 and second.sequence != first.sequence


def left(commands: CommandQueue) -> list[int]:
    """Let the robot confirm all that waits; return the codes."""
    codes = []
    while (command := commands.next(0.0)) is not None:
        codes.append(command.code)
        commands.confirm(command.sequence)
    return codes


def test_hold_that_is_taken_away_waits_for_nothing() -> None:
    """What would give it back is older; so is a start, whose set point was taken back."""
    commands = queue()
    commands.put("cstopi", True, True)
    commands.put("hold", True, False)
    commands.put("rsr1", True, True, behind=True)
    commands.put("hold", False, False)
    assert left(commands) == [3, 10]


def test_a_stop_overtakes_what_the_robot_has_not_confirmed() -> None:
    """Under a number of its own, for the robot may have taken the other; that goes once more."""
    commands = queue()
    commands.put("cstopi", True, True)
    first = commands.next(0.0)
    commands.put("hold", False, False)
    stop = commands.next(0.001)
    assert first is not None and stop is not None
    assert stop.code == 3 and stop.sequence != first.sequence
    commands.confirm(first.sequence)
    assert commands.next(0.002) is None, "it is the stop that must be confirmed"
    commands.confirm(stop.sequence)
    again = commands.next(0.003)
    assert again is not None and again.code == 10
    assert again.sequence not in (first.sequence, stop.sequence)


def test_a_stop_that_is_told_again_is_not_put_off_by_itself() -> None:
    """Nor does what follows it heap up, while the robot is slow to confirm."""
    commands = queue()
    numbers = set()
    for k in range(3):
        commands.put("hold", False, False)
        commands.put("cstopi", True, True)
        command = commands.next(0.1 * k)
        numbers |= {command.sequence} if command is not None else set()
    assert len(numbers) == 1
    commands.confirm(numbers.pop())
    assert left(commands) == [10]


def test_a_start_under_way_is_no_start_behind_a_stop() -> None:
    """It would begin with a set point that was taken back."""
    commands = queue()
    commands.put("rsr1", True, True, behind=True)
    assert commands.next(0.0) is not None
    commands.put("hold", False, False)
    assert left(commands) == [3]


def test_it_says_when_something_is_to_be_written() -> None:
    """At once, then when the command is to be repeated; confirmed, nothing is."""
    waiting = CommandQueue(WORD, PATIENCE)
    waiting.put("cstopi", True, True)
    assert waiting.due() is None, "the robot's number is not known"
    waiting.confirm(4)
    assert waiting.due() == 0.0
    command = waiting.next(10.0)
    assert command is not None and waiting.due() == pytest.approx(10.1)
    waiting.confirm(command.sequence)
    assert waiting.due() is None


def test_an_unconfirmed_command_is_repeated_with_its_number_then_given_up() -> None:
    """A lost write costs 0.1 s; a deaf robot is told about, and the next command has its turn."""
    commands = queue()
    commands.put("cstopi", True, True)
    commands.put("hold", True, False)
    numbers = [
        written.sequence
        for k in range(5)
        if (written := commands.next(0.1 * k + 1e-6 * k)) is not None
    ]
    assert len(numbers) == 5 and len(set(numbers)) == 1
    with pytest.raises(
        CommandLostError, match=r"cstopi: the robot did not confirm command 10 in 5 attempts"
    ):
        commands.next(1.0)
    after = commands.next(1.1)
    assert after is not None and after.code == 4
    assert after.sequence not in numbers, "the robot may have taken the other without showing it"


@pytest.mark.parametrize(
    ("robot", "name", "allowed"),
    [
        ("fanuc_sr6ia", "hold", True),
        ("fanuc_sr6ia", "rsr2", False),
        ("articulated_six", "hold", True),
    ],
)
def test_a_signal_is_written_where_the_map_marks_it_or_has_a_command_for_it(
    robot: str, name: str, allowed: bool
) -> None:
    """A coil that is not marked belongs to somebody else."""
    layout = load_modbus_map(ROOT / "config" / "robots" / robot)
    assert name in signal_names(layout)
    assert may_write_signal(layout, name) is allowed


def test_the_end_of_a_pulse_is_no_command() -> None:
    """The robot makes the edge itself."""
    commands = queue()
    commands.put("cstopi", False, False)
    assert commands.next(0.0) is None


def test_after_a_reconnect_nothing_is_replayed() -> None:
    """As for coils: what was not confirmed is counted and forgotten."""
    commands = queue()
    commands.put("cstopi", True, True)
    commands.put("hold", True, False)
    commands.next(0.0)
    assert commands.discard() == 2
    commands.confirm(1)
    assert commands.next(1.0) is None


@given(st.integers(0, 32767))
def test_our_numbers_are_odd_and_new(echo: int) -> None:
    """Even ones are the pendant's; a number is never the one that the robot shows."""
    number = following(echo)
    assert 1 <= number <= 32767 and number % 2 == 1 and number != echo
