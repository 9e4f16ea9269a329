"""A twin is told to stop again while its samples show that it moves; in the end that is a fault."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.parts import changed
from harness.watch import watched
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command, Send
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.standing import moves_in_stop
from twin_controller.core.orders.stop import STOPPING_TWIN, defied_text, speeds_since

WAY = ramp(HOME, shifted(HOME, 80.0), 30.0)
ATTEMPTS, RETRY_S = SETUP.config.stop.attempts, SETUP.config.stop.twin_retry_ms * 1e-3
IGNORED_S = ATTEMPTS * RETRY_S + 0.1
RESET_S = SETUP.config.reset.timeout_ms * 1e-3 + 0.1
COMMANDS = ["STOP", "PAUSE", "ESTOP"]


class Deaf(Pair):
    """A pair whose twin reports that it obeys, and whose joint moves on all the same."""

    deaf = False

    def command_twin(self, do: Command, number: int, now: float) -> None:
        """Obey; a twin that is deaf goes on with its jog."""
        jog, begun = self.jog, self.jog_start
        super().command_twin(do, number, now)
        if self.deaf:
            self.jog, self.jog_start = jog, begun
        elif do in STOPPING_TWIN:
            # The simulator ends on PAUSE too what drives a joint past its motion nodes.
            self.jog = None


@pytest.fixture
def pair() -> Deaf:
    """Return a watched pair whose twin leads, jogged past its pose controller."""
    made = watched(Deaf())
    made.jog_twin(WAY, made.now)
    made.until(Mode.TWIN_LEADS, 2.0)
    made.run(0.5)
    return made


def told(pair: Pair, since: int) -> list[Command]:
    """Return the stops that the twin was sent since the given index of actions."""
    sent = pair.made(Send, since)
    return [action.command for action in sent if action.command in STOPPING_TWIN]


def ignored(pair: Pair) -> list[str]:
    """Return the reasons of all decisions that the twin does not obey."""
    return [each.why for each in pair.decisions() if each.trigger == "TWIN_STOP_IGNORED"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_twin_that_obeys_is_told_once(pair: Deaf, command: str) -> None:
    """Once it stands nothing is open any more."""
    since = len(pair.actions)
    pair.do(command, IGNORED_S + 1.0)
    assert len(told(pair, since)) == 1
    assert pair.state.orders.twin_stop is None and ignored(pair) == []


@pytest.mark.parametrize(
    ("command", "mode"), [("STOP", Mode.FAULT), ("PAUSE", Mode.FAULT), ("ESTOP", Mode.ESTOP)]
)
def test_a_twin_that_moves_on_is_a_fault(pair: Deaf, command: str, mode: Mode) -> None:
    """After all attempts, once, with a reason that says what happened and what to do."""
    pair.deaf = True
    since, real = len(pair.actions), pair.real_q
    pair.do(command, IGNORED_S - 0.2)
    assert ignored(pair) == [] and told(pair, since).count(Command[f"{command}_TWIN"]) == ATTEMPTS
    pair.run(0.3)
    assert pair.mode is mode and len(ignored(pair)) == 1
    said = (
        f"(it moved on {ATTEMPTS * RETRY_S:.1f} s after {command} was told {ATTEMPTS} times): "
        "end the simulator or what commands it, then RESET"
    )
    assert ignored(pair) == [pair.why] == [f"the twin does not obey a stop {said}"]
    pair.run(2.0 * IGNORED_S)
    assert len(ignored(pair)) == 1, "it is decided once"
    assert pair.real_q == pytest.approx(real, abs=0.02), "the robot does not follow it"
    assert pair.drives is (mode is Mode.FAULT)


def test_a_twin_that_goes_on_with_a_move_of_its_own_is_a_fault(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However often it is told anew: it has never slowed down, so it is one and the same motion."""
    pair = watched(Pair())
    pair.move_twin(ramp(HOME, shifted(HOME, 80.0), 12.0), 3.0)
    assert pair.mode is Mode.TWIN_LEADS
    # It tells that it moves, and takes none of our commands.
    monkeypatch.setattr(pair, "command_twin", lambda do, number, now: None)
    pair.do("STOP", IGNORED_S + 0.5)
    assert pair.mode is Mode.FAULT and len(ignored(pair)) == 1


def test_a_twin_that_was_not_seen_since_has_no_speed() -> None:
    """Of one that was, the lowest and the newest count, by its fastest joint."""
    twin, rest = Pair().state.sides.twin, (0.0,) * (len(HOME) - 1)
    rows = [(0.5, 1.0), (-0.2, 1.1), (0.3, 1.2)]
    history = tuple(
        JointMotion.measured(HOME, (part * SETUP.velocity[0], *rest), t) for part, t in rows
    )
    twin = msgspec.structs.replace(twin, history=history)
    for since, found in ((0.9, (0.2, 0.3)), (1.15, (0.3, 0.3)), (1.3, (0.0, 0.0))):
        assert speeds_since(twin, since, SETUP.velocity) == pytest.approx(found)


def test_a_twin_has_time_to_hear_a_stop_before_it_is_told_again(pair: Deaf) -> None:
    """What it shows meanwhile it shows on the way to rest."""
    pair.do("STOP", 2.0)
    heard_s, now = SETUP.config.stop.heard_ms * 1e-3, pair.now
    begun = changed(pair.state, sides__twin__motion__state="moving")
    for part, again in ((0.5, False), (0.99, False), (1.01, True)):
        state = changed(begun, orders__told__sent=now - part * heard_s, orders__told__before=None)
        assert moves_in_stop(SETUP, state, now) is again


def test_reset_waits_until_the_twin_stands(pair: Deaf) -> None:
    """It is told on without end; a cause that persists ends no fault."""
    pair.deaf = True
    pair.do("STOP", IGNORED_S)
    pair.do("RESET", RESET_S)
    assert pair.mode is Mode.FAULT and "(the twin does not obey a stop)" in pair.why
    pair.deaf = False
    pair.run(RETRY_S + 0.5)
    assert pair.state.orders.twin_stop is None
    pair.do("RESET", RESET_S)
    assert pair.mode is Mode.STOPPED


def test_resume_does_not_let_the_robot_follow_a_twin_that_moves_on(pair: Deaf) -> None:
    """It does not stand where it was paused: the target is cleared."""
    pair.deaf = True
    pair.do("PAUSE", RETRY_S + 0.3)
    rested = pair.real_q
    reply = pair.operate("RESUME")
    assert not reply.success and "no longer stands where it was paused" in reply.message
    assert pair.mode is Mode.STOPPED
    pair.run(IGNORED_S)
    assert pair.mode is Mode.FAULT and pair.real_q == rested


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_lost_link_has_its_own_rules(pair: Deaf, side: str) -> None:
    """Nobody knows whether a lost twin moves; one that is still reached is judged."""
    pair.deaf = True
    pair.do("STOP", RETRY_S)
    pair.link(side, False)
    pair.run(2.0 * IGNORED_S)
    lost = side == "twin"
    assert pair.mode is (Mode.OFFLINE if lost else Mode.FAULT)
    assert len(ignored(pair)) == (0 if lost else 1)
    assert (pair.state.orders.twin_stop is None) is lost


def test_a_twin_that_may_move_again_is_not_judged_by_an_older_stop(pair: Deaf) -> None:
    """A move as soon as one may begin after a STOP is not stopped by the repetition of that."""
    pair.do("STOP")
    pair.run_until(lambda: pair.operate("MOVE_JOINTS", target=shifted(HOME, 30.0)).success, 5.0)
    since = len(pair.actions)
    pair.until(Mode.IDLE)
    assert told(pair, since) == [] and ignored(pair) == []


@pytest.mark.parametrize(("since_s", "said"), [(0.3, "0.3"), (2.04, "2.0"), (-0.1, "0.0")])
def test_how_long_a_twin_went_on_is_told(pair: Deaf, since_s: float, said: str) -> None:
    """To its last sample; one that has come from it before the stop is none of it."""
    pair.deaf = True
    pair.do("STOP", 0.2)
    stop, twin = pair.state.orders.twin_stop, pair.state.sides.twin
    assert stop is not None
    begun = msgspec.structs.replace(stop, since=twin.last.time - since_s)
    assert defied_text(begun, twin).startswith(f"it moved on {said} s after STOP was told ")
