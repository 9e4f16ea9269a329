r"""When a set point is sent to the real robot, and when the robot takes it.

A robot takes set points at the ticks of its own clock and smooths them by filters made for one
spacing. Sent whenever an answer came, they are taken 8, 10 or 12 ms apart instead of every 10: a
ripple of speed that asks for several times the largest acceleration. Therefore each is sent so that
it arrives soon after a tick, which leaves nearly a whole period for what delays it on its way, and
the ticks at which they are taken are a fixed spacing apart:

.. math:: t_{k+1} = t_k + n\,T_{stream}, \quad t_k = t_{sample} + m\,T_{sample}

with the smallest n that can still be reached. All that are due before the next decision, even if
that is late, are decided at once. Everything is in local time; the robot's ticks are known from the
stamp of its newest sample, so its drift is followed.
"""

from __future__ import annotations

import math

import msgspec

PREPARED_S = 0.0004
"""From a decision to its request [s]; measured: 0.1 ms median, 0.5 ms in the worst per cent."""

AFTER, ROUGHLY = 0.15, 3.0
"""A set point arrives behind a tick by this part of a period, or by so many standard deviations of
the stamps that tell of the ticks, but not beyond the middle of a period."""

TICK_GAIN = 0.05
"""Part by which a set point goes towards its tick: a stamp may be read wrongly, a rhythm stays."""


class SendSlot(msgspec.Struct, frozen=True):
    """When a set point is sent and when the robot takes it [s]."""

    send_at: float
    taken_at: float


def next_slots(
    now: float,
    tick: float,
    tick_period: float,
    jitter: float,
    spacing: float | None,
    ahead: float,
    travel_time: float,
    last: float | None,
) -> list[SendSlot]:
    """Find when the set points are sent that are decided now.

    These are all that are due before the next decision may come.

    Args:
        now: Time of the decision [s].
        tick: A tick of the robot [s], near ``now``.
        tick_period: How often the robot ticks [s].
        jitter: How roughly it says when; standard deviation [s].
        spacing: Between two set points [s], a multiple of the period; None: one at once for each
            decision.
        ahead: All set points are decided that are sent within this time [s]: longer than until the
            next decision.
        travel_time: How long a request is under way to the robot [s].
        last: When the set point before is taken [s]; None: there is none.

    Returns:
        One slot for each spacing; none if the set point before is still to be sent.
    """
    if spacing is None:
        due = last is None or now > last
        if due:
            return [SendSlot(now, now)]
        return []
    after = min(max(AFTER * tick_period, ROUGHLY * jitter), 0.5 * tick_period)
    lead = travel_time + tick_period - after
    # The first tick that can still be reached ...
    first = tick + math.ceil((now + PREPARED_S + lead - tick) / tick_period) * tick_period
    taken = first
    if last is not None:
        # ... but in the rhythm of the set point before: spacings that were missed are left out.
        missed = max(0, math.ceil((first - last - 0.5 * tick_period) / spacing) - 1)
        taken = _toward_tick(tick, tick_period, last + (1 + missed) * spacing)
    slots = []
    while taken - lead <= now + ahead:
        slots.append(SendSlot(taken - lead, taken))
        # Rounding to a tick follows the drift of the robot's clock.
        taken = _toward_tick(tick, tick_period, taken + spacing)
    return slots


def _toward_tick(tick: float, tick_period: float, time: float) -> float:
    """Return ``time``, a little nearer to the tick next to it."""
    nearest = tick + round((time - tick) / tick_period) * tick_period
    return time + TICK_GAIN * (nearest - time)
