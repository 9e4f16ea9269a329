"""The real side's parts: held they move with the tool, on a stand with the table.

Drops and collisions are seen.
"""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.surroundings import Surface, WorkSurfaces
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.tp.executor import ProgramState
from harness.programs import program_of
from scara_config import ConfigError, load_robot
from scara_config.palletise import load_palletise
from scara_config.programs.steps import GripperStep

from fanuc_emulator import alarms

CONFIG = Path(__file__).parents[4] / "config"
ROBOT = load_robot(CONFIG)
WORK = load_palletise(CONFIG)
DT = 0.002
NAME, STAND, ANGLE, (X, Y) = WORK.picks()[0]


def joints(x: float, y: float, z: float, table: float) -> list[float]:
    """Return joint positions in the order of robot.yaml."""
    l1, l2, h = ROBOT.geometry.l1_mm / 1e3, ROBOT.geometry.l2_mm / 1e3, ROBOT.geometry.h_mm / 1e3
    q2 = math.acos((x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2))
    q1 = math.atan2(y, x) - math.atan2(l2 * math.sin(q2), l1 + l2 * math.cos(q2))
    return [q1, q2, z - h, 0.0, table]


@pytest.mark.parametrize(
    ("x", "y", "carried"),
    [(0.31, 0.3, True), (0.33, 0.3, False), (0.1, 0.41, True), (0.1, 0.43, False)],
)
def test_a_face_carries_what_is_near_its_edge(x: float, y: float, carried: bool) -> None:
    """Its two edges may be of different lengths."""
    assert Surface("pallet", 0.0, (0.1, 0.3), half=(0.2, 0.1)).carries(x, y, 0.02) is carried


class Bench:
    """Parts under a tool that is put anywhere."""

    def __init__(self) -> None:
        self.parts = CellParts(WORK, ROBOT)

    def be(
        self,
        x: float,
        y: float,
        z: float,
        suction: bool,
        seconds: float = 0.1,
        table: float = ANGLE,
    ) -> None:
        """Hold the tool there for a while."""
        for _ in range(round(seconds / DT)):
            self.parts.step(joints(x, y, z, table), suction, DT)

    def kinds(self) -> list[str]:
        """Return what has happened."""
        return [event.kind for event in self.parts.events]

    def pick(self) -> None:
        """Bring the first part into the air."""
        self.be(X, Y, WORK.pick_height, True)
        self.be(X, Y, 0.07, True)


@pytest.fixture
def bench() -> Bench:
    """Give all parts on their stands."""
    return Bench()


def test_part_is_carried_by_the_tool_and_lies_where_it_was_let_go(bench: Bench) -> None:
    """Gripped off the middle by 1 mm it also lies 1 mm off."""
    bench.be(X + 0.001, Y, WORK.pick_height, True)
    bench.be(X, Y, 0.07, True)
    x, y = WORK.pallet.places()[0]
    bench.be(x, y, WORK.place_height, True)
    bench.be(x, y, WORK.place_height, False)
    part = bench.parts.parts[0]
    assert bench.kinds() == ["gripped", "released", "placed"]
    assert part.on == "pallet"
    assert bench.parts.place(part) == pytest.approx(
        (x - 0.001, y, WORK.pallet.top_mm * 1e-3), abs=1e-9
    )


def test_parts_on_stands_turn_with_the_table_and_others_do_not(bench: Bench) -> None:
    """A quarter turn moves all nine; a part on the pallet stays."""
    bench.be(0.3, -0.3, 0.1, False, table=0.0)
    before = [bench.parts.place(part) for part in bench.parts.parts]
    bench.be(0.3, -0.3, 0.1, False, table=math.pi / 2)
    assert (
        min(math.dist(a, bench.parts.place(part)) for a, part in zip(before, bench.parts.parts))
        > 0.1
    )
    test_part_is_carried_by_the_tool_and_lies_where_it_was_let_go(bench)
    placed = bench.parts.place(bench.parts.parts[0])
    bench.be(0.3, -0.3, 0.1, False, table=0.3)
    assert bench.parts.place(bench.parts.parts[0]) == placed


@pytest.mark.parametrize(
    ("dx", "dz"), [(0.0, 0.002), (0.007, 0.0)], ids=["too high", "too far beside"]
)
def test_suction_grips_only_what_is_near_below(bench: Bench, dx: float, dz: float) -> None:
    """Beyond reach_mm or offset_mm there is no vacuum."""
    bench.be(X + dx, Y - dx, WORK.pick_height + dz, True, 0.5)
    assert bench.parts.held is None and bench.kinds() == []


@pytest.mark.parametrize(
    ("dy", "dz", "gripped"),
    [
        (0.0, 0.9e-3, True),
        (0.0, 1.1e-3, False),
        (0.0, -1.9e-3, True),
        (0.0, -2.1e-3, False),
        (-5.9e-3, 0.0, True),
        (-6.1e-3, 0.0, False),
    ],
)
def test_suction_reaches_as_far_as_its_figures(
    bench: Bench, dy: float, dz: float, gripped: bool
) -> None:
    """1.5 mm above and below the part's top, 6 mm beside its middle; the pick is at 0.5 mm."""
    bench.be(X, Y + dy, WORK.pick_height + dz, True)
    assert (bench.parts.held is not None) is gripped


HANGS = 0.0205
"""A held part's underside is so far below the tool [m]."""


@pytest.mark.parametrize(
    ("held", "dx", "dy", "z", "hit"),
    [
        # The part's top is at -10 mm and gives way by 8 mm, its radius is 12 mm.
        (False, 0.0, 0.0, -0.0181, "nozzle hit part_1"),
        (False, 0.0, 0.0, -0.0179, ""),
        (False, 0.0, -0.0119, -0.0190, "nozzle hit part_1"),
        (False, 0.0, -0.0121, -0.0190, ""),
        # The stand's top is at -30 mm, its middle 16.5 mm inwards, its radius 32 mm.
        (False, 0.0, 0.0165, -0.0306, "nozzle hit stand_1"),
        (False, 0.0, 0.0165, -0.0304, ""),
        (False, 0.0, 0.0165 - 0.0319, -0.0310, "nozzle hit stand_1"),
        (False, 0.0, 0.0165 - 0.0321, -0.0310, ""),
        (True, 0.0, 0.0, HANGS - 0.0381, "part_1 hit stand_1"),
        (True, 0.0, 0.0, HANGS - 0.0379, ""),
        # The middle of part_2 is 28.6 mm off, 14.3 mm to one side and 24.7 mm inwards.
        (True, 0.0143, 0.0247, HANGS - 0.0106, "part_1 hit part_2"),
        (True, 0.0143, 0.0247, HANGS - 0.0104, ""),
        (True, 0.0143, 0.0247 - 0.0238, HANGS - 0.0120, "part_1 hit part_2"),
        (True, 0.0143, 0.0247 - 0.0242, HANGS - 0.0120, ""),
    ],
)
def test_what_goes_too_deep_has_hit(
    bench: Bench, held: bool, dx: float, dy: float, z: float, hit: str
) -> None:
    """Half a millimetre into a face or a part, or more than the bellows gives way."""
    if held:
        bench.pick()
    bench.parts.events.clear()
    bench.be(X + dx, Y + dy, z, held, DT)
    assert [(event.kind, event.message) for event in bench.parts.events] == (
        [("collision", hit)] if hit else []
    )
    assert bench.parts.collisions == bool(hit)
    for event in bench.parts.events:
        assert event.part == hit[hit.find("part_") :][:6] * ("part_" in hit)
        assert event.position == pytest.approx((X + dx, Y + dy, z - HANGS * held), abs=1e-9)


@pytest.mark.parametrize(("deep", "hit"), [(0.4e-3, []), (0.6e-3, ["part_1 hit part_2"])])
def test_a_held_part_that_comes_from_below_hits_what_hangs_over_an_edge(
    bench: Bench, deep: float, hit: list[str]
) -> None:
    """Beside the pallet, by its top into the underside of a part there."""
    bench.pick()
    pallet, other = WORK.pallet, bench.parts.parts[1]
    edge, y = (pallet.middle_mm[0] + 0.5 * pallet.size_mm[0]) * 1e-3, pallet.middle_mm[1] * 1e-3
    other.on, other.turns = "pallet", False
    other.x, other.y, other.z = edge - 1e-3, y, pallet.top_mm * 1e-3
    top = pallet.top_mm * 1e-3 + deep
    bench.be(edge + WORK.parts.radius + 1e-3, y, top - WORK.parts.height + HANGS, True, DT)
    assert [event.message for event in bench.parts.events[1:]] == hit


@pytest.mark.parametrize(
    ("dx", "dy", "above", "kind", "on"),
    [
        (0.0, 0.0, 0.0049, "placed", "stand_1"),
        (0.0, 0.0, 0.0051, "dropped", "stand_1"),
        (0.0143, 0.0247 - 0.0238, 0.0201, "dropped", "part_2"),
        (0.0143, 0.0247 - 0.0242, 0.0049, "placed", "stand_1"),
    ],
)
def test_where_a_part_is_let_go_it_lies_on_what_is_below(
    bench: Bench, dx: float, dy: float, above: float, kind: str, on: str
) -> None:
    """A fall of more than 5 mm is a drop, and so is another part below; the text says on what."""
    bench.pick()
    bench.be(X + dx, Y + dy, HANGS - 0.03 + above, False)
    last = bench.parts.events[-1]
    assert (last.kind, bench.parts.drops) == (kind, kind == "dropped")
    assert last.message.endswith(f"on {on}")
    if kind == "dropped":
        fall = above - 0.02 * (on == "part_2")
        assert f"it fell {1e3 * fall:.1f} mm on" in last.message
    place = bench.parts.place(bench.parts.parts[0])
    assert place == pytest.approx((X + dx, Y + dy, -0.03 + 0.02 * (on == "part_2")), abs=1e-9)


def test_part_is_let_go_once_air_is_in_the_nozzle(bench: Bench) -> None:
    """That takes release_ms; suction that comes back before keeps the part."""
    bench.pick()
    release = WORK.gripper.release_ms * 1e-3
    bench.be(X, Y, 0.07, False, release - DT)
    bench.be(X, Y, 0.07, True, DT)
    bench.be(X, Y, 0.07, False, release - DT)
    assert bench.parts.held is not None
    bench.be(X, Y, 0.07, False, 2 * DT)
    assert bench.parts.held is None


def test_vacuum_over_a_part_just_let_go_takes_its_time_again(bench: Bench) -> None:
    """What was waited for the release does not count for the next grip."""
    bench.pick()
    bench.be(X, Y, WORK.pick_height, True)
    release, vacuum = WORK.gripper.release_ms * 1e-3, WORK.gripper.vacuum_ms * 1e-3
    steps = 0
    while bench.parts.held is not None:
        bench.be(X, Y, WORK.pick_height, False, DT)
        steps += 1
        assert steps <= round(release / DT) + 1
    bench.be(X, Y, WORK.pick_height, True, vacuum - 2 * DT)
    assert bench.parts.held is None
    bench.be(X, Y, WORK.pick_height, True, 3 * DT)
    assert bench.parts.held is not None


@pytest.mark.parametrize("beside", [(0.51, 0.0), (-0.51, 0.0), (0.0, 0.51), (0.0, -0.51)])
def test_beside_the_pallet_nothing_lies_on_it(beside: tuple[float, float]) -> None:
    """It ends half of its size from its middle."""
    (width, depth), (x, y) = WORK.pallet.size_mm, WORK.pallet.middle_mm
    edge = (x + beside[0] * width) * 1e-3, (y + beside[1] * depth) * 1e-3
    around = WorkSurfaces(WORK)
    assert around.below(x * 1e-3, y * 1e-3, 1.0, 0.0).name == "pallet"
    assert around.below(*edge, 1.0, 0.0).name != "pallet"


def test_part_let_go_in_the_air_was_dropped(bench: Bench) -> None:
    """The event says how far and on what."""
    bench.pick()
    bench.be(X, Y, 0.07, False)
    assert bench.kinds() == ["gripped", "released", "dropped"]
    assert bench.parts.drops == 1
    assert "fell 79.5 mm on stand_1" in bench.parts.message


def test_held_part_run_into_a_stand_is_one_collision(bench: Bench) -> None:
    """It is counted once until the two are apart, and again then."""
    bench.pick()
    for count in (1, 2):
        bench.be(X, Y, WORK.pick_height - 0.01, True)
        bench.be(X, Y, 0.07, True)
        assert bench.parts.collisions == count
    assert {"collision"} == {event.kind for event in bench.parts.events} - {"gripped"}


def controller(steps: tuple[GripperStep, ...]) -> Controller:
    """Return a robot with parts and one program as RSR2, at home above stand 1.

    Nothing is near enough to be gripped.
    """
    config = load_emulator(ROBOT, CONFIG)
    made = Controller(config, ROBOT, {2: program_of("GRIP", steps)}, 0.0, CellParts(WORK, ROBOT))
    made.write_input("rsr2", True)
    return made


def run(robot: Controller, seconds: float) -> Snapshot:
    """Let time pass."""
    for _ in range(round(seconds / DT)):
        robot.step()
    return robot.snapshot()


def test_program_waits_for_the_vacuum_and_pauses_with_an_alarm() -> None:
    """Nothing gripped is no reason to go on; the output stays as commanded."""
    now = run(controller((GripperStep(1, True),)), 0.7)
    assert now.program_state is ProgramState.PAUSED
    assert now.alarm is not None
    assert now.alarm.code is alarms.NO_VACUUM
    assert "RI[1] is not ON in line 2" in now.alarm.cause
    assert now.outputs.gripper and not now.outputs.vacuum


def test_only_a_command_opens_the_gripper() -> None:
    """Neither hold, emergency stop nor the program's end does; each write of the coil does."""
    robot = controller((GripperStep(1, True),))
    run(robot, 0.2)
    for name, level in (("hold", False), ("imstp", False), ("cstopi", True)):
        robot.write_input(name, level)
        assert run(robot, 0.2).outputs.gripper
    robot.write_input("gripper", False)
    assert not robot.snapshot().outputs.gripper
    robot.write_input("gripper", True)
    assert robot.snapshot().outputs.gripper


def test_shipped_program_places_nine_parts() -> None:
    """PALLETISE by the robot alone: all on their places, without a collision or a drop."""
    parts = CellParts(WORK, ROBOT)
    robot = Controller(
        load_emulator(ROBOT, CONFIG), ROBOT, load_programs(ROBOT, CONFIG), 0.0, parts
    )
    robot.write_override(100)
    robot.write_input("rsr4", True)
    run(robot, 0.1)
    for _ in range(round(60.0 / DT)):
        if robot.step().program_state is ProgramState.ABORTED:
            break
    assert robot.snapshot().alarm is None
    off = [
        math.dist(parts.place(part)[:2], place) * 1e3
        for part, place in zip(parts.parts, WORK.pallet.places())
    ]
    assert [part.on for part in parts.parts] == ["pallet"] * 9
    assert max(off) < WORK.task.tolerance_mm
    assert (parts.collisions, parts.drops) == (0, 0)


def test_a_robot_without_a_table_is_told_to_have_no_stands() -> None:
    """In words: the parts turn with what is not there."""
    four = msgspec.structs.replace(ROBOT, joints=ROBOT.joints[:4])
    with pytest.raises(
        ConfigError, match=r"table.joint: robot.yaml has no table_joint: remove the file"
    ):
        CellParts(WORK, four)
