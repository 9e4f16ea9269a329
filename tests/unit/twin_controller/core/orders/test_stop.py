"""A stop is sent again until the real robot shows it, and in the end its drives go off."""

from __future__ import annotations

import math

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.watch import Watch, watched
from twin_controller.core.actions import CapTwin, Command, Send
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode
from twin_controller.view import alarm_text

SLOWEST_PERCENT = 4.0
replace = msgspec.structs.replace
PROGRAM = ramp(HOME, shifted(HOME, 80.0), 8.0)
ATTEMPTS, RETRY_S = SETUP.config.stop.attempts, SETUP.config.stop.retry_ms * 1e-3
TO_THE_ROBOT = (Command.STOP_REAL, Command.HOLD_REAL, Command.ESTOP_REAL)


class Deaf(Pair):
    """A pair whose real robot does not hear some commands."""

    not_heard: tuple[Command, ...] = ()

    def command_real(self, do: Command) -> None:
        """Obey what is heard."""
        if do not in self.not_heard:
            super().command_real(do)


@pytest.fixture
def pair() -> Deaf:
    """Return a connected and watched pair, IDLE at home; commands and reports take their time."""
    return watched(Deaf())


def sent(pair: Pair, since: int) -> list[Command]:
    """Return what the real robot was told since the given index of actions, stops only."""
    return [
        action.command
        for action in pair.actions[since:]
        if isinstance(action, Send) and action.command in TO_THE_ROBOT
    ]


def under_way(pair: Pair) -> None:
    """Let the robot run a program, and follow it."""
    pair.start_program(PROGRAM, run=1.0)
    assert pair.mode is Mode.REAL_LEADS


def moved_deg(pair: Pair, since: float) -> float:
    """Return how far joint 1 of the robot is from ``since`` [deg]."""
    return abs(math.degrees(pair.real_q[0] - since))


@pytest.mark.parametrize("command", ["STOP", "PAUSE"])
def test_a_stop_that_is_obeyed_is_sent_once(pair: Deaf, command: str) -> None:
    """The robot's next answer shows it; nothing is repeated."""
    under_way(pair)
    since = len(pair.actions)
    pair.do(command, 2.0)
    assert len(sent(pair, since)) == 1 and pair.state.orders.stop is None


@pytest.mark.parametrize(
    ("command", "lost"), [("STOP", Command.STOP_REAL), ("PAUSE", Command.HOLD_REAL)]
)
def test_a_stop_that_was_lost_once_is_sent_again(pair: Deaf, command: str, lost: Command) -> None:
    """Within the time of one repetition the robot stands."""
    under_way(pair)
    pair.not_heard = (lost,)
    pair.do(command, 0.5 * RETRY_S)
    pair.not_heard = ()
    pair.run(RETRY_S)
    stood = pair.real_q[0]
    pair.run(1.0)
    assert moved_deg(pair, stood) == pytest.approx(0.0, abs=1e-9)
    assert pair.state.orders.stop is None


@pytest.mark.parametrize(
    ("command", "lost"), [("STOP", Command.STOP_REAL), ("PAUSE", Command.HOLD_REAL)]
)
def test_a_robot_that_does_not_obey_has_its_drives_switched_off(
    pair: Deaf, command: str, lost: Command
) -> None:
    """After so many attempts it is an emergency stop, which says why and what was tried."""
    under_way(pair)
    pair.not_heard = (lost,)
    since = len(pair.actions)
    pair.do(command, (ATTEMPTS + 1) * RETRY_S + 0.1)
    assert pair.mode is Mode.ESTOP and not pair.drives
    assert sent(pair, since).count(lost) == ATTEMPTS
    assert (
        f"the real robot does not obey a stop ({lost.value}, sent {ATTEMPTS} times: "
        "its program goes on)" in pair.why
    )


def test_a_stop_while_the_robot_is_away_reaches_it_when_it_answers_again(pair: Deaf) -> None:
    """The operator was told so; a program that outlived the glitch ends, and nobody follows it."""
    under_way(pair)
    pair.link("real", False)
    pair.run(0.02)
    reply = pair.operate("STOP")
    assert reply.success and "when it answers again" in reply.message
    pair.run(0.02)
    pair.link("real", True)
    pair.run(RETRY_S + 0.1)
    assert not pair.own_program
    stood = pair.real_q[0]
    pair.run(3.0)
    assert moved_deg(pair, stood) == pytest.approx(0.0, abs=1e-9)


def test_a_glitch_of_the_robots_line_ends_its_program(pair: Deaf) -> None:
    """LINK_LOST stops the side still reached; the stop for the other one is not forgotten."""
    under_way(pair)
    pair.link("real", False)
    pair.run(0.04)
    pair.link("real", True)
    pair.run(RETRY_S + 0.1)
    assert not pair.own_program


def test_a_program_paused_before_a_glitch_is_not_given_back_by_another_moves_resume(
    pair: Deaf,
) -> None:
    """Its goal was cleared with the link."""
    under_way(pair)
    pair.do("PAUSE", 0.5)
    pair.link("real", False)
    pair.run(0.05)
    pair.link("real", True)
    pair.run(3.0)
    assert not pair.own_program and not pair.paused


def test_no_move_begins_while_the_robot_runs_a_program(pair: Deaf) -> None:
    """The robot would not follow it: it waits in its program, and has not heard the STOP."""
    pair.not_heard = (Command.STOP_REAL,)
    pair.start_program(lambda t: HOME, run=0.3)
    pair.do("STOP", 0.4)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "a program of its own" in reply.message


def test_a_new_stream_is_no_disobedience(pair: Deaf) -> None:
    """A move as soon as one may begin after a STOP is not stopped by the repetition of that."""
    pair.do("MOVE_JOINTS", 0.8, target=shifted(HOME, 1.0))
    pair.do("STOP")
    pair.run_until(lambda: pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0)).success, 2.0)
    pair.until(Mode.IDLE)
    assert pair.real_q == pytest.approx(shifted(HOME, 10.0), abs=1e-3)


def test_a_fault_outlives_a_glitch_of_the_twins_line(pair: Deaf) -> None:
    """FAULT is left by RESET only, as ESTOP is."""
    pair.starts_stream = False
    pair.order_twin(Command.STOP_TWIN, 1)
    pair.run(0.5)
    pair.do("ALIGN")
    pair.until(Mode.IDLE)
    pair.do("MOVE_JOINTS", 3.0, target=shifted(HOME, 20.0))
    assert pair.mode is Mode.FAULT
    pair.link("twin", False)
    pair.run(0.1)
    pair.link("twin", True)
    pair.run(3.0)
    assert pair.mode is Mode.FAULT
    pair.do("RESET", 1.0)
    assert pair.mode is Mode.STOPPED


def test_a_reset_waits_for_what_the_robot_says_after_it(pair: Deaf) -> None:
    """Its drives were on before, too: an answer that was on its way ends no emergency stop."""
    pair.do("ESTOP", 0.5)
    waits = pair.setup.config.reset.wait_ms * 1e-3
    pair.drives = True
    pair.do("RESET", waits - 0.02)
    assert pair.state.lead.mode is Mode.ESTOP
    pair.run(0.05)
    assert pair.state.lead.mode is Mode.STOPPED


def test_after_a_latched_stop_the_pair_aligns_before_a_move(pair: Deaf) -> None:
    """RESET, then ALIGN, then a new command."""
    pair.do("ESTOP", 0.5)
    pair.do("RESET", 1.0)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "ALIGN first" in reply.message
    pair.do("ALIGN")
    pair.until(Mode.IDLE)
    assert pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0)).success


def test_why_says_what_was_ignored_as_echo(pair: Deaf) -> None:
    """At the end of a lead: how many samples of the follower answered our own commands."""
    pair.start_program(ramp(HOME, shifted(HOME, 10.0), 1.0), run=1.2)
    pair.end_program()
    pair.until(Mode.IDLE)
    count = int(pair.why.split("only followed, in ")[1].split()[0])
    assert "the twin only followed" in pair.why and 80 < count < 300


def test_an_answer_with_the_clock_of_the_one_before_shows_no_program(pair: Deaf) -> None:
    """It is not taken in: the next one, that is, would else say that the program had ended."""
    pair.command_delay = 0.06
    pair.move_twin(ramp(HOME, shifted(HOME, 30.0), 1.0))
    while pair.mode is not Mode.TWIN_LEADS:
        pair.run(0.002)
    flags = pair.state.sides.real.flags
    assert flags is not None and not flags.streaming
    pair.feed(replace(flags, now=pair.now, received=pair.now, streaming=True))
    assert pair.state.sides.real.flags is flags
    pair.run(0.5)
    assert pair.mode is Mode.TWIN_LEADS


class HoldOnly(Deaf):
    """A robot as it is delivered: CSTOPI ends no program, so only HOLD stops it."""

    def __init__(self) -> None:
        super().__init__()
        self.cancels = False
        self.told: list[Command] = []

    def command_real(self, do: Command) -> None:
        """Obey, and note it."""
        self.told.append(do)
        super().command_real(do)


@pytest.fixture
def delivered() -> HoldOnly:
    """Return a connected and watched pair, IDLE at home, whose robot only HOLD stops."""
    return watched(HoldOnly())


class Coasting(Deaf):
    """A robot whose joints go on to the end of their way, whatever is said of its program."""

    def end_program(self) -> None:
        """End it; the way stays."""
        self.own_program = self.program_paused = False

    def move_real(self, now: float) -> None:
        """Let a millisecond pass."""
        if self.real_path is not None and self.drives:
            self.real_q = self.real_path(now - self.real_path_start)


def coasting(seconds: float) -> Coasting:
    """Return a connected pair whose robot has just begun a way of so many seconds."""
    made = Coasting()
    Watch(made)
    made.connect()
    made.start_program(ramp(HOME, shifted(HOME, 20.0), seconds), run=0.2)
    assert made.mode is Mode.REAL_LEADS
    return made


def test_hold_comes_back_when_the_robot_stands_and_not_before() -> None:
    """A robot that still slows down is not let go; one that stands is free for who is beside it."""
    made = coasting(0.6)
    made.do("STOP")
    told = made.now
    made.run(0.35)
    assert made.hold_away, "its joints still move, whatever its program says"
    made.run_until(lambda: not made.hold_away, 1.0)
    assert made.now - told >= SETUP.config.stop.hold_ms * 1e-3
    assert made.mode is Mode.STOPPED


def test_a_robot_that_moves_past_its_time_has_its_drives_switched_off() -> None:
    """Its program is gone, but it does not stand: the next means follows, and that is said."""
    made = coasting(3.0)
    made.do("STOP", (ATTEMPTS + 1) * RETRY_S + 0.1)
    assert made.mode is Mode.ESTOP and not made.drives
    assert "it still moves" in made.why


def test_a_paused_stream_goes_on_with_start_behind_fresh_set_points(delivered: HoldOnly) -> None:
    """RSR beside a paused program would be queued and start later: START lets it go on."""
    for target in (10.0, 20.0, 5.0):
        answer = delivered.operate("MOVE_JOINTS", target=shifted(HOME, target))
        assert answer.success, answer.message
        delivered.until(Mode.IDLE)
        assert delivered.real_q == pytest.approx(shifted(HOME, target), abs=1e-3)
        assert delivered.streaming and not delivered.queued
    started = [do for do in delivered.told if do is Command.START_STREAM]
    continued = [do for do in delivered.told if do is Command.CONTINUE_STREAM]
    assert (len(started), len(continued)) == (1, 2)


def test_a_robot_that_nothing_stops_is_left_to_the_person_beside_it(pair: Deaf) -> None:
    """HOLD, CSTOPI and *IMSTP did nothing: once it is said what is left to do."""
    under_way(pair)
    pair.not_heard = (Command.STOP_REAL, Command.ESTOP_REAL)
    pair.do("STOP", 4.0)
    said = [each for each in pair.decisions() if each.trigger == "ESTOP_IGNORED"]
    assert len(said) == 1 and "press the emergency stop at the robot itself" in said[0].why


def test_a_robot_that_stands_at_last_is_no_longer_said_to_move(pair: Deaf) -> None:
    """Its program came to its end: what is left to do is RESET."""
    under_way(pair)
    pair.not_heard = (Command.STOP_REAL, Command.ESTOP_REAL)
    pair.do("STOP", 3.0)
    assert "moves on" in alarm_text(pair.setup, pair.state, pair.now)
    pair.end_program()
    pair.run(1.0)
    assert alarm_text(pair.setup, pair.state, pair.now).startswith("emergency stop is latched")


def rested_behind_a_move(pair: Deaf) -> int:
    """Let the robot follow a move of the twin to its end; return how many actions there were."""
    pair.move_twin(ramp(HOME, shifted(HOME, 20.0), 2.0), run=1.0)
    assert pair.mode is Mode.TWIN_LEADS
    since = len(pair.actions)
    pair.until(Mode.IDLE)
    return since


def test_a_stream_at_rest_is_ended_without_taking_hold_away(pair: Deaf) -> None:
    """A start at the pendant right behind the move would be refused."""
    since = rested_behind_a_move(pair)
    pair.run(1.0)
    assert sent(pair, since) == [] and not pair.streaming and not pair.hold_away
    assert pair.state.orders.stop is None


def test_a_stream_that_does_not_end_at_rest_is_stopped(pair: Deaf) -> None:
    """By HOLD, which is given back once the robot shows it."""
    pair.not_heard = (Command.END_AT_REST,)
    since = rested_behind_a_move(pair)
    pair.run(1.5 * RETRY_S)
    assert sent(pair, since) == [] and pair.streaming
    assert "ends its stream" in refusals(pair.setup, pair.state, pair.now)["RUN"]
    pair.run_until(lambda: pair.hold_away, RETRY_S)
    assert "ends its stream" in refusals(pair.setup, pair.state, pair.now)["RUN"]
    pair.run(1.5)
    assert refusals(pair.setup, pair.state, pair.now)["RUN"] == ""
    assert sent(pair, since) == [Command.STOP_REAL]
    assert not pair.streaming and not pair.hold_away and pair.state.orders.stop is None
    assert pair.mode is Mode.IDLE


def test_a_twin_that_moves_before_the_stream_can_begin_is_led_slowly(pair: Deaf) -> None:
    """Set points that run away from the robot make it leap behind them."""
    pair.not_heard = (Command.END_AT_REST,)
    rested_behind_a_move(pair)
    since = len(pair.actions)
    pair.move_twin(ramp(pair.twin_q, shifted(pair.twin_q, 20.0), 2.0), run=0.2)
    assert pair.mode is Mode.TWIN_LEADS and caps(pair, since)[-1] == SLOWEST_PERCENT
    pair.run(1.0)
    assert pair.streaming and caps(pair, since)[-1] > SLOWEST_PERCENT


def caps(pair: Pair, since: int) -> list[float]:
    """Return the caps of the twin's speed since the given index of actions."""
    return [each.speed_percent for each in pair.actions[since:] if isinstance(each, CapTwin)]


def test_a_program_started_behind_a_stream_is_no_disobedience(pair: Deaf) -> None:
    """It is not stopped for a stream that has ended."""
    rested_behind_a_move(pair)
    pair.run_until(lambda: not pair.streaming, 0.1)
    assert pair.state.orders.stop is not None, "the end is not reported yet"
    since, here = len(pair.actions), pair.real_q
    pair.start_program(ramp(here, shifted(here, 60.0), 4.0), run=2.0)
    assert pair.own_program and sent(pair, since) == []
    assert pair.mode is Mode.REAL_LEADS


def test_a_stop_that_is_pressed_often_while_the_robot_is_away_is_one_stop(pair: Deaf) -> None:
    """None of them was written: the robot is held, and keeps its drives."""
    under_way(pair)
    pair.link("real", False)
    pair.run(0.02)
    for _ in range(ATTEMPTS):
        pair.do("STOP", 0.3)
    pair.link("real", True)
    pair.run(RETRY_S + 0.1)
    assert pair.drives and not pair.own_program and "STOP_IGNORED" not in pair.triggers()


@pytest.mark.parametrize("deed", ["STOP", "lost"])
def test_hold_stays_away_in_an_emergency_stop(pair: Deaf, deed: str) -> None:
    """Until RESET, whatever else is stopped meanwhile."""
    under_way(pair)
    pair.do("ESTOP", 1.0)
    since = len(pair.actions)
    if deed == "STOP":
        pair.do("STOP")
    else:
        pair.link("twin", False)
    pair.run(1.0)
    assert pair.mode is Mode.ESTOP and pair.state.orders.hold_away
    assert Command.GIVE_HOLD_BACK not in pair.performed(since)


def test_a_robot_that_nothing_stops_cannot_be_reset(pair: Deaf) -> None:
    """That its drives are on shows here that it did not obey; its HOLD and *IMSTP stay away."""
    under_way(pair)
    pair.not_heard = (Command.STOP_REAL, Command.ESTOP_REAL)
    pair.do("STOP", 2.5)
    since = len(pair.actions)
    refused = pair.operate("RESET")
    pair.run(3.0)
    assert not refused.success and "stop it there" in refused.message
    assert pair.own_program and pair.mode is Mode.ESTOP
    assert Command.RESET_REAL not in pair.performed(since)


def test_what_nothing_stops_is_said_while_the_twin_is_away(pair: Deaf) -> None:
    """And it is told again and again."""
    under_way(pair)
    pair.not_heard = (Command.STOP_REAL, Command.ESTOP_REAL)
    pair.link("twin", False)
    pair.run(4.0)
    assert "ESTOP_IGNORED" in pair.triggers() and "ESTOP_MISSED" in pair.triggers()
