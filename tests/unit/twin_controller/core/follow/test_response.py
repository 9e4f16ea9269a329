"""How late the real robot does its set points, and how fast it can be led."""

from __future__ import annotations

from itertools import pairwise

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP, idle_pair, ramp, shifted
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.config import MeasuredJoint, load_twin_controller
from twin_controller.core.events import RealKnown
from twin_controller.core.follow.memory import Follow
from twin_controller.core.follow.pace import follower_pace
from twin_controller.core.follow.response import (
    Response,
    _joined,
    _led,
    assumed,
    begun,
    known,
    measured,
    recalled,
)
from twin_controller.core.setup import Setup
from twin_controller.core.sides.echo import EchoTube
from twin_controller.core.sides.side import RealSide, Sides
from twin_controller.estimation.delay import Fit, fit_joint

FIRST_SPREAD_S = 0.003
replace = msgspec.structs.replace
CONFIG = load_twin_controller(ROBOT)
UNKNOWN = Setup(ROBOT, CONFIG)
NUMBERS = CONFIG.response
SENT_S, READ_S = 0.010, 0.0097
LENGTH, DURATION = 60.0, 1.0


def told(t: float, length: float = LENGTH, duration: float = DURATION) -> float:
    """Return where a smooth move is at ``t`` [s], border units; at rest before and after it."""
    u = min(max(t / duration, 0.0), 1.0)
    return length * u**3 * (10 - 15 * u + 6 * u * u)


def answer(
    t: float, delay: float, smoothing: float, length: float = LENGTH, duration: float = DURATION
) -> float:
    """Return where a robot is that does it ``delay`` late, through a filter of that variance."""
    # The mean of two taps that lie a standard deviation to both sides.
    spread = (2.0 * smoothing) ** 0.5
    late = (told(t - delay + side, length, duration) for side in (-spread, spread))
    return 0.5 * sum(late)


def side(
    end: float,
    delays: dict[int, float],
    smoothing: float = 0.0,
    noise: float = 0.0,
    seed: int = 0,
    length: float = LENGTH,
    duration: float = DURATION,
) -> RealSide:
    """Return a robot at ``end`` [s] of a move that some of its joints make."""
    random = np.random.default_rng(seed)
    commands = tuple(
        (
            float(t),
            tuple(told(t, length, duration) if k in delays else 0.0 for k in range(len(HOME))),
        )
        for t in np.arange(end - 0.5, end, SENT_S)
    )
    history = []
    for t in np.arange(end, end - 48 * READ_S, -READ_S)[::-1]:
        q = [
            (answer(t, delays[k], smoothing, length, duration) if k in delays else 0.0)
            + random.normal(0.0, noise)
            for k in range(len(HOME))
        ]
        si = tuple(value * scale for value, scale in zip(q, SETUP.scale))
        history.append(JointMotion.measured(si, (0.0,) * len(HOME), float(t)))
    return replace(RealSide(), history=tuple(history), tube=EchoTube(commands))


def during_move(
    delays: dict[int, float], start: Response, length: float = DURATION
) -> list[Response]:
    """Return what is known in a move, at first and each time that the controller measures."""
    known_then = [replace(start, at=-1e9)]
    for end in np.arange(0.1, length + 0.1, 0.05):
        seen = side(float(end), delays, noise=0.003)
        known_then.append(measured(UNKNOWN, known_then[-1], seen))
    return known_then


def after_move(delays: dict[int, float], start: Response, length: float = DURATION) -> Response:
    """Return what is known after a move."""
    return during_move(delays, start, length)[-1]


@pytest.mark.parametrize(("later", "again"), [(0.01, False), (0.049, False), (0.051, True)])
def test_the_delay_is_measured_twenty_times_a_second(later: float, again: bool) -> None:
    """A fit costs more than a reading; between two of them nothing changes."""
    first = measured(UNKNOWN, replace(assumed(NUMBERS, SETUP.names), at=-1e9), side(0.7, {0: 0.06}))
    assert first.at == pytest.approx(0.7)
    then = measured(UNKNOWN, first, side(0.7 + later, {0: 0.06}))
    assert (then.at > 0.7) is again


@settings(max_examples=60, deadline=None)
@given(
    delay=st.floats(0.01, 0.25),
    smoothing=st.floats(0.0, 300e-6),
    end=st.floats(0.5, 0.8),
    seed=st.integers(0, 1000),
)
def test_delay_and_smoothing_are_found(
    delay: float, smoothing: float, end: float, seed: int
) -> None:
    """Wherever in the move, with noise of 0.003 deg: within 2 ms, and as sure as it says."""
    real = side(end + delay, {0: delay}, smoothing, 0.003, seed)
    rows = [sample for sample in real.history if sample.time > end + delay - 0.3]
    fit = fit_joint(
        np.array([t for t, _ in real.tube.commands]),
        np.array([q[0] for _, q in real.tube.commands]),
        np.array([sample.time for sample in rows]),
        np.array([sample.q[0] / SETUP.scale[0] for sample in rows]),
        0.0,
        0.4,
    )
    assert fit is not None
    assert fit.delay == pytest.approx(delay, abs=0.002)
    assert abs(fit.delay - delay) < 4.0 * fit.doubt < 0.05


def test_nothing_is_known_before_the_robot_has_followed() -> None:
    """The longest usual delay is assumed, and that it is not known is."""
    response = assumed(NUMBERS, SETUP.names)
    assert response.longest == NUMBERS.first_ms * 1e-3 and not known(response, NUMBERS)
    assert measured(UNKNOWN, response, RealSide()) == response
    still = side(5.0, {0: 0.1})
    assert measured(UNKNOWN, response, still) == response


@pytest.mark.parametrize(("end", "shows"), [(0.15, False), (0.19, False), (0.22, True)])
def test_the_beginning_of_a_motion_says_nothing_of_a_delay(end: float, shows: bool) -> None:
    """A joint has been away for ten readings first, from where the window finds it."""
    start = replace(after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), at=-1e9)
    assert (measured(UNKNOWN, start, side(end, {0: 0.1}, duration=0.3)) != start) == shows


def test_what_was_measured_beforehand_is_known() -> None:
    """As the file says it, joint by joint."""
    before = {name: MeasuredJoint(20.0 + k, 50.0) for k, name in enumerate(SETUP.names)}
    response = assumed(replace(NUMBERS, measured=before), SETUP.names)
    assert known(response, NUMBERS)
    assert response.delay == pytest.approx((0.020, 0.021, 0.022, 0.023))
    assert response.smoothing == pytest.approx((50e-6,) * 4)


@pytest.mark.parametrize("delay", [0.018, 0.084, 0.148, 0.18])
def test_a_robot_is_known_after_its_first_move(delay: float) -> None:
    """And a joint that has not moved yet is taken for as late as the others."""
    response = after_move({0: delay, 1: delay + 0.01}, assumed(NUMBERS, SETUP.names))
    assert known(response, NUMBERS)
    assert response.delay[:2] == pytest.approx((delay, delay + 0.01), abs=0.003)
    assert response.delay[2] == pytest.approx(delay + 0.005, abs=0.01)


@pytest.mark.parametrize("change", [0.05, -0.05])
def test_a_delay_that_jumps_is_found_in_one_move(change: float) -> None:
    """By 50 ms in either direction, within a second of motion."""
    before = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    after = after_move({0: 0.1 + change}, before)
    assert after.delay[0] == pytest.approx(0.1 + change, abs=0.005)


@pytest.mark.parametrize(("before", "after"), [(0.0, 2e-4), (2e-4, 0.0)])
def test_a_smoothing_that_has_changed_is_approached_and_not_passed(
    before: float, after: float
) -> None:
    """Between what was known and what is measured, whichever is more."""
    start = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    start = replace(start, smoothing=(before,) * len(HOME), at=-1e9)
    found = measured(UNKNOWN, start, side(0.6, {0: 0.1}, after)).smoothing[0]
    assert 0.0 < (found - after) / (before - after) < 0.5


def test_a_robot_that_keeps_up_is_led_faster() -> None:
    """Only while it is led with nearly as much as it has shown: slow motion proves nothing."""
    start = replace(after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), pace=20.0)
    known_then = during_move({0: 0.1}, start)
    steps = {round(after.pace / before.pace, 6) for before, after in pairwise(known_then)}
    faster = known_then[-1]
    assert steps == {1.0, 1.1} and faster.behind_at == 100.0
    assert 20.0 < faster.pace <= 100.0
    assert after_move({0: 0.1}, replace(start, behind_at=21.0)).pace == 20.0
    slow = after_move({0: 0.1}, replace(start, pace=90.0))
    assert slow.pace == 90.0


@pytest.mark.parametrize(("behind_at", "says"), [(100.0, "has not shown yet"), (99.0, "at 99 %")])
def test_only_a_robot_that_fell_behind_is_said_to(behind_at: float, says: str) -> None:
    """One that never did is only not known well enough."""
    shown = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    sure = (0.0005,) * len(HOME)
    follow = Follow(response=replace(shown, pace=60.0, behind_at=behind_at, doubt=sure))
    pace, why = follower_pace(UNKNOWN, follow, Sides(), 100.0, 0.0)
    assert pace == 60.0 and says in why


@pytest.mark.parametrize(("share", "proves"), [(1.05, True), (0.5, False)])
def test_a_short_move_proves_by_its_acceleration(share: float, proves: bool) -> None:
    """It never reaches the speed of its program, whose square root its acceleration shows."""
    length, duration, pace = 4.0, 0.4, 60.0
    # Largest acceleration of the smooth move, which the robot is said to be able to do.
    largest = 10.0 / 3.0**0.5 * length / duration**2
    whole = largest / (share * pace * 1e-2) ** 2 * SETUP.scale[0]
    setup = Setup(ROBOT, CONFIG)
    setup.acceleration = (whole, *setup.acceleration[1:])
    real = side(0.45, {0: 0.1}, length=length, duration=duration)
    begun = replace(
        after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), pace=pace, behind_at=100.0, at=-1e9
    )
    assert (measured(setup, begun, real).pace > pace) == proves


def test_set_points_that_were_held_back_for_a_moment_make_no_robot_late() -> None:
    """Only for longer than 30 ms: then nothing is measured until they have left the window."""
    response = replace(after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), at=-1e9)
    for end, held, since_long in ((0.40, True, False), (0.42, True, False), (0.43, False, False)):
        response = measured(UNKNOWN, response, side(end, {0: 0.1}), held)
        assert (response.held_at > 0.0) == since_long
    assert response.held_since is None
    for end, since_long in ((0.50, False), (0.52, False), (0.54, True)):
        response = measured(UNKNOWN, replace(response, at=-1e9), side(end, {0: 0.1}), True)
        assert (response.held_at > 0.0) == since_long, end
    later = replace(response, held_since=None)
    assert measured(UNKNOWN, later, side(0.56, {0: 0.1})).at == -1e9
    assert measured(UNKNOWN, later, side(0.54 + 0.31, {0: 0.1})).at > 0.0


def test_a_robot_that_falls_behind_is_led_more_slowly() -> None:
    """By a tenth of the speed at which it did, and never faster than that again."""
    start = replace(after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), pace=30.0)
    late = measured(UNKNOWN, replace(start, at=-1e9), side(0.75, {0: 0.13}, noise=0.003))
    assert late.pace < 30.0 and late.behind_at < 100.0
    assert after_move({0: late.delay[0]}, late).pace <= 0.9 * late.behind_at + 1e-9


def test_a_stream_that_begins_may_be_late_otherwise_than_the_one_before() -> None:
    """Where in its own rhythm a robot takes them is new: by how much that differs is learned."""
    shown = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    assert begun(UNKNOWN, shown, ahead=True) is shown
    new = begun(UNKNOWN, shown, ahead=False)
    assert all(one >= FIRST_SPREAD_S for one in new.doubt)
    later = after_move({0: 0.109}, new)
    assert later.delay[0] == pytest.approx(0.109, abs=0.002) and later.doubt[0] < 0.001
    assert later.spread == pytest.approx((0.8 * FIRST_SPREAD_S**2 + 0.2 * 0.009**2) ** 0.5, rel=0.2)
    same = after_move({0: 0.109}, begun(UNKNOWN, later, ahead=False))
    assert same.spread < later.spread and not same.begun
    assert begun(UNKNOWN, assumed(NUMBERS, SETUP.names), ahead=False).begun == ()


@pytest.mark.parametrize(
    ("delay", "known_to", "shown_to", "part", "left"),
    [
        (0.06, 5e-4, 1e-3, 0.3, 0.028),
        (0.14, 5e-4, 1e-3, 0.3, 0.028),
        # No jump: by what both are known to, and no better than half a millisecond.
        (0.101, 5e-4, 1e-3, 0.2, 5e-4),
        (0.2, 2e-4, 1e-4, 0.8, 0.02),
    ],
)
def test_a_delay_that_has_changed_counts_at_once_for_a_good_part(
    delay: float, known_to: float, shown_to: float, part: float, left: float
) -> None:
    """However well 100 ms were known; what is not known any more is what that has left [s]."""
    joints = len(HOME)
    sure = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    before = replace(sure, delay=(0.1,) * joints, smoothing=(0.0,) * joints)
    before = replace(before, doubt=(known_to,) * joints)
    found = _joined(before, {0: Fit(delay, 1e-3, shown_to)}, NUMBERS)
    assert found.smoothing[0] == pytest.approx(1e-3 * max(part, 0.2))
    assert (found.delay[0] - 0.1) / (delay - 0.1) == pytest.approx(part)
    assert found.delay[1:] == before.delay[1:]
    assert found.doubt[0] == pytest.approx(left)


def test_what_several_joints_show_counts_for_the_others_in_the_mean() -> None:
    """Until they are seen themselves: delay and smoothing alike."""
    hardly = assumed(NUMBERS, SETUP.names)
    seen = {0: Fit(0.09, 2e-4, 1e-4), 1: Fit(0.11, 4e-4, 1e-4)}
    found = _joined(hardly, seen, NUMBERS)
    assert found.delay[2:] == pytest.approx((0.1,) * (len(HOME) - 2), rel=0.01)
    mean = 0.5 * (found.smoothing[0] + found.smoothing[1])
    assert found.smoothing[2:] == pytest.approx((mean,) * (len(HOME) - 2))


def test_a_joint_that_was_never_seen_stays_as_late_as_those_that_were() -> None:
    """It is not left behind with what they showed first."""
    first = after_move({0: 0.1}, assumed(NUMBERS, SETUP.names))
    later = after_move({0: 0.13}, first)
    assert later.delay[1] == pytest.approx(0.13, abs=0.003)
    assert later.doubt[1] == pytest.approx(NUMBERS.known_ms * 1e-3)


def earlier(delay: float, pace: float = 100.0) -> RealKnown:
    """Return what an earlier start has learned of a robot."""
    joints = len(HOME)
    return RealKnown(0.0, (delay,) * joints, (1e-4,) * joints, 0.002, pace, 100.0, 0.001)


def test_what_was_learned_earlier_is_believed_until_the_first_motion_says_otherwise() -> None:
    """A robot that answers as before is known at once; another one is measured from the start."""
    known_before = recalled(NUMBERS, assumed(NUMBERS, SETUP.names), earlier(0.1))
    assert known(known_before, NUMBERS) and known_before.recalled
    same = after_move({0: 0.104}, known_before)
    assert not (same.recalled or same.changed) and same.doubt[1] < NUMBERS.known_ms * 1e-3
    fell_behind = replace(known_before, at=-1e9, behind_at=60.0)
    other = measured(UNKNOWN, fell_behind, side(0.45, {0: 0.15}))
    assert other.changed and not other.recalled
    assert (other.pace, other.behind_at) == (NUMBERS.first_percent, 100.0)
    follow = Follow(response=other)
    assert "otherwise than before" in follower_pace(UNKNOWN, follow, Sides(), 100.0, 0.0).reason


def test_delays_that_a_person_has_measured_go_before_what_was_learned_earlier() -> None:
    """Of an earlier start the pace is left: nobody measures that beforehand."""
    joint = MeasuredJoint(delay_ms=40.0, smoothing_ms2=0.0)
    config = replace(NUMBERS, measured=dict.fromkeys(SETUP.names, joint))
    before = assumed(config, SETUP.names)
    now = recalled(config, before, earlier(0.1, pace=70.0))
    assert (now.delay, now.doubt) == (before.delay, before.doubt) and not now.recalled
    assert now.pace == 70.0


def test_a_robot_that_does_as_it_is_told_is_not_taken_for_one_that_is_held_back() -> None:
    """Else its delay would never be measured."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, shifted(HOME, 20.0), 2.0), run=1.0)
    follow = pair.state.follow
    assert follow.real is not None and not follow.real.held
    assert follow.response.held_since is None and follow.response.held_at < 0.0


@pytest.mark.parametrize(("length", "shows"), [(0.25, False), (1.0, True)])
def test_a_joint_that_was_hardly_told_to_move_shows_no_delay(length: float, shows: bool) -> None:
    """Less than 0.3 of its unit is a reading's noise, and the smallest of its moves."""
    start = replace(after_move({0: 0.1}, assumed(NUMBERS, SETUP.names)), at=-1e9)
    found = measured(UNKNOWN, start, side(0.6, {0: 0.12}, length=length, duration=0.4))
    assert (found.at > 0.0) is shows and (found.delay != start.delay) is shows


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("speed", "gain"), [(0.4, 0.0), (0.0, 0.25)])
def test_a_robot_was_led_by_its_speed_or_by_what_that_gained(
    way: float, speed: float, gain: float
) -> None:
    """40 % of the speed; a quarter of the acceleration is that of moves at 50 %."""
    at = np.arange(0.0, 1.0, 0.01)
    fastest, quickest = (SETUP.to_border(each)[0] for each in (SETUP.velocity, SETUP.acceleration))
    told_to = np.zeros((len(at), len(SETUP.names)))
    told_to[:, 0] = way * (speed * fastest * at + 0.5 * gain * quickest * at**2)
    led = _led(SETUP, at, told_to, 0.1, 0.3)
    assert led == pytest.approx(40.0 if speed else 50.0, rel=0.01)
