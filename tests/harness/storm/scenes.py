"""What is done in a scene, drawn from its seed alone: the same seed gives the same deeds.

A scene is a row of phrases: somebody sets the pair in motion, perhaps something breaks, somebody
stops it, nobody does anything for a while, then the stop is taken back. It opens with a phrase that
an idle pair needs, by turns: a node stands still while a request and a stop come, the page moves
the pair beside a stranger, or a program goes on that never hears of a stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from harness.storm.names import (
    DEAF,
    JOINTS,
    LEADS_ON,
    MOTIONS,
    NODES,
    OTHERS,
    READY_S,
    RELEASES,
    STOPS,
    STRIKES,
    THROUGH,
    WAY_BACK,
    WHOLE,
    Name,
    arguments,
)

SECONDS = 14.0
"""A scene lasts about so long, without what leads back to IDLE."""
OPENINGS = ("stalled", "page", "stalled", "deaf")
"""What scenes open with, by turns."""
DAY = 1640
"""The seed of each ordinary run: its first scene has a node that stands still with a request and a
stop, a bad line, and a clock that jumps."""
BURST_S = 0.1
"""So long a deed lasts that is repeated, where a stop shall come behind it."""
DEAF_S = 3.0
KILLS = 1
"""At most so many nodes are killed in a scene: each start takes a second of a core."""


@dataclass(frozen=True)
class Step:
    """What is done at ``at`` [s] after the scene's begin."""

    at: float
    name: str
    arguments: tuple[float | str, ...] = ()

    def __str__(self) -> str:
        words = " ".join(f"{a:.3g}" if isinstance(a, float) else a for a in self.arguments)
        return f"{self.at:6.2f} {self.name} {words}".rstrip()


def opening(seed: int, scene: int) -> str:
    """Return what a scene opens with."""
    return OPENINGS[(seed + scene) % len(OPENINGS)]


def draw(seed: int, scene: int, seconds: float = SECONDS) -> list[Step]:
    """Return the steps of a scene in their order."""
    rng = Random(f"storm {seed} {scene}")
    steps: list[Step] = []
    first = opening(seed, scene)
    if first == "stalled":
        at = _stalled(rng, 0.3, steps, NODES[(5 * seed + scene // 2) % len(NODES)])
    else:
        at = _page(rng, 0.3, steps) if first == "page" else _deaf(rng, 0.3, steps)
    at = _ordinary(rng, _sure(rng, at, steps), steps)
    while at < seconds - 3.0:
        at = _phrase(rng, at, steps)
    return sorted(_few_kills(steps), key=lambda step: step.at)


def _stalled(rng: Random, at: float, steps: list[Step], node: str) -> float:
    """Append a standstill of a node in which somebody asks for a motion, then somebody stops."""
    seconds = rng.choice((0.3, 0.5, 1.0))
    request = rng.choice(THROUGH.get(node, ("MOVE_JOINTS", "joint move", "jog")))
    steps.append(Step(round(at, 3), "halt", (node, seconds)))
    at += READY_S
    steps.append(Step(round(at + 0.06, 3), request, arguments(rng, request, BURST_S)))
    stop = at + 0.22 + rng.random() * (seconds - 0.25)
    steps.append(Step(round(stop, 3), rng.choice(WHOLE)))
    return at + seconds + rng.uniform(0.8, 1.5)


def _page(rng: Random, at: float, steps: list[Step]) -> float:
    """Append a jog of the page to and fro, a stranger's MOVE in it and one behind it, and a stop.

    Behind it the pair is idle, so that nothing but control keeps the stranger off.
    """
    name, part = rng.choice(JOINTS), rng.choice((-0.1, 0.1))
    steps.append(Step(at, "page jog", (name, part, 0.6)))
    steps.append(Step(round(at + 0.7, 3), "page jog", (name, -part, 0.6)))
    for later in (rng.uniform(0.3, 1.2), 2.4):
        there = (0.5, round(rng.uniform(-0.2, 0.2), 3), 0.1, 30.0)  # can be reached
        steps.append(Step(round(at + later, 3), "gateway MOVE", there))
    steps.append(Step(round(at + 3.0, 3), rng.choice(WHOLE)))
    return at + 3.5


def _deaf(rng: Random, at: float, steps: list[Step]) -> float:
    """Append a program that sends the same again and again, and a stop that it never hears of."""
    name, period = rng.choice(DEAF), rng.choice((0.4, 1.0))
    for k in range(int(DEAF_S / period)):
        steps.append(Step(round(at + k * period, 3), name, arguments(rng, name, BURST_S)))
    steps.append(Step(round(at + rng.uniform(0.3, 1.2), 3), rng.choice(WHOLE)))
    return at + DEAF_S + 0.5


def _back(rng: Random, at: float, steps: list[Step]) -> float:
    """Append what leads back to IDLE, without which most commands would be refused."""
    for name in WAY_BACK:
        _add(rng, at, (name,), steps)
        at += 0.3
    return at + rng.uniform(0.1, 1.0)


def _sure(rng: Random, at: float, steps: list[Step]) -> float:
    """Append a way back and a motion that both sides have far to go for."""
    at = _back(rng, at, steps)
    steps.append(Step(round(at, 3), "MOVE_JOINTS", arguments(rng, "MOVE_JOINTS", 0.0)))
    return at + 0.4


def _phrase(rng: Random, at: float, steps: list[Step]) -> float:
    """Append motion, fault, stop, silence and release from ``at`` on; return where it ends.

    Most phrases begin with what leads back to IDLE. Some are a standstill or a program that hears
    of no stop.
    """
    if rng.random() < 0.7:
        at = _back(rng, at, steps)
    kind = rng.random()
    if kind < 0.2:
        return _stalled(rng, at, steps, rng.choice(NODES))
    return _deaf(rng, at, steps) if kind < 0.3 else _ordinary(rng, at, steps)


def _ordinary(rng: Random, at: float, steps: list[Step]) -> float:
    """Append motion, perhaps a fault, a stop, silence, and what takes the stop back."""
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3))):
        _add(rng, at, MOTIONS, steps)
        at += rng.choice((0.0, 0.01, 0.1, 0.4)) * rng.random()
    under_way = at + 0.04 + rng.choice((0.05, 0.3, 1.5)) * rng.random()
    if rng.random() < 0.3:
        _add(rng, under_way, OTHERS, steps)
    if rng.random() < 0.6:
        _add(rng, rng.uniform(at, under_way + 0.5), STRIKES, steps)
    if rng.random() < 0.8:
        _add(rng, under_way, STOPS, steps)
    at = under_way + rng.uniform(0.8, 2.0)
    if rng.random() < 0.7:
        _add(rng, at, RELEASES, steps)
        at += rng.uniform(0.7, 1.2)
    for name in rng.sample(LEADS_ON, rng.choice((0, 1, 2))):
        _add(rng, at, (name,), steps)
        at += rng.uniform(0.3, 1.0)
    return at + rng.uniform(0.0, 0.5)


def _add(rng: Random, at: float, names: Sequence[Name], steps: list[Step]) -> None:
    name = rng.choice(names)
    steps.append(Step(round(at, 3), name.text, name.draw(rng)))


def _few_kills(steps: list[Step]) -> list[Step]:
    """Return the steps without the kills beyond ``KILLS``."""
    kills = [step for step in steps if step.name == "kill"]
    return [step for step in steps if step not in kills[KILLS:]]
