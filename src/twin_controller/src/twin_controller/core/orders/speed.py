"""Program speed of both sides: what was ordered, and what counts as shown."""

from __future__ import annotations

import msgspec

from twin_controller.config import SpeedOrders
from twin_controller.core.orders.order import Order, Patience

SpeedOrder = Order[float]
"""A cap of the twin, or an override of the real robot [percent]; it is never given up."""


class Speeds(msgspec.Struct, frozen=True):
    """Program speed [percent], what of it is ordered, and why it was limited."""

    # The operator's cap for both sides.
    cap: float = 100.0
    # What the leader asks for and what it gets; shown and published, nothing is decided by them.
    requested: float = 0.0
    applied: float = 0.0
    limited: bool = False
    reason: str = ""
    # The cap that the twin was sent last; forgotten with its link, so that a new twin is told.
    twin: SpeedOrder | None = None
    # The override that the real robot was sent last.
    real: SpeedOrder | None = None
    # The robot's own override before we lowered it; None once it has that back.
    own_override: float | None = None


def speed_patience(config: SpeedOrders) -> Patience:
    """Return how long a side may take to show a cap or an override."""
    return Patience(config.retry_ms * 1e-3)


def cap_step(cap: float, config: SpeedOrders) -> float:
    """Return how far the twin's cap may be from ``cap`` [percent]: a small cap must be finer."""
    return min(config.step_percent, config.step_ratio * cap)


def shows_override(wanted: float, shown: float, config: SpeedOrders) -> bool:
    """Return whether the robot shows an override: it knows whole percents."""
    return abs(wanted - shown) < config.step_percent
