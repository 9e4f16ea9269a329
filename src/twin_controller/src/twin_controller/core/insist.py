"""A stop is not done when it is sent: the real robot must show it.

A write may be lost with its connection, or a robot may refuse it. What a stop asked for is compared with the robot's next
answers; it is sent again, and a robot that does not obey has its drives switched off (``Trigger.STOP_IGNORED``).
"""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Do, Perform
from twin_controller.core.events import RealMeasured
from twin_controller.core.state import CoreState, Setup

replace = msgspec.structs.replace


def real_answered(state: CoreState, event: RealMeasured) -> CoreState:
    """Forget a stop once an answer that was asked for after it shows it; remember whether there is something to stop."""
    owed, busy = state.owed, event.own_program or event.streaming
    if owed is not None and event.sent > owed.sent and _obeyed(state, owed.do, event):
        state = replace(state, owed=None)
    return state if busy == state.real_busy else replace(state, real_busy=busy)


def ignored(setup: Setup, state: CoreState, now: float) -> bool:
    """Return whether the real robot, which answers, has obeyed none of all attempts."""
    return _due(setup, state, now) and not _may_repeat(setup, state)


def insist(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Send a stop again that the real robot should show by now.

    Args:
        setup: Profile and numbers.
        state: After an answer of the real robot.
        now: Time [s].

    Returns:
        The state after, and the action if it is due.
    """
    if state.owed is None or not _due(setup, state, now) or not _may_repeat(setup, state):
        return state, []
    owed = replace(state.owed, sent=now, attempts=state.owed.attempts + 1)
    return replace(state, owed=owed), [Perform(owed.do, "the real robot does not show it yet")]


def _due(setup: Setup, state: CoreState, now: float) -> bool:
    return state.owed is not None and now - state.owed.sent > setup.config.stop.retry_ms * 1e-3


def _may_repeat(setup: Setup, state: CoreState) -> bool:
    return state.owed is not None and state.owed.attempts < setup.config.stop.attempts


def _obeyed(state: CoreState, do: Do, event: RealMeasured) -> bool:
    """Return whether the answer shows the stop; a stream that has been begun since is none that goes on."""
    streaming = event.streaming and state.stream is None
    if do is Do.HOLD_REAL:
        return event.paused or not (event.own_program or event.streaming)
    return not (event.own_program or streaming)
