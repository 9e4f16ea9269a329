"""The robot's stream program: asked for behind a fresh set point, until it is reported.

One that is gone is started; one that is there and paused, as after a stop on a robot whose CSTOPI
ends no program, is let go on.
"""

from __future__ import annotations

import msgspec

from twin_controller.config import Stream
from twin_controller.core.actions import Command, SendReal
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.order import GiveUp, Order, Patience, due, send
from twin_controller.core.orders.stop import StopOrder, under_way
from twin_controller.core.setup import Setup

replace = msgspec.structs.replace
AUTO, TURN = "AUTO", "turn it to AUTO there, then RESET"
"""The mode in which a robot is led, and how it gets there: the robot halts by each turn."""


class StreamOrder(msgspec.Struct, frozen=True):
    """The real robot is to run its stream program, for as long as it follows."""

    # Counts from the begin of the stream; shown once the program was seen running, not held.
    start: Order[Command]
    # Ask for it as soon as a set point has been sent: the program must never find an old one.
    at_once: bool = False
    # It was there, paused, when it was let go on: if it is gone after that, somebody ended it.
    loaded: bool = False


def begin_stream(
    flags: RealMeasured | None, stopping: bool, config: Stream, now: float
) -> StreamOrder:
    """Return the order for a stream that begins or goes on; nothing is asked for yet.

    Args:
        flags: The robot's newest answer.
        stopping: It has not shown yet that the stream before has ended.
        config: How long it may take.
        now: Time [s].
    """
    loaded = flags is not None and flags.streaming and not stopping
    patience = Patience(config.retry_ms * 1e-3, config.attempts, GiveUp.STOP_PAIR)
    return StreamOrder(Order(Command.START_STREAM, patience, sent=now), loaded=loaded)


def ask_for_stream(order: StreamOrder) -> StreamOrder:
    """Return the order after the stream program was asked for."""
    return replace(order, at_once=True)


def hear_stream(order: StreamOrder, event: RealMeasured) -> StreamOrder:
    """Note what an answer of the robot shows of its stream program.

    Only once it was asked for: the stream before may still run.
    """
    if event.streaming and not event.paused and not order.at_once:
        return replace(order, start=replace(order.start, shown=True))
    return order


def start_stream(
    order: StreamOrder, flags: RealMeasured, held: bool, now: float
) -> tuple[StreamOrder, list[SendReal]]:
    """Ask for the program behind a fresh set point; again when the robot does not report it.

    Nobody's hold but ours is ours to undo, and a program of the robot's own is never let go on.

    Args:
        order: What the robot was asked for.
        flags: Its newest answer.
        held: Somebody at the robot holds it.
        now: Time [s].
    """
    late = bool(due([order.start], now).sends)
    if flags.own_program or held or not (order.at_once or late):
        return order, []
    there = flags.streaming
    if there and not flags.paused:
        # It pauses, after a short hold, or it was never paused. RSR1 beside it would wait for its
        # end and start it anew then.
        pauses = now - order.start.sent < order.start.patience.period
        return replace(order, at_once=pauses), []
    command = Command.CONTINUE_STREAM if there else Command.START_STREAM
    reason = "the real robot follows" if order.at_once else "the robot did not start it yet"
    start = send(replace(order.start, wanted=command), now)
    return StreamOrder(start, loaded=there), [SendReal(command, reason)]


def begins_late(order: StreamOrder | None, stop: StopOrder | None) -> str:
    """Return why the robot follows later than a set point takes; empty: it follows, or soon."""
    if order is None or order.start.shown:
        return ""
    if under_way(stop):
        return "the real robot still ends its stream program"
    if order.start.attempts > 1:
        return "the real robot has not started its stream program yet"
    return ""


def by_hand(flags: RealMeasured | None) -> str:
    """Return why nothing starts the robot from outside, and what to do; empty: it is in AUTO.

    A robot that does not tell its mode may be started.
    """
    mode = "" if flags is None else flags.operation_mode
    if mode in ("", AUTO):
        return ""
    return f"the real robot's mode switch is at {mode}: programs start at its pendant alone; {TURN}"


def unstartable(setup: Setup, flags: RealMeasured | None) -> str:
    """Return why the robot's stream program cannot be started, and what to do; empty: it can.

    Args:
        setup: Whether this robot may be led at all.
        flags: The robot's newest answer.
    """
    if setup.only_followed or flags is None or not flags.own_program:
        return setup.only_followed or by_hand(flags)
    if flags.paused:
        return "the real robot has paused a program of its own: end it there, or let it go on"
    return "the real robot runs a program of its own: STOP ends or pauses it"
