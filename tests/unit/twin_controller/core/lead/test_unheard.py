"""A robot to which nothing is ever written: no row sends it anything, none claims that it stops."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, ROBOT, SETUP, WATCHED, Pair, ramp
from twin_controller.core.actions import (
    Command,
    Grip,
    OverrideReal,
    SendReal,
    StreamAhead,
    StreamReal,
)
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.table import look_up
from twin_controller.core.lead.unheard import AT_ITS_PENDANT, TO_REAL, unheard
from twin_controller.core.setup import Setup
from twin_controller.view import state_view

FOLLOWED_ROBOT = msgspec.structs.replace(ROBOT, lead=False)
FOLLOWED = Setup(FOLLOWED_ROBOT, SETUP.config)
AWAY = (1.0, 0.5, -0.10, 0.5)
STOPS = (Command.STOP_REAL, Command.HOLD_REAL, Command.ESTOP_REAL)
LEAD_IS_FALSE = "robot.yaml: lead is false: nothing is ever written to the robot"
CLAIMS = ("both are stopped", "both are paused", "drives are switched off", "is stopped before")


@pytest.fixture
def pair() -> Pair:
    """Give an idle pair whose robot hears nothing."""
    made = Pair(setup=FOLLOWED)
    made.connect()
    return made


def silent(pair: Pair) -> bool:
    """Return whether nothing was decided for the real robot."""
    real = (SendReal, OverrideReal, StreamReal, StreamAhead)
    grips = [grip for grip in pair.made(Grip) if grip.side == "real"]
    return not grips and not any(isinstance(action, real) for action in pair.actions)


@pytest.mark.parametrize("paused", [None, *Mode])
@pytest.mark.parametrize("mode", Mode)
def test_no_row_sends_the_robot_anything_or_claims_that_it_stops(
    mode: Mode, paused: Mode | None
) -> None:
    """Each mode with each trigger."""
    for trigger in Trigger:
        row = look_up(mode, trigger, paused)
        heard = unheard(row, mode)
        assert not TO_REAL & set(heard.commands), (mode, trigger)
        assert heard.refused == row.refused and heard.silent == row.silent
        if set(row.commands) & set(STOPS):
            assert heard.why.startswith(AT_ITS_PENDANT), (mode, trigger)
            assert not any(claim in heard.why for claim in CLAIMS), (mode, trigger, heard.why)


def test_whatever_commands_stop_is_sent_to_the_robot_of_a_pair_that_may_be_led() -> None:
    """The rows themselves stay as they are."""
    row = look_up(Mode.REAL_LEADS, Trigger.STOP)
    assert row.commands == (Command.STOP_REAL, Command.STOP_TWIN)
    assert Setup(ROBOT, SETUP.config).writes and not FOLLOWED.writes


@pytest.mark.parametrize("command", ["STOP", "ESTOP"])
def test_a_stop_moves_no_override_and_waits_for_no_robot(pair: Pair, command: str) -> None:
    """Nothing is owed to a robot that hears nothing: no drives are cut, no attempt is counted."""
    pair.start_program(ramp(HOME, AWAY, 6.0), run=1.0)
    assert pair.mode is Mode.REAL_LEADS
    pair.do(command, run=3.0)
    assert pair.mode is (Mode.STOPPED if command == "STOP" else Mode.ESTOP)
    assert silent(pair) and pair.state.orders.stop is None and not pair.state.orders.hold_away
    assert not {"STOP_IGNORED", "ESTOP_IGNORED", "ESTOP_MISSED"} & set(pair.triggers())
    if command == "ESTOP":
        assert "nothing reaches the real robot" in pair.operate("RESET").message
        pair.until(Mode.STOPPED)
        assert silent(pair)


def test_what_would_move_slow_or_hold_the_robot_is_refused(pair: Pair) -> None:
    """With the reason, and where it can be done."""
    refused = refusals(FOLLOWED, pair.state, pair.now)
    for command in ("PAUSE", "SPEED", "MOVE", "MOVE_JOINTS", "HOME", "JOG"):
        assert refused[command].startswith(LEAD_IS_FALSE), (command, refused[command])
    assert refused["SPEED"].endswith("do it at its own pendant")
    assert not any(refused[command] for command in ("STOP", "ESTOP", "RUN", "ALIGN"))
    assert state_view(FOLLOWED, pair.state, pair.now).only_followed == LEAD_IS_FALSE


def test_a_twin_that_moves_by_itself_is_stopped_and_moves_no_robot(pair: Pair) -> None:
    """Somebody jogs it, or calls move_to."""
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.5)
    assert pair.mode is Mode.STOPPED and LEAD_IS_FALSE in pair.why and silent(pair)
    assert pair.triggers()[-1] == "TWIN_MOVED_UNLED"


def test_a_protective_stop_of_the_twin_cannot_go_on_to_where_the_robot_is_by_now() -> None:
    """Its RESUME would be a jump: it is refused, and ALIGN brings the twin there slowly."""
    pair = Pair(setup=Setup(FOLLOWED_ROBOT, WATCHED.config))
    pair.link("real", True)
    pair.link("twin", True)
    pair.see(9.0, 3.0)
    assert pair.mode is Mode.IDLE
    pair.run_program(ramp(HOME, AWAY, 12.0), pair.now)
    pair.see(9.0, 1.0)
    assert pair.mode is Mode.REAL_LEADS
    pair.see(0.7, 0.15)
    assert pair.mode is Mode.PAUSED and AT_ITS_PENDANT in pair.why
    pair.see(9.0, 0.1)
    reply = pair.operate("RESUME")
    assert not reply.success and pair.mode is Mode.STOPPED, reply
    assert pair.operate("ALIGN").success
    pair.see(9.0, 5.0)
    assert pair.mode is Mode.REAL_LEADS and silent(pair)


def test_a_program_that_begins_at_a_stopped_pair_is_followed_once_the_twin_is_with_it(
    pair: Pair,
) -> None:
    """The robot went on while the twin stood: it does not follow from afar."""
    pair.start_program(ramp(HOME, AWAY, 2.0), run=0.5)
    pair.do("STOP", run=4.0)
    pair.end_program()
    pair.run(1.0)
    assert pair.mode is Mode.STOPPED and pair.far() > 5.0
    since = len(pair.decisions())
    pair.start_program(ramp(AWAY, HOME, 8.0), run=6.0)
    assert pair.mode is Mode.REAL_LEADS and silent(pair)
    modes = [decision.mode_after for decision in pair.decisions()[since:]]
    assert modes[:2] == ["ALIGNING", "REAL_LEADS"]


def test_the_operators_speed_is_no_order_to_the_robot(pair: Pair) -> None:
    """Refused, and no override is lowered for anybody."""
    assert not pair.operate("SPEED", speed_percent=20.0).success
    pair.start_program(ramp(HOME, AWAY, 2.0), run=3.0)
    pair.end_program()
    pair.until(Mode.IDLE)
    assert silent(pair)


def test_a_limit_lowers_no_override_that_cannot_be_written() -> None:
    """The Cartesian limit would halve it; a robot that is led is sent so."""
    cell = msgspec.structs.replace(SETUP.config.cell, cartesian_speed_mm_s=250.0)
    config = msgspec.structs.replace(SETUP.config, cell=cell)
    lowered = []
    for robot in (ROBOT, FOLLOWED_ROBOT):
        pair = Pair(setup=Setup(robot, config))
        pair.connect()
        lowered.append(bool(pair.made(OverrideReal)))
    assert lowered == [True, False]
