"""The 80 % rule, by the real robot's ground truth, whatever leads it by the stream.

Real core, stand-in and simulator, with and without a late machine. Speeds are finite differences
of the robot's true positions; 1 % is left for measuring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from harness.running.thorough import SEARCH, thorough
from harness.scenes.troubled import TroubledCell, desk_files, fastest_percent
from harness.scenes.truth import farthest_apart_mm

MOST_PERCENT = 81.0
FAR, BACK = (1.2, 1.0, -0.10, 0.8), (-1.0, -1.0, -0.15, -0.8)
Act = Callable[[TroubledCell], None]


def ready(**options: float) -> TroubledCell:
    """Give an idle cell whose robot runs at its full override."""
    cell = TroubledCell(desk_files("fanuc_sr6ia"), **options)  # type: ignore[arg-type]
    cell.real.robot.write_override(100)
    cell.connect()
    cell.schedule.run(1.0)
    return cell


@pytest.fixture
def cell() -> Iterator[TroubledCell]:
    """Give an idle cell on a machine that is never late."""
    with ready() as made:
        yield made


def long_moves(cell: TroubledCell, trouble: Act | None = None, both: bool = True) -> None:
    """Let the operator move both at 100 %; ``trouble`` comes at the largest speed.

    Far and, with ``both``, back all the way by the other side of home.
    """
    for target in (FAR, BACK) if both else (FAR,):
        answer = cell.operate("MOVE_JOINTS", target=target, speed_percent=100.0)
        assert answer.success, answer.message
        if trouble is not None:
            cell.schedule.run(0.42)
            trouble(cell)
        cell.wait_whatever(lambda: cell.mode == "OPERATOR_LEADS", 2.0, "OPERATOR_LEADS")
        cell.wait_whatever(lambda: cell.mode != "OPERATOR_LEADS", 15.0, "the end of the move")
        if cell.mode != "IDLE":
            return
        cell.wait_still(0.3)


def test_moves_at_full_speed_stay_below_80_percent_and_together(cell: TroubledCell) -> None:
    """The twin is capped so far below that the robot keeps up: within 0.3 % of its reach."""
    begun = cell.schedule.now
    long_moves(cell)
    assert 70.0 < fastest_percent(cell, begun) <= MOST_PERCENT
    rows = [[row for row in side.truth if row[0] >= begun] for side in (cell.real, cell.twin)]
    assert farthest_apart_mm(*rows) < 2.0


@pytest.mark.parametrize(
    "options",
    [
        *thorough({"late_write": 0.005}),
        {"late_write": 0.02},
        *thorough({"late_answer": 0.025}, {"clock_jitter": 0.002}),
    ],
    ids=["packets 5 ms late", "packets 20 ms late", "answers 25 ms late", "clocks off by 2 ms"],
)
def test_a_late_wire_makes_the_robot_no_faster(options: dict[str, float]) -> None:
    """What comes late is made up for within the limit, and the pair stays together."""
    with ready(**options) as cell:
        begun = cell.schedule.now
        long_moves(cell, both=SEARCH)
        assert cell.mode == "IDLE"
        assert 70.0 < fastest_percent(cell, begun) <= MOST_PERCENT


@pytest.mark.parametrize(
    "trouble",
    [
        *thorough(lambda cell: cell.stand_controller(0.1), lambda cell: cell.stand_controller(0.3)),
        lambda cell: cell.stand_robot(0.1),
    ],
    ids=["controller 0.1 s", "controller 0.3 s", "robot 0.1 s"],
)
def test_who_stood_still_catches_up_no_faster_than_allowed(
    cell: TroubledCell, trouble: Act
) -> None:
    """At the largest speed; where the pair is stopped instead, that is no speed either."""
    begun = cell.schedule.now
    long_moves(cell, trouble, both=SEARCH)
    assert 40.0 < fastest_percent(cell, begun) <= MOST_PERCENT


@pytest.mark.parametrize(
    ("joint", "percent"), [("joint_1", 100.0), *thorough(("joint_2", 82.0), ("table_joint", 100.0))]
)
def test_direct_velocities_lead_the_robot_no_faster_than_allowed(
    cell: TroubledCell, joint: str, percent: float
) -> None:
    """Past all motion nodes, at the joint's largest speed."""
    begun = cell.schedule.now
    velocity = 1e-2 * percent * cell.files.robot.joint(joint).velocity
    for _ in range(40):
        cell.twin.command_velocity(joint, velocity)
        cell.schedule.run(0.01)
    cell.twin.command_velocity(joint, 0.0)
    cell.schedule.run(2.0)
    assert 60.0 < fastest_percent(cell, begun) <= MOST_PERCENT


@pytest.mark.parametrize(
    ("joint", "position"), [("joint_3", -0.02), *thorough(("joint_1", 1.5), ("table_joint", 1.5))]
)
def test_direct_positions_lead_the_robot_no_faster_than_allowed(
    cell: TroubledCell, joint: str, position: float
) -> None:
    """A step of the position command; each joint can reach its largest speed on the way."""
    begun = cell.schedule.now
    cell.twin.command_position(joint, position)
    cell.schedule.run(2.5)
    assert 60.0 < fastest_percent(cell, begun) <= MOST_PERCENT


@pytest.mark.parametrize("cap", [20.0, *thorough(50.0)])
def test_jogs_and_direct_commands_obey_the_operators_speed(cell: TroubledCell, cap: float) -> None:
    """SPEED caps all motion, past the motion nodes too, and the pair stays together."""
    assert cell.operate("SPEED", speed_percent=cap).success
    cell.schedule.run(1.0)
    begun = cell.schedule.now
    velocity = cell.files.robot.joint("joint_1").velocity
    for _ in range(40):
        cell.twin.command_velocity("joint_1", velocity)
        cell.schedule.run(0.01)
    cell.schedule.run(2.5)
    assert cell.mode == "IDLE", cell.why
    cell.twin.command_position("joint_3", -0.02)
    cell.schedule.run(2.5)
    assert cell.mode == "IDLE", cell.why
    # The robot's drives overshoot by up to 2 %; the twin's by nothing but rounding.
    assert 0.5 * cap < fastest_percent(cell, begun) <= cap + 2.0
    twins = [abs(row[2][0]) / velocity for row in cell.twin.truth if row[0] >= begun]
    assert max(twins) <= 1e-2 * cap + 1e-6


def test_a_cap_that_falls_slows_a_direct_command_at_once(cell: TroubledCell) -> None:
    """A command that is under way obeys too."""
    joint = cell.files.robot.joint("table_joint")
    cell.twin.command_position("table_joint", 2.5)
    cell.schedule.run(0.5)
    assert cell.operate("SPEED", speed_percent=20.0).success
    cell.schedule.run(0.5)
    begun = cell.schedule.now
    cell.schedule.run(0.5)
    speeds = [abs(row[2][3]) / joint.velocity for row in cell.twin.truth if row[0] >= begun]
    assert 0.1 < max(speeds) <= 0.2
    assert fastest_percent(cell, begun) <= 21.0
