"""Parts as bodies: gripped, carried, placed, dropped, hit.

Asleep they stay exactly where they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from scara_config import load_robot
from scara_config.palletise import load_palletise
from scara_config.payload import Payload
from scara_control.kinematics.scara import Elbow, Scara, solve_elbow
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.handling.part_world_io import PartWorld
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, Timing

ROOT = Path(__file__).parents[4]
ROBOT = load_robot(ROOT / "config")
CONFIG = load_simulation(ROBOT, ROOT / "config")
WORK = load_palletise(ROOT / "config")
NAMES = [joint.name for joint in ROBOT.twin_joints]
URDF = ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf"
NAME, STAND, ANGLE, (X, Y) = WORK.picks()[0]
ABOVE = WORK.task.travel_mm * 1e-3


class Cell:
    """A world under the shipped control, moved joint by joint."""

    def __init__(self) -> None:
        self.world = PartWorld(
            URDF, NAMES, ROBOT.tool_frame, dt=CONFIG.dt, gravity=CONFIG.gravity_m_s2, work=WORK
        )
        models = joint_models(ROBOT, CONFIG, self.world.damping, self.world.friction)
        start = ROBOT.home_positions
        control = JointControl(
            models,
            load_gains(ROBOT, ROOT / "config"),
            start,
            CONFIG.dt,
            self.world.inverse_dynamics,
            CONFIG.tracking_bandwidth_rad_s,
        )
        self.simulation = Simulation(self.world, control, start, Timing(CONFIG.step_ns, 0, 5, 50))

    def go(self, x: float, y: float, z: float, table: float, seconds: float) -> None:
        """Let the tool go there along the joints' own paths, and wait."""
        solution = solve_elbow(Scara.from_robot(ROBOT), x, y, z, Elbow.RIGHTY)
        for name, value in zip(NAMES, [*solution, table], strict=True):
            self.simulation.control.command_position(name, float(value))
        self.wait(seconds)

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self.simulation.advance(round(seconds / CONFIG.dt))

    def pick(self) -> None:
        """Bring the first part into the air."""
        self.go(X, Y, ABOVE, ANGLE, 1.5)
        self.go(X, Y, WORK.pick_height, ANGLE, 0.6)
        self.world.grip(True)
        self.wait(0.1)
        self.go(X, Y, ABOVE, ANGLE, 0.5)

    def events(self) -> list[tuple[str, str]]:
        """Return (kind, part) of everything that has happened."""
        return [(happened.kind, happened.part) for _, happened in self.world.happened]

    def place(self, name: str) -> tuple[float, float, float]:
        """Return where the middle of a part is."""
        self.wait(0.05)
        return next(part.position for part in self.world.now.parts if part.name == name)


@pytest.fixture
def cell() -> Iterator[Cell]:
    """Give the shipped cell with its parts."""
    made = Cell()
    yield made
    made.world.close()


def carry(cell: Cell) -> tuple[float, float, float]:
    """Carry the first part to the first place and return where it lies then."""
    cell.pick()
    x, y = WORK.pallet.places()[0]
    cell.go(x, y, ABOVE, ANGLE, 1.2)
    cell.go(x, y, WORK.place_height, ANGLE, 0.6)
    cell.world.grip(False)
    cell.wait(0.1)
    cell.go(x, y, ABOVE, ANGLE, 0.5)
    return cell.place(NAME)


def test_part_is_carried_to_its_place_the_same_way_each_time(cell: Cell) -> None:
    """Within half a millimetre, gripped, released, placed; bitwise the same in another world."""
    first = carry(cell)
    x, y = WORK.pallet.places()[0]
    assert math.dist(first[:2], (x, y)) < WORK.task.tolerance_mm * 1e-3
    assert cell.events() == [("gripped", NAME), ("released", NAME), ("placed", NAME)]
    other = Cell()
    with other.world:
        assert carry(other) == first


def test_reset_takes_the_part_off_the_gripper_and_back_to_its_stand(cell: Cell) -> None:
    """As at the start, also in the middle of a carry; and it works again."""
    start = cell.place(NAME)
    cell.pick()
    cell.simulation.reset()
    assert cell.place(NAME) == pytest.approx(start, abs=1e-9)
    assert not cell.world.suction.held
    cell.world.grip(False)
    x, y = WORK.pallet.places()[0]
    assert math.dist(carry(cell)[:2], (x, y)) < WORK.task.tolerance_mm * 1e-3


def test_what_sets_the_twin_right_leaves_the_suction_as_it_was_commanded(cell: Cell) -> None:
    """Off is passed on: the real robot would drop its part."""
    cell.world.grip(True)
    cell.wait(0.1)
    assert cell.world.put_parts_back() == "" and cell.world.suction.commanded
    cell.world.mount(Payload(2, "part", 0.5))
    assert cell.world.suction.commanded
    cell.simulation.reset()
    assert cell.world.suction.commanded


def test_part_let_go_in_the_air_is_reported_as_dropped_once(cell: Cell) -> None:
    """A dropped part is seen, not ignored."""
    cell.pick()
    cell.world.grip(False)
    cell.wait(1.0)
    assert [event for event in cell.events() if event[0] == "dropped"] == [("dropped", NAME)]
    assert ("placed", NAME) not in cell.events()


def test_held_part_swept_through_a_stand_is_a_collision(cell: Cell) -> None:
    """What the arm carries may touch stands from above only."""
    cell.pick()
    cell.go(X, Y - 0.08, ABOVE, ANGLE, 0.6)
    cell.go(X, Y - 0.08, WORK.pick_height - 0.02, ANGLE, 0.6)
    cell.go(X, Y + 0.02, WORK.pick_height - 0.02, ANGLE, 0.6)
    assert ("collision", NAME) in cell.events()


def test_suction_grips_nothing_that_is_not_near_below_it(cell: Cell) -> None:
    """Gripping from afar would hide a wrong height."""
    cell.go(X, Y, WORK.pick_height + 0.004, ANGLE, 1.5)
    cell.world.grip(True)
    cell.wait(0.3)
    assert cell.world.suction.commanded and not cell.world.suction.held


def test_sleeping_parts_turn_with_the_table_and_come_back_exactly(cell: Cell) -> None:
    """Sleep is no drift: a turn there and back leaves each part where it was on its stand."""
    cell.go(0.3, -0.3, 0.1, 0.0, 1.0)
    before = [part.position for part in cell.world.now.parts]
    cell.go(0.3, -0.3, 0.1, math.pi / 2, 1.5)
    turned = [part.position for part in cell.world.now.parts]
    cell.go(0.3, -0.3, 0.1, 0.0, 1.5)
    after = [part.position for part in cell.world.now.parts]
    assert min(math.dist(a, b) for a, b in zip(before, turned)) > 0.1
    assert max(math.dist(a, b) for a, b in zip(before, after)) < 2e-5
    assert cell.events() == []


def test_what_the_arm_touches_is_told_while_it_does(cell: Cell) -> None:
    """A tool that stands on a part gently is no collision, but may be why a pose is not reached."""
    cell.go(X, Y, ABOVE, ANGLE, 1.5)
    assert cell.world.now.touches == ""
    cell.go(X, Y, WORK.pick_height - 0.002, ANGLE, 0.8)
    assert NAME in cell.world.now.touches and " touches " in cell.world.now.touches
    cell.go(X, Y, ABOVE, ANGLE, 1.0)
    assert cell.world.now.touches == ""
