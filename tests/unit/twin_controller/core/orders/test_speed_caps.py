"""The operator's cap and the override of the person at the robot."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.pair import HOME, SETUP
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import OverrideReal
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.speed import NOT_HELD, Leader, Speeds, cap_speeds, hear_override
from twin_controller.core.safety.watch import Safety
from twin_controller.core.sides.side import RealSide, Sides, TwinSide

PERCENT = st.integers(1, 100)
DEEDS = st.lists(
    st.one_of(
        st.tuples(st.just("person"), PERCENT),
        st.tuples(st.just("same"), st.none()),
        st.tuples(st.just("cap"), PERCENT),
        st.tuples(st.just("program"), st.booleans()),
        st.tuples(st.just("wait"), st.integers(1, 40)),
    ),
    min_size=1,
    max_size=30,
)
STEP_S = 0.01


class Register:
    """The robot's override, a person who sets it, and the controller's caps."""

    def __init__(self) -> None:
        self.shown = self.persons = 100.0
        self.program = False
        self.speeds = Speeds()
        self.now = 10.0
        # What was told: when, from what, to what.
        self.told: list[tuple[float, float, float]] = []

    def step(self) -> Iterator[float]:
        """Let one reading pass; yield what the controller writes."""
        self.now += STEP_S
        flags = RealMeasured(
            self.now,
            self.now,
            self.now,
            0,
            JointMotion(0.0, HOME, (0.0,) * len(HOME)),
            own_program=self.program,
            override_percent=self.shown,
        )
        self.speeds, was = hear_override(SETUP.config.speed, self.speeds, flags)
        if was is not None:
            self.told.append((self.now, was, self.shown))
        sides = Sides(RealSide(flags=flags, connected=True), TwinSide())
        leader = Leader("real" if self.program else "", "")
        self.speeds, actions = cap_speeds(
            SETUP, self.speeds, sides, Safety(), leader, NOT_HELD, self.now
        )
        for action in actions:
            assert isinstance(action, OverrideReal)
            yield action.speed_percent
            self.shown = action.speed_percent

    def do(self, what: str, value: object) -> None:
        """Carry out one deed."""
        if what == "person":
            self.shown = self.persons = float(str(value))
        elif what == "same":
            self.persons = self.shown
        elif what == "cap":
            self.speeds = replace(self.speeds, cap=float(str(value)))
        elif what == "program":
            self.program = bool(value)


@example(
    deeds=[("person", 5), ("program", True), ("cap", 1), ("wait", 3), ("same", None), ("cap", 100)]
)
@example(deeds=[("person", 5), ("cap", 1), ("wait", 3), ("person", 1), ("cap", 100), ("wait", 40)])
@given(deeds=DEEDS)
def test_what_a_person_has_set_is_never_raised(deeds: list[tuple[str, object]]) -> None:
    """Whatever the cap does; a program of the robot's own still gets no more than the cap."""
    robot = Register()
    for what, value in deeds:
        robot.do(what, value)
        for _ in range(int(str(value)) if what == "wait" else 2):
            for written in robot.step():
                assert written <= robot.persons, "raised above what the person has set"
        if robot.program and what == "wait":
            assert robot.shown <= robot.speeds.cap


@given(deeds=DEEDS)
def test_what_a_person_changes_is_told_once_and_what_we_change_never(
    deeds: list[tuple[str, object]],
) -> None:
    """What is set while nothing of ours is under way is told at once, all else at most once."""
    robot = Register()
    list(robot.step())
    unheard: set[float] = set()
    for what, value in deeds:
        order, seen = robot.speeds.real, robot.shown
        quiet = order is None or order.sent <= robot.speeds.obeyed
        robot.do(what, value)
        before = len(robot.told)
        if what == "person":
            unheard.add(robot.shown)
            list(robot.step())
            if quiet and robot.told[before:] != [(robot.now, seen, float(str(value)))]:
                assert seen == value, "a change was not told"
        for _ in range(int(str(value)) if what == "wait" else 2):
            list(robot.step())
        for _, _, told in robot.told[before:]:
            assert told in unheard, "told as a person's"
            unheard.discard(told)


def test_without_a_program_of_its_own_the_override_is_the_persons_alone() -> None:
    """The cap goes into the set points and their program speed, which are tested there."""
    robot = Register()
    robot.do("cap", 1)
    for _ in range(60):
        assert list(robot.step()) == []


@pytest.mark.parametrize("persons", [20.0, 60.0])
def test_a_cap_that_lowered_a_program_says_so_until_it_is_lifted(persons: float) -> None:
    """Then nothing limits it but the person, who may raise it."""
    robot = Register()
    robot.do("person", persons)
    robot.do("program", True)
    robot.do("cap", 30)
    for _ in range(30):
        list(robot.step())
    assert robot.shown == min(persons, 30.0)
    robot.do("cap", 100)
    for _ in range(60):
        assert list(robot.step()) == []
