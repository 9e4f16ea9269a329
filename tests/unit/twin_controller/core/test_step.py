"""The controller's rules, acted out by an ideal pair in virtual time."""

from __future__ import annotations

import re

import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from msgspec.structs import replace
from twin_controller.core.actions import Command, Decided, FollowTwin
from twin_controller.core.lead.modes import Mode
from twin_controller.core.sides.pairing import deviation

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)


@pytest.mark.parametrize(
    ("command", "target", "speed", "text"),
    [
        ("MOVE_JOINTS", (0.0, 0.0, -0.1), 10.0, "3 positions for 4 joints"),
        ("MOVE_JOINTS", (0.0, float("nan"), -0.1, 0.0), 10.0, "joint_2 = nan is not finite"),
        (
            "MOVE_JOINTS",
            (9.0, 0.0, -0.1, 0.0),
            10.0,
            r"joint_1 = 9 rad is outside \[-2.58309, 2.58309\]",
        ),
        ("MOVE", (0.5, float("inf"), 0.1), 10.0, "three finite coordinates"),
        ("MOVE", (0.5, 0.1, 0.1), 101.0, "speed_percent = 101"),
        ("HOME", (), 0.5, r"speed_percent = 0.5 is neither 0 \(default\) nor in \[1, 100\]"),
        ("SPEED", (), 0.0, r"speed_percent = 0 is outside \[1, 100\]"),
        ("DANCE", (), 0.0, "unknown command 'DANCE'"),
    ],
)
def test_bad_commands_are_refused_with_a_reason(
    pair: Pair, command: str, target: tuple[float, ...], speed: float, text: str
) -> None:
    """A refusal names what is wrong and what is allowed, and nothing moves."""
    before = len(pair.actions)
    reply = pair.operate(command, target=target, speed_percent=speed)
    assert not reply.success
    assert re.search(text, reply.message), reply.message
    assert not pair.performed(before)


def test_a_frozen_robot_clock_counts_as_silence(pair: Pair) -> None:
    """Answers that repeat the same instant are not fresh."""
    frozen = pair.now
    pair.real_clock_saved = pair.real_clock  # type: ignore[attr-defined]
    for _ in range(150):
        pair.real_clock = 5000.0 - (pair.now - frozen)
        pair.run(0.001)
    assert pair.mode == "OFFLINE"


@pytest.mark.parametrize("jump", [3600.0, -3600.0])
@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_jump_of_a_clock_stops_and_aligns_anew(pair: Pair, side: str, jump: float) -> None:
    """It decides nothing: the links count as lost, the pair aligns, then goes on."""
    setattr(pair, f"{side}_clock", getattr(pair, f"{side}_clock") + jump)
    pair.run(0.3)
    assert "LINK_LOST" in pair.triggers()
    pair.until(Mode.IDLE, 5.0)
    assert not {"REAL_MOVED", "TWIN_MOVED"} & set(pair.triggers())


def test_when_both_move_at_once_the_real_robot_wins(pair: Pair) -> None:
    """Within the uncertainty of the clocks it is a tie."""
    pair.announce = 0.0
    pair.real_path, pair.real_path_start = ramp(HOME, AWAY, 1.0), pair.now
    pair.move_twin(ramp(HOME, shifted(HOME, -20.0), 1.0), run=0.2)
    assert pair.state.lead.leader == "real"


def test_a_program_of_the_robot_takes_over_from_the_twin(pair: Pair) -> None:
    """A robot that runs its own program cannot follow: the twin's motion ends, it follows."""
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.8)
    pair.start_program(ramp(pair.real_q, HOME, 2.0), run=0.2)
    assert pair.mode == "REAL_LEADS"
    assert Command.STOP_TWIN in pair.performed()


def test_a_robot_that_does_not_start_its_stream_is_a_fault(pair: Pair) -> None:
    """The start is repeated a few times, then both are stopped."""
    pair.starts_stream = False
    pair.move_twin(ramp(HOME, AWAY, 4.0), run=1.5)
    assert pair.mode == "FAULT"
    assert pair.performed().count(Command.START_STREAM) == SETUP.config.stream.attempts


def test_a_set_point_that_may_not_be_sent_stops_both_and_says_which(pair: Pair) -> None:
    """A twin leaps, as no robot can: nothing is repaired, and nothing left out."""
    pair.jog_twin(ramp(HOME, AWAY, 4.0), pair.now)
    pair.until(Mode.TWIN_LEADS)
    pair.run(0.5)
    since, real = len(pair.actions), pair.real_q
    pair.jog_twin(lambda t: shifted(HOME, 90.0), pair.now)
    pair.run(0.2)
    assert pair.triggers()[-1] == "REJECTED" and pair.mode is Mode.STOPPED
    assert "joint_1" in pair.why and pair.decisions()[-1].why == pair.why
    assert {Command.STOP_REAL, Command.STOP_TWIN} <= set(pair.performed(since))
    assert pair.real_q == pytest.approx(real, abs=0.05)


def test_an_emergency_stop_is_owed_until_the_reset(pair: Pair) -> None:
    """A side that is let go meanwhile is told again."""
    assert pair.state.orders.estop is None
    pair.do("ESTOP", 0.5)
    assert pair.mode is Mode.ESTOP and pair.state.orders.estop is not None
    pair.do("RESET", 1.0)
    assert pair.mode is Mode.STOPPED and pair.state.orders.estop is None


def test_sides_that_come_to_rest_apart_are_said_after_the_time_to_settle(pair: Pair) -> None:
    """A drive may need so long for its last hundredths, and no longer."""
    settle, take = SETUP.config.settle, pair.take_follow

    def beside(action: FollowTwin, now: float) -> None:
        off = 1.5 * settle.tolerance
        points = tuple(replace(each, q=shifted(each.q, off)) for each in action.points)
        take(replace(action, points=points), now)

    pair.take_follow = beside  # type: ignore[method-assign]
    pair.start_program(ramp(HOME, shifted(HOME, 10.0), 1.0), run=1.1)
    pair.end_program()
    pair.run(0.9 * settle.timeout_ms * 1e-3)
    assert pair.mode is Mode.REAL_LEADS
    pair.run(0.2 * settle.timeout_ms * 1e-3 + 0.3)
    assert pair.triggers()[-1] == "UNSETTLED"


def test_the_pair_coming_apart_pauses_both_until_acknowledged(pair: Pair) -> None:
    """Divergence is k of n beyond the limit; RESUME needs the operator's acknowledgement."""
    pair.start_program(ramp(HOME, AWAY, 4.0), run=1.0)
    pair.take_follow = lambda action, now: None  # type: ignore[method-assign]
    pair.motion, pair.follow = "idle", None
    pair.run(1.5)
    assert pair.mode == "PAUSED" and pair.state.lead.needs_acknowledge
    for _ in range(2):
        refused = pair.operate("RESUME")
        assert not refused.success and "ACKNOWLEDGE" in refused.message
    pair.do("ACKNOWLEDGE")
    assert not pair.operate("ACKNOWLEDGE").success
    pair.do("RESUME")


def test_a_pause_without_a_divergence_has_nothing_to_acknowledge(pair: Pair) -> None:
    """No answer says that RESUME is possible where it is not."""
    pair.start_program(ramp(HOME, AWAY, 4.0), run=1.0)
    pair.do("PAUSE", 1.0)
    answer = pair.operate("ACKNOWLEDGE")
    assert not answer.success and "nothing to acknowledge" in answer.message


def test_speed_above_the_limit_caps_the_twin(pair: Pair) -> None:
    """Requested 100 %, applied what lets the robot keep up within 80 %; the reason is said."""
    pair.places = 10
    pair.move_twin(ramp(HOME, AWAY, 1.0), run=0.5)
    most = SETUP.config.limit.twin_percent
    assert pair.limit == most
    speed = pair.state.orders.speeds
    assert (speed.requested, speed.applied, speed.limited) == (100.0, most, True)
    assert "at most 80 %" in speed.reason


def test_a_move_that_is_too_short_for_the_limit_is_not_slowed(pair: Pair) -> None:
    """A cap slows all of its path down: one whose joints reach half as much needs none."""
    pair.places = 10
    most = SETUP.config.limit.twin_percent
    pair.announced = AWAY, 64.0
    pair.move_twin(ramp(HOME, AWAY, 1.0), run=0.5)
    # The robot's own override of 100 % leaves it 100 / 1.2 %.
    assert pair.limit == 100.0 and not pair.state.orders.speeds.limited
    pair.announced = AWAY, 95.0
    pair.run(0.1)
    assert pair.limit == pytest.approx(100.0 * most / 95.0, abs=1.0)
    pair.run(3.0)
    assert pair.motion == "idle" and pair.limit == most


def test_deviation_is_infinite_while_a_side_is_unknown() -> None:
    """Nothing that needs both sides may pass before both are known."""
    assert deviation(SETUP, Pair().state.sides) == float("inf")


def test_the_twin_leaves_the_robot_room_below_its_override(pair: Pair) -> None:
    """A robot that follows at exactly its override could not catch up."""
    pair.places = 10
    pair.override = 30.0
    pair.move_twin(ramp(HOME, AWAY, 1.0), run=0.5)
    assert pair.limit == pytest.approx(30.0 / SETUP.config.limit.override_margin)
    assert "override is 30 %" in pair.state.orders.speeds.reason


def test_a_decision_that_asks_not_who_was_first_is_recorded_without_onsets(pair: Pair) -> None:
    """Nor with how uncertain they are."""
    before = len(pair.actions)
    pair.operate("STOP")
    (made,) = [action for action in pair.actions[before:] if isinstance(action, Decided)]
    assert made.trigger == "STOP"
    assert (made.onset_real, made.onset_twin, made.onset_uncertainty) == (None, None, 0.0)
