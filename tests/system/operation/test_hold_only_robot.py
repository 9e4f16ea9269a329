"""A stranger's robot that only HOLD stops: it leads, follows, stops, recovers and goes on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.live_cell import LiveCell, forward
from harness.opponents.hold_only_robot import PAUSED, STREAM, HoldOnlyRobot
from harness.processes import wait_until
from harness.running.thorough import examples
from harness.wires.gateway_client import command_over
from harness.yaml_files import REMOVED, changed_yaml, copy_configuration

pytestmark = [pytest.mark.system, pytest.mark.thorough]

NOT_THERE = (
    *("ring_write", "ring_read", "ring_underruns", "ring_clock_ms", "ring_setpoint"),
    *("mode_b0", "mode_b1"),
)
PATIENCE = (
    (["links"], "desk"),
    (["desk", "real_timeout_ms"], 800.0),
    (["desk", "real_stale_ms"], 3000.0),
    (["desk", "twin_stale_ms"], 3000.0),
)
P2, NEAR = (0.51, 0.16, 0.10), (0.60, 0.0, 0.02)
"""Points of the tool [m]."""
SLOW_PERCENT = 4
"""A move takes longer than a command line tool needs to end."""
NEAR_DEG_MM, NEAR_M = 0.3, 1e-3
STANDS_S = 1.0
"""A machine that does other things too."""


@pytest.fixture(scope="module")
def robot() -> Iterator[HoldOnlyRobot]:
    """Give the robot, which listens."""
    with HoldOnlyRobot() as made:
        yield made


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, robot: HoldOnlyRobot) -> Iterator[LiveCell]:
    """Give a ready cell without the stand-in, whose map knows no ring, panel or mode switch."""
    made = LiveCell(tmp_path_factory.mktemp("cell"))
    made.modbus_port = robot.port
    config = copy_configuration(made.folder / "changed")
    for name in NOT_THERE:
        changed_yaml(config / "modbus_map.yaml", config, ["holding_registers", name], REMOVED)
    for path, value in PATIENCE:
        changed_yaml(config / "twin_controller.yaml", config, list(path), value)
    with made.ready("--without", "emulator", config=config):
        made.make_ready()
        yield made


def move(cell: LiveCell, point: tuple[float, float, float]) -> None:
    """Let the operator move the pair; it is accepted."""
    x, y, z = point
    request = f"{{command: MOVE, x: {x}, y: {y}, z: {z}, speed_percent: {SLOW_PERCENT}}}"
    answer = cell.call("/twin_controller/command", request)
    assert answer["success"], answer


def wait_mode(cell: LiveCell, mode: str, seconds: float = 40.0) -> None:
    """Wait until the pair is in a mode."""
    wait_until(lambda: cell.mode() == mode, seconds, f"{mode}, now {cell.mode()}", period=0.05)


def arrives(cell: LiveCell, robot: HoldOnlyRobot, point: tuple[float, float, float]) -> None:
    """Wait until the robot's tool is at a point [m], and the pair idle."""
    wait_until(lambda: forward(robot.q) == pytest.approx(point, abs=NEAR_M), 40.0, f"{point}")
    wait_mode(cell, "IDLE")


def stands(robot: HoldOnlyRobot) -> list[float]:
    """Wait until the robot stands; return where."""
    wait_until(lambda: robot.standing, STANDS_S, "the robot to stand")
    return list(robot.q)


def test_it_follows_stops_and_goes_on_like_ours(cell: LiveCell, robot: HoldOnlyRobot) -> None:
    """A move, a STOP in its middle, ALIGN, and the next move to its end; twice by night.

    Each time twice in virtual time, in stopping/test_hold_only.py.
    """
    for _ in range(examples(1, 2)):
        move(cell, P2)
        wait_until(lambda: not robot.standing and robot.kind == STREAM, 10.0, "the robot to follow")
        assert command_over(cell.gateway_port, "STOP")["success"]
        stood = stands(robot)
        wait_mode(cell, "STOPPED")
        assert robot.state == PAUSED
        command_over(cell.gateway_port, "ALIGN")
        wait_mode(cell, "IDLE")
        assert robot.q == pytest.approx(stood, abs=NEAR_DEG_MM), "only the twin aligns"
        move(cell, NEAR)
        arrives(cell, robot, NEAR)


def test_configuration_names_no_ring(cell: LiveCell) -> None:
    """The robot is followed by PR[1] alone."""
    text = (Path(cell.output) / "config" / "modbus_map.yaml").read_text(encoding="utf-8")
    assert not any(f"{name}:" in text for name in NOT_THERE)
