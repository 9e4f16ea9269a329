"""A stop is not done when it is sent: the real robot must show that it stands.

A stop takes the robot's HOLD away and cancels its program. A write may be lost with its connection,
a robot may be set up so that one of the two does nothing. So neither a written signal nor one that
reads back is a proof: the robot has stopped when its program is paused, held or gone and its joints
stand. It is told again until its program is so. If it still moves or runs after the time that HOLD
and CSTOPI have, the next means follows: its drives are switched off.

HOLD is given back once the robot has stopped, never before: a paused program does not go on by it,
and a HOLD of ours that stayed away would keep the person at the robot from starting anything.

An emergency stop stays latched: a side that was not reached, or is let go, is told again.

The twin must show a stop too: it comes to rest, whatever it reports. Its pose controller may report
that it obeys while somebody commands a joint directly. So only its measured positions count. A twin
that moves on is told again, in the end that is a fault of the pair; from then on it is told without
end until it stands.
"""

from __future__ import annotations

from typing import TypeGuard

import msgspec

from twin_controller.config import Change, EStop, Stop
from twin_controller.core.actions import Command, SendReal
from twin_controller.core.events import Joints, RealMeasured
from twin_controller.core.orders.order import GiveUp, Order, Patience, due, tell
from twin_controller.core.sides.change import stands_still
from twin_controller.core.sides.side import TwinSide

replace = msgspec.structs.replace

STOPPING = (Command.STOP_REAL, Command.HOLD_REAL, Command.END_AT_REST)
TAKES_HOLD = (Command.STOP_REAL, Command.HOLD_REAL, Command.ESTOP_REAL)
"""After one of these the robot's HOLD is away."""
GIVES_HOLD = (Command.GIVE_HOLD_BACK, Command.RELEASE_REAL, Command.RESET_REAL)
"""After one of these it is there again."""
EStopOrder = Order[tuple[Command, ...]]
"""To both sides; it is never given up."""

LATCHED = (Command.ESTOP_REAL, Command.ESTOP_TWIN)


class StopOrder(msgspec.Struct, frozen=True):
    """To stop or to hold the real robot.

    Attributes:
        order: What it was told; shown: its program is paused, held or gone.
        since: When it was told so first [s].
        reached: Its link has been up since it was told last. A program that was paused before
            shows nothing of a stop that was never written, and a robot that is away has no time.
        left: Its program is there, paused.
        stands: It has stopped: that is shown, and its joints stand.
        given_back: When HOLD was given back [s]; None: it is away. From then on it is only watched
            for a moment whether the program goes on all the same.
    """

    order: Order[Command]
    since: float
    reached: bool = True
    left: bool = False
    stands: bool = False
    given_back: float | None = None


def under_way(stop: StopOrder | None) -> TypeGuard[StopOrder]:
    """Return whether the robot was told to stop or to hold, and has not got its HOLD back."""
    return stop is not None and stop.given_back is None


def stop_patience(config: Stop) -> Patience:
    """Return how long the robot may take to show a stop."""
    return Patience(config.retry_ms * 1e-3, config.attempts, GiveUp.DRIVES_OFF)


def _patience(command: Command, config: Stop) -> Patience:
    """Return how long the robot may take to show a stop; at rest it ends its stream in twice that.

    Nobody waits for it, and whoever starts a program at the pendant would find HOLD away.
    """
    patience = stop_patience(config)
    if command is Command.END_AT_REST:
        return replace(patience, period=2.0 * patience.period)
    return patience


def safety_patience(config: Stop) -> Patience:
    """Return how long the robot may go on moving in spite of a safety stop."""
    return Patience(config.safety_retry_ms * 1e-3)


def tell_stop(
    stop: StopOrder | None, command: Command, config: Stop, reached: bool, now: float
) -> StopOrder:
    """Return the stop after the robot, whose link is up or not, was told ``command``."""
    # What a robot was told while it was away was never written: it counts from one again.
    again = under_way(stop) and stop.order.wanted is command
    if stop is None or not again or not reached:
        return StopOrder(tell(None, command, _patience(command, config), now), now, reached)
    order = tell(stop.order, command, _patience(command, config), now)
    return replace(stop, order=order, reached=reached)


def hear_stop(stop: StopOrder, event: RealMeasured, stands: bool, config: Stop) -> StopOrder | None:
    """Return the stop after an answer of the robot; None once nothing of it is left to do.

    Args:
        stop: What the robot was told.
        event: Its answer. One to a question from before the stop tells nothing about it.
        stands: Its joints have not moved for a while.
        config: How long HOLD stays away at least, and how long the robot is watched after that.
    """
    told = stop.order.sent if stop.given_back is None else stop.given_back
    if event.sent <= told:
        return stop
    if stop.order.wanted is Command.END_AT_REST:
        # HOLD is there, and what was started at the pendant behind the stream is not ours to stop.
        return stop if event.streaming else None
    if stop.given_back is not None:
        if not stop.left:
            # What runs from here on was begun by somebody.
            return None
        if event.runs:
            # It went on by itself when HOLD came back, so it is stopped anew.
            order = replace(stop.order, shown=False)
            return StopOrder(order, event.now)
        watched = event.sent - told >= config.retry_ms * 1e-3
        return None if watched else stop
    shown = not event.runs and (stop.reached or not event.loaded)
    since = stop.since if stop.reached else event.now
    order = replace(stop.order, shown=shown)
    stop = replace(stop, order=order, since=since, left=event.loaded, stands=stands and shown)
    if stop.order.wanted is Command.HOLD_REAL and stop.stands:
        # HOLD stays away: RESUME gives it back.
        return None
    return stop


def may_give_back(stop: StopOrder, config: Stop, now: float) -> bool:
    """Return whether the robot has stopped, and every pulse that was on its way has ended."""
    told_for = now - stop.order.sent
    return stop.given_back is None and stop.stands and told_for >= config.hold_ms * 1e-3


def disobeyed(stop: StopOrder | None, config: Stop, now: float) -> bool:
    """Return whether the real robot, which answers, still moves or runs after its time."""
    if stop is None or stop.given_back is not None:
        return False
    most = stop.order.patience.most
    time = config.attempts * config.retry_ms * 1e-3
    return bool(due([stop.order], now).failures) or (
        most is not None and not stop.stands and now - stop.since > time
    )


def stop_again(
    stop: StopOrder | None, config: Stop, now: float
) -> tuple[StopOrder | None, list[SendReal]]:
    """Send a stop again that the real robot should show by now."""
    if stop is None or stop.given_back is not None:
        return stop, []
    for again in due([stop.order], now).sends:
        why = "the real robot does not show it yet"
        if again.wanted is Command.END_AT_REST:
            stop = replace(stop, since=now)
            again = replace(again, wanted=Command.STOP_REAL, patience=stop_patience(config))
        return replace(stop, order=again, reached=True), [SendReal(again.wanted, why)]
    return stop, []


def tell_estop(order: EStopOrder | None, config: EStop, now: float) -> EStopOrder:
    """Return the order after one of the two sides was told."""
    return tell(order, LATCHED, Patience(config.retry_ms * 1e-3), now)


def estop_missed(order: EStopOrder | None, shown: bool, now: float) -> bool:
    """Return whether a side should have obeyed by now and does not; None: it is not latched."""
    return order is not None and bool(due([replace(order, shown=shown)], now).sends)


STOPPING_TWIN = (Command.STOP_TWIN, Command.PAUSE_TWIN, Command.ESTOP_TWIN)
MOVING_TWIN = (
    Command.BEGIN_ALIGN,
    Command.BEGIN_FOLLOW_TWIN,
    Command.BEGIN_STREAM,
    Command.MOVE_TWIN,
    Command.RESUME_TWIN,
    Command.RESET_TWIN,
)
"""After one of these the twin may move again."""


class TwinStop(msgspec.Struct, frozen=True):
    """A stop, pause or emergency stop that the twin has not shown yet.

    Attributes:
        order: What it was told last.
        since: When it was told so first [s].
    """

    order: Order[Command]
    since: float

    @property
    def defied(self) -> bool:
        """Whether it was decided that the twin does not obey: that is decided once."""
        return self.order.patience.most is None


def tell_twin_stop(stop: TwinStop | None, command: Command, config: Stop, now: float) -> TwinStop:
    """Return the stop after the twin was told ``command`` at ``now`` [s]."""
    period = config.twin_retry_ms * 1e-3
    patience = Patience(period, config.attempts, GiveUp.STOP_PAIR)
    if stop is not None and stop.defied:
        patience = stop.order.patience
    if stop is None or stop.order.wanted is not command:
        return TwinStop(tell(None, command, patience, now), now)
    return replace(stop, order=tell(stop.order, command, patience, now))


def strike_off(stop: TwinStop | None, twin: TwinSide, config: Change) -> TwinStop | None:
    """Return the stop, None once the twin has stood for a while since it was told last."""
    if stop is None or not twin.history:
        return stop
    told_for = twin.last.time - stop.order.sent
    stands = stands_still(twin.change, twin.last.time, config)
    if stands and told_for >= config.still_time_ms * 1e-3:
        return None
    return stop


def speeds_since(twin: TwinSide, heard: float, velocity: Joints) -> tuple[float, float]:
    """Return the lowest and the newest speed of its fastest joint since ``heard`` [s].

    As a part of that joint's largest speed; zeros without a sample.
    """
    shares = [
        max(abs(v) / most for v, most in zip(sample.qdot, velocity))
        for sample in twin.history
        if sample.time >= heard
    ]
    return (min(shares), shares[-1]) if shares else (0.0, 0.0)


def moves_on(stop: TwinStop | None) -> bool:
    """Return whether the twin had to be told again: nobody may follow it then."""
    return stop is not None and stop.order.attempts > 1


def twin_disobeyed(stop: TwinStop | None, now: float) -> bool:
    """Return whether the twin, which answers, moves on after all attempts."""
    return stop is not None and bool(due([stop.order], now).failures)


def twin_stop_again(stop: TwinStop | None, now: float) -> Command | None:
    """Return what the twin is to be told once more now; None: nothing."""
    if stop is None or not due([stop.order], now).sends:
        return None
    return stop.order.wanted


def defy(stop: TwinStop | None) -> TwinStop | None:
    """Return the stop after it was decided that the twin does not obey it."""
    if stop is None:
        return None
    endless = Patience(stop.order.patience.period)
    return replace(stop, order=replace(stop.order, patience=endless))


def defied_text(stop: TwinStop, twin: TwinSide) -> str:
    """Say what the twin has done instead of obeying."""
    told = stop.order.wanted.name.removesuffix("_TWIN")
    went_on = max(0.0, twin.last.time - stop.since)
    return f"it moved on {went_on:.1f} s after {told} was told {stop.order.attempts} times"
