"""The probability of a collision: against what can be said beforehand, and the same again."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from statistics import NormalDist

import pytest
from harness.running.thorough import examples
from harness.yaml_files import CONFIG
from what_if.errors import WhatIfError
from what_if.judging import judge
from what_if.motions import JointTarget
from what_if.uncertainty import many_worlds_io as many_worlds
from what_if.uncertainty.chances import Chances, chances_lines, chances_of, interval, tried
from what_if.uncertainty.many_worlds_io import chances
from what_if.uncertainty.spreads import ASSUMED, Spread
from what_if.verdict import Outcome
from what_if.world import World

from what_if import side_by_side_io

PERSON = Spread("person_mm", "person", 50.0, "mm", ASSUMED, 2)
WORLDS = examples(120, 300)
TWO_LOTS = many_worlds.LOT + 4
TURN = JointTarget((1.2, 0.0, -0.05, 0.0))


def beside_a_person(world: World, gap_mm: float) -> World:
    """Return a world in which the straight arm turns past a person, ``gap_mm`` away."""
    low, high = 0.9, 1.3
    for _ in range(14):
        far = 0.5 * (low + high)
        place = (far * math.cos(TURN.q[0]), far * math.sin(TURN.q[0]), 0.0)
        found = replace(world, people=(place,))
        near = judge(found, TURN).clearance
        assert near is not None
        low, high = (low, far) if near.distance_mm > gap_mm else (far, high)
    return found


@pytest.mark.thorough
def test_the_chance_of_a_hit_is_that_of_the_gap(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person who is known to 50 mm, 15 mm away: the part of a normal distribution beyond it."""
    monkeypatch.setattr(many_worlds, "spreads_of", lambda _: (PERSON,))
    begun = beside_a_person(world, 15.0)
    left = judge(begun, TURN).clearance
    assert left is not None and left.between[1] == "person 1"
    found = chances(begun, TURN, WORLDS, seed=7, workers=1, directory=CONFIG)
    # Steps aside count less, since both are round.
    expected = NormalDist(0.0, 50.0).cdf(-left.distance_mm)
    assert found.collision == pytest.approx(expected, abs=0.03)
    assert found.collision_low < found.collision < found.collision_high
    assert "person 1" in found.likeliest


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_chances_whatever_the_workers(world: World) -> None:
    """One process or two; another seed gives others."""
    one, two = (chances(world, TURN, TWO_LOTS, 3, workers, CONFIG) for workers in (1, 2))
    assert one == two
    assert one.collision == 0.0 and one.duration_spread_s > 0.0
    assert chances(world, TURN, 5, 4, 1, CONFIG).duration_s != one.duration_s


def test_other_processes_get_all_of_a_world_that_is_in_no_file() -> None:
    """What was left out would be missing there, and nobody would see it."""
    of_files = {"cell", "models"}
    assert {field.name for field in fields(World)} - of_files == set(side_by_side_io.IN_NO_FILE)


def test_processes_that_are_killed_are_begun_once_more(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twice killed, it is said."""
    asked: list[int] = []

    def killed(question: object, lots: dict[int, object], *_: object) -> None:
        asked.append(len(lots))

    monkeypatch.setattr(side_by_side_io, "_spread", killed)
    with pytest.raises(WhatIfError, match="the processes were killed 2 times"):
        chances(world, TURN, 50, 0, directory=CONFIG)
    assert asked == [3, 3]
    with pytest.raises(WhatIfError, match="worlds = 0: at least 1"):
        chances(world, TURN, 0, 0)


@pytest.mark.parametrize(
    ("hits", "worlds", "low", "high"), [(0, 100, 0.0, 0.0370), (50, 100, 0.4038, 0.5962)]
)
def test_an_interval_is_wilsons(hits: int, worlds: int, low: float, high: float) -> None:
    """Also where nothing was hit at all."""
    assert interval(hits, worlds) == pytest.approx((low, high), abs=1e-4)


def some_chances(world: World) -> Chances:
    """Return chances of two worlds: in one the arm hits a part."""
    free, hit = judge(world, TURN), judge(world, JointTarget((0.0, 0.0, -0.19, 0.0)))
    assert (free.outcome, hit.outcome) == (Outcome.OK, Outcome.REFUSED)
    return chances_of([tried(free), tried(hit)], (PERSON,), 9)


def test_chances_are_told_in_words(world: World) -> None:
    """The chance, what is hit, the time, and where each spread is from."""
    text = "\n".join(chances_lines(some_chances(world)))
    assert "2 were drawn (seed 9)" in text and "collision  50.0 %" in text
    assert "most often: the nozzle would hit part_" in text
    assert f"{ASSUMED}: person ± 50 mm" in text
