"""Any inputs, however absurd, are survived; the real robot is told what is within its limits."""

from __future__ import annotations

import math
import sys
from functools import cache
from itertools import chain

import msgspec
from harness.pair import SETUP, Pair
from harness.running.thorough import examples
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.core.actions import (
    AnyAction,
    Command,
    Decided,
    FollowTwin,
    OverrideReal,
    Reply,
    Send,
    StreamAhead,
    StreamReal,
)
from twin_controller.core.events import (
    AnyEvent,
    ClockProbe,
    ControlAsked,
    Event,
    GripAnswered,
    LinkChanged,
    MoveEnded,
    Operator,
    PersonSeen,
    RealAlarm,
    RealKnown,
    RealMeasured,
    Tick,
    TwinGripper,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.lead.commands.holder import ACTIONS
from twin_controller.core.lead.modes import EVERY_COMMAND
from twin_controller.core.step import step
from twin_controller.twin.packets import MOTION_STATES
from twin_controller.view import decision_text, state_view, statuses

replace = msgspec.structs.replace
BIG = sys.float_info.max
PART, SPEED = st.floats(0.0, 1.0), st.floats(1.0, 100.0)
NOW = st.one_of(st.floats(99.0, 103.0), st.floats(-1e9, 1e9))
ANY = st.one_of(
    st.floats(-3.0, 3.0),
    st.floats(-BIG, BIG),
    st.sampled_from([0.0, -0.0, 5e-324, 1e-200, BIG, -BIG]),
)
STAMP = st.one_of(st.floats(99.0, 103.0), st.floats(-BIG, BIG))
JOINTS = st.tuples(*[ANY] * 4)
PERCENT = st.one_of(st.floats(0.0, 100.0), ANY)
FLAGS = st.booleans()
TEXT = st.text(max_size=5)


@st.composite
def plans(draw: st.DrawFn) -> TwinPlan:
    """Return a plan as it passes the check of the packets: times increase, all finite."""
    times = sorted(set(draw(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=4))))
    rows = [tuple(draw(JOINTS) for _ in times) for _ in range(3)]
    points = tuple(map(JointMotion, *rows))
    return TwinPlan(draw(NOW), draw(STAMP), Setpoints.due(SETUP.names, tuple(times), points))


RINGS = st.sampled_from([(0, 0, 0), (10, 0, 0), (10, 32755, 3), (2, 7, 0)])
"""Places, what was taken last, underruns."""


@st.composite
def answers(draw: st.DrawFn) -> RealMeasured:
    """Return an answer of the real robot, within its limits, as the registers are checked for."""
    now = draw(NOW)
    q = tuple(draw(st.floats(low, high)) for low, high in zip(SETUP.lower, SETUP.upper))
    qdot = tuple(draw(st.floats(-1.5 * v, 1.5 * v)) for v in SETUP.velocity)
    clock = draw(
        st.one_of(st.integers(0, (1 << 31) - 1), st.just(round((now + 5000.0) * 1000) % (1 << 31)))
    )
    sent = now - draw(st.floats(0.0, 0.04))
    flags = [draw(FLAGS) for _ in range(7)]
    grip = (draw(st.one_of(st.none(), FLAGS)), draw(FLAGS))
    return RealMeasured(
        now,
        sent,
        now,
        clock,
        JointMotion.measured(q, qdot, 1e-3 * clock),
        *flags,
        draw(st.floats(0, 100)),
        draw(st.floats(0, 100)),
        *grip,
        *draw(RINGS),
    )


PERSON = st.sampled_from(["", "fitter", "foreman"])
UNPROVEN = st.sampled_from(["", "", "", "wrong token"])
COMMAND = st.sampled_from([*EVERY_COMMAND, "NONSENSE", ""])
EVENTS: st.SearchStrategy[AnyEvent] = st.one_of(
    st.builds(Tick, NOW),
    st.builds(LinkChanged, NOW, st.sampled_from(["real", "twin"]), FLAGS, TEXT),
    answers(),
    st.builds(RealAlarm, NOW, TEXT),
    st.builds(TwinMeasured, NOW, st.builds(JointMotion.measured, JOINTS, JOINTS, STAMP)),
    plans(),
    st.builds(
        TwinMotion,
        NOW,
        st.sampled_from(MOTION_STATES),
        PERCENT,
        PERCENT,
        PERCENT,
        st.integers(0, (1 << 32) - 1),
        FLAGS,
        TEXT,
        st.one_of(st.just(()), JOINTS),
    ),
    st.builds(TwinGripper, NOW, FLAGS, FLAGS, TEXT),
    st.builds(GripAnswered, NOW, st.sampled_from(["real", "twin"]), FLAGS, TEXT),
    st.builds(
        RealKnown,
        NOW,
        *[st.tuples(*[st.floats(0.0, 1.0)] * len(SETUP.names))] * 2,
        PART,
        SPEED,
        SPEED,
        PART,
    ),
    st.builds(PersonSeen, NOW, st.tuples(ANY, ANY, ANY)),
    st.builds(ClockProbe, NOW, NOW, NOW, STAMP),
    st.builds(MoveEnded, NOW, FLAGS, TEXT),
    st.builds(
        Operator,
        NOW,
        COMMAND,
        st.integers(0, 9),
        st.floats(allow_nan=True),
        st.lists(st.floats(allow_nan=True), max_size=5).map(tuple),
        TEXT,
        PERSON,
        PERSON,
        UNPROVEN,
    ),
    st.builds(
        ControlAsked,
        NOW,
        st.sampled_from([*ACTIONS, "NONSENSE", ""]),
        st.integers(0, 9),
        PERSON,
        PERSON,
        UNPROVEN,
        FLAGS,
    ),
)


@cache
def warm(leader: str) -> Pair:
    """Return a pair in the middle of something; nobody changes it."""
    pair = Pair()
    if leader == "new":
        return pair
    pair.connect()
    if leader == "operator":
        pair.operate("MOVE_JOINTS", target=(0.3, -0.4, -0.1, 0.1))
        pair.run(0.4)
    elif leader == "paused":
        pair.operate("MOVE_JOINTS", target=(0.3, -0.4, -0.1, 0.1))
        pair.run(0.6)
        pair.operate("PAUSE")
        pair.run(0.1)
    elif leader == "held":
        pair.control("TAKE", "fitter")
    elif leader == "stopped":
        pair.operate("STOP")
        pair.run(0.6)
    elif leader == "emergency":
        pair.operate("ESTOP")
        pair.run(0.1)
    return pair


STARTS = ("emergency", "held", "idle", "new", "operator", "paused", "stopped")


def in_time(event: AnyEvent, now: float, pair: Pair) -> AnyEvent:
    """Return the event as if it had come at ``now`` from clocks in good order."""
    event = replace(event, now=now)
    if isinstance(event, RealMeasured):
        clock = round((now + pair.real_clock) * 1000) % (1 << 31)
        return replace(event, sent=now - 0.001, received=now, clock_ms=clock)
    if isinstance(event, TwinMeasured):
        return replace(event, motion=replace(event.motion, time=now + pair.twin_clock))
    if isinstance(event, TwinPlan):
        return replace(event, stamp=now + pair.twin_clock)
    if isinstance(event, ClockProbe):
        return replace(event, sent=now - 0.001, received=now, remote=now + pair.twin_clock - 0.0005)
    return event


@st.composite
def histories(draw: st.DrawFn) -> tuple[str, list[AnyEvent]]:
    """Return where to begin and what comes, half of it in good order of time, the rest wild."""
    start = draw(st.sampled_from(STARTS))
    pair, events = warm(start), []
    now = pair.now
    for event in draw(st.lists(EVENTS, min_size=1, max_size=12)):
        now += draw(st.sampled_from([0.0, 0.001, 0.01, 0.01, 0.05]))
        events.append(in_time(event, now, pair) if draw(FLAGS) else event)
    return start, events


def check(action: AnyAction, override: float) -> None:
    """Hold one action against what each side can be told at all."""
    if isinstance(action, StreamReal):
        q = action.setpoint.q
        assert len(q) == len(SETUP.names)
        assert all(low <= value <= high for value, low, high in zip(q, SETUP.lower, SETUP.upper))
        assert 0.0 < action.speed_percent <= 100.0
        assert (
            action.speed_percent * max(override, 1.0) * 1e-2
            <= SETUP.config.limit.speed_percent + 1e-9
        )
    elif isinstance(action, StreamAhead):
        assert 0.0 < action.speed_percent <= 100.0 and 1 <= action.newest <= 32760
        for point in action.points:
            assert 1 <= point.number <= 32760 and len(point.q) == len(SETUP.names)
            assert all(
                low <= value <= high for value, low, high in zip(point.q, SETUP.lower, SETUP.upper)
            )
    elif isinstance(action, FollowTwin):
        rows = [row for point in action.points for row in (point.q, point.qdot, point.qddot)]
        assert all(map(math.isfinite, (action.stamp, *chain.from_iterable(rows))))
    elif isinstance(action, OverrideReal):
        assert 1.0 <= action.speed_percent <= 100.0


@settings(
    max_examples=examples(60, 400), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(history=histories())
def test_any_sequence_of_inputs_is_survived(history: tuple[str, list[AnyEvent]]) -> None:
    """Nothing raises or is out of range, all is answered, and all of it can be shown."""
    start, events = history
    state = warm(start).state
    for event in events:
        state, actions = step(SETUP, state, event)
        flags = state.sides.real.flags
        for action in actions:
            check(action, flags.override_percent if flags is not None else 100.0)
            if isinstance(action, Decided):
                assert decision_text(action)
        replies = [action for action in actions if isinstance(action, Reply)]
        assert len(replies) == isinstance(event, Operator | ControlAsked)
        done = {action.command for action in actions if isinstance(action, Send)}
        if isinstance(event, Operator) and event.command == "STOP":
            assert {Command.STOP_REAL, Command.STOP_TWIN} <= done
    state_view(SETUP, state, events[-1].now)
    statuses(SETUP, state, {}, events[-1].now)


def test_every_kind_of_input_is_tried() -> None:
    """The strategy knows all events."""
    found: set[type[Event]] = set()

    @settings(max_examples=600, deadline=None, database=None, derandomize=True)
    @given(EVENTS)
    def look(event: AnyEvent) -> None:
        found.add(type(event))

    look()
    assert found == set(Event.__subclasses__())
