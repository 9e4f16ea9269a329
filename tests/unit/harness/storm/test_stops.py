"""The storm's rules of standing, on literal histories."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from harness.storm.rules.history import Decided, History, Strike
from harness.storm.rules.literal import history, motion, moving, release, stop
from harness.storm.rules.stops import (
    REFUSED,
    TOO_LATE,
    UNANSWERED,
    moves_after_stop,
    moves_by_itself,
    stop_not_taken,
)


def decided(at: float, before: str, after: str, leader: str = "") -> Decided:
    """Return a decision."""
    return Decided(at, before, "EVENT", after, leader)


RAMPS = history(moving((1.0, 2.15, 100.0)), deeds=[motion(0.9), stop(2.0)])
GOES_ON = history(moving((1.0, 4.0, 100.0)), deeds=[motion(0.9), stop(2.0)])
QUEUED = history(moving((1.0, 2.1, 50.0), (3.0, 3.5, 50.0)), deeds=[motion(0.9), stop(2.0)])


def test_side_that_ramps_down_after_a_stop_keeps_the_rule() -> None:
    """Its reaction and its ramp are its own."""
    assert not list(moves_after_stop(RAMPS))


@pytest.mark.parametrize("broken", [GOES_ON, QUEUED])
def test_motion_later_than_the_ramp_after_a_stop_is_found(broken: History) -> None:
    """Whether it never ended, or something queued came out."""
    (found,) = moves_after_stop(broken)
    assert found.rule == "moves after an acknowledged stop" and "real: joint_1" in found.evidence


def test_new_command_after_a_stop_may_move() -> None:
    """Also one that was sent just before: the stop may have been heard first."""
    for sent in (1.98, 2.5):
        deeds = [motion(0.9), stop(2.0), motion(sent)]
        assert not list(moves_after_stop(history(moving((2.6, 4.0, 50.0)), deeds=deeds)))


@pytest.mark.parametrize(("waits", "found"), [(False, 1), (True, 0)])
def test_refused_command_after_a_stop_moves_nothing(waits: bool, found: int) -> None:
    """One that is answered at its end has moved, and failed later."""
    refused = motion(2.15, answered=2.16, success=False, waits=waits)
    made = dataclasses.replace(GOES_ON, deeds=[*GOES_ON.deeds, refused])
    assert len(list(moves_after_stop(made))) == found


def test_command_long_before_a_stop_is_no_new_one() -> None:
    """It was heard before the stop."""
    deeds = [stop(2.0), motion(1.9)]
    assert list(moves_after_stop(history(moving((2.5, 4.0, 50.0)), deeds=deeds)))


def test_abort_of_a_robot_that_stands_ends_nothing() -> None:
    """There is no program to end; with a side in motion an abort is a stop like others."""
    for first, found in (((2.5, 2.6), 0), ((1.0, 2.1), 2)):
        deeds = [motion(0.9), dataclasses.replace(stop(2.0), name="pendant abort")]
        made = history(moving((*first, 50.0), (3.0, 4.0, 50.0)), deeds=deeds)
        broken = [*moves_after_stop(made), *moves_by_itself(made)]
        assert len(broken) == found, broken


@pytest.mark.parametrize("answer", [{"answered": None}, {"success": False}])
def test_stop_that_nobody_has_acknowledged_promises_nothing(answer: dict[str, object]) -> None:
    """Neither does one that was refused."""
    (sent, old) = GOES_ON.deeds
    deeds = [sent, dataclasses.replace(old, **answer)]
    assert not list(moves_after_stop(dataclasses.replace(GOES_ON, deeds=deeds)))


@pytest.mark.parametrize(
    ("answer", "rule"),
    [
        ({"success": False, "said": "later"}, REFUSED),
        ({"success": False, "said": f"the controller {TOO_LATE}"}, UNANSWERED),
        ({"answered": None}, UNANSWERED),
    ],
    ids=["refused", "answered late", "never answered"],
)
def test_stop_that_is_not_taken_is_found(answer: dict[str, Any], rule: str) -> None:
    """Whatever the pair does; a PAUSE of a stopped pair is rightly refused."""
    (found,) = stop_not_taken(history(deeds=[stop(1.0), stop(2.0, **answer)]))
    assert (found.rule, found.begin) == (rule, 2.0)
    pause = dataclasses.replace(stop(2.0, **answer), name="PAUSE")
    assert not list(stop_not_taken(history(deeds=[pause])))


@pytest.mark.parametrize(
    ("strike", "found"),
    [
        (Strike("halt twin_controller 0.5", 1.5, 2.0), 0),
        (Strike("line web freeze 0.3", 1.2, 1.5, {"twin": 2.5}), 0),
        (Strike("halt recorder 0.5", 1.2, 1.9), 1),
        (Strike("halt twin_controller 0.5", 2.5, 3.0), 1),
    ],
    ids=["meanwhile", "not over yet", "over", "later"],
)
def test_fault_in_the_way_of_a_stop_excuses_it(strike: Strike, found: int) -> None:
    """And what it leaves behind, as long as it may."""
    deeds = [stop(2.0, success=False, said="later")]
    assert len(list(stop_not_taken(history(deeds=deeds, strikes=[strike])))) == found


def test_stop_counts_from_the_end_of_a_fault_that_keeps_it_away() -> None:
    """The side must stand then."""
    cut = Strike("line", 1.9, 3.5, {"real": 0.5})
    assert not list(moves_after_stop(dataclasses.replace(GOES_ON, strikes=[cut])))
    other = Strike("line", 1.9, 3.5, {"twin": 0.5})
    assert list(moves_after_stop(dataclasses.replace(GOES_ON, strikes=[other])))


def test_stop_of_the_robot_alone_does_not_judge_the_twin() -> None:
    """Who presses a button at the robot is not answered by the twin."""
    deeds = [motion(0.9), stop(2.0, sides=("real",))]
    assert not list(moves_after_stop(history(twin=moving((1.0, 4.0, 50.0)), deeds=deeds)))


def test_twin_may_align_after_a_stop_and_the_robot_may_not() -> None:
    """A link that comes back leads to a slow alignment of the twin."""
    decisions = [decided(4.0, "OFFLINE", "ALIGNING"), decided(6.0, "ALIGNING", "IDLE")]
    way = moving((4.1, 5.9, 20.0))
    deeds = [stop(2.0)]
    assert not list(moves_after_stop(history(twin=way, deeds=deeds, decisions=decisions)))
    assert list(moves_after_stop(history(real=way, deeds=deeds, decisions=decisions)))


SENT_ON = dataclasses.replace(motion(3.0, until=3.1), name="jog")
"""A program on the twin's side has not heard of the stop."""


def test_program_that_never_hears_of_a_stop_moves_no_robot() -> None:
    """The twin may be moved by it for a moment."""
    moves = moving((3.1, 4.0, 50.0))
    deeds = [stop(2.0), SENT_ON]
    (found,) = moves_after_stop(history(moves, deeds=deeds))
    assert "real: joint_1" in found.evidence
    assert not list(moves_after_stop(history(twin=moves, deeds=deeds)))


@pytest.mark.parametrize(
    ("known", "found"),
    [
        ({}, 1),
        ({"deeds": [release(2.5, "ALIGN")]}, 0),
        ({"deeds": [release(1.5, "ALIGN")]}, 1),
        ({"deeds": [release(2.5)]}, 1),
        (
            {"decisions": [decided(2.5, "STOPPED", "OFFLINE"), decided(2.6, "OFFLINE", "STOPPED")]},
            1,
        ),
        ({"decisions": [decided(2.5, "OFFLINE", "ALIGNING")]}, 0),
        ({"decisions": [decided(2.5, "STOPPED", "TWIN_LEADS", "twin")]}, 1),
        ({"strikes": [Strike("kill twin_controller 0.1", 2.4, 2.6)]}, 0),
        ({"strikes": [Strike("halt recorder 0.1", 2.4, 2.6)]}, 1),
    ],
    ids=[
        "nothing",
        "aligned",
        "aligned before",
        "reset",
        "lost",
        "anew",
        "led",
        "killed",
        "halted",
    ],
)
def test_stopped_pair_is_left_by_a_person_or_a_new_controller(
    known: dict[str, Any], found: int
) -> None:
    """Then a program may lead it again; a decision of the controller alone is no reason."""
    deeds = [stop(2.0), SENT_ON, *known.pop("deeds", ())]
    made = history(moving((3.1, 4.0, 50.0)), deeds=deeds, **known)
    assert len(list(moves_after_stop(made))) == found


def test_motion_of_a_command_in_force_keeps_the_rule() -> None:
    """Sent, not answered, not stopped."""
    assert not list(moves_by_itself(history(moving((1.0, 2.0, 50.0)), deeds=[motion(0.9)])))


@pytest.mark.parametrize(("sent", "found"), [(1.002, 0), (1.01, 1)])
def test_two_clocks_may_show_a_motion_just_before_its_command(sent: float, found: int) -> None:
    """By some milliseconds, not by more."""
    made = history(moving((1.0, 2.0, 50.0)), deeds=[motion(sent)])
    assert len(list(moves_by_itself(made))) == found


@pytest.mark.parametrize("name", ["RESET", "release buttons", "pendant reset"])
def test_motion_on_a_release_is_found(name: str) -> None:
    """What was wanted before the stop does not come back."""
    deeds = [motion(0.9), stop(2.0), release(4.0, name)]
    (found,) = moves_by_itself(history(moving((1.0, 2.1, 50.0), (4.1, 5.0, 50.0)), deeds=deeds))
    assert f"{name}, 0.10 s ago" in found.evidence


def test_command_is_in_force_until_a_stop_can_have_reached_the_side() -> None:
    """A twin whose line is cut goes on with what it was told before; then it is stopped."""
    lost = [decided(2.5, "IDLE", "OFFLINE")]
    cut = Strike("line web refuse 0.5", 2.4, 2.9, {"twin": 0.5})
    for begins, found in ((3.0, 0), (4.0, 1)):
        made = history(
            twin=moving((begins, begins + 0.4, 50.0)),
            deeds=[motion(2.0)],
            decisions=lost,
            strikes=[cut],
        )
        assert len(list(moves_by_itself(made))) == found, begins


@pytest.mark.parametrize(("begins", "found"), [(1.99, 0), (2.5, 0), (1.9, 1)])
def test_a_twin_moves_from_its_alignment_on(begins: float, found: int) -> None:
    """A decision is published a moment after it was carried out."""
    aligned = [decided(2.0, "STOPPED", "ALIGNING"), decided(3.0, "ALIGNING", "IDLE")]
    made = history(twin=moving((begins, begins + 0.4, 50.0)), decisions=aligned)
    assert len(list(moves_by_itself(made))) == found


def test_motion_on_a_connection_that_comes_back_is_found() -> None:
    """The controller had said that both are stopped."""
    decisions = [decided(2.0, "OPERATOR_LEADS", "OFFLINE")]
    strikes = [Strike("line modbus cut", 2.0, 4.0, {"real": 0.5})]
    real = moving((1.0, 2.1, 50.0), (4.1, 5.0, 50.0))
    broken = history(real, deeds=[motion(0.9)], decisions=decisions, strikes=strikes)
    (found,) = moves_by_itself(broken)
    assert "end of line modbus cut" in found.evidence


@pytest.mark.parametrize("over", [{"waits": True}, {"success": False}])
def test_command_that_has_been_answered_at_its_end_moves_nothing_more(
    over: dict[str, bool],
) -> None:
    """Neither does one that was refused."""
    deed = motion(0.9, answered=2.1, **over)
    assert list(moves_by_itself(history(moving((4.0, 5.0, 50.0)), deeds=[deed])))


@pytest.mark.parametrize(
    ("known", "found"),
    [
        ({}, 1),
        ({"answered": None}, 1),
        ({"answered": 2.6}, 0),
        ({"name": "jog"}, 1),
        ({"name": "pendant program"}, 0),
        ({"until": 2.45, "strikes": [Strike("halt gateway 0.5", 2.4, 2.9)]}, 0),
    ],
    ids=["accepted", "not answered", "accepted later", "a jog", "a program", "waits in a node"],
)
def test_command_is_over_when_the_pair_has_come_to_rest(known: dict[str, Any], found: int) -> None:
    """It excuses no later motion, whichever side begins."""
    strikes = known.pop("strikes", [])
    deed = dataclasses.replace(motion(0.9, answered=0.91), **known)
    moves = moving((1.0, 2.4, 30.0), (7.0, 8.0, 30.0))
    decisions = [decided(2.5, "OPERATOR_LEADS", "IDLE")]
    made = history(moves, deeds=[deed], decisions=decisions, strikes=strikes)
    assert [round(each.end, 2) for each in moves_by_itself(made)] == found * [7.0]


STALLED = [Strike("stall 0.4", 2.05, 2.45, {"real": 0.5, "twin": 2.5})]


def test_ramp_that_a_stall_cuts_in_two_is_one_ramp() -> None:
    """The side goes on to brake when its process goes on."""
    real = moving((1.0, 2.06, 100.0), (2.45, 2.5, 50.0))
    assert not list(moves_by_itself(history(real, deeds=[motion(0.9), stop(2.0)], strikes=STALLED)))


@pytest.mark.parametrize(
    "spans",
    [((1.0, 2.06, 100.0), (2.45, 2.9, 50.0)), ((1.0, 1.9, 100.0), (2.45, 2.5, 50.0))],
    ids=["longer than hearing of the stop and a ramp", "stood before"],
)
def test_motion_after_a_stall_that_is_no_rest_of_a_ramp_is_found(
    spans: tuple[tuple[float, float, float], ...],
) -> None:
    """A stall excuses what was on its way to rest, and nothing else."""
    deeds = [motion(0.9), stop(2.0)]
    assert list(moves_by_itself(history(moving(*spans), deeds=deeds, strikes=STALLED)))


@pytest.mark.parametrize(("sent", "found"), [(2.6, 0), (None, 1)])
def test_rest_of_a_ramp_goes_over_into_a_motion_only_by_a_command(
    sent: float | None, found: int
) -> None:
    """Somebody moves the side again before it has come to rest."""
    deeds = [motion(0.9), stop(2.0), *([motion(sent)] if sent else [])]
    real = moving((1.0, 2.06, 100.0), (2.45, 4.0, 50.0))
    assert len(list(moves_by_itself(history(real, deeds=deeds, strikes=STALLED)))) == found


@pytest.mark.parametrize(
    ("begins", "lasts", "sent", "found"),
    [(2.01, 0.3, 1.8, 0), (2.01, 1.5, 1.8, 1), (2.2, 0.3, 1.8, 1), (2.01, 0.3, None, 1)],
    ids=["on its ramp", "goes on", "begins later", "nobody has sent it"],
)
def test_announced_motion_begins_until_its_side_has_heard_of_the_stop(
    begins: float, lasts: float, sent: float | None, found: int
) -> None:
    """A robot is held a moment before the twin begins what it was told, and is paused then."""
    made = history(
        twin=moving((begins, begins + lasts, 50.0)),
        deeds=[motion(sent)] if sent else [],
        decisions=[decided(2.0, "OPERATOR_LEADS", "PAUSED")],
    )
    assert len(list(moves_by_itself(made))) == found


@pytest.mark.parametrize(
    ("lost", "begins", "lasts", "found"),
    [
        ("real", 2.11, 0.1, 0),
        ("real", 2.11, 1.5, 1),
        ("real", 2.25, 0.1, 1),
        ("twin", 2.11, 0.1, 1),
    ],
)
def test_a_robot_without_its_line_goes_on_until_its_watchdog_ends_it(
    lost: str, begins: float, lasts: float, found: int
) -> None:
    """The line is lost between two motions of its program; nobody can tell it to stop."""
    why = f"a link was lost ({lost}: closed): the side still reached is stopped"
    made = history(
        moving((begins, begins + lasts, 50.0)),
        deeds=[motion(1.8)],
        decisions=[Decided(2.0, "REAL_LEADS", "LINK_LOST", "OFFLINE", "", why)],
    )
    assert len(list(moves_by_itself(made))) == found


def test_side_that_settles_does_not_move() -> None:
    """A drive comes to rest over some hundredths of a degree."""
    assert not list(moves_by_itself(history(moving((4.0, 4.1, 2.0)))))


def test_side_that_is_started_anew_has_not_moved() -> None:
    """It stands elsewhere than the one before."""
    real = [*moving(ends=4.0), *((at + 4.0, (1.0, *q[1:]), v) for at, q, v in moving(ends=4.0))]
    anew = history(real, births={"real": [4.0]}, deeds=[stop(2.0)])
    assert not list(moves_after_stop(anew))
    assert list(moves_after_stop(dataclasses.replace(anew, births={})))
