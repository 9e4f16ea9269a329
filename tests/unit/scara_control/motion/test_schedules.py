"""Random schedules: a request from before an acknowledged STOP never begins after it."""

from __future__ import annotations

import pytest
from harness.running.thorough import examples
from harness.scenes.late_requests import BY_WEB, KINDS, UNSTAMPED, WIRE_S, Begun, Schedule

SCHEDULES = examples(100, 200)
REQUESTS = 12
QUIET_S = 4.0
"""Behind all standstills: from 10.1 to 12.0 s, and two stop after each other."""


def late(world: Schedule) -> list[Begun]:
    """Return what has begun although a STOP was acknowledged after it was sent.

    The twin's nodes hear a STOP when the gateway passes it on; the core decides it.
    """
    heard = world.passed_on + 2 * WIRE_S
    return [
        one
        for one in world.begun
        if one.sent + WIRE_S < world.acknowledged  # so the first door has read it before
        and one.at > (world.acknowledged if one.kind == "core" else heard)
    ]


def play(seed: int) -> Schedule:
    """Play one schedule: requests at random times, and a STOP among them."""
    world = Schedule(seed)
    rng, begin = world.rng, world.now
    world.stop(begin + rng.uniform(0.3, 1.2))
    for _ in range(REQUESTS):
        kind = rng.choice(KINDS)
        world.send(
            kind,
            begin + rng.uniform(0.1, 1.3),
            stamped=kind not in UNSTAMPED or rng.random() < 0.5,
            web=kind in BY_WEB and rng.random() < 0.5,
        )
    world.run(begin + QUIET_S)
    return world


@pytest.mark.parametrize("seed", range(0, SCHEDULES, 20))
def test_nothing_from_before_a_stop_begins_after_it(seed: int) -> None:
    """Whichever nodes stood still for how long, and whatever said when it was asked for."""
    refused = 0
    for number in range(seed, seed + 20):
        world = play(number)
        assert world.acknowledged < float("inf")
        assert late(world) == [], number
        refused += len(world.refused)
    assert refused > 20, "the schedules have tried nothing"


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_asked_for_after_the_stop_begins(kind: str) -> None:
    """Once nobody stands still any more, a STOP of the past refuses nothing."""
    for seed in range(examples(5, 20)):
        world = play(seed)
        count = len(world.begun)
        for web in (False, True) if kind in BY_WEB else (False,):
            world.send(kind, world.now, stamped=kind not in UNSTAMPED, web=web)
        world.run(world.now + 1.0)
        assert len(world.begun) > count, seed
