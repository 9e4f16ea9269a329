"""What each command of the core does on the robot's inputs: a table, and the steps it gives.

Signals and numbers are named as in modbus_map.yaml. A map says by which coil, register or command
code the robot takes each of them, so all shipped robots share one table although their wires
differ. A robot that wants other signals for a command gets a table of its own beside this one.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from twin_controller.core.actions import Command


class Signal(msgspec.Struct, frozen=True):
    """Set an input to a level."""

    name: str
    level: bool


class Pulse(msgspec.Struct, frozen=True):
    """Switch an input on and off again.

    Attributes:
        name: Of the input.
        behind: Not before a set point that waits for its time.
        if_paused: Only while one of the robot's programs is paused.
    """

    name: str
    behind: bool = False
    if_paused: bool = False


class Number(msgspec.Struct, frozen=True):
    """Write a whole number."""

    name: str
    value: int


class DropSetpoints(msgspec.Struct, frozen=True):
    """Forget the set points that wait for their time."""


class TakeBack(msgspec.Struct, frozen=True):
    """Tell the robot that none of its set points counts any longer."""


class StandHere(msgspec.Struct, frozen=True):
    """Make where the robot stands its set point.

    Attributes:
        if_paused: Only while one of the robot's programs is paused.
    """

    if_paused: bool = False


Step = Signal | Pulse | Number | DropSetpoints | TakeBack | StandHere
SignalTable = Mapping[Command, tuple[Step, ...]]

# HOLD first: it pauses any program, whatever else is set up. CSTOPI ends the program only where
# "CSTOPI for ABORT" is set; everywhere it clears the programs that wait for their turn.
STOP: tuple[Step, ...] = (DropSetpoints(), Signal("hold", False), Pulse("cstopi"), TakeBack())
# A paused program does not go on by this, it wants START. Who presses that at the pendant must not
# find an old set point: the robot goes to PR[1] whether it is marked as valid or not.
GIVE_HOLD_BACK: tuple[Step, ...] = (StandHere(if_paused=True), TakeBack(), Signal("hold", True))
UI_SIGNALS: SignalTable = {
    Command.STOP_REAL: STOP,
    Command.GIVE_HOLD_BACK: GIVE_HOLD_BACK,
    # Nothing moves: HOLD stays, or a start at the pendant right behind would be refused. If the
    # program does not end by that, the robot is stopped.
    Command.END_AT_REST: (DropSetpoints(), Pulse("cstopi"), TakeBack()),
    # Without a set point: the stream must not begin with an old one when it is let go on.
    Command.HOLD_REAL: (DropSetpoints(), Signal("hold", False), TakeBack()),
    Command.END_STREAM: (DropSetpoints(), TakeBack()),
    Command.RELEASE_REAL: (Signal("hold", True), Pulse("start", if_paused=True)),
    Command.ESTOP_REAL: (
        DropSetpoints(),
        Signal("hold", False),
        Signal("imstp", False),
        # An alarm may only pause a program. With CSTOPI its goal is gone: no reset gives it back.
        Pulse("cstopi"),
        TakeBack(),
    ),
    Command.RESET_REAL: (Signal("imstp", True), Signal("hold", True), Pulse("fault_reset")),
    # The stream program must never begin, or go on, with an old set point. RSR1 beside a program
    # that is paused would wait for its end and start then.
    Command.START_STREAM: (Pulse("rsr1", behind=True),),
    Command.CONTINUE_STREAM: (Pulse("start", behind=True, if_paused=True),),
}
"""Robots that take UI signals, by coils or by numbered commands: all that config/robots has."""


def steps(table: SignalTable, command: Command, paused: bool) -> tuple[Step, ...]:
    """Return what a command does, in order; nothing for a command that is not the robot's.

    Args:
        table: Of the robot's profile.
        command: The command.
        paused: One of the robot's programs is paused.
    """
    found = table.get(command, ())
    return tuple(step for step in found if paused or not getattr(step, "if_paused", False))


def override_steps(speed_percent: float) -> tuple[Step, ...]:
    """Return what sets the robot's override, in whole percent."""
    return (Number("override", round(speed_percent)),)


def gripper_steps(on: bool) -> tuple[Step, ...]:
    """Return what switches the robot's suction."""
    return (Signal("gripper", on),)
