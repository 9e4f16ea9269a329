"""A stopped pair is left by a person; a twin that moves meanwhile is stopped again."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, Pair, ramp, shifted
from harness.running.thorough import thorough
from harness.watch import watched
from twin_controller.core.actions import Command
from twin_controller.core.events import AnyEvent, TwinMeasured, TwinMotion
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.reports import note_stopped
from twin_controller.core.orders.stop import tell_stop

BURST = 0.3


@pytest.fixture
def pair() -> Pair:
    """Return a connected and watched pair, IDLE at home; commands and reports take their time."""
    return watched(Pair())


@pytest.mark.parametrize(("part", "told"), [(0.9, False), (1.1, True)])
def test_a_stopped_twin_moves_again_from_a_part_of_its_largest_speed_on(
    pair: Pair, monkeypatch: pytest.MonkeyPatch, part: float, told: bool
) -> None:
    """Below it is what a sensor of speed shows at rest."""
    pair.do("STOP", 1.0)
    since, restart = len(pair.actions), pair.setup.config.stop.restart_percent * 1e-2
    speed = (part * restart * pair.setup.velocity[0], *(0.0 for _ in HOME[1:]))
    monkeypatch.setattr(pair, "twin_speed", lambda now: speed)
    pair.run(0.3)
    assert (Command.STOP_TWIN in pair.performed(since)) is told


@pytest.mark.parametrize("state", ["announcing", "moving"])
def test_a_stopped_twin_that_begins_a_move_is_stopped_before_it_moves(
    pair: Pair, state: str
) -> None:
    """It says so some time ahead, so that a follower can aim."""
    pair.do("STOP", 1.0)
    assert pair.state.sides.twin.motion is not None
    since = len(pair.actions)
    pair.feed(msgspec.structs.replace(pair.state.sides.twin.motion, now=pair.now, state=state))
    assert pair.decisions()[-1].trigger == "TWIN_MOVED_STOPPED"
    assert Command.STOP_TWIN in pair.performed(since)


def test_home_waits_for_an_alignment_where_a_stopped_twin_was_moved(pair: Pair) -> None:
    """The robot would leap to where the twin is now: its way was judged from there."""
    pair.do("STOP", 1.0)
    pair.jog_twin(ramp(HOME, shifted(HOME, 2.0), 0.02), pair.now)
    pair.run(1.0)
    assert pair.far() > 0.5 and pair.mode is Mode.STOPPED
    answer = pair.operate("HOME")
    assert not answer.success and "ALIGN first" in answer.message
    assert "ALIGN first" in refusals(pair.setup, pair.state, pair.now)["MOVE"]
    pair.do("ALIGN")
    pair.until(Mode.IDLE)
    assert pair.operate("HOME").success


def test_a_stopped_twin_that_moves_is_told_by_the_very_sample_that_shows_it(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each time; what is heard of others says nothing new of it."""
    pair.do("STOP", 1.0)
    feed, by = pair.feed, list[AnyEvent]()

    def watch(event: AnyEvent) -> None:
        since = len(pair.actions)
        feed(event)
        by.extend([event] if Command.STOP_TWIN in pair.performed(since) else [])

    monkeypatch.setattr(pair, "feed", watch)
    for _ in range(3):
        pair.jog_twin(ramp(pair.twin_q, shifted(pair.twin_q, 2.0), BURST), pair.now)
        pair.run(1.0)
    assert len(by) > 2 and all(isinstance(event, TwinMeasured | TwinMotion) for event in by)


@pytest.mark.parametrize(("stops", "named"), [(1, 1), (2, 2)])
def test_a_twin_that_goes_on_is_named_once_after_each_stop(
    pair: Pair, stops: int, named: int
) -> None:
    """Each of its motions would fill the history; who stops it again is told again."""
    for _ in range(stops):
        pair.do("STOP", 1.0)
        for _ in range(3):
            pair.jog_twin(ramp(pair.twin_q, shifted(pair.twin_q, 2.0), BURST), pair.now)
            pair.run(1.0)
    said = [each for each in pair.decisions() if each.trigger == "TWIN_MOVED_STOPPED"]
    assert len(said) == named


@pytest.mark.parametrize("way_out", ["ALIGN", "HOME", "MOVE_JOINTS"])
def test_a_person_leaves_it(pair: Pair, way_out: str) -> None:
    """By a command of the controller; from then on the twin may lead again."""
    pair.do("STOP", 1.0)
    target = shifted(HOME, 5.0) if way_out == "MOVE_JOINTS" else ()
    pair.do(way_out, target=target)
    pair.until(Mode.IDLE)
    pair.run(0.3)
    pair.move_twin(ramp(pair.twin_q, shifted(HOME, 10.0), 1.0))
    pair.until(Mode.TWIN_LEADS, 2.0)


def test_the_person_at_the_robot_leaves_it(pair: Pair) -> None:
    """Also while somebody goes on commanding the twin."""
    pair.do("STOP", 1.0)
    pair.jog_twin(ramp(pair.twin_q, shifted(pair.twin_q, 2.0), BURST), pair.now)
    pair.start_program(ramp(HOME, shifted(HOME, 20.0), 2.0))
    pair.until(Mode.REAL_LEADS, 1.0)


def test_a_jog_of_the_page_is_refused_with_what_to_do(pair: Pair) -> None:
    """The buttons say it before they are pressed."""
    pair.do("STOP", 1.0)
    found = refusals(pair.setup, pair.state, pair.now)
    assert found["JOG"] == "the pair is stopped: ALIGN first"
    assert found["MOVE"] == found["HOME"] == found["ALIGN"] == found["RUN"] == ""


@pytest.mark.parametrize("waited", [0.02, 1.0])
def test_a_pause_in_idle_ends_in_idle(pair: Pair, waited: float) -> None:
    """Soon or late; the robot can be started at its pendant again, and the twin may lead."""
    pair.do("PAUSE", waited)
    assert pair.operate("RESUME").success and pair.mode is Mode.IDLE
    pair.run(0.5)
    assert not pair.hold_away and pair.motion == "idle"
    pair.move_twin(ramp(pair.twin_q, shifted(HOME, 10.0), 1.0))
    pair.until(Mode.TWIN_LEADS, 2.0)


def test_a_pause_ends_no_alignment(pair: Pair) -> None:
    """The twin stands meanwhile, and goes on to the robot's pose after RESUME."""
    pair.start_program(ramp(HOME, shifted(HOME, 30.0), 1.0), run=0.5)
    pair.do("STOP", 0.5)
    pair.twin_q = shifted(pair.real_q, -8.0)
    pair.run(0.5)
    pair.do("ALIGN", 0.1)
    assert pair.mode is Mode.ALIGNING and pair.operate("PAUSE").success
    pair.run(0.5)
    stood = pair.twin_q
    pair.run(1.0)
    assert pair.twin_q == stood
    pair.do("RESUME")
    pair.until(Mode.IDLE, 20.0)
    assert pair.twin_q == pytest.approx(pair.real_q, abs=1e-3)


@pytest.mark.parametrize(
    ("side", "command"),
    [("real", "STOP"), ("twin", "PAUSE"), *thorough(("real", "PAUSE"), ("twin", "STOP"))],
)
def test_a_link_that_blinks_does_not_leave_it(pair: Pair, side: str, command: str) -> None:
    """What commands the twin may never have heard of the stop; a blink, or two, is nobody's act."""
    pair.do(command, 1.0)
    for _ in range(2):
        pair.link(side, False)
        pair.run(0.1)
        pair.link(side, True)
        pair.run(0.1)
    pair.run(4.0)
    rested = pair.real_q
    pair.move_twin(ramp(pair.twin_q, shifted(pair.twin_q, 5.0), 1.0), run=1.0)
    assert pair.mode is Mode.STOPPED and pair.real_q == rested
    assert pair.operate("ALIGN").success
    pair.run(4.0)
    assert pair.mode is Mode.IDLE


def test_a_stop_while_a_link_is_away_lasts(pair: Pair) -> None:
    """Whoever has pressed STOP looks at a pair that comes back as one that was never stopped."""
    pair.link("twin", False)
    pair.run(0.5)
    pair.do("STOP", 0.1)
    pair.link("twin", True)
    pair.run(4.0)
    assert pair.mode is Mode.STOPPED


@pytest.mark.parametrize(
    ("shown", "trigger"), [("stopping", Trigger.TWIN_STOPPED), ("paused", Trigger.TWIN_PAUSED)]
)
def test_what_somebody_does_at_the_twin_while_the_robot_is_away_lasts(
    pair: Pair, shown: str, trigger: Trigger
) -> None:
    """A stop or a pause there is told once, and the pair comes back as one that was stopped."""
    pair.do("MOVE_JOINTS", 0.5, target=shifted(HOME, 20.0))
    pair.link("real", False)
    pair.run(0.02)
    pair.motion, pair.command_id = shown, 7
    pair.run(0.1)
    pair.motion = "idle" if shown == "stopping" else shown
    pair.link("real", True)
    pair.run(4.0)
    assert pair.mode is Mode.STOPPED
    assert pair.triggers().count(trigger.name) == 1
    assert pair.operate("ALIGN").success


def test_a_stop_that_came_long_before_a_link_was_lost_is_no_news(pair: Pair) -> None:
    """The twin still tells its number where it stops because nothing comes any more."""
    pair.do("MOVE_JOINTS", 0.5, target=shifted(HOME, 20.0))
    pair.command_id = 7
    pair.run(0.1)
    pair.link("real", False)
    pair.motion, pair.command_id = "stopping", 7
    pair.run(0.05)
    pair.motion = "idle"
    pair.link("real", True)
    pair.run(4.0)
    assert pair.mode is Mode.IDLE


@pytest.mark.parametrize(
    ("given_back", "is_over", "was_off"),
    [(None, True, False), (1.0, False, False), (1.0, True, True)],
    ids=["ended by another", "watched", "over"],
)
def test_a_program_that_runs_once_a_stop_is_over_is_a_new_one(
    pair: Pair, given_back: float | None, is_over: bool, was_off: bool
) -> None:
    """Until then it may be the one that was stopped."""
    told = tell_stop(None, Command.STOP_REAL, pair.setup.config.stop, True, 0.0)
    stop = msgspec.structs.replace(told, given_back=given_back)
    lead = msgspec.structs.replace(pair.state.lead, program_was_off=False)
    noted = note_stopped(lead, stop, None if is_over else stop)
    assert noted.program_was_off is was_off and note_stopped(lead, None, None) == lead
