"""Every remedy works in the mode in which it is shown, held to the controller's own core."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache, partial

import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from harness.scenes.copies import copied
from harness.sides import Joints
from operator_panel.view.alarms import REMEDIES, Alarm, active_alarms
from operator_panel.view.snapshot import CellState, Diagnosis, Snapshot
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup
from twin_controller.view import state_view, statuses

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
ASIDE = shifted(HOME, 20.0)
ACT = re.compile(r"\b(RESET on its own pendant|RESET|ALIGN|ACKNOWLEDGE|RESUME|STOP)\b")
OF_THE_PERSON_THERE = "RESET on its own pendant"
WARNING = "WARN SYST-011 Start refused"


def nothing(pair: Pair) -> None:
    """Leave the pair at rest."""


def leads(pair: Pair) -> None:
    """Let a program of the robot run."""
    pair.start_program(ramp(HOME, AWAY, 8.0))
    pair.run(1.0)


def pauses(pair: Pair) -> None:
    """Pause the pair on its way."""
    leads(pair)
    assert pair.operate("PAUSE").success
    pair.run(1.0)


def stops(pair: Pair) -> None:
    """Stop the pair on its way."""
    leads(pair)
    assert pair.operate("STOP").success
    pair.run(1.0)


def latches(pair: Pair) -> None:
    """Latch an emergency stop."""
    assert pair.operate("ESTOP").success
    pair.run(1.0)


def presses(pair: Pair) -> None:
    """Press the emergency stop at the robot."""
    pair.press_estop()
    pair.run(1.0)


def cut(side: str, pair: Pair) -> None:
    """Cut the line of a side."""
    pair.link(side, False)
    pair.run(0.5)


def alarmed(text: str, pair: Pair) -> None:
    """Let the robot be stopped by an alarm."""
    pair.alarm(text)
    pair.run(0.5)


def unstarted(pair: Pair) -> None:
    """Let the stream program not start."""
    pair.starts_stream = False
    pair.move_twin(ramp(HOME, AWAY, 4.0))
    pair.run(4.0)


def apart(then: str, pair: Pair, end: Joints = ASIDE) -> None:
    """Let the twin stay behind until the pair is found apart, and then command something."""
    pair.start_program(ramp(HOME, end, 8.0))
    pair.run(1.0)
    pair.take_follow = lambda action, now: None  # type: ignore[method-assign]
    pair.motion, pair.follow = "idle", None
    pair.run_until(lambda: pair.state.safety.divergence.alarm, 5.0)
    pair.run(0.5)
    assert pair.state.safety.divergence.alarm
    if then:
        assert pair.operate(then).success
        pair.run(1.0)


def both(first: Callable[[Pair], None], then: Callable[[Pair], None], pair: Pair) -> None:
    """Let two things happen, one after the other."""
    first(pair)
    then(pair)


def warned(first: Callable[[Pair], None], pair: Pair) -> None:
    """Let the robot refuse a start."""
    first(pair)
    pair.warn(WARNING)
    pair.run(0.1)


FAULTS = partial(alarmed, "SRVO SRVO-050 Collision detect")
NO_TWIN = partial(cut, "twin")
SITUATIONS: dict[str, tuple[Callable[[Pair], None], Mode]] = {
    "warned at rest": (partial(warned, nothing), Mode.IDLE),
    "warned while it leads": (partial(warned, leads), Mode.REAL_LEADS),
    "warned while paused": (partial(warned, pauses), Mode.PAUSED),
    "warned while stopped": (partial(warned, stops), Mode.STOPPED),
    "warned while latched": (partial(warned, latches), Mode.ESTOP),
    "an alarm": (FAULTS, Mode.FAULT),
    "an alarm, then no twin": (partial(both, FAULTS, NO_TWIN), Mode.FAULT),
    "no twin, then an alarm": (partial(both, NO_TWIN, FAULTS), Mode.OFFLINE),
    "no heartbeat": (partial(alarmed, "ABORT UALM-213 heartbeat lost"), Mode.FAULT),
    "apart, then a standstill": (partial(apart, "STANDSTILL"), Mode.STANDSTILL),
    "emergency stop": (latches, Mode.ESTOP),
    "emergency stop at the robot": (presses, Mode.ESTOP),
    "no robot": (partial(cut, "real"), Mode.OFFLINE),
    "no twin": (NO_TWIN, Mode.OFFLINE),
    "no stream": (unstarted, Mode.FAULT),
    "apart": (partial(apart, ""), Mode.PAUSED),
    "apart, then STOP": (partial(apart, "STOP"), Mode.STOPPED),
    "apart, then ESTOP": (partial(apart, "ESTOP"), Mode.ESTOP),
    "apart, then an alarm": (partial(both, partial(apart, ""), FAULTS), Mode.FAULT),
    "apart, then no twin": (partial(both, partial(apart, ""), NO_TWIN), Mode.OFFLINE),
}


def alarms(pair: Pair, diagnosed: bool = True) -> tuple[Alarm, ...]:
    """Return what the page lists of the core's state now, diagnoses included or not yet."""
    view = state_view(SETUP, pair.state, pair.now)
    told = statuses(SETUP, pair.state, {}, pair.now) if diagnosed else []
    found = {s.name: Diagnosis(s.level, s.name, s.message, pair.now) for s in told}
    state = CellState(view.mode, why=view.why, alarm=view.alarm)
    return active_alarms(Snapshot(True, state, pair.now, diagnoses=found), pair.now, 1.0)


def mend(pair: Pair) -> None:
    """Take the causes away that a person takes away: at the robot, at the twin, at a cable."""
    pair.estop_pressed = pair.fault_persists = False
    pair.starts_stream = True
    vars(pair).pop("take_follow", None)
    for side in ("real", "twin"):
        if not getattr(pair, f"{side}_up"):
            pair.link(side, True)
    pair.run(1.0)


def do(pair: Pair, act: str) -> None:
    """Carry out one act of a remedy.

    Raises:
        AssertionError: It is refused.
    """
    if act == OF_THE_PERSON_THERE:
        pair.warn("")
        return
    reply = pair.operate(act)
    assert reply.success, f"{act} in {pair.state.lead.mode}: {reply.message}"
    pair.run(1.0)
    if act == "RESET" and not pair.fault:
        pair.warn("")  # the robot's alarm ends with it


@cache
def together(situation: str) -> Pair:
    """Return a pair in a situation; what is done to it is done to copies."""
    pair = idle_pair()
    begin, mode = SITUATIONS[situation]
    begin(pair)
    assert pair.state.lead.mode is mode
    return pair


@pytest.mark.parametrize("situation", SITUATIONS)
def test_each_remedy_is_accepted_in_its_mode_and_ends_its_alarm(situation: str) -> None:
    """All alarms of a situation, one after the other, each from the beginning."""
    begun = together(situation)
    shown = {alarm for diagnosed in (True, False) for alarm in alarms(begun, diagnosed)}
    assert shown

    def answered(alarm: Alarm, pair: Pair) -> None:
        mend(pair)
        acts = ACT.findall(alarm.remedy or alarm.text)
        # What is done if RESUME does not help is a case of its own, below.
        for act in acts[: acts.index("RESUME") + 1] if "RESUME" in acts else acts:
            do(pair, act)
        left = [(one.source, one.text) for one in alarms(pair)]
        assert (alarm.source, alarm.text) not in left, (alarm, pair.state.lead.mode)

    for alarm in shown:
        copied(partial(answered, alarm, begun))


def test_a_twin_too_far_away_to_follow_parts_again_until_stop_and_align() -> None:
    """RESUME does not bring it back; a pair that was stopped is not asked to acknowledge."""
    pair = idle_pair()
    apart("", pair, AWAY)
    mend(pair)
    (alarm,) = [one for one in alarms(pair) if one.source.endswith("pair")]
    acts = ACT.findall(alarm.remedy)
    assert acts == ["ACKNOWLEDGE", "RESUME", "STOP", "ALIGN"]
    for act in acts[:2]:
        do(pair, act)
    assert pair.state.lead.mode is Mode.PAUSED
    do(pair, "STOP")
    (alarm,) = [one for one in alarms(pair) if one.source.endswith("pair")]
    assert ACT.findall(alarm.remedy) == ["ALIGN"]
    do(pair, "ALIGN")
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 30.0)
    assert alarms(pair) == ()


def test_a_warning_is_no_reason_of_a_later_stop() -> None:
    """What the robot refused a while ago does not explain what stops it now."""
    pair = idle_pair()
    warned(nothing, pair)
    pair.raise_alarm()
    pair.run(0.5)
    assert pair.state.lead.mode is Mode.FAULT
    assert "Start refused" not in pair.state.lead.why


def test_a_pair_that_is_not_paused_when_it_comes_apart_is_told_to_stop_first() -> None:
    """Where what is done about a divergence is left to the operator."""
    pair = Pair(setup=Setup(ROBOT, changed(SETUP.config, divergence__pause=False)))
    pair.connect()
    apart("", pair)
    (alarm,) = [one for one in alarms(pair) if one.source.endswith("pair")]
    mend(pair)
    for act in ACT.findall(alarm.remedy):
        do(pair, act)
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 30.0)
    assert alarms(pair) == ()


def test_every_remedy_that_names_a_command_is_tried_here() -> None:
    """A new row of the table asks for a situation."""
    found = [together(name) for name in SITUATIONS]
    tried = {alarm.remedy for pair in found for alarm in (*alarms(pair), *alarms(pair, False))}
    named = {advice for _, _, advice in REMEDIES if ACT.search(advice)}
    above = {"Look at both robots, STOP, then ALIGN."}
    assert named - tried - above == set()
