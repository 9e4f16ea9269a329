"""Recognise the follower's motion as the answer to our own commands.

A follower may be anywhere between where its recent commands were, plus a tolerance that is wide
only for the joints that were told to move. Inside this tube its motion is an echo; outside, it
moves on its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from twin_controller.config import Change
from twin_controller.core.events import Joints


class EchoTube(msgspec.Struct, frozen=True):
    """The last commands to one side: (time [s], position in border units)."""

    commands: tuple[tuple[float, Joints], ...] = ()
    # Around the place where the side rests, how far it may go on settling, border units; 0: it was
    # sent somewhere since.
    settles: float = 0.0


def remember(tube: EchoTube, commands: Sequence[tuple[float, Joints]], memory: float) -> EchoTube:
    """Add commands by their time [s], instead of those for then or later.

    Those older than ``memory`` [s] are forgotten.
    """
    first, last = commands[0][0], commands[-1][0]
    kept = [command for command in tube.commands if last - memory <= command[0] < first]
    return EchoTube((*kept, *commands))


def rested(tube: EchoTube, reach: float) -> EchoTube:
    """Return what counts once the side rests where it was sent: that place alone.

    Args:
        tube: Commands sent.
        reach: How far from there one that was on its way may still be, and settle, border units.
    """
    ways = zip(*(position for _, position in tube.commands))
    moved = any(max(way) - min(way) > reach for way in ways)
    return EchoTube(tube.commands[-1:], reach if moved else 0.0)


def answers(tube: EchoTube, t: float, q: Joints, config: Change) -> bool:
    """Return whether ``q`` (border units) at ``t`` [s] is an echo, by a side's thresholds."""
    rest = config.hysteresis + 0.5 * 10.0**-config.decimals
    return is_echo(tube, t, q, config.echo_memory_ms * 1e-3, rest, config.echo_tolerance)


def is_echo(
    tube: EchoTube, t: float, q: Joints, memory: float, rest: float, tolerance: float
) -> bool:
    """Return whether ``q`` at ``t`` [s] lies in the tube of the last ``memory`` seconds.

    Args:
        tube: Commands sent.
        t: When the position was true [s].
        q: Position, border units.
        memory: How long a command is remembered [s].
        rest: Half width of the tube for a joint that was not told to move, border units.
        tolerance: What is added for a joint that was.
    """
    recent = [position for sent, position in tube.commands if abs(t - sent) <= memory]
    if not recent:
        return False
    for value, commanded in zip(q, zip(*recent)):
        low, high = min(commanded), max(commanded)
        # A joint that was told to move may lag or overshoot; one that was not has no reason to.
        margin = rest + tolerance if high - low > rest else max(rest, tube.settles)
        if not low - margin <= value <= high + margin:
            return False
    return True
