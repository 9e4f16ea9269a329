"""What each action does on the robot's signals; nothing stays that a reset could give back."""

from __future__ import annotations

from typing import cast

import msgspec
import pytest
from harness.pair import ROBOT
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command, RobotSetpoint, StreamReal
from twin_controller.core.events import RealMeasured
from twin_controller.robot.link import Connect, RobotCounters, RobotListener
from twin_controller.robot.real_link_io import RealLink
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    RobotSample,
    WatchdogState,
)


class Line:
    """Takes the place of the Modbus link and writes down what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[object, ...]] = []
        self.counters = RobotCounters()

    def __getattr__(self, name: str) -> object:
        return lambda *arguments, **options: self.asked.append((name, *arguments))


@pytest.fixture
def pair() -> tuple[RealLink, Line]:
    """Return a link that is not connected to anything, and its line."""
    line = Line()

    def connect(listener: RobotListener) -> Line:
        return line

    def ignore(*_: object) -> None:
        """Hear nothing."""

    made = RealLink(ROBOT, True, cast(Connect, connect), ignore, ignore, ignore, lambda: True)
    return made, line


@pytest.mark.parametrize("do", [Command.STOP_REAL, Command.ESTOP_REAL])
def test_a_stop_ends_the_program_and_its_set_points(
    pair: tuple[RealLink, Line], do: Command
) -> None:
    """An alarm may only pause a program: with CSTOPI its goal is gone, whatever is reset."""
    made, line = pair
    made.perform(do)
    assert line.asked[0] == ("drop_setpoints",)
    assert ("pulse", "cstopi") in line.asked and ("take_back_setpoints",) in line.asked
    assert (("set_signal", "imstp", False) in line.asked) is (do is Command.ESTOP_REAL)


def test_a_hold_keeps_the_program(pair: tuple[RealLink, Line]) -> None:
    """PAUSE keeps the goal, and takes the set point back: nothing old is there to go on with."""
    made, line = pair
    made.perform(Command.HOLD_REAL)
    assert line.asked == [
        ("drop_setpoints",),
        ("set_signal", "hold", False),
        ("take_back_setpoints",),
    ]


def test_a_reset_starts_nothing(pair: tuple[RealLink, Line]) -> None:
    """It releases signals and resets the fault."""
    made, line = pair
    made.perform(Command.RESET_REAL)
    assert [asked[1] for asked in line.asked] == ["imstp", "hold", "fault_reset"]


@pytest.mark.parametrize("kind", [ControlType.STREAM, ControlType.PROGRAM])
@pytest.mark.parametrize(
    ("signals", "runs"),
    [
        ({"progrun", "busy"}, True),
        ({"paused"}, True),
        ({"paused", "held"}, True),
        ({"held"}, False),
        (set(), False),
    ],
    ids=["runs", "paused", "held", "ended while held", "ended"],
)
def test_a_program_whose_signals_are_gone_has_ended(
    pair: tuple[RealLink, Line], kind: ControlType, signals: set[str], runs: bool
) -> None:
    """Registers and signals are read one after the other; a program may end between them."""
    made, _ = pair
    seen: list[RealMeasured] = []
    made._put = seen.append  # type: ignore[assignment]
    at = JointMotion.at_rest((0.0,) * len(ROBOT.joints))
    made._sampled(
        RobotSample(
            at, 0, kind, 50, 100, 0, WatchdogState.DISARMED, frozenset(signals | {"sysrdy"})
        ),
        0.0,
        0.001,
    )
    shown = msgspec.structs.asdict(seen[0])
    assert shown["streaming"] is (runs and kind is ControlType.STREAM)
    assert shown["own_program"] is (runs and kind is ControlType.PROGRAM)
    assert shown["paused"] is bool(signals & {"paused", "held"})


def test_an_alarms_number_comes_from_its_register(pair: tuple[RealLink, Line]) -> None:
    """The text of a robot need not repeat it; both are gone with the alarm."""
    made, _ = pair
    told: list[tuple[object, ...]] = []
    made._on_data = lambda *data: told.append(data)
    at = JointMotion.at_rest((0.0,) * len(ROBOT.joints))
    program = ProgramStatus("", 0, ProgramState.ABORTED)
    sample = RobotSample(
        at, 0, ControlType.NONE, 50, 100, 0, WatchdogState.DISARMED, frozenset({"sysrdy"})
    )
    for alarm in (AlarmStatus(11, 37, "STOP", "Hand broken", ""), AlarmStatus(0, 0, "", "", "")):
        made._told(program, alarm)
        made._sampled(sample, 0.0, 0.001)
    assert [data[1:] for data in told] == [("", "STOP 11-037 Hand broken", 37), ("", "", 0)]


def sample(control: ControlType, *outputs: str) -> RobotSample:
    """Return a sample of a robot that stands, moved by ``control``."""
    return RobotSample(
        motion=JointMotion.at_rest((0.0,) * len(ROBOT.joints)),
        clock_ms=1,
        control_type=control,
        program_speed=50,
        override=100,
        heartbeat_echo=1,
        watchdog_state=WatchdogState.ARMED,
        outputs=frozenset({"sysrdy", *outputs}),
    )


@pytest.mark.parametrize(
    ("control", "stopped"), [(ControlType.STREAM, True), (ControlType.PROGRAM, False)]
)
def test_the_end_stops_a_stream_of_ours_and_no_program_of_the_robot(
    control: ControlType, stopped: bool
) -> None:
    """Who writes a set point after our end would move a stream program that goes on running."""
    line = Line()
    listeners: list[RobotListener] = []

    def connect(listener: RobotListener) -> Line:
        listeners.append(listener)
        return line

    def ignore(*_: object) -> None:
        """Hear nothing."""

    made = RealLink(ROBOT, True, cast(Connect, connect), ignore, ignore, ignore, lambda: True)
    with made:
        listeners[0].opened()
        shown = sample(control, "progrun")
        # A connection's first readings are compared with each other before one is believed.
        believed = [
            listeners[0].sampled(
                msgspec.structs.replace(shown, clock_ms=1 + 10 * k), 1.0 + 0.01 * k, 1.0 + 0.01 * k
            )
            for k in range(5)
        ]
        assert believed[-1]
    assert (("pulse", "cstopi") in line.asked) is stopped
    assert (("take_back_setpoints",) in line.asked) is stopped
    assert line.asked[-1][0] == "close"
    made.stream(StreamReal(RobotSetpoint((0.0,) * 4), 50.0, 0.0))
    assert line.asked[-1][0] == "close", "nothing is streamed after the end"
