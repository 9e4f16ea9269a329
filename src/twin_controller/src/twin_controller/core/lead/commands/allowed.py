"""Tell which commands are allowed now and why the others are not, by the rules themselves."""

from __future__ import annotations

from twin_controller.core.actions import Reply
from twin_controller.core.events import Operator
from twin_controller.core.lead.modes import COMMANDS, Mode, Trigger
from twin_controller.core.lead.operator import operate
from twin_controller.core.lead.table import look_up
from twin_controller.core.orders.stop import under_way
from twin_controller.core.orders.stream import unstartable
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState

ANY_POINT = (0.0, 0.0, 0.0)
"""A target that says nothing: whether a move may begin at all does not depend on it."""
ANY_SPEED_PERCENT = 100.0


def refusals(setup: Setup, state: CoreState, now: float) -> dict[str, str]:
    """Return for each command why it is refused now; an empty text where it is allowed.

    Each command is put to :func:`operate`, whose next state is dropped. The target of MOVE and
    MOVE_JOINTS is judged when it is sent. JOG stands for a jog of the twin, RUN for a program of
    the real robot: no commands, but a side that moves first.

    Args:
        setup: Profile and numbers.
        state: The state now.
        now: Time of the state [s].
    """
    found = {command: _answer(setup, state, now, command) for command in (*COMMANDS, "HOME")}
    found["SPEED"] = _answer(setup, state, now, "SPEED")
    found["MOVE"] = found["MOVE_JOINTS"] = _answer(setup, state, now, "MOVE")
    found["RUN"] = _why_not_lead(state, Trigger.REAL_MOVED)
    if not found["RUN"] and (state.orders.hold_away or under_way(state.orders.stop)):
        # The robot itself would refuse it.
        found["RUN"] = "the real robot still ends its stream program: wait a moment"
    # A jog makes the twin the leader, and goes on meanwhile.
    jogs = state.lead.mode is Mode.TWIN_LEADS
    found["JOG"] = "" if jogs else _why_not_lead(state, Trigger.TWIN_MOVED)
    if not jogs and state.lead.mode is Mode.IDLE:
        found["JOG"] = unstartable(setup, state.sides.real.flags)
    return found


def _answer(setup: Setup, state: CoreState, now: float, command: str) -> str:
    """Return why ``operate`` refuses a command, or an empty text."""
    event = Operator(now=now, command=command, speed_percent=ANY_SPEED_PERCENT, target=ANY_POINT)
    _, actions = operate(setup, state, event, judge_target=False)
    reply = actions[-1]
    assert isinstance(reply, Reply)  # operate answers every command, with the answer last
    return "" if reply.success else reply.message


def _why_not_lead(state: CoreState, moved: Trigger) -> str:
    """Return why a side that moves now does not lead, in the words of a refused move."""
    if not look_up(state.lead.mode, moved, state.lead.paused).silent:
        return ""
    if state.lead.mode is Mode.STOPPED:
        return "the pair is stopped: ALIGN first"
    return look_up(state.lead.mode, Trigger.MOVE, state.lead.paused).why
