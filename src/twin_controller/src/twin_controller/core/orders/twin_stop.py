"""The twin must show a stop too: it comes to rest, whatever it reports.

Its pose controller may report that it obeys while somebody commands a joint directly. So only its
measured positions count. A twin that moves on is told again, in the end that is a fault of the
pair; from then on it is told without end until it stands.
"""

from __future__ import annotations

import msgspec

from twin_controller.config import Change, Stop
from twin_controller.core.actions import Command
from twin_controller.core.events import Joints
from twin_controller.core.orders.order import GiveUp, Order, Patience, due, tell
from twin_controller.core.sides.change import stands_still
from twin_controller.core.sides.side import TwinSide

replace = msgspec.structs.replace

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
