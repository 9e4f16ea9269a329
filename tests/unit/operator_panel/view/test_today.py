"""What was done today, from what the cell says."""

from __future__ import annotations

import math

import msgspec
import pytest
from operator_panel.view.robot.status import status_texts
from operator_panel.view.snapshot import CellState, RobotPackage, RobotStatus, Snapshot
from operator_panel.view.today import Today
from operator_panel.view.words import UNKNOWN

DAY = "2030-03-17"
NO_MOVES = ", twin 0, operator 0"


def cell(
    running: bool,
    deviation_mm: float = 0.0,
    leader: str | None = None,
    placed: int = 0,
    *,
    mode: str = "",
    said: str = "",
    kind: str = "program",
    heard: bool = True,
) -> Snapshot:
    """Return a cell with a program that runs or not, and leads as long; ``heard``: the robot is."""
    leader = leader if leader is not None else "real" if running else ""
    mode = mode or (f"{leader.upper()}_LEADS" if leader else "IDLE")
    position = (0.0,) if heard else ()
    state = CellState(mode, leader=leader, deviation_mm=deviation_mm, real_position=position)
    said = said or f"ARTICLE line 1 {'running' if running else 'aborted'}"
    package = RobotPackage(kind, 50.0, True, running, said)
    apart = ((0.0, deviation_mm),) if leader and math.isfinite(deviation_mm) else ()
    return Snapshot(True, state, package=package, placed={"real": placed}, apart=apart)


def after(*cells: Snapshot) -> dict[str, str]:
    """Return the texts after cells that were seen each 10 s."""
    today = Today()
    for number, one in enumerate(cells):
        today.look(one, False, DAY, "12:00:00", 10.0 * number)
    return today.texts(cells[-1], 10.0 * len(cells))


def test_cycle_is_the_time_from_start_to_end_of_a_program() -> None:
    """Two programs of 10 and 14 s: the last one, and their mean."""
    today = Today()
    for now, running in ((0.0, False), (1.0, True), (11.0, False), (20.0, True), (34.0, False)):
        today.look(cell(running), False, DAY, "12:00:00", now)
    texts = today.texts(cell(False), 40.0)
    assert (texts["today.cycles"], texts["today.last"]) == (f"real 2{NO_MOVES}", "14.0 s")
    assert (texts["today.mean"], texts["today.running"]) == ("12.0 s", "none runs")
    today.look(cell(True), False, DAY, "12:00:00", 50.0)
    assert today.texts(cell(True), 57.0)["today.running"] == "ARTICLE, 7 s so far"


TWIN_MOVES = cell(True, leader="twin", kind="stream")
PAUSED = cell(False, leader="real", mode="PAUSED", said="ARTICLE line 3 paused")
RUNS, RESTS, ENDS = cell(True), cell(False), cell(False, leader="real")


@pytest.mark.parametrize(
    ("cells", "cycles", "last"),
    [
        # A program's end is that of its run, and not of the rest behind it.
        ([RUNS, ENDS, RESTS], f"real 1{NO_MOVES}", "10.0 s"),
        ([RUNS, ENDS, RUNS, RESTS], f"real 2{NO_MOVES}", "10.0 s"),
        # What the robot takes over from the twin is no move of it.
        ([TWIN_MOVES, RUNS, RESTS], f"real 1{NO_MOVES}", "10.0 s"),
        # A paused program is one run; the robot says that none runs meanwhile.
        ([RUNS, PAUSED, RUNS, RESTS], f"real 1{NO_MOVES}", "30.0 s"),
        # What was stopped did not run to its end, and may end before the mode says why.
        *[
            ([*begun, cell(False, mode=mode), RESTS], f"real 0{NO_MOVES}", UNKNOWN)
            for mode in ("STOPPED", "ESTOP", "FAULT", "OFFLINE")
            for begun in ([RUNS, ENDS], [TWIN_MOVES], [cell(True, leader="operator")])
        ],
        # A move is no run of a program: what runs on the robot is its stream, whatever its name.
        *[
            ([cell(True, leader=who, said=said, kind=kind), RESTS], f"real 0, {moves}", UNKNOWN)
            for who, moves in (("twin", "twin 1, operator 0"), ("operator", "twin 0, operator 1"))
            for said in ("ARTICLE line 8 aborted", "STREAM line 1 running")
            for kind in ("program", "stream")
        ],
    ],
)
def test_what_ran_to_its_end_is_counted_once_for_who_led(
    cells: list[Snapshot], cycles: str, last: str
) -> None:
    """Once both stand."""
    found = after(*cells)
    assert (found["today.cycles"], found["today.last"]) == (cycles, last)


def test_cycle_that_nobody_saw_to_its_end_is_not_counted() -> None:
    """The twin controller was silent: when the program ended is not known."""
    today = Today()
    today.look(cell(True), False, DAY, "12:00:00", 0.0)
    today.look(cell(True), True, DAY, "12:00:05", 5.0)
    today.look(cell(False), False, DAY, "12:00:09", 9.0)
    assert today.texts(cell(False), 9.0)["today.cycles"] == f"real 0{NO_MOVES}"


def test_run_of_a_robot_that_is_not_heard_counts_no_longer() -> None:
    """Its line was lost: whether the program still runs, and how it ends, is not known."""
    lost = cell(True, leader="", mode="OFFLINE", heard=False)
    assert after(RUNS, lost)["today.running"] == UNKNOWN
    assert after(RUNS, lost, RESTS)["today.cycles"] == f"real 0{NO_MOVES}"


def test_largest_deviation_counts_while_a_side_leads_and_has_its_time() -> None:
    """A robot that is turned on 100 mm away from its twin is no bad following."""
    today = Today()
    for clock, leader, apart in (
        ("08:00:00", "", 136.0),
        ("08:01:00", "real", 1.5),
        ("08:02:00", "real", math.nan),
        ("08:03:00", "twin", 0.7),
    ):
        today.look(cell(False, apart, leader), False, DAY, clock, 0.0)
    assert today.texts(cell(False), 0.0)["today.deviation"] == "1.50 mm at 08:01:00"


def test_tools_that_are_never_apart_are_known_to_be_so() -> None:
    """Zero is a measured distance, the dash says that nobody led yet."""
    assert after(cell(False))["today.deviation"] == UNKNOWN
    assert after(cell(False, 0.0, "real"))["today.deviation"] == "0.00 mm at 12:00:00"


def test_a_peak_that_no_look_saw_counts() -> None:
    """It is shorter than the time between two looks; the state of now is lower already."""
    today, seen = Today(), cell(False, 0.7, "real")
    seen = msgspec.structs.replace(seen, apart=((0.0, 0.6), (0.02, 6.9), (0.04, 0.7)))
    today.look(seen, False, DAY, "08:00:00", 0.05)
    assert today.texts(seen, 0.05)["today.deviation"] == "6.90 mm at 08:00:00"


def test_a_new_day_begins_at_nothing() -> None:
    """Parts of yesterday stay with yesterday."""
    today = Today()
    today.look(cell(False, 1.5, "real", placed=4), False, DAY, "23:59:59", 0.0)
    today.look(cell(False, 0.2, "real", placed=6), False, DAY, "23:59:59", 0.5)
    assert today.texts(cell(False, placed=6), 0.5)["today.parts"] == "real 2, twin 0"
    today.look(cell(False, 0.1, "real", placed=6), False, "2030-03-18", "00:00:00", 1.0)
    texts = today.texts(cell(False, placed=7), 1.0)
    assert texts["today.parts"] == "real 1, twin 0"
    assert texts["today.deviation"] == "0.10 mm at 00:00:00"


def test_a_program_that_runs_over_midnight_counts_with_its_whole_time() -> None:
    """On the day on which it ends."""
    today = Today()
    today.look(RUNS, False, DAY, "23:59:50", 0.0)
    today.look(RUNS, False, "2030-03-18", "00:00:00", 10.0)
    assert today.texts(RUNS, 12.0)["today.running"] == "ARTICLE, 12 s so far"
    today.look(RESTS, False, "2030-03-18", "00:00:04", 14.0)
    texts = today.texts(RESTS, 14.0)
    assert (texts["today.cycles"], texts["today.last"]) == (f"real 1{NO_MOVES}", "14.0 s")


def test_status_is_in_words_and_unknown_stays_unknown() -> None:
    """A robot that says nothing is neither stopped nor ready."""
    assert set(status_texts(None).values()) == {"not known"}
    good = RobotStatus(2, 0, 1, 1, 0, 0)
    assert status_texts(good) == {
        "status.mode": "automatic",
        "status.drives": "on",
        "status.stop": "not pressed",
        "status.motion": "stands, can move",
        "status.error": "none",
    }
    assert status_texts(good, "T1")["status.mode"].startswith("T1: by hand, at most 250 mm/s")
    assert status_texts(good, "?")["status.mode"] == "automatic"
    bad = msgspec.structs.replace(good, mode=1, e_stopped=1, motion_possible=0, in_error=1)
    texts = status_texts(msgspec.structs.replace(bad, error_code=21))
    assert texts["status.mode"] == "by hand, at its pendant"
    assert (texts["status.stop"], texts["status.motion"]) == ("pressed", "stands, cannot move")
    assert texts["status.error"] == "yes, number 21"
