"""Lines are repeated over places: the register arithmetic leads to each of them, in order."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from fanuc_emulator.tp.rehearsal import library_of, rehearse
from harness.workspace import ROOT
from operator_panel.teach import draft as teach
from operator_panel.teach import rounds
from operator_panel.teach.draft import Draft, TeachError, empty
from operator_panel.teach.grid import MOST_PLACES, Place, grid_of, read_places
from operator_panel.teach.places import position_of
from scara_config import Robot, load_robot
from scara_config.programs.files import taught_of
from scara_config.programs.steps import GripperStep, MoveStep, PathStep, WaitStep
from scara_config.programs.tp.listing import Position

ROBOT: Robot = load_robot(ROOT / "config")
HOME = {joint.name: 0.0 for joint in ROBOT.joints}
LIBRARY = library_of(ROOT / "CARRY.LS", ROBOT, ROOT / "config")
"""Of a cell: it knows the tool frames that lines are made with."""
FINE_50, LINE_100 = 50.0, 100.0


def at(turn: float) -> Position:
    """Return home with joint 1 turned [deg]."""
    return position_of(ROBOT, HOME | {"joint_1": turn * ROBOT.joint("joint_1").scale})


def turns(draft: Draft) -> list[float | str]:
    """Return what the stand-in's interpreter makes of it: joint 1 [deg], or the gripper."""
    done: list[float | str] = []
    program = taught_of(draft.program, ROBOT, draft.program.name)
    for step in rehearse(program, ROBOT, LIBRARY):
        if isinstance(step, MoveStep):
            done.append(round(step.target[0] / ROBOT.joints[0].scale, 6))
        elif isinstance(step, PathStep):
            place = step.targets[0].place
            assert isinstance(place, tuple)
            done.append(round(place[0] / ROBOT.joints[0].scale, 6))
        elif isinstance(step, GripperStep):
            done.append("on" if step.on else "off")
        else:
            assert isinstance(step, WaitStep)
    return done


def handled(draft: Draft, after: int, first: float, count: int, close: bool) -> Draft:
    """Handle parts at ``first`` and each further degree; above them is half a degree on."""
    there = [at(first + k) for k in range(count)]
    above = [at(first + k + 0.5) for k in range(count)]
    return rounds.handled(draft, ROBOT, after, above, there, close, (FINE_50, LINE_100), None)


def carried(count: int) -> Draft:
    """Return a program that fetches from 10 deg and brings to 40 deg, each further one by 1."""
    fetched = handled(empty("CARRY", ROBOT), 0, 10.0, count, True)
    return handled(
        fetched, rounds.last_added(empty("CARRY", ROBOT), 0, fetched), 40.0, count, False
    )


def round_of(k: int) -> list[float | str]:
    """Return what one round does."""
    a, b = 10.0 + k, 40.0 + k
    return [a + 0.5, a, "on", a + 0.5, b + 0.5, b, "off", b + 0.5]


@pytest.mark.parametrize("count", [1, 2, 9])
def test_each_part_is_fetched_and_brought_in_its_round(count: int) -> None:
    """One loop for both: what is added inside goes through its places with it."""
    draft = carried(count)
    assert draft.text.count("  FOR ") == (count > 1)
    assert turns(draft) == [thing for k in range(count) for thing in round_of(k)]
    assert [each.number for each in draft.program.positions] == list(range(1, 4 * count + 1))


def test_positions_are_named_by_what_is_done_there() -> None:
    """In each round with its number."""
    one = ["above pick", "pick", "above place", "place"]
    assert [each.comment for each in carried(1).program.positions] == one
    two = [f"{name} {number}" for name in one for number in (1, 2)]
    assert [each.comment for each in carried(2).program.positions] == two


def test_lines_that_were_taught_are_repeated_in_the_loop_around_them() -> None:
    """Fetched at one place, brought to three: only the lines of the pallet go along."""
    one = carried(1)
    lines = len(one.program.lines)
    looped = teach.looped(one, ROBOT, 1, lines, 3)
    first, last = lines // 2 + 2, lines + 1
    numbers = rounds.own_places(looped, first, last)
    places = {n: [at(60.0 + 5 * i + k) for k in range(3)] for i, n in enumerate(numbers)}
    made = rounds.repeated(looped, ROBOT, first, last, places)
    fetch = [10.5, 10.0, "on", 10.5]
    bring = [[60.0 + k, 65.0 + k, "off", 60.0 + k] for k in range(3)]
    assert turns(made) == [thing for k in range(3) for thing in (*fetch, *bring[k])]
    assert len(made.program.positions) == 2 + 2 * 3


@pytest.mark.parametrize(
    ("first", "last", "done"), [(1, 3, [6.0, 6.0, 7.0, 7.0]), (2, 2, [6.0, 7.0])]
)
def test_a_whole_loop_stands_in_none(first: int, last: int, done: list[float]) -> None:
    """It goes round at each place; a line of it, be it all that it holds, goes along with it."""
    draft = teach.recorded(empty("A", ROBOT), ROBOT, 0, at(5.0), "J", 50.0, None)
    draft = teach.looped(draft, ROBOT, 1, 1, 2)
    made = rounds.repeated(draft, ROBOT, first, last, {1: [at(6.0), at(7.0)]})
    assert turns(made) == done


def test_position_that_other_lines_need_stays() -> None:
    """A line outside goes there still."""
    draft = teach.recorded(empty("A", ROBOT), ROBOT, 0, at(5.0), "J", 50.0, None)
    draft = teach.inserted(draft, ROBOT, 1, draft.program.lines)
    made = rounds.repeated(draft, ROBOT, 2, 2, {1: [at(6.0), at(7.0)]})
    assert turns(made) == [5.0, 6.0, 7.0]


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "half a block": (
        lambda: rounds.own_places(teach.looped(carried(1), ROBOT, 1, 3, 2), 1, 3),
        "lines 1 to 3 hold half of a block",
    ),
    "another loop": (
        lambda: handled(carried(2), 3, 60.0, 3, True),
        "line 1 does not go round 3 times",
    ),
    "one place": (
        lambda: rounds.repeated(carried(1), ROBOT, 1, 1, {1: [at(1.0)]}),
        "nothing to repeat",
    ),
    "registers": (
        lambda: rounds.own_places(carried(2), 4, 4),
        "a register says where line 4 goes",
    ),
    "no motion": (lambda: rounds.own_places(carried(1), 3, 3), "lines 3 to 3 go nowhere"),
    "outside": (
        lambda: rounds.recorded(carried(1), ROBOT, 0, [at(1.0), at(999.0)], "J", 50.0, None),
        r"P\[6\]\.J1 = 999 deg: outside \[",
    ),
    "words": (lambda: read_places("1 2 3\n4 5", ROBOT), "place 2: '4 5': x y z in mm"),
    "no number": (lambda: read_places("1 2 a", ROBOT), "place 1: 'a' is no number"),
    "two corners": (lambda: grid_of((Place((0.0,) * 3),) * 2, 2, 2, 1.0, 1.0), "2 places: a grid"),
    "no pitch": (lambda: grid_of((Place((0.0,) * 3),), 1, 2, 1.0, 0.0), "2 columns are 0 mm apart"),
    "too many": (lambda: grid_of((Place((0.0,) * 3),), 99, 99, 1.0, 1.0), "allowed are 1 to"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_edit_is_refused_with_place_and_reason(name: str) -> None:
    """The draft stays as it was."""
    edit, said = REFUSED[name]
    with pytest.raises(TeachError, match=said):
        edit()


def test_places_are_read_as_they_are_printed() -> None:
    """The outer axis stands behind x, y and z, or is left out."""
    text = "310.643 0 -9.5 180\n-10 -510 -19.2"
    places = read_places(text, ROBOT)
    assert places == (Place((310.643, 0.0, -9.5), (180.0,)), Place((-10.0, -510.0, -19.2)))
    assert "\n".join(place.text for place in places) == text
    assert Place((-1e-5, 0.00006, -0.0)).text == "0 0.0001 0", "no zero has a sign"
    assert read_places(" \n", ROBOT) == ()
    with pytest.raises(TeachError, match="allowed are"):
        read_places("0 0 0\n" * (MOST_PLACES + 1), ROBOT)


def test_grid_goes_row_by_row_from_its_corner() -> None:
    """Columns along x, rows along y; three corners turn it and say how far it goes."""
    corner = Place((10.0, 20.0, 5.0), (90.0,))
    plain = [place.xyz_mm for place in grid_of((corner,), 2, 3, -7.0, 4.0)]
    assert plain == [(10.0 + 4 * c, 20.0 - 7 * r, 5.0) for r in range(2) for c in range(3)]
    turned = grid_of((corner, Place((10.0, 28.0, 5.0)), Place((4.0, 20.0, 11.0))), 4, 3, 0.0, 0.0)
    assert [place.xyz_mm for place in turned] == [
        (10.0 - 2 * r, 20.0 + 4 * c, 5.0 + 2 * r) for r in range(4) for c in range(3)
    ]
    assert {place.axes for place in turned} == {(90.0,)}


@pytest.mark.parametrize(("rows", "columns"), [(1, 3), (3, 1), (1, 1)])
def test_a_grid_of_one_row_has_no_way_to_the_next(rows: int, columns: int) -> None:
    """Nor one of one column to the next; three corners are three corners all the same."""
    corners = (Place((10.0, 20.0, 5.0)), Place((10.0, 28.0, 5.0)), Place((4.0, 20.0, 11.0)))
    made = [place.xyz_mm for place in grid_of(corners, rows, columns, 0.0, 0.0)]
    assert made == [
        (10.0 - 3 * r, 20.0 + 4 * c, 5.0 + 3 * r) for r in range(rows) for c in range(columns)
    ]


def test_a_part_is_lifted_as_fast_as_it_is_reached() -> None:
    """Both lines at the speed of lines, the way to above it at the speed of joints."""
    speeds = re.findall(r"([JL]) P\[.*?\] (\d+)", carried(1).text)
    assert speeds == [("J", "50"), ("L", "100"), ("L", "100")] * 2


def test_line_to_choose_is_the_last_that_was_added_within_its_loop() -> None:
    """Behind the line that was chosen, however long the draft was before."""
    before = teach.recorded(empty("MINE", ROBOT), ROBOT, 0, at(5.0), "J", FINE_50, None)
    one = teach.recorded(before, ROBOT, 0, at(6.0), "J", FINE_50, None)
    assert rounds.last_added(before, 0, one) == 1
    assert rounds.last_added(before, 1, teach.waiting(before, ROBOT, 1, 0.5)) == 2
    looped = rounds.recorded(before, ROBOT, 1, [at(7.0), at(8.0)], "J", FINE_50, None)
    number = rounds.last_added(before, 1, looped)
    assert number == len(looped.program.lines) - 1
