"""The operator's cap and the override of the person at the robot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import pytest
from harness.pair import HOME, SETUP, idle_pair
from harness.parts import changed
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import OverrideReal
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.order import Order, Patience
from twin_controller.core.orders.speed import (
    NOT_HELD,
    ZONE_AHEAD,
    ZONE_BESIDE,
    Leader,
    Speeds,
    cap_speeds,
    cap_step,
    hear_override,
    real_cap,
    speed_answer,
)
from twin_controller.core.safety.beside import Beside
from twin_controller.core.safety.fastest import Cap
from twin_controller.core.safety.guard import Guard
from twin_controller.core.safety.separation import Distance
from twin_controller.core.safety.watch import Safety
from twin_controller.core.sides.side import RealSide, Sides, TwinSide

PERCENT = st.integers(1, 100)
NO_CAP = [
    st.tuples(st.just("person"), PERCENT),
    st.tuples(st.just("same"), st.none()),
    st.tuples(st.just("zone"), PERCENT),
    st.tuples(st.just("program"), st.booleans()),
    st.tuples(st.just("wait"), st.integers(1, 40)),
]
DEEDS = st.lists(st.one_of(*NO_CAP, st.tuples(st.just("cap"), PERCENT)), min_size=1, max_size=30)
STEP_S = 0.01
LATE = st.integers(0, 40)  # [steps]
WRITES = st.lists(st.one_of(LATE, st.none()), max_size=8)
"""How late each write reaches the robot; None: it is lost. Those behind the last are at once."""
RETRY = round(SETUP.config.speed.retry_ms * 1e-3 / STEP_S)
MEMORY = 100
"""For so many steps a value that was written and one that a person has set look the same."""
QUIET = 400
"""Steps after which all that was sent has come, and what was lost has been sent again."""


class Register:
    """The robot's override, a person who sets it, and the controller's caps.

    Writes come in the order in which they were sent, late or never; readings are
    ``late`` steps old.
    """

    def __init__(self, writes: Iterable[int | None] = (), late: int = 0) -> None:
        self.value = self.shown = 100.0
        # What a person has set and the controller could see; ``sure``: nothing else looks like it.
        self.persons, self.sure = 100.0, True
        self.program = False
        self.zone = 100.0
        self.speeds = Speeds()
        self.steps, self.unsure = 1000, 0
        self.set_there = False
        self.delays = iter(writes)
        self.coming: list[tuple[int, float]] = []
        self.readings = [(self.value, False)] * late
        self.written: list[tuple[int, float]] = []
        # What was told: when, from what, to what.
        self.told: list[tuple[float, float, float]] = []

    @property
    def now(self) -> float:
        """Time [s]."""
        return self.steps * STEP_S

    @property
    def recent(self) -> set[float]:
        """What was written so recently that the robot may show it yet."""
        return {value for at, value in self.written if self.steps - at <= MEMORY}

    @property
    def seen(self) -> bool:
        """Whether the newest reading shows what the robot has."""
        return self.shown == self.value and not self.coming

    def step(self) -> Iterator[float]:
        """Let one reading pass; yield what the controller writes."""
        self.steps += 1
        while self.coming and self.coming[0][0] <= self.steps:
            self.value, self.set_there = self.coming.pop(0)[1], False
        self.readings.append((self.value, self.set_there))
        before = self.shown
        self.shown, by_person = self.readings.pop(0)
        if by_person and self.shown != before:
            if self.shown in self.recent:
                self.unsure = self.steps + MEMORY
            self.sure = self.steps > self.unsure
            # Else what is still to come of ours may look like a person's, too.
            most = max(self.persons, self.shown, *self.recent)
            self.persons = self.shown if self.sure else most
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
        safety = Safety(separation=Distance(cap=self.zone))
        self.speeds, actions = cap_speeds(
            SETUP, self.speeds, sides, safety, leader, NOT_HELD, self.now
        )
        for action in actions:
            assert isinstance(action, OverrideReal)
            yield action.speed_percent
            self._write(action.speed_percent)

    def _write(self, value: float) -> None:
        self.written.append((self.steps, value))
        delay = next(self.delays, 0)
        if delay == 0 and not self.coming:
            self.value, self.set_there = value, False
        elif delay is not None:
            first = self.coming[-1][0] if self.coming else 0
            self.coming.append((max(first, self.steps + delay), value))

    def do(self, what: str, value: object) -> None:
        """Carry out one deed."""
        if what == "person":
            self.value, self.set_there = float(str(value)), True
            self.sure &= self.value != self.shown
        elif what == "same" and self.zone == 100.0 and not self.recent and self.seen:
            # Beside a zone this cannot be seen.
            self.persons = self.value
        elif what == "cap":
            self.speeds = replace(self.speeds, cap=float(str(value)))
        elif what == "zone":
            self.zone = float(str(value))
        elif what == "program":
            self.program = bool(value)


def slow_robot(
    deeds: list[tuple[str, object]], writes: Iterable[int | None], late: int
) -> Register:
    """Return a robot after the deeds and some quiet: nothing written was more than a person set."""
    robot = Register(writes, late)
    for what, value in [*deeds, ("wait", QUIET)]:
        robot.do(what, value)
        for _ in range(int(str(value)) if what == "wait" else 2):
            for written in robot.step():
                assert written <= robot.persons, "raised above what the person has set"
                last = robot.written[-1] if robot.coming else (0, 0.0)
                assert written != last[1] or robot.steps - last[0] >= RETRY, "told twice"
    assert robot.value <= robot.persons
    return robot


@example(
    deeds=[("person", 5), ("program", True), ("cap", 1), ("wait", 3), ("same", None), ("cap", 100)],
    writes=[],
    late=0,
)
@example(
    deeds=[("person", 5), ("cap", 1), ("wait", 3), ("person", 1), ("cap", 100), ("wait", 40)],
    writes=[],
    late=0,
)
@given(deeds=DEEDS, writes=WRITES, late=LATE)
def test_what_a_person_has_set_is_never_raised(
    deeds: list[tuple[str, object]], writes: list[int | None], late: int
) -> None:
    """Whatever cap and zone do, and however late the robot; both limit a program of its own."""
    robot = slow_robot(deeds, writes, late)
    if robot.program:
        assert robot.value <= min(robot.speeds.cap, robot.zone)


@given(deeds=st.lists(st.one_of(NO_CAP), max_size=30), writes=WRITES, late=LATE)
def test_what_a_zone_has_taken_comes_back_however_late(
    deeds: list[tuple[str, object]], writes: list[int | None], late: int
) -> None:
    """And no write that is lost keeps the robot slow."""
    robot = slow_robot([*deeds, ("zone", 100)], writes, late)
    assert robot.value == robot.persons or not robot.sure
    assert robot.speeds.own_override is None and not robot.speeds.under_way


@given(deeds=DEEDS, writes=WRITES, late=LATE)
def test_what_a_person_changes_is_told_once_and_what_we_change_never(
    deeds: list[tuple[str, object]], writes: list[int | None], late: int
) -> None:
    """What is set while nothing of ours is under way is told at once, all else at most once."""
    robot = Register(writes, late)
    list(robot.step())
    unheard: list[float] = []
    for what, value in [*deeds, ("wait", QUIET)]:
        seen, quiet = robot.shown, not robot.speeds.under_way and not late
        robot.do(what, value)
        before = len(robot.told)
        if what == "person":
            unheard.append(robot.value)
            list(robot.step())
            if quiet and robot.told[before:] != [(robot.now, seen, float(str(value)))]:
                assert seen == value, "a change was not told"
        for _ in range(int(str(value)) if what == "wait" else 2):
            list(robot.step())
        for _, _, told in robot.told[before:]:
            assert told in unheard or not robot.sure, "told as a person's"
            unheard = unheard[unheard.index(told) + 1 :] if told in unheard else unheard


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


@pytest.mark.parametrize(
    ("allowed", "own", "told"),
    [
        (50.0, 100.0, ""),
        (49.5, 100.0, ""),
        (49.0, 100.0, "; the real robot gets 49 % for now: a zone"),
        (50.0, 49.0, "; the real robot keeps its own override of 49 %: raise it there"),
        (49.0, 49.5, ""),
        (20.0, 30.0, "; the real robot gets 20 % for now: a zone"),
    ],
)
def test_the_answer_to_a_cap_says_what_of_it_the_robot_does_not_get(
    allowed: float, own: float, told: str
) -> None:
    """From a whole percent on: the override is a whole number."""
    rest = JointMotion.at_rest(HOME)
    flags = RealMeasured(1.0, 1.0, 1.0, 0, rest, own_program=True, override_percent=own)
    answer = speed_answer(Speeds(cap=50.0), flags, Cap(allowed, "a zone"))
    assert answer == "speed of both capped at 50 %" + told


def running(shown: float, speed: float) -> Sides:
    """Return sides whose robot runs a program of its own, with override and speed [percent]."""
    told = {"own_program": True, "override_percent": shown, "speed_percent": speed}
    return changed(
        idle_pair().state.sides, **{f"real__flags__{name}": value for name, value in told.items()}
    )


@pytest.mark.parametrize(
    ("shown", "speed", "asks", "gets"),
    [(40.0, 20.0, 40.0, 20.0), (40.0, 60.0, 80.0, 40.0), (0.0, 0.2, 16.0, 0.0)],
)
def test_a_robot_that_leads_asks_for_its_part_of_what_it_was_set_to(
    shown: float, speed: float, asks: float, gets: float
) -> None:
    """It was set to 80 % and held at 40: it shows its override times its program's speed."""
    held = Speeds(
        real=Order(40.0, Patience(1e3), sent=1.0, attempts=1), own_override=80.0, seen_override=40.0
    )
    leader, pace = Leader("real", ""), Cap(100.0, "")
    sides = running(shown, speed)
    speeds, _ = cap_speeds(SETUP, held, sides, Safety(), leader, pace, 2.0)
    assert (speeds.requested, speeds.applied) == pytest.approx((asks, gets))
    assert speeds.limited


@pytest.mark.parametrize(("cap", "step"), [(100.0, 0.5), (10.0, 0.5), (4.0, 0.2), (1.0, 0.05)])
def test_a_small_cap_is_told_more_finely(cap: float, step: float) -> None:
    """By half a percent, or by a twentieth of itself."""
    config = replace(SETUP.config.speed, step_percent=0.5, step_ratio=0.05)
    assert cap_step(cap, config) == pytest.approx(step)


@pytest.mark.parametrize(("share", "asked", "percent"), [(0.305, 1.0, 30.0), (0.305, 0.8, 38.0)])
def test_a_program_before_a_zone_gets_its_part_of_what_it_asks_for(
    share: float, asked: float, percent: float
) -> None:
    """At an override of 38 % a program of 80 % is as fast as the robot can be stopped from."""
    safety = replace(Safety(), guard=Guard(share=share, asked=asked))
    cap = real_cap(SETUP, Speeds(), safety, "real", own_program=False)
    assert (cap.percent, cap.reason) == (percent, ZONE_AHEAD)


@pytest.mark.parametrize("claimed", [0.0, 30.0, 60.0])
def test_a_twin_that_leads_asks_for_what_it_claims_or_what_is_measured_of_it(
    claimed: float,
) -> None:
    """Of its fastest joint, whichever way it goes, in percent of that joint's largest speed."""
    sides = idle_pair().state.sides
    qdot = (0.2 * SETUP.velocity[0], -0.45 * SETUP.velocity[1], 0.0, 0.0)
    motion = replace(sides.twin.motion, speed_requested_percent=claimed)
    sample = JointMotion.measured(HOME, qdot, sides.twin.last.time)
    twin = replace(sides.twin, motion=motion, history=(*sides.twin.history[:-1], sample))
    sides = replace(sides, twin=twin)
    leader, pace = Leader("twin", ""), Cap(100.0, "")
    speeds, _ = cap_speeds(SETUP, Speeds(), sides, Safety(), leader, pace, 2.0)
    assert speeds.requested == pytest.approx(max(claimed, 45.0))


@pytest.mark.parametrize(("leader", "beside"), [("", True), ("real", True), ("twin", False)])
def test_a_robot_beside_a_zone_begins_as_slowly_as_it_can_be_stopped(
    leader: str, beside: bool
) -> None:
    """In whole percents; one that follows is as slow as its leader, whose way was judged."""
    safety = replace(Safety(), guard=Guard(beside=Beside(share=0.305)))
    cap = real_cap(SETUP, Speeds(), safety, leader, own_program=False)
    assert (cap.percent, cap.reason) == ((30.0, ZONE_BESIDE) if beside else (100.0, ""))


@pytest.mark.parametrize(("claimed", "limited"), [(50.0, False), (50.5, True), (30.0, False)])
def test_a_twin_that_asks_for_half_a_percent_more_than_it_gets_is_limited(
    claimed: float, limited: bool
) -> None:
    """And the reason is said with it, and never without it."""
    sides = idle_pair().state.sides
    twin = replace(sides.twin, motion=replace(sides.twin.motion, speed_requested_percent=claimed))
    leader, pace = Leader("twin", ""), Cap(50.0, "the pace")
    speeds, _ = cap_speeds(SETUP, Speeds(), replace(sides, twin=twin), Safety(), leader, pace, 2.0)
    assert (speeds.limited, speeds.reason) == (limited, "the pace" if limited else "")


@pytest.mark.parametrize(("shown", "limited"), [(100.0, False), (40.0, True), (30.0, False)])
def test_a_robot_that_runs_at_what_we_wrote_is_limited_by_it(shown: float, limited: bool) -> None:
    """Though nobody knows what it was set to; below the cap it is the person's own choice."""
    sides = running(shown, shown)
    order = Order(shown, Patience(1e3), sent=1.0, attempts=1)
    held = Speeds(cap=40.0, real=order, own_override=None, seen_override=shown)
    leader, pace = Leader("real", ""), Cap(100.0, "")
    speeds, _ = cap_speeds(SETUP, held, sides, Safety(), leader, pace, 2.0)
    assert speeds.limited is limited and bool(speeds.reason) is limited
