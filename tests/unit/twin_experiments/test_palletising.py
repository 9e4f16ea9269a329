"""Palletising is judged: parts on their places count, everything else is a reason to fail."""

from __future__ import annotations

import math

import pytest
from harness.workspace import ROOT
from scara_config import ConfigError, load_robot
from scara_config.palletise import load_palletise
from twin_experiments.config import load_experiments
from twin_experiments.palletising import (
    Handled,
    as_document,
    error_rows,
    outcome,
    shortcomings,
    summary_rows,
)

WORK = load_palletise(ROOT / "config")
LEVEL = WORK.pallet.top_mm * 1e-3 + 0.5 * WORK.parts.height
PLACES = {part.name: (*place, LEVEL) for part, place in zip(WORK.starts(), WORK.pallet.places())}
NAMES = list(PLACES)


def judged(places: dict[str, tuple[float, float, float]], *events: tuple[float, str, str, str]):  # type: ignore[no-untyped-def]
    """Judge a run from 1 s to 30 s whose parts lie there at its end."""
    return outcome(
        "twin", Handled([(0.0, {}), (29.0, places), (31.0, {})], events), WORK, 1.0, 30.0
    )


def test_all_parts_on_their_places_pass() -> None:
    """Nine of nine, error 0, the cycle ends with the last part placed."""
    found = judged(
        PLACES,
        (5.0, "placed", "part_1", ""),
        (21.5, "placed", "part_9", ""),
        (30.5, "placed", "part_9", ""),
    )
    assert len(found.placed) == found.parts == 9
    assert found.error_max_mm == pytest.approx(0.0, abs=1e-9)
    assert found.cycle_s == pytest.approx(20.5)
    assert shortcomings([found], WORK.task.tolerance_mm) == ()


@pytest.mark.parametrize(
    ("shift", "placed"),
    [
        ((0.0004, 0.0, 0.0), True),
        ((0.0004, 0.0004, 0.0), False),
        ((0.0, 0.0, 0.02), False),
        ((0.0, 0.0, -0.02), False),
    ],
    ids=["within", "beyond", "on another part", "on the floor"],
)
def test_part_counts_within_the_tolerance_and_on_the_pallet_only(
    shift: tuple[float, float, float], placed: bool
) -> None:
    """A part beside its place, above or below the pallet is not placed, and is named."""
    moved = tuple(a + b for a, b in zip(PLACES["part_4"], shift))
    found = judged({**PLACES, "part_4": moved})  # type: ignore[dict-item]
    assert ("part_4" in found.placed) == placed
    reasons = shortcomings([found], WORK.task.tolerance_mm)
    assert reasons == (() if placed else ("twin: 8 of 9 parts within 0.5 mm; not part_4",))


def test_collisions_and_drops_fail_a_run_with_their_text() -> None:
    """Nine of nine is not enough if something was hit or dropped on the way.

    What came before the start does not count.
    """
    found = judged(
        PLACES,
        (0.5, "collision", "", "before"),
        (3.0, "collision", "part_1", "a hit b"),
        (4.0, "dropped", "part_2", "c"),
    )
    assert shortcomings([found], 0.5) == (
        "twin: 1 collision, the first: a hit b",
        "twin: 1 drop, the first: c",
    )


def test_side_that_recorded_nothing_has_placed_nothing() -> None:
    """A missing recording is no success; report.json says null, not infinity."""
    found = outcome("real", Handled(), WORK, 0.0, 10.0)
    assert found.placed == () and found.cycle_s is None and found.error_max_mm is None
    assert all(math.isinf(error) for error in found.errors_mm.values())
    assert as_document([found])["real"]["errors_mm"] == dict.fromkeys(NAMES)  # type: ignore[index]
    assert summary_rows([found]) == [("real", "0 / 9", "-", "-", "0", "0")]
    assert error_rows([found])[0] == ("part_1", "not on the pallet")


def test_palletise_stands_for_both_leaders_and_is_asked_for_by_name() -> None:
    """Without names only the article's experiments run; an unknown name lists them all."""
    config = load_experiments(load_robot(ROOT / "config"), ROOT / "config")
    assert list(config.select(["palletise"])) == ["palletise_real_leads", "palletise_twin_leads"]
    assert list(config.select(["palletise_twin_leads"])) == ["palletise_twin_leads"]
    assert not set(config.select([])) & set(config.palletising)
    with pytest.raises(
        ConfigError,
        match=r"unknown experiment 'stack': experiments\.yaml has real_leads, .*, palletise$",
    ):
        config.select(["stack"])
