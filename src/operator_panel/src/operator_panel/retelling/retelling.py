"""Tells a recording again: at each of its moments what the page would have shown; pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Any

from msgspec.structs import replace

from operator_panel.retelling import taking
from operator_panel.retelling.lines import Happened, Head, Line, Parts, told
from operator_panel.view.alarms import active_alarms
from operator_panel.view.events import INFO, WARNING, EventLog
from operator_panel.view.snapshot import Part, Snapshot

FINEST_S = 0.1  # our choice: twice the period of twin_controller/state
MOST = 12_000
"""Moments of one recording at most; our choice: 20 minutes at ``FINEST_S``, some 10 MB."""
SELF = "twin_controller"
"""Whose audit, also over the gateway, says again what its decisions say."""

Take = Callable[[Snapshot, Any, float, str], Snapshot]

NEWEST: dict[str, Take] = {
    "twin_controller/state": taking.with_state,
    "real/robot_data": lambda known, said, *_: taking.with_package(known, said),
    "twin/joint_states": lambda known, said, at, _: taking.with_joint_states(known, said, at),
    "joint_vel_controller/state": lambda known, said, *_: replace(known, jog=said.data),
    "what_if/outcomes": lambda known, said, *_: taking.with_outcome(known, said),
    "twin/parts": lambda known, said, *_: taking.with_parts(known, "twin", said),
    "real/parts": lambda known, said, *_: taking.with_parts(known, "real", said),
}
"""Of these only the newest message before a moment is read."""
EACH: dict[str, Take] = {
    "twin_controller/decisions": lambda known, said, at, _: taking.with_decision(
        known, said, _stamp(at)
    ),
    "/diagnostics": lambda known, said, at, clock: taking.with_diagnostics(known, said, at),
}
"""Of these each message counts."""
AUDIT, MARKER = "twin_controller/audit", "experiment/marker"
TOPICS = (*NEWEST, *EACH, AUDIT, MARKER)


class Retelling:
    """Takes the messages of a recording in their order, and says its lines."""

    def __init__(self, first: float, last: float, silent_s: float) -> None:
        """Begin a recording from ``first`` to ``last`` [s]; silent after ``silent_s`` [s]."""
        self.period = max(FINEST_S, (last - first) / MOST)
        self._first, self._last, self._silent_s = first, last, silent_s
        self._snapshot = Snapshot(master=True)
        self._parts: dict[str, tuple[Part, ...]] = {}
        self._log = EventLog()
        self._count = self._said = 0

    def head(self, robot: str) -> Head:
        """Return the first line; ``robot`` is who was recorded."""
        return Head(self._first, self._last, robot)

    def take(self, topic: str, at: float, message: Any) -> None:
        """Take a message of ``TOPICS`` that was received at ``at`` [s]."""
        stamp = _stamp(at)
        if topic == AUDIT:
            # What a page has commanded is said by the page itself.
            if SELF not in message.who:
                severity = INFO if message.success else WARNING
                text = f"{message.what}: {message.outcome}"
                self._log.note(stamp, severity, message.who.strip("/"), text)
        elif topic == MARKER:
            self._log.note(stamp, INFO, "experiment", message.data)
        else:
            take = NEWEST.get(topic) or EACH[topic]
            self._snapshot = take(self._snapshot, message, at, stamp.partition("T")[2])

    def due(self, at: float) -> float | None:
        """Return the time of the next moment [s] if it is not later than ``at``, else None."""
        time = self._first + self._count * self.period
        return time if time <= at else None

    def lines(self, at: float) -> Iterator[Line]:
        """Return what there is to say of the moment ``at`` [s]; the next one is due later."""
        self._count += 1
        snapshot = self._snapshot
        if snapshot.parts is not self._parts:
            self._parts = snapshot.parts
            yield Parts(self._parts)
        # Without what is said in other lines, or shown by no frame.
        state = snapshot.state and replace(snapshot.state, command=(), refused=())
        yield told(at, replace(snapshot, state=state, diagnoses={}, decisions=(), parts={}))
        self._log.decisions(snapshot.decisions)
        if snapshot.state is not None:  # before it nobody knows what is wrong
            alarms = active_alarms(snapshot, at, self._silent_s)
            self._log.alarms(alarms, _stamp(at))
        for event in self._log.since(self._said):
            self._said = event.number
            yield Happened(at, event)


def _stamp(at: float) -> str:
    """Return date and time of day of a ROS time [s], as in ISO 8601."""
    return datetime.fromtimestamp(at).isoformat(timespec="seconds")
