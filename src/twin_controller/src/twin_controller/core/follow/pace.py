r"""With what speed the real robot can be led: never faster than it follows.

What is not known of its delay, :math:`\sigma_k` of joint k, puts the tools apart in motion:

.. math:: e = \sum_k \sigma_k\, l_k\, |\dot q_k|

with the lever :math:`l_k` by which it moves the tool. So the twin is slow enough for :math:`e` to
stay below a part of the reach. It is the same for a robot that nobody knows, for a joint that has
not moved yet and for a delay that has changed.
"""

from __future__ import annotations

import math

from twin_controller.core.follow.memory import Follow
from twin_controller.core.follow.real import planned
from twin_controller.core.follow.response import SLOWEST_PERCENT
from twin_controller.core.safety.fastest import Cap
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Sides

ALONE = "the real robot takes one set point after the other, and needs the rest to keep up"


def follower_pace(setup: Setup, follow: Follow, sides: Sides, cap: float, now: float) -> Cap:
    """Return with what speed the real robot can be led, and why with no more.

    Args:
        setup: Profile and numbers.
        follow: What was measured of how it follows, and what its set points reckon with.
        sides: Both sides; the twin's plan tells which joints move.
        cap: The operator's cap of the program speed [percent].
        now: Time [s].
    """
    response, sure, alone = follow.response, _sure(setup, follow, sides, now), math.inf
    flags = sides.real.flags
    if flags is not None and not sides.real.takes_ahead:
        most = min(setup.config.limit.told_percent, cap, max(flags.override_percent, 1.0))
        alone = sides.twin.program_speed(setup.config.stream.alone_percent * 1e-2 * most)
    if alone < min(response.pace, sure):
        return Cap(alone, ALONE)
    if sure < response.pace:
        late = 1e3 * max(response.delay)
        anew = "it answers otherwise than before: " if response.changed else ""
        return Cap(
            sure, f"{anew}how late the real robot follows is being measured: about {late:.0f} ms"
        )
    if response.behind_at < 100.0:
        return Cap(response.pace, f"the real robot falls behind at {response.behind_at:.0f} %")
    return Cap(response.pace, "the real robot has not shown yet that it keeps up with more")


def _sure(setup: Setup, follow: Follow, sides: Sides, now: float) -> float:
    """Return the speed at which what is not known of the delay costs little."""
    response, stream = follow.response, follow.real
    wrong = response.doubt
    if stream is not None and stream.delay:
        # The set points go towards a delay that has changed bit by bit.
        aims = zip(wrong, response.delay, stream.delay)
        wrong = tuple([doubt + abs(delay - aim) for doubt, delay, aim in aims])
    shares = sides.twin.shares if planned(sides.twin, now) else ()
    each = [doubt * speed for doubt, speed in zip(wrong, setup.tool_speeds)]
    # Who does not say where the twin is going moves one joint, about.
    apart = sum([share * one for share, one in zip(shares, each)]) if shares else max(each)
    allowed = setup.config.response.doubt_percent * 1e-5 * setup.reach_mm
    percent = 100.0 * allowed / max(apart, 1e-9)
    return max(sides.twin.program_speed(percent), SLOWEST_PERCENT)
