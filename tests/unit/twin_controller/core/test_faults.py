"""Faults and their ends: what is sent again, what is forgotten, what is not believed."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from harness.running.thorough import examples, thorough
from harness.watch import Watch
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command, FollowTwin
from twin_controller.core.events import RealAlarm, RealMeasured, Tick, TwinMeasured
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.safety.divergence import DivergenceState
from twin_controller.core.step import step

replace = msgspec.structs.replace
AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
PLAIN, LATE = (0.0, 0.0), (0.03, 0.02)
RESET_S = SETUP.config.reset.timeout_ms * 1e-3 + 0.5


@pytest.fixture(params=[*thorough((PLAIN,)), LATE], ids=["at once", "late"])
def pair(request: pytest.FixtureRequest) -> Pair:
    """Return a connected and watched pair, IDLE at home, heard at once or late."""
    made = Pair()
    made.command_delay, made.report_delay = request.param
    Watch(made)
    made.connect()
    return made


@pytest.mark.parametrize("side", ["real", "twin"])
def test_an_emergency_stop_reaches_a_side_that_was_away(pair: Pair, side: str) -> None:
    """Latched: the side that comes back is stopped too, and nothing of it moves meanwhile."""
    pair.link(side, False)
    pair.do("ESTOP", 0.5)
    pair.link(side, True)
    pair.run(1.0)
    assert not pair.drives and pair.motion == "estopped"
    pair.do("RESET", 1.0)
    assert pair.mode is Mode.STOPPED and pair.drives and pair.motion == "idle"


def test_a_side_that_is_let_go_on_its_own_side_is_stopped_again(pair: Pair) -> None:
    """The latch is left by our RESET only; the repetition is slow enough to be read."""
    pair.do("ESTOP", 1.0)
    since = len(pair.decisions())
    pair.drives = True
    pair.order_twin(Command.RESET_TWIN, 17)
    pair.run(1.5)
    assert pair.mode is Mode.ESTOP and not pair.drives and pair.motion == "estopped"
    assert 1 <= pair.triggers(since).count("ESTOP_MISSED") <= 3


def test_an_emergency_stop_that_persists_cannot_be_reset(pair: Pair) -> None:
    """RESET fails with a text while the button is pressed; nothing is switched on."""
    pair.press_estop()
    pair.run(0.2)
    assert pair.mode is Mode.ESTOP and pair.motion == "estopped"
    pair.do("RESET", RESET_S)
    assert pair.mode is Mode.ESTOP and "(its drives are off)" in pair.why
    pair.estop_pressed = False
    pair.run(1.0)
    assert pair.mode is Mode.ESTOP, "releasing alone changes nothing"
    pair.do("RESET", 1.0)
    assert pair.mode is Mode.STOPPED


def test_a_reset_waits_for_drives_that_take_two_seconds(pair: Pair) -> None:
    """So long a real controller may take to switch servo power on: B-83284EN/09, figure 3.8."""
    pair.press_estop()
    pair.run(0.2)
    pair.do("RESET", 2.2)
    assert pair.mode is Mode.ESTOP and "not become ready" not in pair.why
    pair.estop_pressed, pair.drives = False, True
    pair.run(0.5)
    assert pair.mode is Mode.STOPPED


@pytest.mark.parametrize(
    ("drives", "alarm", "said"),
    [
        (False, "", "(its drives are off)"),
        (False, "SERVO SRVO-068", "(its drives are off: SERVO SRVO-068)"),
        (True, "", "(its FAULT is on)"),
        (True, "STOP MOTN-017", "(STOP MOTN-017)"),
    ],
)
def test_a_reset_that_failed_says_what_it_lacks(
    pair: Pair, drives: bool, alarm: str, said: str
) -> None:
    """Drives that do not come, or an alarm that stays; it is latched as before."""
    pair.press_estop()
    pair.run(0.2)
    pair.command_real = lambda do: None  # type: ignore[method-assign]
    pair.drives, pair.fault = drives, True
    pair.feed(RealAlarm(pair.now, alarm))
    pair.do("RESET", RESET_S)
    assert pair.mode is Mode.ESTOP
    (failed,) = [made for made in pair.decisions() if made.trigger == "RESET_FAILED"]
    assert said in failed.why


def test_a_reset_does_not_outlive_a_lost_link(pair: Pair) -> None:
    """Drives that somebody switches on after the link came back are no answer to the old RESET."""
    pair.press_estop()
    pair.run(0.2)
    pair.do("RESET", 0.1)
    pair.link("real", False)
    pair.estop_pressed = False
    pair.run(0.3)
    pair.link("real", True)
    pair.drives = True
    pair.run(1.0)
    assert pair.mode is Mode.ESTOP


@pytest.mark.parametrize("resumed_by", ["operator", "pendant"])
def test_a_hold_on_the_robots_side_ends_once(pair: Pair, resumed_by: str) -> None:
    """A report from before the release is no new hold."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=1.0)
    since = len(pair.decisions())
    pair.paused = True
    pair.run(1.0)
    assert pair.mode is Mode.PAUSED and pair.motion == "paused"
    if resumed_by == "operator":
        pair.do("RESUME")
    else:
        pair.paused = False
    pair.until(Mode.IDLE, 8.0)
    assert len(pair.triggers(since)) == 3


def test_a_program_that_has_not_shown_its_pause_yet_cannot_be_resumed(pair: Pair) -> None:
    """START lets a paused program go on, and this one is about to pause."""
    pair.start_program(ramp(HOME, AWAY, 3.0), run=1.0)
    pair.do("PAUSE")
    refused = pair.operate("RESUME")
    assert not refused.success and "has not shown the pause yet" in refused.message
    pair.run(1.0)
    pair.do("RESUME", 0.5)
    assert pair.mode is Mode.REAL_LEADS


def test_a_stream_that_has_not_shown_its_pause_yet_is_resumed(pair: Pair) -> None:
    """The robot goes on by set points, which begin anew wherever it is by then."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=1.0)
    pair.do("PAUSE")
    since = len(pair.actions)
    pair.do("RESUME")
    pair.until(Mode.IDLE, 8.0)
    assert pair.far() < 0.05
    assert pair.performed(since).count(Command.RESUME_TWIN) == 1


def test_a_pause_is_whose_until_the_operator_takes_it(pair: Pair) -> None:
    """Who held the robot may let it go on, also after a command that was refused meanwhile."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=1.0)
    pair.paused = True
    pair.run(1.0)
    held = pair.state.lead.paused_by
    assert pair.mode is Mode.PAUSED and not pair.operate("HOME").success
    assert pair.state.lead.paused_by is held
    pair.do("PAUSE")
    assert pair.mode is Mode.PAUSED and pair.state.lead.paused_by is Trigger.PAUSE


def test_a_robot_that_stays_held_after_resume_pauses_the_twin_again(pair: Pair) -> None:
    """The twin does not go on alone."""
    pair.move_twin(ramp(HOME, AWAY, 6.0), run=1.0)
    pair.paused = True
    pair.run(0.5)
    pair.command_real = lambda do: None  # type: ignore[method-assign]
    pair.do("RESUME", 1.5)
    assert pair.mode is Mode.PAUSED and pair.motion == "paused"


def test_a_stream_that_was_ended_during_a_pause_is_started_again(pair: Pair) -> None:
    """RESUME brings the real robot along, or fails with a text: the twin never goes alone."""
    pair.move_twin(ramp(HOME, AWAY, 5.0), run=1.0)
    pair.order_twin(Command.PAUSE_TWIN, 17)
    pair.run(0.5)
    pair.streaming = False
    pair.run(0.2)
    assert pair.mode is Mode.PAUSED
    pair.do("RESUME", 0.5)
    assert pair.mode is Mode.TWIN_LEADS and pair.streaming


def test_a_stream_that_is_ended_as_it_goes_on_is_not_started_again(pair: Pair) -> None:
    """Its own pendant ends the program before its next answer: a stop of both."""
    pair.move_twin(ramp(HOME, AWAY, 5.0), run=1.0)
    pair.paused = True
    pair.run(0.5)
    assert pair.mode is Mode.PAUSED and pair.streaming
    pair.do("RESUME")
    pair.streaming = False
    pair.run(1.0)
    assert pair.mode is Mode.STOPPED and not pair.streaming
    assert pair.triggers()[-1] == "REAL_STOPPED"


def test_a_program_of_the_robot_leads_after_a_pause_has_ended(pair: Pair) -> None:
    """Not while both are held; after STOP it leads, and the twin follows once it is aligned."""
    pair.move_twin(ramp(HOME, AWAY, 5.0), run=1.0)
    pair.order_twin(Command.PAUSE_TWIN, 17)
    pair.run(0.5)
    pair.start_program(ramp(pair.real_q, HOME, 2.0), run=0.8)
    assert pair.mode is Mode.PAUSED and not pair.own_program
    pair.do("STOP", 0.5)
    pair.start_program(ramp(pair.real_q, HOME, 2.0), run=0.8)
    assert pair.mode is Mode.REAL_LEADS and pair.motion == "following"


@pytest.mark.parametrize("released", ["real", "twin"])
def test_a_release_does_not_go_round_the_acknowledgement(pair: Pair, released: str) -> None:
    """After a divergence a side that goes on by itself stops both."""
    pair.move_twin(ramp(HOME, AWAY, 8.0), run=1.0)
    pair.state = changed(pair.state, safety__divergence=DivergenceState((True,) * 15, True, 30.0))
    pair.run(0.5)
    assert pair.mode is Mode.PAUSED and pair.state.lead.needs_acknowledge and pair.paused
    if released == "real":
        pair.paused = False
    else:
        pair.order_twin(Command.RESUME_TWIN, 17)
    pair.run(0.3)
    assert pair.mode is Mode.STOPPED
    assert pair.triggers()[-1] == "RELEASED_BLOCKED"


def test_an_old_alarm_does_not_pause_an_aligned_pair(pair: Pair) -> None:
    """Aligning ends a divergence; a program that begins at once is not paused for it."""
    pair.operate("STOP")
    pair.run(0.5)
    pair.state = changed(pair.state, safety__divergence=DivergenceState((True,) * 15, True, 30.0))
    pair.start_program(ramp(HOME, AWAY, 4.0))
    pair.do("ALIGN", 1.0)
    assert "DIVERGED" not in pair.triggers()


def test_stamps_from_the_future_are_not_believed() -> None:
    """A clock that jumped is found by the first stamp, not only by the next probe."""
    pair = idle_pair()
    stamp = pair.now + pair.twin_clock + 3600.0
    pair.feed(TwinMeasured(pair.now, JointMotion.measured(shifted(HOME, 9.0), (0.0,) * 4, stamp)))
    assert pair.mode is Mode.OFFLINE
    assert "ahead of its clock" in pair.state.sides.twin.reason


def test_data_that_come_late_are_not_fresh() -> None:
    """What delivers everything 0.3 s late is no connection: age counts from the stamp."""
    pair = idle_pair()
    pair.twin_delay_begins = pair.now  # type: ignore[attr-defined]
    pair.report_delay = 0.3
    pair.run(0.6)
    assert pair.mode is Mode.OFFLINE
    before = len(pair.actions)
    pair.run(3.0)
    assert not pair.made(FollowTwin, before)


def test_an_answer_that_repeats_an_instant_commands_nobody(pair: Pair) -> None:
    """The follower gets one set point for each new sample."""
    pair.start_program(ramp(HOME, AWAY, 3.0), run=1.0)
    last = next(event for event in reversed(pair.inputs) if isinstance(event, RealMeasured))
    state, actions = step(
        SETUP,
        pair.state,
        replace(last, now=last.now + 0.01, sent=last.sent + 0.01, received=last.received + 0.01),
    )
    assert not actions and state.sides.real.history == pair.state.sides.real.history


def test_the_end_of_an_old_plan_is_no_new_motion() -> None:
    """Rows due before the positions were agreed say nothing about who moves first now."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, AWAY, 1.0), run=0.8)
    old = pair.state.sides.twin.plan
    pair.until(Mode.IDLE, 5.0)
    assert old is not None and pair.state.sides.twin.motion is not None
    pair.feed(replace(pair.state.sides.twin.motion, now=pair.now, state="announcing"))
    pair.feed(replace(old, now=pair.now))
    assert pair.mode is Mode.IDLE


def test_what_the_gate_slowed_down_is_shown() -> None:
    """Nothing is limited silently; the reason goes when the stream ends."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, AWAY, 4.0), run=1.5)
    assert pair.state.follow.real is not None and not pair.state.follow.real.slowed
    slowed = changed(
        pair.state,
        follow__real__slowed="joint_1 at 95 % of its largest speed, allowed 80 %",
        sides__twin__motion__speed_requested_percent=10.0,
    )
    shown = step(SETUP, slowed, Tick(pair.now))[0].orders.speeds
    assert shown.limited and "joint_1 at 95 %" in shown.reason
    gone = step(SETUP, changed(slowed, follow__real=None), Tick(pair.now))[0].orders.speeds
    assert not gone.limited and not gone.reason


def test_a_side_lost_in_the_step_that_decides_a_leader_leads_nobody() -> None:
    """The robot turns out to be silent in the step in which the twin moved: OFFLINE, no error."""
    pair = idle_pair()
    pair.jog_twin(ramp(HOME, AWAY, 2.0), pair.now)
    pair.real_up = False
    pair.run(0.3)
    assert pair.mode is Mode.OFFLINE
    idle = changed(pair.state, lead__mode=Mode.IDLE, lead__links_up=True)
    late = step(SETUP, idle, Tick(pair.now))[0]
    assert late.lead.mode is Mode.OFFLINE


POSE = st.tuples(
    st.floats(-25.0, 25.0), st.floats(-35.0, 35.0), st.floats(-40.0, 90.0), st.floats(-15.0, 15.0)
)
FLAP = st.tuples(st.sampled_from(["real", "twin"]), st.integers(1, 900))


@settings(max_examples=examples(5, 15), deadline=None)
@given(real=POSE, twin=POSE, flaps=st.lists(FLAP, max_size=6))
def test_a_reconnect_moves_the_twin_slowly_and_the_real_robot_not_at_all(
    real: tuple[float, ...], twin: tuple[float, ...], flaps: list[tuple[str, int]]
) -> None:
    """Links come and go in any order: nothing is replayed, the twin aligns slowly, all is idle."""
    pair = Pair(real=shifted(HOME, *real), twin=shifted(HOME, *twin))
    Watch(pair)
    begin = pair.real_q
    pair.link("twin", True)
    pair.link("real", True)
    for side, ms in flaps:
        pair.link(side, not getattr(pair, f"{side}_up"))
        pair.run(ms * 1e-3)
    for side in ("real", "twin"):
        if not getattr(pair, f"{side}_up"):
            pair.link(side, True)
    pair.run(1.0)
    pair.until(Mode.IDLE, 15.0)
    assert pair.real_q == begin
    assert set(pair.performed()) <= {
        Command.STOP_REAL,
        Command.GIVE_HOLD_BACK,
        Command.STOP_TWIN,
        Command.RELEASE_TWIN,
    }
    speeds = [
        abs(v) / limit
        for a in pair.actions
        if isinstance(a, FollowTwin)
        for v, limit in zip(a.points[0].qdot, SETUP.velocity)
    ]
    assert max(speeds) <= SETUP.config.align.speed_percent * 1e-2 + 1e-9
    assert set(pair.triggers()) <= {"LINKS_READY", "LINK_LOST", "ALIGNED"}


def test_a_program_that_runs_already_leads_as_soon_as_the_pair_is_ready(pair: Pair) -> None:
    """In any order of start: it waits at a point, but it is what the twin has to follow."""
    pair.link("real", False)
    pair.start_program(ramp(HOME, HOME, 60.0), run=0.3)
    pair.link("real", True)
    pair.run(2.0)
    assert pair.mode is Mode.REAL_LEADS
    assert pair.triggers()[-2:] == ["ALIGNED", "REAL_TOOK_OVER"]


def test_a_robot_that_had_moved_before_the_announced_twin_takes_the_lead(pair: Pair) -> None:
    """Announced first, but to begin later: its stream ends, the twin follows."""
    pair.move_twin(ramp(HOME, shifted(HOME, -20.0), 2.0), run=0.03)
    pair.jog_real(ramp(HOME, AWAY, 0.5))
    pair.run(0.12)
    assert pair.triggers()[-2:] == ["TWIN_MOVED", "REAL_WAS_FIRST"]
    assert pair.mode is Mode.REAL_LEADS
    assert Command.STOP_TWIN in pair.performed()


def rested_apart(pair: Pair) -> None:
    """Let the twin leave the robot, which leads no more, by 11 mm."""
    pair.start_program(ramp(HOME, shifted(HOME, 5.0), 1.0), run=2.0)
    assert pair.mode is Mode.REAL_LEADS
    pair.take_follow = lambda action, now: None  # type: ignore[method-assign]
    pair.motion, pair.follow = "idle", None
    pair.jog_twin(ramp(pair.twin_q, shifted(pair.twin_q, 1.0), 0.3), pair.now)
    pair.run(1.5)


def test_a_divergence_ends_with_the_stop_behind_it(pair: Pair) -> None:
    """Who starts the robot after a STOP is followed; the pair is measured anew."""
    rested_apart(pair)
    assert pair.triggers()[-1] == "DIVERGED"
    del pair.take_follow
    pair.do("STOP", 1.0)
    begun = len(pair.decisions())
    pair.start_program(ramp(pair.real_q, shifted(pair.real_q, -30.0), 3.0), run=2.0)
    assert pair.triggers(begun) == ["REAL_TOOK_OVER"] and pair.far() < 0.5


def test_a_pair_that_rests_apart_diverges_by_the_smaller_limit(pair: Pair) -> None:
    """11 mm between the tools at rest are an alarm, though less than what is allowed on the way."""
    rested_apart(pair)
    distance = pair.state.safety.divergence.distance_mm
    assert SETUP.config.divergence.rest_mm < distance < SETUP.config.divergence.path_mm
    assert pair.mode is Mode.PAUSED and pair.triggers()[-1] == "DIVERGED"


def test_an_emergency_stop_reaches_the_robot_while_the_twin_stays_away(pair: Pair) -> None:
    """It was given while neither could hear it."""
    pair.start_program(ramp(HOME, AWAY, 8.0), run=0.5)
    for side in ("real", "twin"):
        pair.link(side, False)
    pair.do("ESTOP", 0.02)
    pair.link("real", True)
    pair.run(1.5)
    assert not pair.drives and not pair.own_program


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_side_does_not_end_the_operators_pause(pair: Pair, side: str) -> None:
    """Also where that side had paused before."""
    pair.move_twin(ramp(HOME, AWAY, 5.0), run=1.0)
    if side == "real":
        pair.paused = True
    else:
        pair.order_twin(Command.PAUSE_TWIN, 17)
    pair.run(0.5)
    pair.do("PAUSE", 0.3)
    if side == "real":
        pair.paused = False
    else:
        pair.order_twin(Command.RESUME_TWIN, 18)
    pair.run(1.5)
    assert pair.mode is Mode.STOPPED


@pytest.mark.parametrize("command", ["ESTOP", "STOP"])
def test_a_reset_does_not_outlive_a_newer_stop(pair: Pair, command: str) -> None:
    """Whoever stops again, while the robot is being reset, has stopped it."""
    pair.do("ESTOP", 1.0)
    pair.do("RESET", 0.13)
    since = len(pair.decisions())
    pair.do(command, 1.0)
    assert pair.mode is Mode.ESTOP and "RESET_DONE" not in pair.triggers(since)


def test_a_robot_that_comes_back_in_an_emergency_stop_is_not_said_to_move(pair: Pair) -> None:
    """It stands, and has not been seen for long enough to know it."""
    pair.do("ESTOP", 0.5)
    pair.link("real", False)
    pair.run(1.5)
    pair.link("real", True)
    pair.run(1.0)
    assert not pair.drives and "ESTOP_IGNORED" not in pair.triggers()
