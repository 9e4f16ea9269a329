"""What each action does on the robot's signals; nothing stays that a reset could give back."""

from __future__ import annotations

import threading
import time

import msgspec
import pytest
from harness.opponents.memory_robot import STANDS, MemoryCell
from harness.sides import ROBOT
from twin_controller.core.actions import Command, RobotSetpoint, StreamReal
from twin_controller.core.events import RealAlarm, RealMeasured
from twin_controller.robot import real_link_io
from twin_controller.robot.intake import HEARTBEAT_LOST
from twin_controller.robot.signals import UI_SIGNALS
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    WatchdogState,
)


@pytest.fixture
def cell() -> MemoryCell:
    """Return the shared side with the shipped robots' table."""
    return MemoryCell(UI_SIGNALS, has_gripper=True)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the end wait for nothing for long."""
    monkeypatch.setattr(real_link_io, "REST", 0.01)
    monkeypatch.setattr(real_link_io, "PULSES", 0.0)


def show(cell: MemoryCell, control: ControlType, *signals: str) -> None:
    """Let a robot that stands be seen until it is believed: two readings have to fit."""
    shown = {"control_type": control, "outputs": frozenset({"sysrdy", *signals})}
    while not cell.robot.show(**shown):
        pass


@pytest.mark.parametrize("do", [Command.STOP_REAL, Command.ESTOP_REAL])
def test_a_stop_ends_the_program_and_its_set_points(cell: MemoryCell, do: Command) -> None:
    """An alarm may only pause a program: with CSTOPI its goal is gone, whatever is reset."""
    cell.link.perform(do)
    assert cell.asked[0] == ("drop_setpoints",)
    assert ("pulse", "cstopi", False) in cell.asked and ("take_back_setpoints",) in cell.asked
    assert (("set_signal", "imstp", False) in cell.asked) is (do is Command.ESTOP_REAL)


def test_a_hold_keeps_the_program(cell: MemoryCell) -> None:
    """PAUSE keeps the goal, and takes the set point back: nothing old is there to go on with."""
    cell.link.perform(Command.HOLD_REAL)
    held = ("set_signal", "hold", False)
    assert cell.asked == [("drop_setpoints",), held, ("take_back_setpoints",)]


def test_a_reset_starts_nothing(cell: MemoryCell) -> None:
    """It releases signals and resets the fault."""
    cell.link.perform(Command.RESET_REAL)
    assert [asked[1] for asked in cell.asked] == ["imstp", "hold", "fault_reset"]


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
    cell: MemoryCell, kind: ControlType, signals: set[str], runs: bool
) -> None:
    """Registers and signals are read one after the other; a program may end between them."""
    show(cell, kind, *signals)
    (seen,) = cell.events
    assert isinstance(seen, RealMeasured)
    assert seen.streaming is (runs and kind is ControlType.STREAM)
    assert seen.own_program is (runs and kind is ControlType.PROGRAM)
    assert seen.paused is bool(signals & {"paused", "held"})


def test_an_alarms_number_comes_from_its_register(cell: MemoryCell) -> None:
    """The text of a robot need not repeat it; both are gone with the alarm."""
    program = ProgramStatus("", 0, ProgramState.ABORTED)
    for alarm in (AlarmStatus(11, 37, "STOP", "Hand broken", ""), AlarmStatus(0, 0, "", "", "")):
        cell.robot.listener.told(program, alarm)
        show(cell, ControlType.NONE)
    assert cell.words == [("", "STOP 11-037 Hand broken", 37), ("", "", 0)]


@pytest.mark.parametrize(
    ("outputs", "stops"), [({"sysrdy"}, False), ({"sysrdy", "fault"}, True), (set(), True)]
)
def test_an_alarm_without_a_severity_stops_where_the_robot_shows_so(
    cell: MemoryCell, outputs: set[str], stops: bool
) -> None:
    """A map need not tell it: a start that was refused is no fault of the robot."""
    program = ProgramStatus("", 0, ProgramState.ABORTED)
    show(cell, ControlType.NONE, "sysrdy")
    cell.robot.listener.told(program, AlarmStatus(24, 11, "", "Start refused", ""))
    while not cell.robot.show(outputs=frozenset(outputs)):
        pass
    alarm = [event for event in cell.events if isinstance(event, RealAlarm)][-1]
    assert (alarm.text, alarm.stops) == ("24-011 Start refused", stops)


def test_a_robot_whose_watchdog_holds_it_is_a_fault_with_a_reason(cell: MemoryCell) -> None:
    """It raises no alarm of its own for it; one that it has goes first, and both end with RESET."""
    program, none = ProgramStatus("", 0, ProgramState.ABORTED), AlarmStatus(0, 0, "", "", "")
    alarm = AlarmStatus(11, 37, "SERVO", "IMSTP input", "")
    steps = (
        (WatchdogState.EXPIRED, none, HEARTBEAT_LOST),
        (WatchdogState.EXPIRED, alarm, "SERVO 11-037 IMSTP input"),
        (WatchdogState.EXPIRED, none, HEARTBEAT_LOST),
        (WatchdogState.DISARMED, none, ""),
    )
    for state, told, said in steps:
        cell.events.clear()
        cell.robot.listener.told(program, told)
        while not cell.robot.show(watchdog_state=state, outputs=frozenset({"sysrdy"})):
            pass
        alarms = [event.text for event in cell.events if isinstance(event, RealAlarm)]
        assert alarms[-1:] == [said]
        last = cell.events[-1]
        assert isinstance(last, RealMeasured)
        assert last.fault is (state is WatchdogState.EXPIRED)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("control", "stopped"), [(ControlType.STREAM, True), (ControlType.PROGRAM, False)]
)
def test_the_end_stops_a_stream_of_ours_and_no_program_of_the_robot(
    cell: MemoryCell, control: ControlType, stopped: bool
) -> None:
    """Who writes a set point after our end would move a stream program that goes on running."""
    with cell.link:
        show(cell, control, "progrun")
    assert (("pulse", "cstopi", False) in cell.asked) is stopped
    assert (("take_back_setpoints",) in cell.asked) is stopped
    assert cell.asked[-1][0] == "close"
    cell.link.stream(StreamReal(RobotSetpoint((0.0,) * 4), 50.0, 0.0))
    assert cell.asked[-1][0] == "close", "nothing is streamed after the end"


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("shown", "stopped"),
    [
        ([], True),
        ([(ControlType.PROGRAM, "progrun")], False),
        ([(ControlType.STREAM, "progrun"), (ControlType.NONE, "sysrdy")], False),
    ],
    ids=["not shown yet", "a program of the robot", "it has ended"],
)
def test_the_end_stops_a_stream_that_was_asked_for_and_is_not_shown_yet(
    cell: MemoryCell, shown: list[tuple[ControlType, str]], stopped: bool
) -> None:
    """It would start behind the end, with a valid set point and no watchdog."""
    with cell.link:
        show(cell, ControlType.NONE)
        cell.link.perform(Command.START_STREAM)
        for each in shown:
            show(cell, *each)
    assert (("pulse", "cstopi", False) in cell.asked) is stopped
    assert (("take_back_setpoints",) in cell.asked) is stopped


@pytest.mark.parametrize(
    ("commands", "given"),
    [
        ((Command.HOLD_REAL,), True),
        ((Command.STOP_REAL,), True),
        ((Command.HOLD_REAL, Command.GIVE_HOLD_BACK), False),
        ((Command.ESTOP_REAL, Command.STOP_REAL), False),
    ],
)
def test_the_end_gives_a_hold_of_ours_back_to_a_robot_that_stands(
    cell: MemoryCell, monkeypatch: pytest.MonkeyPatch, commands: tuple[Command, ...], given: bool
) -> None:
    """Else its pendant starts nothing, and nobody says why; an emergency stop stays.

    A START that is on its way acts at the end of its pulse: it must find HOLD away. The engine goes
    on meanwhile: it starts nothing, and takes no HOLD away that nobody would give back.
    """

    def sleep(seconds: float) -> None:
        cell.asked.append(("sleep", seconds))
        cell.link.perform(Command.START_STREAM)
        cell.link.perform(Command.STOP_REAL)

    monkeypatch.setattr(time, "sleep", sleep)
    monkeypatch.setattr(real_link_io, "REST", 10.0)  # this machine may stand still for a while

    def stand() -> None:
        while ("close", True) not in cell.asked and not done.wait(0.01):
            cell.robot.show(control_type=ControlType.PROGRAM, outputs=frozenset({"paused"}))

    done = threading.Event()
    robot = threading.Thread(target=stand)
    with cell.link:
        show(cell, ControlType.PROGRAM, "paused", "held")
        for command in commands:
            cell.link.perform(command)
        cell.asked.clear()
        robot.start()
    done.set()
    robot.join()
    ended = [("sleep", real_link_io.PULSES), ("set_signal", "hold", True)]
    assert (ended[1] in cell.asked) is given
    if given:
        assert [each for each in cell.asked if each in ended] == ended
    stops = cell.asked.count(("pulse", "cstopi", False))
    assert stops == cell.asked.count(ended[0]), "the engine's stop is obeyed, and there is no other"
    assert ("pulse", "rsr1", True) not in cell.asked
    for command, obeyed in ((Command.STOP_REAL, not given), (Command.ESTOP_REAL, True)):
        cell.asked.clear()
        cell.link.perform(command)
        assert bool(cell.asked) is obeyed


@pytest.mark.usefixtures("quick")
def test_a_hold_of_ours_stays_away_from_a_robot_that_was_not_seen_to_stand(
    cell: MemoryCell, caplog: pytest.LogCaptureFixture
) -> None:
    """It may still move: the log says what keeps START from it, and its watchdog stays armed."""
    with cell.link:
        show(cell, ControlType.PROGRAM, "progrun")
        cell.link.perform(Command.HOLD_REAL)
    assert ("set_signal", "hold", True) not in cell.asked
    assert "its HOLD stays away, and its watchdog armed" in caplog.text
    assert cell.asked[-1] == ("close", False)


@pytest.mark.parametrize("control", [ControlType.PROGRAM, ControlType.NONE])
def test_the_end_disarms_the_watchdog_unless_nobody_decides_any_longer(
    cell: MemoryCell, control: ControlType
) -> None:
    """A program of the robot's own goes on; an error of ours stops it, as if we had been killed."""
    for alive in (True, False):
        cell.alive = alive
        with cell.link:
            show(cell, control, "progrun")
        assert cell.asked[-1] == ("close", alive)


def test_the_end_writes_nothing_to_a_robot_that_is_only_followed() -> None:
    """Another master streams to it: its link refuses a stop, and has to be closed all the same."""
    cell = MemoryCell(UI_SIGNALS, robot=msgspec.structs.replace(ROBOT, lead=False))
    with cell.link:
        show(cell, ControlType.STREAM, "progrun")
        cell.asked.clear()
    assert [asked[0] for asked in cell.asked] == ["close"]


def test_a_joint_without_a_twin_stays_where_it_was_turned_in_a_pause(cell: MemoryCell) -> None:
    """Somebody has turned it at the pendant: the stream must not turn it back by itself."""
    show(cell, ControlType.STREAM, "progrun")
    turned = list(STANDS.motion.q)
    turned[3] += 0.005
    assert cell.robot.show(
        *turned, control_type=ControlType.STREAM, outputs=frozenset({"sysrdy", "paused"})
    )
    assert cell.robot.show(
        *STANDS.motion.q, control_type=ControlType.STREAM, outputs=frozenset({"progrun"})
    )
    cell.link.stream(StreamReal(RobotSetpoint((0.1, 0.2, -0.05, 0.4)), 50.0, 0.0))
    (_, written), *_ = cell.asked
    assert isinstance(written, StreamReal)
    assert written.setpoint.q[3] == pytest.approx(turned[3])


def test_an_error_that_ended_the_link_is_kept(cell: MemoryCell) -> None:
    """The node ends with it, for the link never connects again."""
    assert cell.link.failure is None
    error = RuntimeError("a value that no message can hold")
    cell.robot.listener.died(error)
    assert cell.link.failure is error


def test_a_program_has_no_name_until_it_was_told_since_its_start(cell: MemoryCell) -> None:
    """The blocks are read behind the sample: the name of the last program would be judged."""
    named = []
    for name, signals, state in (
        ("ARTICLE", ("progrun",), ProgramState.RUNNING),
        ("ARTICLE", ("paused",), ProgramState.PAUSED),
        ("ARTICLE", (), ProgramState.ABORTED),
        ("PALLETISE", ("progrun",), ProgramState.RUNNING),
        ("PALLETISE", ("progrun",), ProgramState.RUNNING),
    ):
        show(cell, ControlType.PROGRAM, *signals)
        cell.robot.listener.told(ProgramStatus(name, 1, state), AlarmStatus(0, 0, "", "", ""))
        last = cell.events[-1]
        assert isinstance(last, RealMeasured)
        named.append((last.own_program, last.program))
    assert named == [
        (True, ""),
        (True, "ARTICLE"),
        (False, "ARTICLE"),
        (True, ""),
        (True, "PALLETISE"),
    ]
