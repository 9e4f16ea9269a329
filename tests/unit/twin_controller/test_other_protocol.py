"""A second protocol to the robot: one link and one table, all the rest is the shared side."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import ROBOT
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command, RobotSetpoint, StreamReal
from twin_controller.core.events import AnyEvent, RealAlarm, RealMeasured
from twin_controller.robot.link import LinkLostError, RobotCounters, RobotListener
from twin_controller.robot.real_link_io import RealLink
from twin_controller.robot.signals import (
    UI_SIGNALS,
    DropSetpoints,
    Number,
    Pulse,
    Signal,
    SignalTable,
    StandHere,
)
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    RobotSample,
    WatchdogState,
)

PERIOD = 0.01
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


class MemoryLink:
    """A protocol without a wire: it writes down what it is asked, and plays the robot's samples."""

    def __init__(self, listener: RobotListener) -> None:
        self.listener = listener
        self.name = "a robot in memory"
        self.counters = RobotCounters()
        self.asked: list[tuple[object, ...]] = []
        self.now = 100.0

    def start(self) -> None:
        """Connect."""
        self.listener.opened()

    def close(self, disarm: bool = True) -> None:
        """End."""
        self.asked.append(("close", disarm))

    def write_setpoint(self, action: StreamReal) -> None:
        """Write a set point of all joints."""
        self.asked.append(("setpoint", action.setpoint.q, action.speed_percent, action.send_at))

    def drop_setpoints(self) -> None:
        """Forget set points."""
        self.asked.append(("drop",))

    def set_signal(self, name: str, level: bool) -> None:
        """Set an input."""
        self.asked.append(("signal", name, level))

    def pulse(self, name: str, behind: bool = False) -> None:
        """Pulse an input."""
        self.asked.append(("pulse", name, behind))

    def write_integer(self, name: str, value: int) -> None:
        """Write a number."""
        self.asked.append(("number", name, value))

    def show(self, *positions: float, **changes: object) -> bool:
        """Let the robot stand at these positions, and say whether it is believed."""
        self.now += PERIOD
        clock_ms = round(self.now * 1e3)
        still = (0.0,) * len(ROBOT.joints)
        motion = JointMotion.measured(positions or STANDS.motion.q, still, clock_ms * 1e-3)
        sample = msgspec.structs.replace(STANDS, motion=motion, clock_ms=clock_ms, **changes)
        return self.listener.sampled(sample, self.now - 0.001, self.now)


STANDS = RobotSample(
    motion=JointMotion.at_rest((0.1, 0.2, -0.05, 0.3, 0.4)),
    clock_ms=0,
    control_type=ControlType.NONE,
    program_speed=50,
    override=80,
    heartbeat_echo=0,
    watchdog_state=WatchdogState.ARMED,
    outputs=frozenset(("sysrdy",)),
)


class Cell:
    """The shared side on a link in memory, and all that it tells."""

    def __init__(self, table: SignalTable = WORDS) -> None:
        self.events: list[AnyEvent] = []
        self.changes: list[tuple[str, bool, str]] = []
        self.words: list[tuple[str, str, int]] = []
        self.robot: MemoryLink

        def connect(listener: RobotListener) -> MemoryLink:
            self.robot = MemoryLink(listener)
            return self.robot

        self.link = RealLink(
            ROBOT,
            False,
            connect,
            self.events.append,
            lambda *change: self.changes.append(change),
            lambda sample, *words: self.words.append(words),
            lambda: True,
            table,
        )
        self.robot.start()


@pytest.fixture
def cell() -> Cell:
    """Return a cell whose robot is believed."""
    made = Cell()
    assert [made.robot.show(), made.robot.show()] == [False, True], "the second one fits the first"
    return made


@pytest.mark.parametrize(
    ("do", "asked"),
    [
        (Command.STOP_REAL, [("drop",), ("number", "task", 0)]),
        (Command.END_AT_REST, [("drop",), ("number", "task", 0)]),
        (Command.HOLD_REAL, [("drop",), ("signal", "motion_enable", False)]),
        (Command.RELEASE_REAL, [("signal", "motion_enable", True)]),
        (Command.ESTOP_REAL, [("drop",), ("signal", "power", False), ("number", "task", 0)]),
        (Command.RESET_REAL, [("signal", "power", True), ("pulse", "acknowledge", False)]),
        (Command.START_STREAM, [("number", "task", 7)]),
    ],
)
def test_each_action_becomes_what_the_table_says(
    cell: Cell, do: Command, asked: list[tuple[object, ...]]
) -> None:
    """In the order of the table; nothing of another robot's signals is left."""
    cell.link.perform(do)
    assert cell.robot.asked == asked


def test_a_paused_program_is_resumed_and_no_other(cell: Cell) -> None:
    """START would run a program that nobody paused."""
    for do in (Command.RELEASE_REAL, Command.CONTINUE_STREAM):
        cell.link.perform(do)
        assert ("pulse", "continue", False) not in cell.robot.asked
        cell.robot.show(outputs=frozenset(("sysrdy", "paused")))
        cell.link.perform(do)
        assert cell.robot.asked.pop() == ("pulse", "continue", False)
        cell.robot.show()


def test_whoever_starts_a_paused_program_finds_the_robot_at_its_set_point(cell: Cell) -> None:
    """The joints without a twin too; a robot without a paused program gets no set point."""
    cell.link.perform(Command.GIVE_HOLD_BACK)
    assert cell.robot.asked == []
    here = (0.101, 0.201, -0.0501, 0.301, 0.4)
    assert cell.robot.show(*here, outputs=frozenset(("sysrdy", "paused")))
    cell.link.perform(Command.GIVE_HOLD_BACK)
    assert cell.robot.asked == [("setpoint", here, 1.0, 0.0)]


def test_the_link_is_up_with_the_first_believed_sample(cell: Cell) -> None:
    """What the core gets are the twin's joints and flags; joint_4 is the robot's alone."""
    assert cell.changes == [("real", True, "connected to a robot in memory")]
    (event,) = cell.events
    assert isinstance(event, RealMeasured)
    assert event.motion.q == (0.1, 0.2, -0.05, 0.4)
    assert (event.drives_on, event.fault, event.speed_percent) == (True, False, 40.0)
    assert event.gripper is None
    assert cell.link.counters["samples"] == 1 and cell.link.counters["connects"] == 1


def test_a_set_point_is_made_whole_with_the_joints_that_rest(cell: Cell) -> None:
    """They stay where they were when the stream began, whatever is read while it runs."""
    cell.robot.show(0.1, 0.2, -0.05, 0.3001, 0.4)
    cell.robot.show(0.1, 0.2, -0.05, 0.3002, 0.4, control_type=ControlType.STREAM)
    cell.link.stream(StreamReal(RobotSetpoint((0.11, 0.21, -0.06, 0.41)), 30.0, 5.0))
    assert cell.robot.asked == [("setpoint", (0.11, 0.21, -0.06, 0.3001, 0.41), 30.0, 5.0)]


def test_no_set_point_goes_out_before_the_pose_is_known() -> None:
    """Nobody knows where joint_4 is to stay."""
    cell = Cell()
    cell.link.stream(StreamReal(RobotSetpoint((0.0, 0.0, 0.0, 0.0)), 30.0, 5.0))
    assert cell.robot.asked == [] and cell.link.counters["refused"] == 1


def test_a_reading_that_leaps_is_refused_and_a_robot_that_jumped_begins_anew(cell: Cell) -> None:
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


def test_program_and_alarm_come_in_words(cell: Cell) -> None:
    """The core hears of an alarm when its text changes, and whether it stops the robot."""
    program = ProgramStatus("ARTICLE", 5, ProgramState.RUNNING)
    alarm = AlarmStatus(11, 37, "SERVO", "overload", "joint 2")
    for _ in range(2):
        cell.robot.listener.told(program, alarm)
    cell.robot.show()
    assert cell.words[-1] == ("ARTICLE line 5 running", "SERVO 11-037 overload (joint 2)", 37)
    cell.robot.listener.told(program, AlarmStatus(24, 11, "WARN", "Start refused", ""))
    told = [(event.text, event.stops) for event in cell.events if isinstance(event, RealAlarm)]
    assert told == [
        ("SERVO 11-037 overload (joint 2)", True),
        ("WARN 24-011 Start refused", False),
    ]


def test_override_and_gripper_go_the_same_way(cell: Cell) -> None:
    """Whole percent; the suction is a signal."""
    cell.link.override(42.4)
    cell.link.grip(True)
    assert cell.robot.asked == [("number", "override", 42), ("signal", "gripper", True)]


def test_every_action_on_the_real_robot_stands_in_the_shipped_table() -> None:
    """An action that is forgotten would silently do nothing."""
    others = {Command.START_STREAM, Command.CONTINUE_STREAM, Command.END_STREAM}
    others |= {Command.GIVE_HOLD_BACK, Command.END_AT_REST}
    on_the_robot = {do for do in Command if do.name.endswith("_REAL")} | others
    assert set(UI_SIGNALS) == on_the_robot == set(WORDS)
