"""What is done in a scene, drawn from its seed alone: the same seed gives the same deeds.

A scene is a row of phrases: somebody sets the pair in motion, perhaps something breaks, somebody
stops it, nobody does anything for a while, then the stop is taken back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from harness.storm.names import LEADS_ON, MOTIONS, OTHERS, RELEASES, STOPS, STRIKES, WAY_BACK, Name

SECONDS = 14.0
"""A scene lasts about so long, without what leads back to IDLE."""
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


def draw(seed: int, scene: int, seconds: float = SECONDS) -> list[Step]:
    """Return the steps of a scene in their order."""
    rng = Random(f"storm {seed} {scene}")
    steps: list[Step] = []
    at = 0.3
    while at < seconds - 3.0:
        at = _phrase(rng, at, steps)
    return sorted(_few_kills(steps), key=lambda step: step.at)


def _phrase(rng: Random, at: float, steps: list[Step]) -> float:
    """Append motion, fault, stop, silence and release from ``at`` on; return where it ends.

    Most phrases begin with what leads back to IDLE, else most commands would be refused.
    """
    if steps and rng.random() < 0.7:
        for name in WAY_BACK:
            _add(rng, at, (name,), steps)
            at += 0.3
        at += rng.uniform(0.1, 1.0)
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
