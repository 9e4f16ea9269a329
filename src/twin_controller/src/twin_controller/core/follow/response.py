"""How the real robot answers its set points: measured from what it was told and what it did.

Delay and smoothing of each joint (:mod:`twin_controller.estimation.delay`), each measurement
weighed against what was known, and with what speed the robot keeps up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from twin_controller.config import ResponseConfig
from twin_controller.core.events import Joints, RealKnown
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import RealSide
from twin_controller.estimation.delay import Array, Fit, fit_joint

replace = msgspec.structs.replace

EVERY_S = 0.05
"""Between two measurements [s]: each takes about a millisecond."""
MOVED, TOLD, LASTED = 0.1, 0.3, 10
"""A joint is measured that has been away by so much for so many readings, and was told to move so
far, border units: how a motion begins says little of its delay."""
LEAST_DEVIATION_S = 0.0005
"""No delay is known better [s]."""
JUMPED = 4.0
"""A measurement so many standard deviations away is a delay that has changed."""
HELD_S = 0.03
"""Set points that were slowed down for so long have taken a robot to its limit [s]."""
FIRST_SPREAD_S, SPREAD_GAIN = 0.003, 0.2
"""The delay of a stream differs so much from that of the one before until it is known [s], and so
much counts what a stream shows of it: 3 ms are what steps of 8 to 12 ms make. Our choice."""
MEASURED_S, RECALLED_S = LEAST_DEVIATION_S, 0.003
"""A delay is known so well that was measured beforehand, or learned at an earlier start [s]; our
choice: a payload changes less."""
JUMP_GAIN, SMOOTHING_GAIN = 0.3, 0.2
"""So much of what was measured counts at once at least, of a delay that has changed and of a
smoothing."""
MOST_SMOOTHING = 2.5e-3
"""No larger one is reckoned with [s^2]: two filters of 170 ms have that."""
LED_STEP_S = 0.02
"""Speeds that a robot was told are differences over this time [s]."""
SLOWEST_PERCENT = 4.0
"""Slower than this shows nothing of a delay; our choice."""
SLOWER, FASTER, NEARLY = 0.9, 1.1, 0.9
"""A robot that falls behind is led so much slower, one that keeps up so much faster. Our choice."""


class Response(msgspec.Struct, frozen=True):
    """How the real robot answers its set points; one entry a joint."""

    # Mean of the filters' weights [s]: by so much each joint is late.
    delay: Joints
    # Half of their variance [s^2]: an acceleration is rounded off by so much.
    smoothing: Joints
    # Standard deviation of each delay [s].
    doubt: Joints
    # The speed with which the robot has kept up so far [percent of the joints' largest].
    pace: float
    # The least speed with which it has fallen behind [percent].
    behind_at: float = 100.0
    # When its set points were held back last [s]: a robot at its limit is late for that reason.
    held_at: float = -1e9
    # Since when without a break [s]; None while they are not: a single one makes no robot late.
    held_since: float | None = None
    # When it was measured last [s].
    at: float = -1e9
    # Standard deviation of the delay from one stream to the next [s], of a robot that takes set
    # points in a rhythm of its own: where in it they come is new each time.
    spread: float = FIRST_SPREAD_S
    # The delays with which this stream began [s]; empty once it has shown its own.
    begun: Joints = ()
    # It was learned at an earlier start, and this one's first motion has not borne it out yet.
    recalled: bool = False
    # That motion did not: the robot is another one, or is loaded otherwise.
    changed: bool = False

    @property
    def longest(self) -> float:
        """Delay of the slowest joint [s]."""
        return max(self.delay)


def assumed(config: ResponseConfig, names: Sequence[str]) -> Response:
    """Return what is known of the robot before it has followed.

    Args:
        config: Numbers, and what was measured beforehand, if anything.
        names: The joints.
    """
    pace = config.first_percent
    if config.measured is None:
        first, count = config.first_ms * 1e-3, len(names)
        return Response((first,) * count, (0.0,) * count, (first,) * count, pace)
    before = [config.measured[name] for name in names]
    return Response(
        tuple(joint.delay_ms * 1e-3 for joint in before),
        tuple(joint.smoothing_ms2 * 1e-6 for joint in before),
        (MEASURED_S,) * len(before),
        pace,
    )


def recalled(config: ResponseConfig, response: Response, event: RealKnown) -> Response:
    """Return what earlier starts have learned; it is believed as far as a load may have changed.

    Delays that a person has measured and written down go before it.
    """
    if config.measured is not None:
        return replace(response, pace=event.pace, behind_at=event.behind_at, spread=event.spread)
    return Response(
        event.delay,
        event.smoothing,
        (RECALLED_S,) * len(event.delay),
        event.pace,
        event.behind_at,
        spread=event.spread,
        recalled=True,
    )


def known(response: Response, config: ResponseConfig) -> bool:
    """Return whether the delay of a joint, and so about that of all, has been measured."""
    return min(response.doubt) <= config.known_ms * 1e-3


def begun(setup: Setup, response: Response, ahead: bool) -> Response:
    """Return what is known of the robot when a stream begins.

    Args:
        setup: Numbers.
        response: What is known of it.
        ahead: It takes set points ahead of their time, so a delay is that of its drives alone.
    """
    if ahead or not known(response, setup.config.response):
        return response
    doubt = tuple([math.hypot(one, response.spread) for one in response.doubt])
    return replace(response, doubt=doubt, begun=response.delay)


def measured(setup: Setup, response: Response, real: RealSide, held: bool = False) -> Response:
    """Take the newest readings of a robot that follows in.

    Args:
        setup: Profile and numbers.
        response: What is known so far.
        real: Its readings, and what it was told.
        held: Its set points are being slowed down.
    """
    config = setup.config.response
    if not real.history or not real.tube.commands:
        return response
    response = _held(response, real.last.time, held)
    due = max(response.at + EVERY_S, response.held_at + config.window_ms * 1e-3)
    if real.last.time < due:
        return response
    begin = real.last.time - config.window_ms * 1e-3
    rows = [sample for sample in real.history if sample.time > begin]
    told_at = np.array([t for t, _ in real.tube.commands])
    told = np.array([q for _, q in real.tube.commands])
    seen_at = np.array([sample.time for sample in rows])
    seen = np.array([setup.to_border(sample.q) for sample in rows])
    longest = config.longest_ms * 1e-3
    fits: dict[int, Fit] = {}
    for k in range(len(response.delay)):
        moving = int(np.sum(np.abs(seen[:, k] - seen[0, k]) > MOVED))
        if moving < LASTED or np.ptp(told[:, k]) < TOLD:
            continue
        fit = fit_joint(told_at, told[:, k], seen_at, seen[:, k], response.smoothing[k], longest)
        if fit is not None and fit.doubt <= config.known_ms * 1e-3:
            fits[k] = fit
    if not fits:
        return response
    # What it did in the newer half of the window it was told by its delay before.
    end = real.last.time - response.longest
    led = _led(setup, told_at, told, end - 0.5 * config.window_ms * 1e-3, end)
    paced = _paced(response, fits, led, config)
    return replace(_joined(paced, fits, config), at=real.last.time)


def _held(response: Response, now: float, held: bool) -> Response:
    """Remember when its set points were held back for longer than for a moment."""
    since = response.held_since
    if not held:
        if since is None:
            return response
        return replace(response, held_since=None)
    if since is None:
        since = now
    if now - since >= HELD_S:
        response = replace(response, held_at=now)
    return replace(response, held_since=since)


def _joined(response: Response, fits: dict[int, Fit], config: ResponseConfig) -> Response:
    """Weigh what was measured against what was known."""
    delay, smoothing, doubt = list(response.delay), list(response.smoothing), list(response.doubt)
    best = min(fits, key=lambda k: fits[k].doubt)
    if response.recalled:
        changed = abs(fits[best].delay - delay[best]) > config.behind_ms * 1e-3
        if changed:
            doubt = [config.first_ms * 1e-3] * len(doubt)
            response = replace(response, pace=config.first_percent, behind_at=100.0, begun=())
        response = replace(response, recalled=False, changed=changed)
    if response.begun and fits[best].doubt <= FIRST_SPREAD_S:
        step = fits[best].delay - response.begun[best]
        spread = math.sqrt((1.0 - SPREAD_GAIN) * response.spread**2 + SPREAD_GAIN * step**2)
        response = replace(response, spread=spread, begun=())
    for k, fit in fits.items():
        gain = doubt[k] ** 2 / (doubt[k] ** 2 + fit.doubt**2)
        off = fit.delay - delay[k]
        jumped = abs(off) > JUMPED * (doubt[k] + fit.doubt)
        if jumped:
            gain = max(gain, JUMP_GAIN)
        delay[k] += gain * off
        # Of a joint that was hardly known, what is measured first counts as for its delay.
        smoothing[k] += max(SMOOTHING_GAIN, gain) * (
            min(max(fit.smoothing, 0.0), MOST_SMOOTHING) - smoothing[k]
        )
        doubt[k] = max((1.0 - gain) ** 0.5 * doubt[k], LEAST_DEVIATION_S)
        if jumped:
            doubt[k] = max(doubt[k], (1.0 - gain) * abs(off))
    # A joint that was not seen yet is as late as the others, about.
    most = config.known_ms * 1e-3
    others = [delay[k] for k in fits]
    rounded = [smoothing[k] for k in fits]
    for k in range(len(delay)):
        if doubt[k] >= most and k not in fits:
            delay[k], doubt[k] = sum(others) / len(others), most
            smoothing[k] = sum(rounded) / len(rounded)
    return replace(response, delay=tuple(delay), smoothing=tuple(smoothing), doubt=tuple(doubt))


def _paced(
    response: Response, fits: dict[int, Fit], led: float, config: ResponseConfig
) -> Response:
    """Find the speed with which the robot keeps up.

    Args:
        response: What was known before.
        fits: What was measured.
        led: With what program speed it was led meanwhile [percent].
        config: Numbers.
    """
    if not known(response, config):
        return response
    late = max(fit.delay - response.delay[k] for k, fit in fits.items())
    if late > config.behind_ms * 1e-3 and led > 0.5 * response.pace:
        pace = max(SLOWER * min(led, response.pace), SLOWEST_PERCENT)
        return replace(response, pace=pace, behind_at=max(min(led, response.behind_at), pace))
    if late < 0.5 * config.behind_ms * 1e-3 and led >= NEARLY * response.pace:
        most = 100.0 if response.behind_at >= 100.0 else NEARLY * response.behind_at
        return replace(response, pace=max(response.pace, min(FASTER * response.pace, most)))
    return response


def _led(setup: Setup, told_at: Array, told: Array, begin: float, end: float) -> float:
    """Return the program speed that the robot was led with [percent].

    A short move never reaches its speed: it asks for acceleration, which grows with the square of
    the program speed.
    """
    at = np.arange(begin, end, LED_STEP_S)
    way = np.stack([np.interp(at, told_at, column) for column in told.T], axis=1)
    speed = np.abs(way[-1] - way[0]) / (at[-1] - at[0]) / setup.to_border(setup.velocity)
    velocity = np.diff(way, axis=0) / LED_STEP_S
    change = np.abs(np.diff(velocity, axis=0)) / LED_STEP_S
    acceleration = change.max(axis=0) / setup.to_border(setup.acceleration)
    return float(100.0 * max(speed.max(), math.sqrt(acceleration.max())))
