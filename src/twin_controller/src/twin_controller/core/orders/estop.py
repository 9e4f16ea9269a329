"""An emergency stop stays latched: a side that was not reached, or is let go, is told again."""

from __future__ import annotations

import msgspec

from twin_controller.config import EStop
from twin_controller.core.actions import Command
from twin_controller.core.events import TwinMotion
from twin_controller.core.orders.book import due
from twin_controller.core.orders.order import Order, Patience, tell

EStopOrder = Order[tuple[Command, ...]]
"""To both sides; it is never given up."""

LATCHED = (Command.ESTOP_REAL, Command.ESTOP_TWIN)


def tell_estop(order: EStopOrder | None, config: EStop, now: float) -> EStopOrder:
    """Return the order after one of the two sides was told."""
    return tell(order, LATCHED, Patience(config.retry_ms * 1e-3), now)


def estop_missed(
    order: EStopOrder | None, off: bool, motion: TwinMotion, old: bool, now: float
) -> bool:
    """Return whether a side should have obeyed by now and does not.

    Args:
        order: The emergency stop; None: it is not latched.
        off: The real robot shows it: its drives are off, or it stands where nothing cuts them.
        motion: The twin's report.
        old: The twin's report is from before our last command to it.
        now: Time [s].
    """
    if order is None:
        return False
    shown = off and (motion.state == "estopped" or old)
    return bool(due([msgspec.structs.replace(order, shown=shown)], now).sends)
