"""Cycles: from the first motion to rest, or to what ended it."""

from __future__ import annotations

import math

import pytest
from cell_recorder.journal.cycles import ENDS, LEADS, REAL, TWIN, Cycles
from cell_recorder.journal.entries import Cycle
from hypothesis import given
from hypothesis import strategies as st

from scara_msgs.msg import PartEvent, TwinControllerState

IDLE, PAUSED = TwinControllerState.IDLE, TwinControllerState.PAUSED
REAL_LEADS, TWIN_LEADS = TwinControllerState.REAL_LEADS, TwinControllerState.TWIN_LEADS
STOPPED = TwinControllerState.STOPPED


def begun(now: float = 10.0, who: str = "") -> Cycles:
    """Return a cycle that the real robot leads."""
    cycles = Cycles(rest_s=3.0)
    assert cycles.decided(now, REAL_LEADS, "real", "the real robot moved first", who) == []
    return cycles


def test_cycle_ends_when_the_pair_rested_long_enough() -> None:
    """It ended with the last motion."""
    cycles = begun(who="Ada")
    cycles.measured(0.40006, 0.09)
    cycles.measured(math.nan, math.nan)
    cycles.measured(0.2, 0.084)
    assert cycles.decided(20.0, IDLE, "") == []
    cycles.measured(9.0, 1.0)  # at rest: no longer part of it
    assert cycles.look(22.9) == []
    (cycle,) = cycles.look(23.0)
    assert (cycle.start, cycle.end, cycle.leader, cycle.outcome) == (10.0, 20.0, "real", "done")
    assert (cycle.worst_error_mm, cycle.who, cycle.program) == (0.4001, "Ada", "")
    assert cycle.follower_lag_s == 0.084
    assert not cycles.is_open and cycles.look(99.0) == []


def test_clock_that_is_set_back_while_the_pair_rests_ends_the_cycle() -> None:
    """Else it would wait for the time to come again."""
    cycles = begun()
    cycles.decided(20.0, IDLE, "")
    assert [cycle.end for cycle in cycles.look(19.5)] == [20.0]


def test_short_rests_belong_to_the_cycle() -> None:
    """A gripper that closes ends no cycle."""
    cycles = begun()
    for n in range(5):
        cycles.decided(20.0 + 4 * n, IDLE, "")
        assert cycles.look(22.0 + 4 * n) == []
        cycles.decided(22.0 + 4 * n, REAL_LEADS, "real")
    cycles.decided(50.0, IDLE, "")
    assert [cycle.end for cycle in cycles.look(60.0)] == [50.0]


def test_program_holds_a_cycle_through_its_waiting_and_each_run_is_one() -> None:
    """From run to run, also without a rest between them."""
    cycles = begun()
    cycles.program(10.2, "PALLET line 1 running", True)
    cycles.decided(12.0, IDLE, "")
    assert cycles.look(30.0) == []
    cycles.decided(30.0, REAL_LEADS, "real")
    assert cycles.program(40.0, "PALLET line 9 aborted", False) == []
    (first,) = cycles.program(40.5, "ARTICLE line 1 running", True)
    assert (first.start, first.end, first.program) == (10.0, 40.5, "PALLET")
    cycles.decided(50.0, IDLE, "")
    cycles.program(50.1, "ARTICLE line 8 aborted", False)
    (second,) = cycles.look(60.0)
    assert (second.start, second.end, second.program) == (40.5, 50.1, "ARTICLE")


@pytest.mark.parametrize(
    ("mode", "leader"), [(TWIN_LEADS, "twin"), (TwinControllerState.OPERATOR_LEADS, "operator")]
)
@pytest.mark.parametrize("said", ["ARTICLE line 8 aborted", "STREAM line 1 running"])
def test_what_streams_to_the_robot_is_no_run_of_a_program(
    mode: str, leader: str, said: str
) -> None:
    """Nor of the one that ran before, whose name is still read; the cycle ends with its rest."""
    cycles = Cycles(rest_s=3.0)
    cycles.decided(10.0, mode, leader)
    assert cycles.program(10.1, said, True) == []
    cycles.decided(12.0, IDLE, "")
    (cycle,) = cycles.look(15.0)
    assert (cycle.program, cycle.leader, cycle.end) == ("", leader, 12.0)


def test_a_run_has_the_name_that_is_read_behind_its_start() -> None:
    """The first words are still those of the run before."""
    cycles = begun()
    for said in ("OTHER line 9 aborted", "ARTICLE line 1 running", "ARTICLE line 8 running"):
        assert cycles.program(10.2, said, True) == []
    assert cycles.program(19.0, "ARTICLE line 8 aborted", False) == []
    cycles.decided(20.0, IDLE, "")
    assert [cycle.program for cycle in cycles.look(30.0)] == ["ARTICLE"]


def test_a_run_that_was_paused_is_one_run() -> None:
    """Its program does not run meanwhile, and has not ended."""
    cycles = begun()
    cycles.program(10.2, "ARTICLE line 1 running", True)
    cycles.decided(12.00044, PAUSED, "real")
    for said in ("ARTICLE line 3 running", "ARTICLE line 3 paused"):
        assert cycles.program(12.1, said, False) == []
    cycles.decided(20.0, REAL_LEADS, "real")
    assert cycles.program(20.1, "ARTICLE line 3 paused", True) == []
    assert cycles.program(29.9, "ARTICLE line 8 aborted", False) == []
    cycles.decided(30.0, IDLE, "")
    (cycle,) = cycles.look(40.0)
    assert (cycle.program, cycle.start, cycle.end) == ("ARTICLE", 10.0, 30.0)
    assert (cycle.paused_s, cycle.outcome) == (8.0, "done")


@pytest.mark.parametrize(("mode", "outcome"), ENDS.items())
def test_what_stops_the_pair_ends_the_cycle(mode: str, outcome: str) -> None:
    """With the reason."""
    (cycle,) = begun().decided(12.0, mode, "", "a person is too close")
    assert (cycle.end, cycle.outcome, cycle.why) == (12.0, outcome, "a person is too close")


@pytest.mark.parametrize("mode", ENDS)
def test_what_comes_after_the_last_motion_ends_no_cycle(mode: str) -> None:
    """A STOP or ALIGN soon after a finished run is no part of it; one in a waiting run is."""
    cycles = begun()
    cycles.decided(12.0, IDLE, "")
    (cycle,) = cycles.decided(13.0, mode, "", "by the operator")
    assert (cycle.end, cycle.outcome, cycle.why) == (12.0, "done", "")
    cycles = begun()
    cycles.program(10.2, "PALLET line 1 running", True)
    cycles.decided(12.0, IDLE, "")
    (cycle,) = cycles.decided(13.0, mode, "", "by the operator")
    assert (cycle.end, cycle.outcome) == (13.0, ENDS[mode])


def test_a_pause_after_the_last_motion_is_no_part_of_the_cycle() -> None:
    """Else a finished cycle would last until RESUME, or count as stopped."""
    cycles = begun()
    cycles.decided(12.0, IDLE, "")
    (cycle,) = cycles.decided(13.0, PAUSED, "")
    assert (cycle.end, cycle.outcome, cycle.paused_s) == (12.0, "done", 0.0)


def test_a_pair_that_does_not_agree_at_rest_has_lost_no_link() -> None:
    """Its robot is stopped, and the twin aligned."""
    (cycle,) = begun().decided(12.0, TwinControllerState.ALIGNING, "", "they do not agree")
    assert cycle.outcome == "stopped"


def test_pause_is_part_of_the_cycle_and_counted() -> None:
    """However long it is."""
    cycles = begun()
    cycles.decided(20.0, PAUSED, "real")
    assert cycles.look(1000.0) == []
    cycles.decided(1020.0, REAL_LEADS, "real")
    cycles.decided(1025.0, IDLE, "")
    (cycle,) = cycles.look(1030.0)
    assert (cycle.paused_s, cycle.end, cycle.outcome) == (1000.0, 1025.0, "done")


def test_a_clock_that_is_set_back_in_a_pause_takes_no_time_away() -> None:
    """A pause lasts no time at least."""
    cycles = begun()
    cycles.decided(20.0, PAUSED, "real")
    cycles.decided(19.5, REAL_LEADS, "real")
    (cycle,) = cycles.close(30.0)
    assert (cycle.paused_s, cycle.start, cycle.end) == (0.0, 10.0, 30.0)


def test_stop_in_a_pause_ends_the_cycle_with_the_pause_counted() -> None:
    """STOP clears what RESUME would have gone on with."""
    cycles = begun()
    cycles.decided(20.0, PAUSED, "real")
    (cycle,) = cycles.decided(25.0, STOPPED, "", "STOP by the operator")
    assert (cycle.paused_s, cycle.outcome) == (5.0, "stopped")


def test_another_leader_begins_another_cycle() -> None:
    """At rest the first was done; in motion it was taken over."""
    cycles = begun()
    cycles.decided(20.0, IDLE, "")
    (first,) = cycles.decided(21.0, TWIN_LEADS, "twin")
    assert (first.end, first.outcome) == (20.0, "done")
    (second,) = cycles.decided(25.0, REAL_LEADS, "real")
    assert (second.start, second.end, second.leader) == (21.0, 25.0, "twin")
    assert (second.outcome, second.why) == ("taken over", "real leads")


def test_parts_are_the_real_robots_where_it_tells_of_them() -> None:
    """A robot without sensors has the twin's parts; both together count once."""
    cycles = begun()
    cycles.part(TWIN, PartEvent.PLACED)
    cycles.part(TWIN, PartEvent.GRIPPED)
    assert cycles.close(20.0)[0].parts_placed == 1
    cycles = begun()
    for _ in range(2):
        cycles.part(TWIN, PartEvent.PLACED)
    cycles.part(REAL, PartEvent.PLACED)
    cycles.part(REAL, PartEvent.DROPPED)
    (cycle,) = cycles.close(20.0)
    assert (cycle.parts_placed, cycle.parts_dropped) == (1, 1)
    assert (cycle.outcome, cycle.worst_error_mm) == ("unfinished", None)


MODES = [value for name, value in vars(TwinControllerState).items() if name.isupper()]
LEADERS = dict(zip(LEADS, ("real", "twin", "operator")))


@given(st.lists(st.tuples(st.sampled_from(MODES), st.floats(0.0, 5.0), st.booleans()), max_size=60))
def test_cycles_never_overlap_and_none_is_told_twice(
    steps: list[tuple[str, float, bool]],
) -> None:
    """Whatever order the modes come in."""
    cycles, now, told = Cycles(rest_s=3.0), 100.0, list[Cycle]()
    for mode, dt, running in steps:
        now += dt
        told += cycles.look(now)
        told += cycles.decided(now, mode, LEADERS.get(mode, ""))
        told += cycles.program(now, f"P line 1 {'running' if running else 'aborted'}", running)
    told += cycles.close(now)
    assert cycles.close(now) == []
    times = [time for cycle in told for time in (cycle.start, cycle.end)]
    assert times == sorted(times)
    assert all(0.0 <= cycle.paused_s <= cycle.end - cycle.start + 1e-3 for cycle in told)
