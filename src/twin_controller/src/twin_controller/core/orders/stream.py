"""The robot's stream program: asked for behind a fresh set point, until it is reported."""

from __future__ import annotations

import msgspec

from twin_controller.config import Stream
from twin_controller.core.actions import Command, Send
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.book import due
from twin_controller.core.orders.order import GiveUp, Order, Patience, send

replace = msgspec.structs.replace


class StreamOrder(msgspec.Struct, frozen=True):
    """The real robot is to run its stream program, for as long as it follows."""

    # Counts from the begin of the stream; shown once the program was seen running, not held.
    start: Order[Command]
    # Ask for it as soon as a set point has been sent: the program must never find an old one.
    at_once: bool = False
    # The robot still reports the stream before, which was told to end; ask for this one after it.
    ending: bool = False
    # It was there, held, when it was let go on: if it is gone after that, somebody ended it.
    loaded: bool = False


def begin_stream(
    before: StreamOrder | None, flags: RealMeasured | None, config: Stream, now: float
) -> StreamOrder:
    """Return the order for a stream that begins or goes on; nothing is asked for yet."""
    ends = before is not None and before.ending
    loaded = flags is not None and flags.streaming and not ends
    patience = Patience(config.retry_ms * 1e-3, config.attempts, GiveUp.STOP_PAIR)
    return StreamOrder(Order(Command.START_STREAM, patience, sent=now), loaded=loaded)


def ask_for_stream(order: StreamOrder, flags: RealMeasured | None) -> StreamOrder:
    """Return the order after the stream program was asked for: a new one, not one that is there."""
    ending = flags is not None and flags.streaming
    return replace(order, at_once=True, ending=ending, loaded=False)


def hear_stream(order: StreamOrder, event: RealMeasured) -> StreamOrder:
    """Note what an answer of the robot shows of its stream program."""
    if order.ending:
        return replace(order, ending=event.streaming)
    if event.streaming and not event.paused:
        return replace(order, start=replace(order.start, shown=True))
    return order


def start_stream(
    order: StreamOrder, flags: RealMeasured, config: Stream, now: float
) -> tuple[StreamOrder, list[Send]]:
    """Ask for the program behind a fresh set point; again when the robot does not report it."""
    if flags.own_program:
        return order, []
    # The stream before gets as long to end as this one would get to start.
    if order.ending and now - order.start.sent <= longest_wait(config):
        return order, []
    # A held program does not show that it runs; who holds it lets it go on.
    late = not flags.paused and bool(due([order.start], now).sends)
    if not order.at_once and not late:
        return order, []
    reason = "the robot did not start it yet" if late else "the real robot follows"
    order = replace(order, start=send(order.start, now), at_once=False, ending=False)
    return order, [Send(Command.START_STREAM, reason)]


def longest_wait(config: Stream) -> float:
    """Return how long the robot may take to start its stream program, all attempts together [s]."""
    return config.attempts * config.retry_ms * 1e-3
