"""A second protocol to the robot: one link and one table, all the rest is the shared side."""

from __future__ import annotations

import pytest
from harness.opponents.memory_robot import MemoryCell
from harness.sides import ROBOT
from twin_controller.core.actions import Command, RobotSetpoint, StreamReal
from twin_controller.core.events import RealAlarm, RealMeasured
from twin_controller.robot.link import LinkLostError
from twin_controller.robot.signals import (
    UI_SIGNALS,
    DropSetpoints,
    Number,
    Pulse,
    Signal,
    SignalTable,
    StandHere,
)
from twin_controller.robot_sample import AlarmStatus, ControlType, ProgramState, ProgramStatus

WORDS: SignalTable = {
    Command.STOP_REAL: (DropSetpoints(), Number("task", 0)),
    Command.END_AT_REST: (DropSetpoints(), Number("task", 0)),
    Command.HOLD_REAL: (DropSetpoints(), Signal("motion_enable", False)),
    Command.END_STREAM: (DropSetpoints(),),
    Command.GIVE_HOLD_BACK: (StandHere(if_paused=True),),
    Command.CONTINUE_STREAM: (Pulse("continue", if_paused=True),),
    Command.RELEASE_REAL: (Signal("motion_enable", True), Pulse("continue", if_paused=True)),
    Command.ESTOP_REAL: (DropSetpoints(), Signal("power", False), Number("task", 0)),
    Command.RESET_REAL: (Signal("power", True), Pulse("acknowledge")),
    Command.START_STREAM: (Number("task", 7),),
}
"""Another robot: no UI signals, a task number instead of programs that are pulsed."""


@pytest.fixture
def cell() -> MemoryCell:
    """Return a cell whose robot is believed."""
    made = MemoryCell(WORDS)
    assert [made.robot.show(), made.robot.show()] == [False, True], "the second one fits the first"
    return made


@pytest.mark.parametrize(
    ("do", "asked"),
    [
        (Command.STOP_REAL, [("drop_setpoints",), ("write_integer", "task", 0)]),
        (Command.END_AT_REST, [("drop_setpoints",), ("write_integer", "task", 0)]),
        (Command.HOLD_REAL, [("drop_setpoints",), ("set_signal", "motion_enable", False)]),
        (Command.RELEASE_REAL, [("set_signal", "motion_enable", True)]),
        (
            Command.ESTOP_REAL,
            [("drop_setpoints",), ("set_signal", "power", False), ("write_integer", "task", 0)],
        ),
        (Command.RESET_REAL, [("set_signal", "power", True), ("pulse", "acknowledge", False)]),
        (Command.START_STREAM, [("write_integer", "task", 7)]),
    ],
)
def test_each_action_becomes_what_the_table_says(
    cell: MemoryCell, do: Command, asked: list[tuple[object, ...]]
) -> None:
    """In the order of the table; nothing of another robot's signals is left."""
    cell.link.perform(do)
    assert cell.asked == asked


def test_a_paused_program_is_resumed_and_no_other(cell: MemoryCell) -> None:
    """START would run a program that nobody paused."""
    for do in (Command.RELEASE_REAL, Command.CONTINUE_STREAM):
        cell.link.perform(do)
        assert ("pulse", "continue", False) not in cell.asked
        cell.robot.show(outputs=frozenset(("sysrdy", "paused")))
        cell.link.perform(do)
        assert cell.asked.pop() == ("pulse", "continue", False)
        cell.robot.show()


def test_whoever_starts_a_paused_program_finds_the_robot_at_its_set_point(cell: MemoryCell) -> None:
    """The joints without a twin too; a robot without a paused program gets no set point."""
    cell.link.perform(Command.GIVE_HOLD_BACK)
    assert cell.asked == []
    here = (0.101, 0.201, -0.0501, 0.301, 0.4)
    assert cell.robot.show(*here, outputs=frozenset(("sysrdy", "paused")))
    cell.link.perform(Command.GIVE_HOLD_BACK)
    assert cell.asked == [("write_setpoint", StreamReal(RobotSetpoint(here), 1.0, 0.0))]


def test_the_link_is_up_with_the_first_believed_sample(cell: MemoryCell) -> None:
    """What the core gets are the twin's joints and flags; joint_4 is the robot's alone."""
    assert cell.changes == [("real", True, "connected to a robot in memory")]
    (event,) = cell.events
    assert isinstance(event, RealMeasured)
    assert event.motion.q == (0.1, 0.2, -0.05, 0.4)
    assert (event.drives_on, event.fault, event.speed_percent) == (True, False, 40.0)
    assert event.gripper is None
    assert cell.link.counters["samples"] == 1 and cell.link.counters["connects"] == 1


def test_a_set_point_is_made_whole_with_the_joints_that_rest(cell: MemoryCell) -> None:
    """They stay where they were when the stream began, whatever is read while it runs."""
    cell.robot.show(0.1, 0.2, -0.05, 0.3001, 0.4)
    cell.robot.show(0.1, 0.2, -0.05, 0.3002, 0.4, control_type=ControlType.STREAM)
    cell.link.stream(StreamReal(RobotSetpoint((0.11, 0.21, -0.06, 0.41)), 30.0, 5.0))
    whole = RobotSetpoint((0.11, 0.21, -0.06, 0.3001, 0.41))
    assert cell.asked == [("write_setpoint", StreamReal(whole, 30.0, 5.0))]


def test_an_axis_that_no_joint_names_rests_as_well(cell: MemoryCell) -> None:
    """Behind the joints, as it was read before the stream; whoever starts a pause finds it too."""
    cell.robot.show(axes=(5.0, -98.3))
    cell.robot.show(axes=(5.0, -98.4), control_type=ControlType.STREAM)
    cell.link.stream(StreamReal(RobotSetpoint((0.11, 0.21, -0.06, 0.41)), 30.0, 5.0))
    paused = frozenset(("sysrdy", "paused"))
    cell.robot.show(axes=(5.0, -98.5), control_type=ControlType.STREAM, outputs=paused)
    cell.link.perform(Command.GIVE_HOLD_BACK)
    sent = [each for asked in cell.asked for each in asked if isinstance(each, StreamReal)]
    assert [each.setpoint.q[len(ROBOT.joints) :] for each in sent] == [(5.0, -98.3), (5.0, -98.5)]


def test_a_joint_that_rests_a_hair_outside_its_range_stays_at_its_edge(cell: MemoryCell) -> None:
    """A reading may be a little outside, a set point may not: each of them would be refused."""
    joint = ROBOT.joints[3]
    assert not joint.twin
    cell.robot.start()
    for _ in range(2):
        cell.robot.show(0.1, 0.2, -0.05, joint.upper + 0.0005, 0.4)
    cell.link.stream(StreamReal(RobotSetpoint((0.11, 0.21, -0.06, 0.41)), 30.0, 5.0))
    whole = RobotSetpoint((0.11, 0.21, -0.06, joint.upper, 0.41))
    assert cell.asked == [("write_setpoint", StreamReal(whole, 30.0, 5.0))]


def test_no_set_point_goes_out_before_the_pose_is_known() -> None:
    """Nobody knows where joint_4 is to stay."""
    cell = MemoryCell(WORDS)
    cell.link.stream(StreamReal(RobotSetpoint((0.0, 0.0, 0.0, 0.0)), 30.0, 5.0))
    assert cell.asked == [] and cell.link.counters["refused"] == 1


def test_a_reading_that_leaps_is_refused_and_a_robot_that_jumped_begins_anew(
    cell: MemoryCell,
) -> None:
    """One wrong answer is kept out; three that fit each other mean that nothing known holds."""
    assert not cell.robot.show(1.5, 0.2, -0.05, 0.3, 0.4)
    assert cell.robot.show()
    cell.robot.show(1.5, 0.2, -0.05, 0.3, 0.4)
    cell.robot.show(1.5, 0.2, -0.05, 0.3, 0.4)
    with pytest.raises(LinkLostError, match="a robot in memory jumped: joint_1 jumped by"):
        cell.robot.show(1.5, 0.2, -0.05, 0.3, 0.4)
    cell.robot.listener.lost("it jumped")
    assert cell.changes[-1] == ("real", False, "it jumped")
    cell.robot.start()
    assert [cell.robot.show(1.5, 0.2, -0.05, 0.3, 0.4) for _ in range(2)] == [False, True]
    positions = [event.motion.q[0] for event in cell.events if isinstance(event, RealMeasured)]
    assert positions == [0.1, 0.1, 1.5]


def test_program_and_alarm_come_in_words(cell: MemoryCell) -> None:
    """The core hears of an alarm when its text changes, and whether it stops the robot."""
    program = ProgramStatus("ARTICLE", 5, ProgramState.RUNNING)
    alarm = AlarmStatus(11, 37, "SERVO", "overload", "joint 2")
    for _ in range(2):
        cell.robot.listener.told(program, alarm)
    cell.robot.show()
    assert cell.words[-1] == ("ARTICLE line 5 running", "SERVO 11-037 overload (joint 2)", 37)
    cell.robot.listener.told(program, AlarmStatus(24, 11, "WARN", "Start refused", ""))
    told = [(event.text, event.stops) for event in cell.events if isinstance(event, RealAlarm)]
    assert told == [("SERVO 11-037 overload (joint 2)", True), ("WARN 24-011 Start refused", False)]


def test_override_and_gripper_go_the_same_way(cell: MemoryCell) -> None:
    """Whole percent; the suction is a signal."""
    cell.link.override(42.4)
    cell.link.grip(True)
    assert cell.asked == [("write_integer", "override", 42), ("set_signal", "gripper", True)]


def test_every_action_on_the_real_robot_stands_in_the_shipped_table() -> None:
    """An action that is forgotten would silently do nothing."""
    others = {Command.START_STREAM, Command.CONTINUE_STREAM, Command.END_STREAM}
    others |= {Command.GIVE_HOLD_BACK, Command.END_AT_REST}
    on_the_robot = {do for do in Command if do.name.endswith("_REAL")} | others
    assert set(UI_SIGNALS) == on_the_robot == set(WORDS)
