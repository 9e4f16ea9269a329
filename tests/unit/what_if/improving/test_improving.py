"""A quicker program: what is changed, what is left alone, and what speaks against it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.tp.rehearsal import rehearse
from harness.yaml_files import CONFIG
from scara_config import Robot
from scara_config.programs.files import Taught, program_files, read_listing, taught_of
from scara_config.programs.steps import Step
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import MotionLine, Program
from scara_config.robot import KeepOut
from what_if.errors import WhatIfError
from what_if.improving.choices import (
    Choice,
    Corner,
    Height,
    Order,
    Speed,
    Usual,
    Way,
    chosen,
    with_coordinates,
    with_positions,
)
from what_if.improving.descent import descend
from what_if.improving.finding import Motion, heights_of, motions_of, rounds_of
from what_if.improving.improve_io import Improver, result_of
from what_if.improving.trying import Bench
from what_if.improving.ways import ways_of
from what_if.judging import judge
from what_if.verdict import Outcome
from what_if.world import World

PALLETISE = program_files(CONFIG)["PALLETISE"]
HEAD = """/PROG  {name}
/MN
{lines}
/POS
{positions}
/END
"""
POSITION = """P[{number}]{{
   GP1:
  UF : 0, UT : 1,
  J1= {j1} deg, J2= 70 deg, J3= {j3} mm, J4= 0 deg, E1= 0 deg
}};"""
OVER_AND_LOW = {1: (-90, -20), 2: (-90, -60), 3: (-30, -20), 4: (-30, -60)}
"""Two places beside each other, each with a position 40 mm above it: J1, J3."""
THERE = (1, 2, 1, 3, 4, 3)


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Give a function that writes a program."""

    def written(name: str, *lines: str) -> Path:
        shown = "\n".join(f"{k:4d}:{line} ;" for k, line in enumerate(lines, start=1))
        positions = "\n".join(
            POSITION.format(number=number, j1=j1, j3=j3)
            for number, (j1, j3) in OVER_AND_LOW.items()
        )
        path = tmp_path / f"{name}.LS"
        path.write_text(HEAD.format(name=name, lines=shown, positions=positions))
        return path

    return written


def to_and_fro(speed: int, ending: str = "FINE") -> list[str]:
    """Return lines that go down at two places."""
    return [f"J P[{number}] {speed}% {ending}" for number in THERE]


def of_kind(improver: Improver, kind: type[Choice]) -> list[Choice]:
    """Return the choices of one kind."""
    return [choice for choice in improver.choices if isinstance(choice, kind)]


def result(improver: Improver) -> Program:
    """Return what the first descent comes to."""
    return result_of(improver, improver.descended(0, 0), improver.program.name)


def speeds(program: Program) -> list[object]:
    """Return the speeds of all motions."""
    return [line.speed for line in program.lines if isinstance(line, MotionLine)]


def test_a_slow_line_is_sped_up_and_remarks_stay(world: World, write: Callable[..., Path]) -> None:
    """One of three is slow; its speed alone saves most, and no other line is touched by hand."""
    lines = ("!to the shelf", "J P[1] 100% FINE", "J P[3] 3% FINE", "J P[1] 100% FINE")
    improver = Improver(world, write("SLOW", *lines), CONFIG)
    assert improver.choices == [Speed(3, 3.0, "%")]
    found = improver.descended(0, 0)
    assert found.seconds < 0.3 * improver.bench.verdict.duration_s
    program = result_of(improver, found, "SLOW_2")
    assert program.lines[0] == improver.program.lines[0] and program.name == "SLOW_2"
    (change,) = improver.changes(found)
    assert change.what == "line 3: speed" and change.was == "3 %"
    assert change.saves == pytest.approx(improver.bench.verdict.duration_s - found.seconds)


def test_a_zone_between_two_points_keeps_the_way_high(
    world: World, write: Callable[..., Path]
) -> None:
    """Without it the way is as low as the places allow; with it no lower than 10 mm above."""
    path = write("HIGH", *to_and_fro(100))
    free = Improver(replace(world, zones=()), path, CONFIG)
    assert [height.positions for height in of_kind(free, Height)] == [(1,), (3,)]  # type: ignore[union-attr]
    heights = dict(zip(free.choices, free.descended(0, 0).values))
    assert [heights[height] for height in of_kind(free, Height)] == [35.0, 35.0]
    # Half way between the two places; the tool passes 140 mm above the base with J3 at -20 mm.
    zone = KeepOut("shelf", (460.0, -262.0, 0.0), (480.0, -240.0, 100.0))
    held = Improver(replace(world, zones=(zone,)), path, CONFIG)
    values = dict(zip(held.choices, held.descended(0, 0).values))
    lowered = [values[height] or 0.0 for height in of_kind(held, Height)]
    assert min(lowered) <= 30.0, lowered
    assert "zone" in held.bench.against(free_program(free))


def free_program(improver: Improver) -> Program:
    """Return the program with all positions as low as the places allow."""
    heights = of_kind(improver, Height)
    return chosen(improver.program, heights, [height.values(None)[0] for height in heights])


def rehearsed(program: Program, robot: Robot) -> tuple[Taught, list[Step], list[Motion]]:
    """Return a program, what it does and its motions."""
    taught = taught_of(program, robot, program.name)
    steps = list(rehearse(taught, robot, {}))
    return taught, steps, motions_of(taught, steps)


def may_be_lower(program: Program, robot: Robot) -> list[tuple[int, ...]]:
    """Return the positions of a program that may lie lower."""
    taught, _, motions = rehearsed(program, robot)
    return [height.positions for height in heights_of(taught, motions, robot)]


def test_a_joint_that_counts_down_tells_no_height(world: World, write: Callable[..., Path]) -> None:
    """Its larger coordinate is the lower place: what was touched would be raised from the part."""
    program, robot = read_listing(write("DOWN", *to_and_fro(100))), world.cell.robot
    assert may_be_lower(program, robot) == [(1,), (3,)]
    negated = partial(with_coordinates, changes={"J3": lambda value: -value})
    third = msgspec.structs.replace(
        robot.joints[2], lower_mm=0.0, upper_mm=210.0, screw_axis=(0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    )
    down = msgspec.structs.replace(robot, joints=[*robot.joints[:2], third, *robot.joints[3:]])
    assert may_be_lower(with_positions(program, dict.fromkeys(OVER_AND_LOW, negated)), down) == []


@pytest.mark.parametrize(
    ("first", "there", "lower"),
    [
        (["!P[1]"], ["R[1]=1"], [(1,), (3,)]),
        ([], ["DO[1]=ON"], [(3,)]),
        ([], ["WAIT .50(sec)"], [(3,)]),
        (["PR[10]=P[1]"], [], [(3,)]),
        (["R[1]=1", "PR[10]=P[R[1]]"], [], []),
    ],
)
def test_a_height_on_which_more_than_motions_depends_stays(
    world: World,
    write: Callable[..., Path],
    first: list[str],
    there: list[str],
    lower: list[tuple[int, ...]],
) -> None:
    """An output that is set there, a dwell, a line that reads its numbers."""
    begin, *rest = to_and_fro(50)
    program = read_listing(write("STAYS", *first, begin, *there, *rest))
    assert may_be_lower(program, world.cell.robot) == lower


def test_a_place_whose_numbers_a_line_reads_stays(world: World) -> None:
    """Neither its round nor its table and elbow are others; its neighbours' are."""
    program, robot = read_listing(PALLETISE), world.cell.robot
    taught, steps, motions = rehearsed(program, robot)
    assert rounds_of(taught.flow, motions)
    assert ways_of(world, taught, steps, motions)[0].title == "pick 1, pick 2, pick 3: table, elbow"
    lines = (read_line("PR[10]=P[21]"), *program.lines)
    taught, steps, motions = rehearsed(msgspec.structs.replace(program, lines=lines), robot)
    assert not rounds_of(taught.flow, motions)
    assert ways_of(world, taught, steps, motions)[0].title == "pick 2, pick 3: table, elbow"


def test_a_weak_joint_is_not_overdriven(world: World, write: Callable[..., Path]) -> None:
    """A joint that has just the effort of the slow program gets no more speed."""
    path = write("WEAK", "J P[1] 50% FINE", "J P[3] 50% FINE", "J P[1] 50% FINE")
    strong = Improver(world, path, CONFIG)
    need = strong.bench.verdict.joints[0].effort_percent
    assert result(strong) != strong.program
    robot = world.cell.robot
    first = robot.joints[0]
    weak = msgspec.structs.replace(first, effort=first.effort * need / 100.0 * 1.0001)
    poor = msgspec.structs.replace(robot, joints=[weak, *robot.joints[1:]])
    held = Improver(replace(world, cell=replace(world.cell, robot=poor)), path, CONFIG)
    assert held.bench.verdict.joints[0].effort_percent == pytest.approx(100.0, abs=0.1)
    assert "joint_1 would need" in held.bench.against(result(strong))
    assert speeds(result(held)) != speeds(result(strong))
    assert held.bench.against(result(held)) == ""


def test_a_corner_makes_no_joint_too_fast(world: World, write: Callable[..., Path]) -> None:
    """Nor faster than it was, where it was too fast before."""
    lines = ("J P[1] 100% FINE", "J P[3] 100% CNT{} ACC50", "J P[2] 100% FINE")
    rounded = {}
    for cnt in (0, 90, 100):
        program = read_listing(write("FAST", *(line.format(cnt) for line in lines)))
        turned = {
            number: partial(with_coordinates, changes={"J1": lambda _, j1=j1: j1})
            for number, j1 in {1: -60.0, 3: 50.0, 2: 130.0}.items()
        }
        rounded[cnt] = with_positions(program, turned)
    said = Bench(world, rounded[0], {}).against(rounded[100])
    assert "joint_1 would be at" in said and "of its speed in the corner" in said
    limited = Bench(world, rounded[90], {})
    assert limited.verdict.outcome is Outcome.LIMITED
    said = limited.against(rounded[100])
    assert "joint_1 would have" in said and said.endswith(" % of its speed")
    assert limited.against(rounded[90]) == ""


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_program(world: World, write: Callable[..., Path]) -> None:
    """Also from a drawn beginning."""
    path = write("SEED", *to_and_fro(30))
    one, two = (Improver(world, path, CONFIG).descended(1, 5) for _ in range(2))
    assert one == two
    found = Improver(world, path, CONFIG).search(2, 5, 1, lambda: None)
    assert one in found and found[0].seconds <= found[1].seconds


def test_what_a_person_decided_about_touching_stays(world: World) -> None:
    """Of PALLETISE: waits, the touching lines 9 and 17, the corners and heights before them."""
    improver = Improver(world, PALLETISE, CONFIG)
    assert [each.line for each in of_kind(improver, Speed)] == [7, 8, 14, 15, 16, 22]  # type: ignore[union-attr]
    assert [each.line for each in of_kind(improver, Corner)] == [7, 14, 15, 22]  # type: ignore[union-attr]
    over, above = of_kind(improver, Height)
    assert (over.positions, above.positions) == (tuple(range(1, 10)), tuple(range(31, 40)))  # type: ignore[union-attr]
    (order,) = of_kind(improver, Order)
    last_first = order.applied(improver.program, tuple(range(8, -1, -1)))
    assert last_first.lines == improver.program.lines
    places = {each.number: each for each in last_first.positions}
    assert (places[1].comment, places[21].comment, places[59].comment) == (
        "over 9",
        "pick 9",
        "place 1",
    )
    assert improver.bench.against(order.applied(improver.program, (*range(7), 8, 7))) == ""


def test_a_place_on_the_table_turns_with_it(world: World) -> None:
    """Picked with the table elsewhere, or with the other elbow, all parts come to their places."""
    improver = Improver(world, PALLETISE, CONFIG)
    ways = [way for way in improver.choices if isinstance(way, Way)]
    assert [way.title for way in ways[:2]] == [
        "pick 1, pick 2, pick 3: table, elbow",
        "place 1, place 2, place 3: elbow",
    ]
    assert (ways[0].was, ways[0].mirrored) == ("-90.0 deg, righty", "-90.0 deg, lefty")
    placed = sorted(improver.bench.verdict.placed)
    assert len(placed) == 9
    for way, value in ((ways[0], "-130.0 deg, righty"), (ways[1], "lefty")):
        verdict = judge(world, improver.bench.motion(way.applied(improver.program, value)))
        assert sorted(verdict.placed) == placed, verdict.sentence
    # The places of the pallet do not turn, but the table stays where it is meanwhile.
    written, turned = (
        joints_of(improver.program),
        joints_of(ways[0].applied(improver.program, "-130.0 deg, righty")),
    )
    assert {turned[number]["E1"] for number in (1, 11, 21, 31, 41, 51)} == {-130.0}
    assert turned[1]["J1"] != written[1]["J1"] and turned[31]["J1"] == written[31]["J1"]
    assert turned[4] == written[4]


def joints_of(program: Program) -> dict[int, dict[str, float | None]]:
    """Return the coordinates of each position by name."""
    return {
        place.number: {each.name: each.value for each in place.groups[0].coordinates}
        for place in program.positions
    }


def test_a_place_of_a_program_that_is_called_stays(world: World) -> None:
    """What it grips there is placed by this one's own lines, and that place may be others'."""
    whole, robot = read_listing(PALLETISE), world.cell.robot
    there = ["J P[21] 4% FINE", "RO[1]=ON", "WAIT RI[1]=ON", "J P[1] 20% FINE"]
    own = ["J P[1] 50% FINE", "CALL PICK", "J P[31] 50% FINE", "J P[51] 4% FINE", "RO[1]=OFF"]
    pick, main = (
        taught_of(msgspec.structs.replace(whole, name=name, lines=tuple(lines)), robot, name)
        for name, lines in (("PICK", map(read_line, there)), ("MAIN", map(read_line, own)))
    )
    steps = list(rehearse(main, robot, {"PICK": pick}))
    (way,) = ways_of(world, main, steps, motions_of(main, steps))
    assert way.title == "place 1: elbow"


def test_where_no_part_is_touched_the_arm_goes_as_it_was_taught(world: World) -> None:
    """How the tool is turned may matter there."""
    improver = Improver(world, program_files(CONFIG)["TWO_POINT"], CONFIG)
    assert not any(isinstance(choice, Way) for choice in improver.choices)


def test_parts_that_would_come_elsewhere_speak_against_a_program(world: World) -> None:
    """A place 5 mm aside is another place."""
    improver = Improver(world, PALLETISE, CONFIG)
    lines = improver.program.lines
    swapped = msgspec.structs.replace(
        improver.program, lines=(lines[0], *lines[1:5], lines[4], *lines[6:])
    )
    assert improver.bench.against(swapped)


@pytest.mark.parametrize(
    ("line", "corner"),
    [("R[1]=1", True), ("DO[1]=ON", False), ("WAIT .10(sec)", False), ("CALL TWO_POINT", False)],
)
def test_a_corner_is_rounded_where_only_motions_follow(
    world: World, write: Callable[..., Path], line: str, corner: bool
) -> None:
    """An output is set where the robot stands."""
    path = write("CORNER", "J P[1] 100% CNT0", line, "J P[3] 100% FINE")
    assert bool(of_kind(Improver(world, path, CONFIG), Corner)) is corner


def test_acc_becomes_what_is_usual_and_no_more(world: World, write: Callable[..., Path]) -> None:
    """ACC 40 goes; nothing is driven harder than without ACC."""
    path = write("ACC", "J P[1] 100% FINE", "J P[3] 100% FINE ACC40", "J P[1] 100% FINE ACC120")
    improver = Improver(world, path, CONFIG)
    assert improver.choices == [Usual(2, 40.0)]
    second = result(improver).lines[1]
    assert isinstance(second, MotionLine) and second.options == ()


def test_a_program_that_is_refused_itself_is_no_beginning(
    world: World, write: Callable[..., Path]
) -> None:
    """It is mended first."""
    zone = KeepOut("here", (0.0, -650.0, 0.0), (650.0, 0.0, 400.0))
    with pytest.raises(WhatIfError, match="NOGO is refused itself: REFUSED at"):
        Improver(replace(world, zones=(zone,)), write("NOGO", *to_and_fro(50)), CONFIG)


def test_of_two_values_the_quickest_that_is_allowed_is_taken() -> None:
    """And what another choice makes needless is not changed."""
    program = Program("X", tuple(MotionLine("J", (), 10.0, "%") for _ in range(2)))
    choices = [Speed(1, 10.0, "%"), Speed(2, 10.0, "%")]

    def seconds(tried: Program) -> float:
        first, second = speeds(tried)
        return 10.0 / float(first) + (0.001 if float(second) > 10.0 else 0.002)  # type: ignore[arg-type]

    def allowed(tried: Program) -> bool:
        return float(speeds(tried)[0]) <= 65.0  # type: ignore[arg-type]

    found = descend(program, choices, [None, None], [1, 0], seconds, allowed)
    assert found.values == [65.0, None]
    assert found.seconds == pytest.approx(10.0 / 65.0 + 0.002)
