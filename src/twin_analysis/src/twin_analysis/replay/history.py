"""The pair at any time of a recording.

The controller's state of then is replayed from the last recorded one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from scara_ros.shadow import Shadow
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState
from twin_controller.reporting.shadow import shadow_of
from twin_controller.reporting.snapshots import decode_events, latest
from twin_experiments.report.record import RecordError

from twin_analysis.replay.decisions import RecordedInput, Replay

# [s], our choice: a larger number is ROS time, a smaller one counts from the start of the recording
ROS_TIME = 1e6
DOUBLE_NS = 1000  # what a double in seconds since 1970 cannot resolve, and then some


def shadow_at(
    setup_at: Callable[[float], Setup], inputs: Sequence[RecordedInput], time: float
) -> Shadow:
    """Return the shadow that was true at a time of the recording.

    Args:
        setup_at: Profile and numbers in force at a time [s].
        inputs: The recorded inputs.
        time: [s] since the start of the recording, 0: the first state, negative: before its end,
            large: ROS time.

    Raises:
        RecordError: There is no state at or before that time.
    """
    begin = next((message.at for message in inputs if message.state), None)
    if begin is None:
        raise RecordError("no state of the controller was recorded")
    if time > ROS_TIME:
        last = max(
            (k for k, message in enumerate(inputs) if message.stamp_ns <= time * 1e9 + DOUBLE_NS),
            default=-1,
        )
    else:
        wanted = begin
        if time > 0.0:
            wanted = time
        elif time < 0.0:  # counted from the end
            wanted = inputs[-1].at + time
        last = max((k for k, message in enumerate(inputs) if message.at <= wanted), default=-1)
    first = max((k for k, message in enumerate(inputs[: last + 1]) if message.state), default=-1)
    if first < 0:
        raise RecordError(f"time {time:g} s: no state before it; the first one is at {begin:.3f} s")
    return _replayed(setup_at, inputs[first : last + 1])


def _replayed(setup_at: Callable[[float], Setup], inputs: Sequence[RecordedInput]) -> Shadow:
    """Replay messages that begin with a state and return the shadow after the last one."""
    running = Replay(setup_at, {}, inputs[-1].at)
    reached: list[CoreState] = []
    for message in inputs:
        # A lambda cannot assign, so the newest state takes the place of a list's content.
        running.feed(message, lambda _, state: reached.__setitem__(slice(None), [state]))
    result = running.finish()
    if result.lost or result.restarts:
        raise RecordError(
            f"the state then is not known: {(result.lost + result.restarts)[-1]}; no "
            "state was recorded since"
        )
    last = inputs[-1]
    now = latest(decode_events(last.data), 0.0)
    return shadow_of(setup_at(last.at), reached[0], now, last.stamp_ns * 1e-9)
