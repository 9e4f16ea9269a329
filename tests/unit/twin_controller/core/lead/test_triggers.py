"""Who was first, from onsets and their uncertainty; when to wait; what a stale plan is worth."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, ROBOT, SETUP, idle_pair, shifted
from harness.parts import changed
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.core.events import Operator, TwinPlan
from twin_controller.core.lead.modes import COMMANDS, MOVES, Mode, Trigger
from twin_controller.core.lead.reports import agree_when_stopped
from twin_controller.core.lead.triggers import (
    leader_triggers,
    onsets,
    operator_trigger,
    pair_agreed,
)
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
CONFIRMED, PENDING, NOTHING = (True, True), (False, True), ()
LATER = 10.0


@pytest.fixture(scope="module")
def idle() -> CoreState:
    """Return the state of an idle pair."""
    pair = idle_pair()
    return pair.state


def moved(
    state: CoreState,
    side: str,
    recent: tuple[bool, ...],
    onset: float | None,
    seen_until: float = LATER,
) -> CoreState:
    """Return the state with one side's change, its newest sample ``seen_until`` [s] from now."""
    known = getattr(state.sides, side)
    change = replace(known.change, recent=recent, onset=onset, previous=None)
    last = replace(known.last, time=state.lead.since + seen_until)
    known = replace(known, change=change, history=(*known.history, last))
    return changed(state, **{f"sides__{side}": known})


def both(state: CoreState, real: float, twin: float) -> CoreState:
    """Return the state after both have moved, onsets in seconds after IDLE began."""
    begun = state.lead.since
    return moved(moved(state, "real", CONFIRMED, begun + real), "twin", CONFIRMED, begun + twin)


@pytest.mark.parametrize(
    ("ahead", "expected"),
    [
        (-100.0, Trigger.TWIN_MOVED),
        (-0.5, Trigger.REAL_MOVED),
        (-0.99, Trigger.REAL_MOVED),
        (-1.01, Trigger.TWIN_MOVED),
        (0.0, Trigger.REAL_MOVED),
        (1.0, Trigger.REAL_MOVED),
        (100.0, Trigger.REAL_MOVED),
    ],
)
def test_the_twin_leads_only_if_it_was_first_beyond_the_uncertainty(
    idle: CoreState, ahead: float, expected: Trigger
) -> None:
    """``ahead``: the twin's onset minus the real one, in uncertainties; within one it is a tie."""
    uncertainty = onsets(SETUP, idle).uncertainty
    assert (
        uncertainty == idle.sides.real.clock.uncertainty + idle.sides.twin.clock.uncertainty > 0.0
    )
    assert leader_triggers(SETUP, both(idle, 1.0, 1.0 + ahead * uncertainty)) == [expected]


def test_nobody_leads_while_nobody_moved(idle: CoreState) -> None:
    """A single sample outside is no change."""
    assert leader_triggers(SETUP, idle) == []
    assert leader_triggers(SETUP, moved(idle, "real", PENDING, idle.lead.since + 1.0)) == []


@pytest.mark.parametrize(
    ("real", "twin", "expected"),
    [
        ((CONFIRMED, 1.0, LATER), (NOTHING, None, LATER), [Trigger.REAL_MOVED]),
        ((CONFIRMED, 1.0, LATER), (NOTHING, None, 0.9), []),
        ((CONFIRMED, 1.0, LATER), (PENDING, 0.98, 1.01), []),
        ((CONFIRMED, 1.0, LATER), (PENDING, 0.98, 1.2), [Trigger.REAL_MOVED]),
        ((CONFIRMED, 1.0, LATER), (PENDING, 1.01, 1.02), [Trigger.REAL_MOVED]),
        ((NOTHING, None, LATER), (CONFIRMED, 1.0, LATER), [Trigger.TWIN_MOVED]),
        ((NOTHING, None, 0.9), (CONFIRMED, 1.0, LATER), []),
        ((PENDING, 0.99, 1.01), (CONFIRMED, 1.0, LATER), []),
        ((PENDING, 0.99, 1.2), (CONFIRMED, 1.0, LATER), [Trigger.TWIN_MOVED]),
        ((PENDING, 1.02, 1.03), (CONFIRMED, 1.0, LATER), [Trigger.TWIN_MOVED]),
    ],
)
def test_a_side_that_may_still_prove_to_be_first_is_waited_for(
    idle: CoreState,
    real: tuple[tuple[bool, ...], float | None, float],
    twin: tuple[tuple[bool, ...], float | None, float],
    expected: list[Trigger],
) -> None:
    """Until its data reach past the other's onset; a few samples more once it began to move."""
    state = idle
    for side, (recent, onset, until) in (("real", real), ("twin", twin)):
        state = moved(
            state, side, recent, None if onset is None else idle.lead.since + onset, until
        )
    assert leader_triggers(SETUP, state) == expected


def plan(state: CoreState, due: float) -> CoreState:
    """Return the state with an announced motion that begins ``due`` seconds after IDLE did."""
    points = tuple(map(JointMotion.at_rest, (HOME, *[shifted(HOME, 1.0)] * 2)))
    stamp = state.sides.twin.clock.to_remote(state.lead.since + due)
    coming = TwinPlan(0.0, stamp - 0.1, Setpoints.due(SETUP.names, (0.0, 0.1, 0.2), points))
    return changed(state, sides__twin__plan=coming, sides__twin__motion__state="announcing")


def test_an_announced_motion_counts_from_when_it_will_begin(idle: CoreState) -> None:
    """The twin leads before it moves, unless the real robot has moved before that instant."""
    announced = plan(idle, 5.0)
    assert onsets(SETUP, announced).twin == pytest.approx(idle.lead.since + 5.0)
    assert leader_triggers(SETUP, announced) == [Trigger.TWIN_MOVED]
    assert leader_triggers(SETUP, moved(announced, "real", CONFIRMED, idle.lead.since + 4.9)) == [
        Trigger.REAL_MOVED
    ]


@pytest.mark.parametrize("motion", ["idle", "following", "paused", "stopping", "estopped"])
def test_a_plan_counts_only_while_a_motion_is_announced_or_runs(
    idle: CoreState, motion: str
) -> None:
    """What is left of a plan after its motion is no intent."""
    announced = changed(plan(idle, 5.0), sides__twin__motion__state=motion)
    assert leader_triggers(SETUP, announced) == []


def test_rows_from_before_the_agreement_do_not_count(idle: CoreState) -> None:
    """They belong to the motion that ended with it."""
    assert onsets(SETUP, plan(idle, -0.3)).twin is None


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode not in (Mode.IDLE, Mode.STOPPED)])
def test_a_lead_is_taken_only_from_rest(idle: CoreState, mode: Mode) -> None:
    """While somebody leads, aligns or is stopped by a fault, motion makes no new leader."""
    assert leader_triggers(SETUP, changed(both(idle, 1.0, 2.0), lead__mode=mode)) == []


@pytest.mark.parametrize("side", ["real", "twin"])
def test_nobody_leads_while_a_side_is_unknown(idle: CoreState, side: str) -> None:
    """A side that has been lost has no past to compare."""
    state = both(idle, 1.0, 2.0)
    assert leader_triggers(SETUP, changed(state, **{f"sides__{side}__history": ()})) == []


@pytest.mark.parametrize(("off", "agreed"), [(0.0, True), (0.5, True), (-0.5, True), (0.52, False)])
def test_a_twin_leads_only_from_where_the_real_robot_is(
    idle: CoreState, off: float, agreed: bool
) -> None:
    """Else it aligns first: the real robot never jumps to where the twin happens to be."""
    base = idle.sides.real.change.baseline
    away = changed(idle, sides__real__change__baseline=(base[0] + off, *base[1:]))
    state = moved(away, "real", NOTHING, None)
    assert pair_agreed(SETUP, state) is agreed
    expected = Trigger.TWIN_MOVED if agreed else Trigger.TWIN_MOVED_UNALIGNED
    assert leader_triggers(SETUP, moved(state, "twin", CONFIRMED, idle.lead.since + 1.0)) == [
        expected
    ]


@pytest.mark.parametrize(
    ("command", "changes", "expected"),
    [
        *((name, {}, Trigger[name]) for name in COMMANDS if name != "ACKNOWLEDGE"),
        ("ACKNOWLEDGE", {"lead__needs_acknowledge": True}, Trigger.ACKNOWLEDGE),
        ("ACKNOWLEDGE", {}, Trigger.ACKNOWLEDGE_NOTHING),
        ("RESUME", {"lead__needs_acknowledge": True}, Trigger.RESUME_BLOCKED),
        ("RESET", {"lead__links_up": False}, Trigger.RESET_BLOCKED),
        # Its loss is found in this very step.
        ("RESET", {"sides__real__history": ()}, Trigger.RESET_BLOCKED),
        *((name, {}, Trigger.MOVE) for name in MOVES),
        ("stop", {}, None),
        ("LINK_LOST", {}, None),
        ("", {}, None),
    ],
)
def test_a_command_becomes_its_trigger(
    idle: CoreState, command: str, changes: dict[str, bool], expected: Trigger | None
) -> None:
    """Conditions included; a trigger that is no command cannot be called by its name."""
    assert operator_trigger(SETUP, changed(idle, **changes), Operator(0.0, command)) is expected


@pytest.mark.parametrize("late_ms", [0, 40, 80, 120])
def test_one_damaged_answer_while_the_twin_aligns_is_no_motion(late_ms: int) -> None:
    """A standing robot whose one reading is far off leads nobody, whenever that comes.

    While it comes again and again the pair need not be ready: the twin may be on its way there.
    """
    pair = idle_pair()
    pair.link("real", False)
    pair.run(0.3)
    since = len(pair.decisions())
    pair.link("real", True)
    pair.until(Mode.ALIGNING)
    sound, begun = pair.real_at, pair.now
    # For longer than it takes to align, each tenth answer is damaged.
    for number in range(60):
        pair.run(0.0097)
        damaged = (number + late_ms // 40) % 10 == 0
        pair.real_at = (  # type: ignore[method-assign]
            (lambda t: (shifted(sound(t)[0], 0.4), sound(t)[1])) if damaged else sound
        )
    assert pair.now - begun > 0.5
    pair.real_at = sound  # type: ignore[method-assign]
    pair.run(0.3)
    assert pair.triggers(since) == ["LINKS_READY", "ALIGNED"]


@pytest.mark.parametrize(
    ("writes", "runs", "ended", "agrees"),
    [
        (False, False, False, True),
        (False, False, True, True),
        (False, True, False, False),
        (False, True, True, True),
        (True, True, False, True),
    ],
)
def test_only_a_program_that_no_stop_reaches_keeps_a_robot_from_agreeing(
    idle: CoreState, writes: bool, runs: bool, ended: bool, agrees: bool
) -> None:
    """It stands in a WAIT, and goes on; one that was seen to end has ended."""
    setup = Setup(replace(ROBOT, lead=writes), SETUP.config)
    sides = changed(idle.sides, real__flags__own_program=runs, real__change__baseline=())
    lead = replace(idle.lead, mode=Mode.STOPPED, program_was_off=ended)
    found = agree_when_stopped(setup, lead, sides, lead.since + 1e3)
    assert bool(found.real.change.baseline) is agrees
