"""Recognise the follower's motion as the answer to our own commands.

A follower may be anywhere between where its recent commands were, plus a tolerance that is wide only for the joints
that were told to move. Inside this tube its motion is an echo; outside, it moves on its own. One that came to rest beside
its last command may go on settling towards it for as long as its drive needs; its agreed position goes along.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.events import Joints


class EchoTube(msgspec.Struct, frozen=True):
    """The last commands to one side: (time [s], position in border units)."""

    commands: tuple[tuple[float, Joints], ...] = ()


def remember(tube: EchoTube, t: float, q: Joints, memory: float) -> EchoTube:
    """Add a command sent at ``t`` [s] and forget those older than ``memory`` [s], but never the newest."""
    kept = [command for command in tube.commands if t - command[0] <= memory]
    return EchoTube((*kept, (t, q)))


def is_echo(tube: EchoTube, t: float, q: Joints, memory: float, rest: float, tolerance: float) -> bool:
    """Return whether ``q`` at ``t`` [s] lies in the tube of the commands of the last ``memory`` seconds.

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
    return all(_inside(value, axis, rest, tolerance) for value, axis in zip(q, zip(*recent)))


def is_settling(tube: EchoTube, mean: Joints, agreed: Joints, reach: float, step: float) -> bool:
    """Return whether a side that stands is on its way from its agreed position to its last command.

    Args:
        tube: Commands sent.
        mean: Where it stands, without noise, border units.
        agreed: Its agreed position, border units.
        reach: How far that may be from the last command.
        step: Half of the smallest step of an agreed position: no more beyond it, else the agreed position would go with
            whoever creeps away.
    """
    if not tube.commands or not len(mean) == len(agreed) == len(tube.commands[-1][1]):
        return False
    return all(
        abs(place - command) <= reach and min(place, command) - step <= value <= max(place, command) + step
        for value, place, command in zip(mean, agreed, tube.commands[-1][1])
    )


def _inside(value: float, commanded: tuple[float, ...], rest: float, tolerance: float) -> bool:
    low, high = min(commanded), max(commanded)
    margin = rest + tolerance if high - low > rest else rest
    return low - margin <= value <= high + margin
