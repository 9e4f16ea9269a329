"""What each action does on the robot's signals; the robot keeps nothing that a reset could give back."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import ROBOT, SETUP
from harness.workspace import ROOT
from scara_config.modbus_map import load_modbus_map
from twin_controller.core.actions import Do
from twin_controller.core.events import RealMeasured
from twin_controller.io.real_door import RealDoor
from twin_controller.robot_sample import ControlType, RobotSample, WatchdogState


class Line:
    """Takes the place of the Modbus link and writes down what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[object, ...]] = []

    def __getattr__(self, name: str) -> object:
        return lambda *arguments, **options: self.asked.append((name, *arguments))


@pytest.fixture
def door() -> tuple[RealDoor, Line]:
    """Return a door that is not connected to anything, and its line."""
    layout = load_modbus_map(ROOT / "config")
    ignore = lambda *_: None  # noqa: E731
    made, line = RealDoor(SETUP, ROBOT, layout, "127.0.0.1", 1, ignore, ignore, ignore, lambda: True), Line()
    made._link = line  # type: ignore[assignment]
    return made, line


@pytest.mark.parametrize("do", [Do.STOP_REAL, Do.ESTOP_REAL])
def test_a_stop_ends_the_program_and_its_set_points(door: tuple[RealDoor, Line], do: Do) -> None:
    """An alarm may only pause a program: with CSTOPI its goal is gone, whatever is reset afterwards."""
    made, line = door
    made.perform(do)
    assert line.asked[0] == ("drop_setpoints",)
    assert ("pulse", "cstopi") in line.asked and ("write_integer", "setpoint_valid", 0) in line.asked
    assert (("set_coil", "imstp", False) in line.asked) is (do is Do.ESTOP_REAL)


def test_a_hold_keeps_the_program(door: tuple[RealDoor, Line]) -> None:
    """PAUSE keeps the goal."""
    made, line = door
    made.perform(Do.HOLD_REAL)
    assert line.asked == [("drop_setpoints",), ("set_coil", "hold", False)]


def test_a_reset_starts_nothing(door: tuple[RealDoor, Line]) -> None:
    """It releases signals and resets the fault."""
    made, line = door
    made.perform(Do.RESET_REAL)
    assert [asked[1] for asked in line.asked] == ["imstp", "hold", "fault_reset"]


@pytest.mark.parametrize("kind", [ControlType.STREAM, ControlType.PROGRAM])
@pytest.mark.parametrize(
    ("signals", "runs"),
    [({"progrun", "busy"}, True), ({"paused"}, True), ({"paused", "held"}, True), ({"held"}, False), (set(), False)],
    ids=["runs", "paused", "held", "ended while held", "ended"],
)
def test_a_program_whose_signals_are_gone_has_ended(
    door: tuple[RealDoor, Line], kind: ControlType, signals: set[str], runs: bool
) -> None:
    """Registers and signals are read one after the other; a program that ends between them is not one that goes on."""
    made, _ = door
    seen: list[RealMeasured] = []
    made._put = seen.append  # type: ignore[method-assign, assignment]
    at = tuple(0.0 for _ in ROBOT.joints)
    made._sampled(RobotSample(at, at, 0, kind, 50, 100, 0, WatchdogState.DISARMED, frozenset(signals | {"sysrdy"})), 0.0, 0.001)
    shown = msgspec.structs.asdict(seen[0])
    assert shown["streaming"] is (runs and kind is ControlType.STREAM)
    assert shown["own_program"] is (runs and kind is ControlType.PROGRAM)
    assert shown["paused"] is bool(signals & {"paused", "held"})
