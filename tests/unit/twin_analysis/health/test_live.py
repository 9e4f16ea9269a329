"""The monitor beside a running cell: which cycles it takes, what it keeps, what it says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from scara_ros.diagnosis import Level
from twin_analysis.health.live.health_watch_node import week_file
from twin_analysis.health.live.taking import LONGEST_S, REST_S, HeardCycle, Taking
from twin_analysis.health.live.telling import RECENT_S, WearStatus, diagnose
from twin_analysis.health.live.weeks import (
    DAY_S,
    MOST_CYCLES,
    MOST_KINDS,
    CycleShape,
    KeptSigns,
    KindVerdict,
    Weeks,
    is_same,
    judged,
    kept_signs,
    shape_of,
    signs_from,
    with_cycle,
)
from twin_analysis.health.live.weeks_io import read_weeks, write_weeks
from twin_analysis.health.signs import CycleSignals, Signs
from twin_analysis.health.trend import LEAST, RECENT, JointFacts

from scara_msgs.msg import TwinControllerState as M

NAMES = ("joint_1", "joint_2", "joint_4")
JOINTS = JointFacts(NAMES, np.full(3, 2.0), np.full(3, 3.0), (True,) * 3, ("deg",) * 3)
SHAPE = CycleShape("real", "PALLETISE", list(NAMES), 20.0, [1.0, 1.0, 0.0], [0.5, 0.5, 0.0])
NAN = float("nan")
NOW = 1.8e9  # a time in 2027 [s]


def signs(friction: float = 5.0, at: float = 0.0, standing: bool = True) -> KeptSigns:
    """Return the signs of a cycle: joint_2 rubs so much, joint_4 stands."""
    row = np.array([5.0, friction, NAN if standing else 5.0])
    ones = row / row
    return kept_signs(at, Signs(row, row, row, ones, 0.1 * ones, 0.0 * ones, NAN))


def weeks_of(frictions: list[float]) -> tuple[Weeks, KindVerdict | None]:
    """Take cycles one after the other, one a second of a first week of ``LEAST`` - 1 s."""
    kept, told = Weeks(), None
    for at, friction in enumerate(frictions):
        kept, told = with_cycle(kept, JOINTS, SHAPE, signs(friction, float(at)), LEAST - 1.0)
    return kept, told


def lead(taking: Taking, now: float, mode: str = M.REAL_LEADS) -> HeardCycle | None:
    """Let the real robot lead, or what ``mode`` says."""
    return taking.decided(now, mode, "real" if mode == M.REAL_LEADS else "")


def test_a_cycle_is_listened_to_from_its_begin_to_its_rest() -> None:
    """And the next one is not, until it is due; nothing is heard while the pair stands."""
    taking = Taking(every_s=100.0)
    assert not taking.listens(0.0)
    assert lead(taking, 10.0) is None and taking.listens(10.0)
    assert taking.program(11.0, "PALLETISE line 3 running", True) is None
    assert taking.program(30.0, "", False) is None
    assert lead(taking, 30.0, M.IDLE) is None and taking.look(31.0) is None
    assert taking.look(30.0 + REST_S) == HeardCycle("real", "PALLETISE")
    assert not taking.listens(34.0)
    lead(taking, 50.0)
    assert not taking.listens(50.0), "not due yet"
    assert taking.listens(110.0), "a program that runs all day is heard from where it is"


@pytest.mark.parametrize("mode", [M.STOPPED, M.ESTOP, M.FAULT, M.OFFLINE])
def test_a_cycle_that_did_not_come_to_its_end_is_dropped(mode: str) -> None:
    """It is no cycle as the others; the next one is due at once."""
    taking = Taking(every_s=100.0)
    lead(taking, 10.0)
    assert taking.listens(10.0)
    assert lead(taking, 20.0, mode) is None and not taking.listens(20.0)
    lead(taking, 25.0)
    assert taking.listens(25.0)


def test_a_paused_cycle_is_dropped_and_a_long_one_is_cut() -> None:
    """After a pause the rest of that cycle does not count either."""
    taking = Taking(every_s=1000.0)
    lead(taking, 0.0)
    assert taking.listens(0.0)
    lead(taking, 5.0, M.PAUSED)
    assert not taking.listens(5.0)
    lead(taking, 6.0)
    assert not taking.listens(6.0)
    lead(taking, 7.0, M.IDLE)
    assert taking.look(7.0 + REST_S) is None and not taking.listens(11.0)
    lead(taking, 20.0)
    assert taking.listens(20.0)
    taking.program(21.0, "ALL_DAY line 1 running", True)
    assert taking.look(20.0 + LONGEST_S - 1.0) is None
    assert taking.look(20.0 + LONGEST_S) == HeardCycle("real", "ALL_DAY")
    assert not taking.listens(20.0 + LONGEST_S)


def test_each_run_of_a_program_is_a_cycle_of_its_own() -> None:
    """Also where the robot does not rest between two."""
    taking = Taking(every_s=0.0)
    lead(taking, 0.0)
    assert taking.listens(0.0)
    taking.program(0.5, "FLICK line 1 running", True)
    taking.program(4.0, "", False)
    assert taking.program(5.0, "FLICK line 1 running", True) == HeardCycle("real", "FLICK")
    assert taking.listens(5.0)


def test_the_first_week_ends_with_enough_cycles_and_then_the_newest_are_held_against_it() -> None:
    """joint_2 rubs 40 % more; what is kept says so again after a restart."""
    kept, told = weeks_of([5.0] * (LEAST - 1))
    assert told is not None and not told.kind.complete
    kept, told = weeks_of([5.0 + 0.01 * (k % 3) for k in range(LEAST)])
    assert told is not None and told.kind.complete and told.finding is None
    for at in range(RECENT):
        assert told.finding is None
        kept, told = with_cycle(kept, JOINTS, SHAPE, signs(9.0, 100.0 + at), LEAST - 1.0)
    assert told.finding is not None and told.finding.joint == "joint_2"
    out = "joint_4 moved both ways in 0 of 12 cycles of its first week: left out"
    assert told.left_out.startswith(f"{out}; joints that moved both ways: 2, and 3 are needed:")
    assert judged(kept.kinds[0], JOINTS) == told


def test_a_clock_that_was_wrong_does_not_end_the_first_week_early_nor_for_ever() -> None:
    """Neither one that was a year ahead, nor one that was not set yet; a holiday is no week either.

    Of what it learns in the week nothing is lost, and what was seen once makes nothing else old.
    """
    week_s, hour = 7 * DAY_S, DAY_S / 24

    def ends_at(*begin: float) -> float:
        """Return after how many days the first week is over, of a cycle an hour from 0 on."""
        kept, told = Weeks(), None
        for at in (NOW + time for time in (*begin, *np.arange(0.0, 15 * DAY_S, hour))):
            if told is None or not told.kind.complete:
                kept, told = with_cycle(kept, JOINTS, SHAPE, signs(at=at), week_s)
                seen = at - NOW
        assert told is not None and told.kind.complete and len(told.kind.week) > 6 * 24
        return seen / DAY_S

    assert ends_at() == ends_at(365 * DAY_S) == 7.0
    assert ends_at(-NOW) == ends_at(-30 * DAY_S) == 6.0
    kept, _ = with_cycle(Weeks(), JOINTS, SHAPE, signs(at=NOW), week_s)
    jogged = msgspec.structs.replace(SHAPE, program="JOG")
    kept, _ = with_cycle(kept, JOINTS, jogged, signs(at=2 * NOW), week_s)
    kept, told = with_cycle(kept, JOINTS, SHAPE, signs(at=NOW + hour), week_s)
    assert max(kind.newest for kind in kept.kinds) == told.kind.newest == NOW + hour


def test_a_first_week_of_more_cycles_than_are_kept_ends_too() -> None:
    """Those behind the last one that is kept have their time."""
    kept, told = Weeks(), None
    for at in np.linspace(0.0, 7 * DAY_S, 2 * MOST_CYCLES):
        assert told is None or not told.kind.complete
        kept, told = with_cycle(kept, JOINTS, SHAPE, signs(at=NOW + at), 7 * DAY_S - 1.0)
    assert told is not None and told.kind.complete and len(told.kind.week) == MOST_CYCLES


def test_only_the_same_cycle_is_compared() -> None:
    """Another program, speed, way, or length is another one."""
    assert is_same(
        SHAPE, msgspec.structs.replace(SHAPE, seconds=20.9, spans=[1.09, 1.0, 0.01]), JOINTS
    )
    for change in (
        {"program": "OTHER"},
        {"leader": "twin"},
        {"names": ["joint_1", "joint_2", "joint_3"]},
        {"seconds": 23.0},
        {"spans": [1.2, 1.0, 0.0]},
        {"paces": [0.5, 0.6, 0.0]},
    ):
        assert not is_same(SHAPE, msgspec.structs.replace(SHAPE, **change), JOINTS), change


def test_what_is_done_once_gives_way_to_what_comes_again() -> None:
    """However much is jogged: a first week that is over stays."""
    kept, _ = weeks_of([5.0] * LEAST)
    for number in range(2 * MOST_KINDS):
        jogged = msgspec.structs.replace(SHAPE, program=f"JOG_{number}")
        kept, _ = with_cycle(kept, JOINTS, jogged, signs(5.0, 1000.0 + number), LEAST - 1.0)
    assert len(kept.kinds) == MOST_KINDS
    assert "PALLETISE" in [kind.shape.program for kind in kept.kinds]


def test_a_shape_is_what_each_joint_goes_and_how_fast() -> None:
    """A joint that swings goes four times its span in two periods."""
    times = np.arange(0.0, 12.0, 0.01)
    # It rests before and after.
    swings = np.clip(times - 1.0, 0.0, 8.0)
    q = np.stack([np.sin(0.5 * np.pi * swings), 0.0 * times], axis=1)
    cycle = CycleSignals(times, q, q, q)
    shape = shape_of(HeardCycle("real", "SWING"), JOINTS, ("joint_1", "joint_2"), cycle)
    assert shape.seconds == pytest.approx(8.0, abs=0.2)
    assert shape.spans == pytest.approx([2.0, 0.0], abs=0.01)
    assert shape.paces == pytest.approx([1.0, 0.0], abs=0.02)


def test_what_is_kept_survives_and_a_broken_file_is_put_aside(tmp_path: Path) -> None:
    """NaN too: it is null in the file."""
    file = tmp_path / "cell" / "robot.json"
    assert read_weeks(file) == Weeks()
    kept, _ = weeks_of([5.0] * 3)
    write_weeks(file, kept)
    assert read_weeks(file) == kept
    again = signs_from(kept.kinds[0].week[0])
    assert again.forward[:2].tolist() == [5.0, 5.0] and np.isnan(again.forward[2])
    assert np.isnan(again.vacuum_s)
    file.write_text('{"kinds": [{')
    assert read_weeks(file) == Weeks()
    assert file.with_suffix(".unreadable").read_text() == '{"kinds": [{'


def test_each_robot_has_a_first_week_of_its_own() -> None:
    """A real one is not held against what was learned from the stand-in, nor from another one."""
    hosts = ("127.0.0.1", "192.0.2.9", "192.0.2.10", "fe80::1")
    assert [week_file("r", "ideal", host) for host in hosts] == [
        "r.json",
        "r_192.0.2.9.json",
        "r_192.0.2.10.json",
        "r_fe80__1.json",
    ]
    assert [week_file("r", "field:7", host) for host in hosts[:2]] == [
        "r_field_7.json",
        "r_192.0.2.9.json",
    ]


def test_the_node_says_what_wears_before_anything_else() -> None:
    """And what is wrong with itself, how far the first week is, and that all is well."""
    _, fresh = weeks_of([5.0] * 5)
    _, over = weeks_of([5.0] * LEAST)
    _, well = weeks_of([5.0] * (LEAST + RECENT))
    kept, _ = weeks_of([5.0 + 0.01 * (k % 3) for k in range(LEAST)])
    for at in range(RECENT + 1):
        kept, worn = with_cycle(kept, JOINTS, SHAPE, signs(9.0, 100.0 + at), LEAST - 1.0)
    assert fresh is not None and over is not None
    assert well is not None and worn.finding is not None
    assert over.kind.complete and over.finding is None
    stood = replace(well, compared=False, left_out="no joint moved")

    def said(*told: KindVerdict, problem: str = "") -> tuple[int, str]:
        found = diagnose(WearStatus(told, 1, "", problem), "health_watch: wear", NOW)
        return found.level, found.message

    assert said() == (Level.OK, "no cycle was taken yet")
    assert said(fresh) == (Level.OK, "first week: 5 times the same cycle so far")
    assert said(over) == (Level.OK, "the first week is over: 0 of 7 cycles behind it so far")
    assert said(stood) == (Level.OK, "nothing can be compared: no joint moved")
    assert said(well, over) == (Level.OK, "as in its first week: PALLETISE of 20 s")
    assert said(well, problem="the disk is full") == (Level.WARN, "the disk is full")
    assert said(well, worn, problem="the disk is full") == (Level.WARN, worn.finding.text)
    # A repair: another program runs since, for more than a week.
    later = replace(
        well, kind=msgspec.structs.replace(well.kind, recent=[signs(5.0, 2 * RECENT_S)])
    )
    assert said(later, worn)[0] == Level.OK
    # But one that was seen while the clock was ahead makes nothing old.
    ahead = replace(well, kind=msgspec.structs.replace(well.kind, recent=[signs(5.0, 2 * NOW)]))
    assert said(ahead, worn) == (Level.WARN, worn.finding.text)
