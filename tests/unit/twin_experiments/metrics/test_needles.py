"""What a needle is made of: what had just happened when the tools were apart for a moment."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.errors import Move, Trace
from twin_experiments.metrics.needles import Needle, NeedleCause, find_needles, tool_speeds
from twin_experiments.metrics.pauses import Pause
from twin_experiments.metrics.series import Aligned, Array, Motion

RATE, SPEED = 1000.0, 0.5
AT, LASTS, HEIGHT_MM = 2.0, 0.02, 3.0
TIMES = np.arange(0.0, 4.0, 1.0 / RATE)
MOVE = Move(0.5, 3.5, 1500.0, HEIGHT_MM, None)


def trace(real: Array, twin: Array, deviation_mm: Array) -> Trace:
    """Return what both tools did at ``TIMES``, whatever their joints did."""
    rows = np.zeros((len(TIMES), 1))
    sides = (Motion(side, TIMES, rows, rows) for side in ("real", "twin"))
    aligned = Aligned(RATE, ((0, len(TIMES)),), *sides, (), 4.0)
    moving = np.ones(len(TIMES), dtype=bool)
    return Trace(aligned, real, twin, deviation_mm, moving, moving)


def needle(
    height_mm: float = HEIGHT_MM,
    lasts: float = LASTS,
    moves: tuple[Move, ...] = (MOVE,),
    pauses: tuple[Pause, ...] = (),
    late: float | None = None,
    aged: bool = True,
    late_each: int = 0,
    hill_mm: float = 0.0,
) -> Needle | None:
    """Return what is found of a bump of the tools' distance at ``AT`` [s] while both go on.

    Args:
        height_mm: Of the bump.
        lasts: Its width at half its height [s].
        moves: Of the experiment.
        pauses: Of the machine.
        late: When a sample came 20 ms later than the others [s].
        aged: The recording says how old its samples were.
        late_each: One sample of so many came 20 ms later than the others; 0: none.
        hill_mm: How far the tools come apart and together again once within the first 1.5 s.
    """
    bump = height_mm * np.exp(-np.log(2.0) * (2.0 * (TIMES - AT) / lasts) ** 2)
    tool = np.column_stack((SPEED * TIMES, 0.0 * TIMES, 0.0 * TIMES))
    hill = hill_mm * np.exp(-(((TIMES - 0.8) / 0.2) ** 2))
    seen = trace(tool, tool, 0.2 + bump + hill)
    ages = np.full(len(TIMES), 0.004)
    if late is not None:
        ages[round(late * RATE)] += 0.02
    if late_each:
        ages[::late_each] += 0.02
    found = find_needles(seen, moves, pauses, {"state": (TIMES, ages)} if aged else {})
    assert len(found) <= 1
    return found[0] if found else None


@pytest.mark.parametrize("aged", [True, False])
def test_a_bump_is_a_needle_with_its_place_height_and_timing(aged: bool) -> None:
    """A distance of 3.2 mm at 0.5 m/s is 6.4 ms between both sides, also without ages."""
    found = needle(aged=aged)
    assert found is not None
    assert (found.start, found.at, found.end) == pytest.approx((1.98, 2.0, 2.02), abs=2e-3)
    assert found.height_mm == pytest.approx(3.2) and found.speed == pytest.approx(SPEED)
    assert found.timing_ms == pytest.approx(6.4)
    assert found.cause == NeedleCause.NONE


@pytest.mark.parametrize(
    ("height_mm", "lasts", "is_one"),
    [(0.28, LASTS, False), (0.32, LASTS, True), (3.0, 0.1, False), (3.0, 0.05, True)],
)
def test_what_is_low_or_wide_is_no_needle(height_mm: float, lasts: float, is_one: bool) -> None:
    """Unrest below 0.3 mm, and a distance that comes and goes."""
    assert (needle(height_mm, lasts) is not None) is is_one


@pytest.mark.parametrize(("height_mm", "is_one"), [(2.8, False), (3.2, True)])
def test_what_is_low_beside_the_highest_distance_is_no_needle(
    height_mm: float, is_one: bool
) -> None:
    """Below 15 % of it, as in a figure that shows all of it; here of 20 mm."""
    assert (needle(height_mm, hill_mm=19.8) is not None) is is_one


@pytest.mark.parametrize(
    ("before", "cause"),
    [(0.0, NeedleCause.LATE), (0.09, NeedleCause.LATE), (0.12, NeedleCause.NONE)],
)
def test_a_late_sample_shows_for_a_tenth_of_a_second(before: float, cause: NeedleCause) -> None:
    """Not longer: else most needles had one."""
    found = needle(late=AT - before)
    assert found is not None and found.cause == cause


@pytest.mark.parametrize(
    ("end", "cause"),
    [(AT, NeedleCause.PAUSE), (AT - 0.19, NeedleCause.PAUSE), (AT - 0.22, NeedleCause.NONE)],
)
def test_a_pause_shows_until_both_are_together_again(end: float, cause: NeedleCause) -> None:
    """The machine stood still, and both sides need 0.2 s."""
    found = needle(pauses=(Pause(end - 0.05, 0.05),))
    assert found is not None and found.cause == cause


@pytest.mark.parametrize(
    ("begun", "cause"), [(0.09, NeedleCause.BEGINNING), (0.11, NeedleCause.NONE)]
)
def test_a_follower_joins_a_move_in_a_tenth_of_a_second(begun: float, cause: NeedleCause) -> None:
    """From the move's beginning on."""
    found = needle(moves=(Move(AT - begun, 3.5, 1500.0, HEIGHT_MM, None),))
    assert found is not None and found.cause == cause


def test_the_surest_cause_is_told() -> None:
    """A pause makes samples late, and a move can begin in it."""
    found = needle(
        moves=(Move(AT - 0.05, 3.5, 1500.0, HEIGHT_MM, None),),
        pauses=(Pause(AT - 0.1, 0.05),),
        late=AT - 0.05,
    )
    assert found is not None and found.cause == NeedleCause.PAUSE


@pytest.mark.parametrize(("late_each", "cause"), [(22, NeedleCause.LATE), (19, NeedleCause.NONE)])
def test_what_one_sample_in_twenty_does_is_usual(late_each: int, cause: NeedleCause) -> None:
    """4.5 % of the samples explain a needle, 5.3 % are how this robot is read."""
    found = needle(late_each=late_each)
    assert found is not None and found.cause == cause


@pytest.mark.parametrize(("count", "found"), [(3, SPEED), (2, SPEED), (1, 0.0)])
@pytest.mark.parametrize("faster", ["real", "twin"])
def test_the_speed_of_a_run_is_that_of_its_faster_tool(
    count: int, found: float, faster: str
) -> None:
    """Two instants have one, a single instant tells of none."""
    tool = np.column_stack((SPEED * TIMES, 0.0 * TIMES, 0.0 * TIMES))
    tools = (tool, 0.5 * tool) if faster == "real" else (0.5 * tool, tool)
    speeds = tool_speeds(trace(*tools, 0.0 * TIMES), slice(7, 7 + count))
    assert speeds == pytest.approx([found] * count)
