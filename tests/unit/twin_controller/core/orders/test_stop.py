"""A stop is not done when it is sent.

It is sent again until the real robot shows it, and in the end its drives go off.
"""

from __future__ import annotations

import math

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.watch import Watch
from twin_controller.core.actions import Command, Send
from twin_controller.core.lead.modes import Mode

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
    made = Deaf()
    made.command_delay, made.report_delay = 0.01, 0.01
    Watch(made)
    made.connect()
    return made


def sent(pair: Pair, since: int) -> list[Command]:
    """Return what the real robot was told since the given index of actions, stops only."""
    return [
        action.command
        for action in pair.actions[since:]
        if isinstance(action, Send) and action.command in TO_THE_ROBOT
    ]


def under_way(pair: Pair) -> None:
    """Let the robot run a program, and follow it."""
    pair.start_program(PROGRAM)
    pair.run(1.0)
    assert pair.state.lead.mode is Mode.REAL_LEADS


def moved_deg(pair: Pair, since: float) -> float:
    """Return how far joint 1 of the robot is from ``since`` [deg]."""
    return abs(math.degrees(pair.real_q[0] - since))


@pytest.mark.parametrize("command", ["STOP", "PAUSE"])
def test_a_stop_that_is_obeyed_is_sent_once(pair: Deaf, command: str) -> None:
    """The robot's next answer shows it; nothing is repeated."""
    under_way(pair)
    since = len(pair.actions)
    assert pair.operate(command).success
    pair.run(2.0)
    assert len(sent(pair, since)) == 1 and pair.state.orders.stop is None


@pytest.mark.parametrize(
    ("command", "lost"), [("STOP", Command.STOP_REAL), ("PAUSE", Command.HOLD_REAL)]
)
def test_a_stop_that_was_lost_once_is_sent_again(pair: Deaf, command: str, lost: Command) -> None:
    """Within the time of one repetition the robot stands."""
    under_way(pair)
    pair.not_heard = (lost,)
    assert pair.operate(command).success
    pair.run(0.5 * RETRY_S)
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
    assert pair.operate(command).success
    pair.run((ATTEMPTS + 1) * RETRY_S + 0.1)
    assert pair.state.lead.mode is Mode.ESTOP and not pair.drives
    assert sent(pair, since).count(lost) == ATTEMPTS
    assert (
        f"the real robot does not obey a stop ({lost.value}, sent {ATTEMPTS} times)"
        in pair.state.lead.why
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
    """LINK_LOST stops the side still reached.

    The stop that could not be delivered is not forgotten.
    """
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
    assert pair.operate("PAUSE").success
    pair.run(0.5)
    pair.link("real", False)
    pair.run(0.05)
    pair.link("real", True)
    pair.run(3.0)
    assert not pair.own_program and not pair.paused


def test_no_move_begins_while_the_robot_runs_a_program(pair: Deaf) -> None:
    """The robot would not follow it: it waits in its program, and has not heard the STOP."""
    pair.not_heard = (Command.STOP_REAL,)
    pair.start_program(lambda t: HOME)
    pair.run(0.3)
    assert pair.operate("STOP").success
    pair.run(0.4)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "a program of its own" in reply.message


def test_a_new_stream_is_no_disobedience(pair: Deaf) -> None:
    """A move as soon as one may begin after a STOP is not stopped by the repetition of that."""
    assert pair.operate("MOVE_JOINTS", target=shifted(HOME, 1.0)).success
    pair.run(0.8)
    assert pair.operate("STOP").success
    pair.run_until(lambda: pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0)).success, 2.0)
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 10.0)
    assert pair.real_q == pytest.approx(shifted(HOME, 10.0), abs=1e-3)


def test_a_fault_outlives_a_glitch_of_the_twins_line(pair: Deaf) -> None:
    """FAULT is left by RESET only, as ESTOP is."""
    pair.starts_stream = False
    pair.order_twin(Command.STOP_TWIN, 1)
    pair.run(0.5)
    assert pair.operate("ALIGN").success
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 10.0)
    assert pair.operate("MOVE_JOINTS", target=shifted(HOME, 20.0)).success
    pair.run(3.0)
    assert pair.state.lead.mode is Mode.FAULT
    pair.link("twin", False)
    pair.run(0.1)
    pair.link("twin", True)
    pair.run(3.0)
    assert pair.state.lead.mode is Mode.FAULT
    assert pair.operate("RESET").success
    pair.run(1.0)
    assert pair.state.lead.mode is Mode.STOPPED


def test_after_a_latched_stop_the_pair_aligns_before_a_move(pair: Deaf) -> None:
    """RESET, then ALIGN, then a new command."""
    assert pair.operate("ESTOP").success
    pair.run(0.5)
    assert pair.operate("RESET").success
    pair.run(1.0)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "ALIGN first" in reply.message
    assert pair.operate("ALIGN").success
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 10.0)
    assert pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0)).success


def test_why_says_what_was_ignored_as_echo(pair: Deaf) -> None:
    """At the end of a lead.

    How many samples of the follower were the answer to our own commands.
    """
    pair.start_program(ramp(HOME, shifted(HOME, 10.0), 1.0))
    pair.run(1.2)
    pair.end_program()
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 10.0)
    count = int(pair.state.lead.why.split("only followed, in ")[1].split()[0])
    assert "the twin only followed" in pair.state.lead.why and 80 < count < 300


def test_an_answer_with_the_clock_of_the_one_before_shows_no_program(pair: Deaf) -> None:
    """It is not taken in: the next one, that is, would else say that the program had ended."""
    pair.command_delay = 0.06
    pair.move_twin(ramp(HOME, shifted(HOME, 30.0), 1.0))
    while pair.state.lead.mode is not Mode.TWIN_LEADS:
        pair.run(0.002)
    flags = pair.state.sides.real.flags
    assert flags is not None and not flags.streaming
    pair.feed(replace(flags, now=pair.now, received=pair.now, streaming=True))
    assert pair.state.sides.real.flags is flags
    pair.run(0.5)
    assert pair.state.lead.mode is Mode.TWIN_LEADS
