"""The first mover leads, the real robot in a tie, never a follower or noise, by whatever clocks."""

from __future__ import annotations

import math
import random
from functools import cache

import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.running.thorough import examples, thorough
from harness.watch import Watch
from hypothesis import example, given, settings
from hypothesis import strategies as st
from twin_controller.core.actions import CapTwin, Decided, FollowTwin, StreamReal
from twin_controller.core.lead.modes import Mode

# joint_3 stays above the keep-out zone below the table.
OFFSETS = st.tuples(
    st.floats(-25.0, 25.0), st.floats(-35.0, 35.0), st.floats(-25.0, 90.0), st.floats(-15.0, 15.0)
)
HARMLESS = {"LINK_LOST", "LINKS_READY", "ALIGNED"}
FEW = settings(max_examples=examples(3, 12), deadline=None)
"""A run of some virtual seconds costs some tens of milliseconds."""


def connected(**arguments: float) -> Pair:
    """Return a connected and watched pair, IDLE at home."""
    pair = Pair(**arguments)  # type: ignore[arg-type]
    Watch(pair)
    pair.connect()
    return pair


def leaders(pair: Pair, since: int) -> list[str]:
    """Return who led, one after the other."""
    return [decision.leader for decision in pair.decisions()[since:] if decision.leader]


def uniform(seed: int, width: float) -> Pair:
    """Return a pair with uniform noise of ``width``, peak to peak, in degrees and millimetres."""
    pair = Pair()
    source = random.Random(seed)
    pair.noise = lambda: width * (source.random() - 0.5)
    return pair


@FEW
@given(edge=st.integers(-900, 900), width=st.floats(0.0, 1.0), seed=st.integers(0, 2**32 - 1))
@example(edge=0, width=1.0, seed=1)
def test_noise_below_the_hysteresis_changes_no_leader(edge: int, width: float, seed: int) -> None:
    """Idle stays idle with noise up to the hysteresis, all joints on rounding edges x.xx5."""
    pair = uniform(seed, width * SETUP.config.change.hysteresis)
    at = shifted(HOME, *(edge * 0.01 + 0.005 for _ in range(2)), 0.005, edge * 0.01 + 0.005)
    pair.real_q = pair.twin_q = at
    Watch(pair)
    pair.connect()
    pair.run(4.0)
    assert pair.triggers() == ["LINKS_READY", "ALIGNED"]


def test_idling_with_noise_changes_no_leader() -> None:
    """An idle cell stays idle: thousands of samples at full noise, both clocks 200 ppm off."""
    pair = uniform(7, SETUP.config.change.hysteresis)
    pair.real_drift, pair.twin_drift = 200e-6, -200e-6
    pair.connect()
    pair.run(examples(10, 60))
    assert pair.triggers() == ["LINKS_READY", "ALIGNED"]


@FEW
@given(ahead_ms=st.integers(-60, 60), seed=st.integers(0, 100))
@example(ahead_ms=0, seed=0)
@example(ahead_ms=-4, seed=0)
@example(ahead_ms=4, seed=0)
def test_the_first_mover_leads_and_the_real_robot_wins_a_tie(ahead_ms: int, seed: int) -> None:
    """Both begin unannounced, ``ahead_ms`` apart: one leader, right as far as clocks can tell."""
    pair = connected()
    pair.run(0.001 * (seed % 10))
    since, begin = len(pair.decisions()), pair.now + 0.1
    away, other = shifted(HOME, 20.0, -30.0), shifted(HOME, -20.0, 10.0)
    for k in range(240):
        if k == 100:
            pair.jog_real(ramp(HOME, away, 0.5))
        if k == 100 + ahead_ms:
            pair.jog_twin(ramp(HOME, other, 0.5), pair.now)
        pair.run(0.001)
    assert pair.now > begin
    uncertainty_ms = 1e3 * (
        pair.state.sides.real.clock.uncertainty + pair.state.sides.twin.clock.uncertainty
    )
    found = leaders(pair, since)
    assert len(found) == 1, "one winner, once"
    if ahead_ms >= 0:
        assert found == ["real"], "the real robot was first, or it is a tie"
    elif ahead_ms < -uncertainty_ms - 4.0:
        assert found == ["twin"], "the twin was first by more than what is uncertain"


@FEW
@given(offset=OFFSETS, duration=st.floats(0.6, 2.0), noise=st.floats(0.0, 1.0), late=st.booleans())
def test_a_twin_that_follows_is_never_a_new_leader(
    offset: tuple[float, ...], duration: float, noise: float, late: bool
) -> None:
    """One lead of the real robot, then IDLE, whatever the path, the noise and the delays."""
    pair = uniform(3, noise * SETUP.config.change.hysteresis)
    pair.command_delay, pair.report_delay = (0.02, 0.01) if late else (0.0, 0.0)
    Watch(pair)
    pair.connect()
    since = len(pair.decisions())
    pair.start_program(ramp(HOME, shifted(HOME, *offset), duration), run=duration + 0.3)
    pair.end_program()
    pair.run(2.0)
    assert pair.triggers(since) == ["REAL_TOOK_OVER", "AT_REST"]


def test_a_twin_that_goes_back_the_way_it_has_just_followed_leads() -> None:
    """What it was sent there is done by IDLE: its own motion is no echo of it, nothing aligns."""
    pair = connected()
    since, goal = len(pair.decisions()), shifted(HOME, 3.0, -3.0)
    pair.start_program(ramp(HOME, goal, 0.5), run=0.5)
    pair.end_program()
    while pair.state.lead.mode is not Mode.IDLE:
        pair.run(0.01)
    begun = pair.now
    pair.jog_twin(lambda t: shifted(goal, -min(2.0, 3.0 * t), min(2.0, 3.0 * t)), begun)
    pair.run(0.6)
    assert pair.triggers(since) == ["REAL_TOOK_OVER", "AT_REST", "TWIN_MOVED"]


@pytest.mark.parametrize(
    ("left", "tau"),
    [
        (0.045, 0.3),
        (-0.045, 1.2),
        *thorough((-0.045, 0.3), (0.045, 0.6), (-0.045, 0.6), (0.045, 1.2)),
    ],
)
def test_a_twin_that_goes_on_settling_is_no_new_leader(left: float, tau: float) -> None:
    """Its drive takes what is left away long after the last command."""
    pair = connected()
    since, goal = len(pair.decisions()), shifted(HOME, 20.0, -30.0)
    pair.start_program(ramp(HOME, goal, 1.0), run=1.1)
    pair.end_program()
    pair.jog_twin(lambda t: shifted(goal, left * math.exp(-t / tau)), pair.now)
    pair.run(4.0)
    assert pair.triggers(since) == ["REAL_TOOK_OVER", "AT_REST"]
    pair.run(1.0)
    pair.jog_twin(lambda t: shifted(goal, -0.04 * min(1.0, t) * math.copysign(1.0, left)), pair.now)
    pair.run(2.0)
    assert leaders(pair, since) == ["real", "twin"], "what goes on later is a motion"


@pytest.mark.parametrize("left", [0.08, -0.08])
def test_a_twin_that_settles_after_a_stop_is_not_aligned_by_that(left: float) -> None:
    """After ESTOP and RESET the drive's last hundredths are no motion of the twin."""
    pair = connected()
    pair.operate("MOVE_JOINTS", target=shifted(HOME, 20.0), speed_percent=50.0)
    pair.run(0.8)
    pair.operate("ESTOP")
    pair.run(0.5)
    pair.operate("RESET")
    pair.until(Mode.STOPPED, 2.0)
    since, place = len(pair.decisions()), pair.twin_q
    pair.jog_twin(lambda t: shifted(place, left * (1.0 - math.exp(-t / 0.6))), pair.now)
    pair.run(4.0)
    assert pair.triggers(since) == []


@FEW
@given(
    offset=OFFSETS,
    duration=st.floats(1.0, 2.0),
    noise=st.floats(0.0, 1.0),
    lag_ms=st.integers(0, 140),
)
@example(offset=(20.0, 0.0, 0.0, 0.0), duration=1.0, noise=1.0, lag_ms=140)
def test_a_robot_that_follows_is_never_a_new_leader(
    offset: tuple[float, ...], duration: float, noise: float, lag_ms: int
) -> None:
    """One lead of the twin, then IDLE, whatever the path, the noise and the robot's lag."""
    if max(abs(part) for part in offset) < 1.0:
        return
    pair = uniform(5, noise * SETUP.config.change.hysteresis)
    pair.stream_lag = lag_ms * 1e-3
    Watch(pair)
    pair.connect()
    since = len(pair.decisions())
    pair.move_twin(ramp(HOME, shifted(HOME, *offset), duration), run=duration + 2.5)
    assert pair.triggers(since) == ["TWIN_MOVED", "AT_REST"]


REPORT_S = 0.011
"""A time that lies on an edge may fall on the next report by the rounding of a float."""
SHIFTS = st.integers(-(10**7), 10**7)
REAL_CLOCK_S = 5000.0003
"""No instant of the scenario lies on an edge of the robot's ticks, where the last digit of a float
would decide in which of two ticks it falls."""
ROUNDING_S = 1e-6
"""Some last digits of a clock that shows 1.7e9 s."""


def scenario(pair: Pair) -> list[tuple[str, str, float]]:
    """Let several things happen; return the decisions and when they fell after the beginning."""
    start = pair.now
    pair.connect()
    pair.start_program(ramp(HOME, shifted(HOME, 20.0, -30.0, 40.0), 1.0), run=1.2)
    pair.end_program()
    pair.run(1.0)
    pair.move_twin(ramp(pair.twin_q, HOME, 1.0), run=0.6)
    pair.operate("PAUSE")
    pair.run(0.5)
    pair.operate("RESUME")
    pair.run(1.5)
    pair.operate("STOP")
    pair.run(0.5)
    return [(d.trigger, d.mode_after, round(d.now - start, 4)) for d in pair.decisions()]


@cache
def unshifted() -> tuple[Pair, list[tuple[str, str, float]]]:
    """Return the pair that others are held against, behind its scenario, and what was decided."""
    pair = Pair(real_clock=REAL_CLOCK_S)
    return pair, scenario(pair)


def same_way(here: list[StreamReal], there: list[StreamReal]) -> None:
    """Fail unless the set points are the same, at the same times."""
    apart = [b.send_at - a.send_at for a, b in zip(here, there, strict=True)]
    assert max(map(abs, apart)) <= ROUNDING_S
    deviation = [np.subtract(b.setpoint.q, a.setpoint.q) for a, b in zip(here, there, strict=True)]
    assert np.abs(deviation).max() <= 1e-5


@pytest.mark.slow
@settings(max_examples=examples(1, 30), deadline=None)
@given(shift=SHIFTS)
@example(shift=-1776)
@example(shift=-2616)
@example(shift=-2585)
@example(shift=1545)
def test_a_common_shift_of_both_clocks_changes_nothing(shift: int) -> None:
    """Same decisions at the same times, same set points; only the stamps are shifted."""
    moved = Pair(real_clock=REAL_CLOCK_S + 2.0 * shift, twin_clock=1.7e9 + 2.0 * shift)
    pair, here = unshifted()
    assert scenario(moved) == here
    for a, b in zip(pair.actions, moved.actions, strict=True):
        if isinstance(a, FollowTwin):
            assert isinstance(b, FollowTwin)
            assert b.points[0].q == pytest.approx(a.points[0].q, abs=1e-5)
            assert b.stamp - a.stamp == pytest.approx(2.0 * shift, abs=1e-4)
        elif isinstance(a, CapTwin):
            assert isinstance(b, CapTwin)
            assert b.speed_percent == pytest.approx(a.speed_percent, rel=1e-4)
        elif isinstance(a, StreamReal):
            assert isinstance(b, StreamReal)
        elif not isinstance(a, Decided):
            assert a == b
    same_way(*([each for each in p.actions if isinstance(each, StreamReal)] for p in (pair, moved)))


@pytest.mark.slow
@settings(max_examples=examples(2, 6), deadline=None)
@given(start=st.integers(0, 10**6))
def test_the_controllers_own_clock_may_begin_anywhere(start: int) -> None:
    """Monotonic time has no meaning of its own."""
    moved = Pair(real_clock=REAL_CLOCK_S + 100.0 - start, twin_clock=1.7e9 + 100.0 - start)
    moved.now = float(start)
    here, there = unshifted()[1], scenario(moved)
    assert [entry[:2] for entry in there] == [entry[:2] for entry in here]
    assert [entry[2] for entry in there] == pytest.approx(
        [entry[2] for entry in here], abs=REPORT_S
    )


CLOCK_FAULT = st.tuples(
    st.sampled_from(["real", "twin"]),
    st.sampled_from(["jump", "drift"]),
    st.sampled_from([3600.0, -3600.0, 0.5, -0.5, 0.03, -0.03]),
    st.sampled_from([200e-6, -200e-6, -1.0, -2.0, 1.0]),
    st.integers(10, 900),
)


@settings(max_examples=examples(8, 25), deadline=None)
@given(faults=st.lists(CLOCK_FAULT, min_size=1, max_size=6), noise=st.booleans())
def test_clocks_that_jump_drift_stand_or_run_backwards_make_nobody_lead(
    faults: list[tuple[str, str, float, float, int]], noise: bool
) -> None:
    """Nobody moved, so nobody leads; afterwards the pair comes back by itself."""
    pair = uniform(11, SETUP.config.change.hysteresis * noise)
    Watch(pair)
    pair.connect()
    for side, kind, jump, drift, ms in faults:
        if kind == "jump":
            setattr(pair, f"{side}_clock", getattr(pair, f"{side}_clock") + jump)
        else:
            setattr(pair, f"{side}_drift", drift)
        pair.run(ms * 1e-3)
    assert set(pair.triggers()) <= HARMLESS
    pair.real_drift = pair.twin_drift = 0.0
    pair.run(0.5)
    pair.until(Mode.IDLE, 12.0)
    assert set(pair.triggers()) <= HARMLESS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("side", "drift"),
    [("real", 200e-6), *thorough(("twin", -200e-6), ("real", -200e-6), ("twin", 200e-6))],
)
def test_drifting_clocks_keep_the_pair_together(side: str, drift: float) -> None:
    """After 40 s at 200 ppm the twin follows to the same place, and the drift is known."""
    pair = connected()
    setattr(pair, f"{side}_drift", drift)
    pair.run(40.0)
    pair.start_program(ramp(HOME, shifted(HOME, 20.0, -30.0), 1.0), run=0.5)
    assert pair.mode is Mode.REAL_LEADS
    assert (
        max(abs(a - b) / scale for a, b, scale in zip(pair.real_q, pair.twin_q, SETUP.scale)) < 0.2
    )
    clock = {"real": pair.state.sides.real, "twin": pair.state.sides.twin}[side].clock
    assert clock.drift_ppm == pytest.approx(drift * 1e6, abs=120.0)
    assert clock.jumps == 0


def test_the_wrap_of_the_robots_clock_is_nothing_special() -> None:
    """After 2^31 ms its counter begins at 0, in the middle of a motion: the twin follows on."""
    pair = connected(real_clock=2**31 * 1e-3 - 104.0)
    since = len(pair.decisions())
    pair.run_until(lambda: pair.now >= 103.5, 10.0)
    pair.start_program(ramp(HOME, shifted(HOME, 20.0, -30.0), 1.0), run=0.6)
    assert pair.state.sides.real.clock_ms is not None and pair.state.sides.real.clock_ms > 2**31
    assert pair.mode is Mode.REAL_LEADS
    assert (
        max(abs(a - b) / scale for a, b, scale in zip(pair.real_q, pair.twin_q, SETUP.scale)) < 0.2
    )
    pair.run(0.6)
    pair.end_program()
    pair.run(1.0)
    assert pair.triggers(since) == ["REAL_TOOK_OVER", "AT_REST"]


def test_a_program_that_a_person_starts_during_a_fault_is_said_once_and_not_followed() -> None:
    """The robot has an author for its motion; the twin stands until RESET."""
    pair = Pair()
    Watch(pair)
    pair.connect()
    pair.alarm("a test")
    pair.run(0.5)
    pair.fault = False
    pair.run(0.5)
    assert pair.mode is Mode.FAULT
    since, place = len(pair.decisions()), pair.twin_q
    pair.start_program(ramp(pair.real_q, shifted(HOME, 20.0), 2.0), run=3.0)
    (told,) = pair.decisions()[since:]
    assert (told.trigger, told.mode_after) == ("REAL_TOOK_OVER", "FAULT")
    assert told.why.startswith("the real robot moves on its own")
    assert told.why.endswith("the twin does not follow it before RESET")
    assert pair.twin_q == place
