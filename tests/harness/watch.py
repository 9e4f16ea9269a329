"""Look at every step of the core and hold it against the rules of the twin controller."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeVar

from twin_controller.core.actions import (
    AnyAction,
    Command,
    Decided,
    FollowTwin,
    MoveTwin,
    Reply,
    RobotSetpoint,
    Send,
    StreamAhead,
    StreamReal,
)
from twin_controller.core.events import AnyEvent, Operator
from twin_controller.core.lead.modes import Mode
from twin_controller.core.sides.side import HISTORY, Side
from twin_controller.core.state import CoreState

from harness.pair import REAL_PERIOD_S, SETUP, Pair

LEADERS = {Mode.REAL_LEADS: "real", Mode.TWIN_LEADS: "twin", Mode.OPERATOR_LEADS: "operator"}
TWIN_FOLLOWS = (Mode.ALIGNING, Mode.REAL_LEADS)
REAL_FOLLOWS = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
STREAMS = (Command.START_STREAM, Command.CONTINUE_STREAM)
MOVING = (*STREAMS, Command.RELEASE_REAL, Command.RESUME_TWIN)
RESUMED = (*LEADERS, Mode.IDLE, Mode.ALIGNING)
TOLERANCE = 1e-9
P = TypeVar("P", bound=Pair)


class Watch:
    """Checks each step of a pair; an assertion names the rule that is broken."""

    def __init__(self, pair: Pair) -> None:
        """Watch ``pair`` from now on."""
        self.pair = pair
        self.before = pair.state
        self.streamed: StreamReal | None = None
        self.ahead: dict[int, RobotSetpoint] = {}
        # Whether the next set points ahead of their time are the first of a stream.
        self.begins = True
        self.reset_asked = False
        pair.watch = self.check

    def check(self, event: AnyEvent, actions: list[AnyAction]) -> None:
        """Check one step."""
        before, after = self.before, self.pair.state
        self._decisions(before, after, actions)
        self._leader(after)
        self._commands_to_move(event, before, after, actions)
        self._stream(after, actions)
        self._stream_ahead(after, actions)
        self._stops(event, actions)
        self._emergency_stop(event, before, after, actions)
        self._bounded(before, after)
        self.before = after

    def _decisions(self, before: CoreState, after: CoreState, actions: list[AnyAction]) -> None:
        mode, seq = before.lead.mode.value, before.lead.seq
        for decision in actions:
            if isinstance(decision, Decided):
                assert decision.mode_before == mode and decision.seq == seq + 1, (
                    "decisions follow each other without a gap"
                )
                assert decision.why, "each decision has a reason"
                mode, seq = decision.mode_after, decision.seq
        assert (mode, seq) == (after.lead.mode, after.lead.seq), (
            "the mode changes by decisions only"
        )

    def _leader(self, after: CoreState) -> None:
        assert after.lead.leader == LEADERS.get(after.lead.paused or after.lead.mode, ""), (
            "the leader is that of the mode"
        )
        assert (after.lead.paused is not None) == (after.lead.mode is Mode.PAUSED), (
            "only PAUSED remembers a mode"
        )

    def _commands_to_move(
        self, event: AnyEvent, before: CoreState, after: CoreState, actions: list[AnyAction]
    ) -> None:
        active = after.lead.paused or after.lead.mode
        for action in actions:
            moves = isinstance(action, FollowTwin | StreamReal | StreamAhead | MoveTwin)
            if not moves and not (isinstance(action, Send) and action.command in MOVING):
                continue
            for side, stale_ms in (
                (after.sides.real, SETUP.config.real.stale_ms),
                (after.sides.twin, SETUP.config.twin.stale_ms),
            ):
                assert is_fresh(side, event.now, stale_ms), (
                    f"{action}: no command without fresh state"
                )
            if isinstance(action, FollowTwin):
                assert active in TWIN_FOLLOWS, (
                    "the twin gets set points only while it follows or aligns"
                )
            elif isinstance(action, StreamReal | StreamAhead) or (
                isinstance(action, Send) and action.command in STREAMS
            ):
                assert active in REAL_FOLLOWS, (
                    "the real robot gets set points only while the twin or the operator leads"
                )
            elif isinstance(action, MoveTwin):
                assert isinstance(event, Operator), "a move comes from the operator only"
            else:
                follows = before.follow.real
                waits = before.lead.mode is Mode.PAUSED or (follows and follows.resumes)
                assert waits and active in RESUMED, "only a paused motion goes on"

    def _stream(self, after: CoreState, actions: list[AnyAction]) -> None:
        if after.follow.real is None or after.follow.real.last is None:
            self.streamed = None
        for action in actions:
            if not isinstance(action, StreamReal):
                continue
            q = action.setpoint.q
            for name, value, low, high in zip(SETUP.names, q, SETUP.lower, SETUP.upper):
                assert low <= value <= high, f"{name} = {value} is outside [{low}, {high}]"
            flags = after.sides.real.flags
            assert flags is not None and 0.0 < action.speed_percent <= 100.0
            effective = action.speed_percent * max(flags.override_percent, 1.0) * 1e-2
            assert effective <= SETUP.config.limit.told_percent + TOLERANCE, (
                "program speed times override is limited"
            )
            if self.streamed is None or action.send_at <= self.streamed.send_at:
                begins_at(after.sides.real, q)
            else:
                last = self.streamed
                # Sent in the robot's rhythm, which may drift by a tick.
                share = 1e-2 * SETUP.config.limit.told_percent
                passed = action.send_at - last.send_at + REAL_PERIOD_S
                for a, b, v in zip(q, last.setpoint.q, SETUP.velocity):
                    allowed = v * passed * share
                    assert abs(a - b) <= allowed + TOLERANCE, "no step is faster than allowed"
            self.streamed = action

    def _stream_ahead(self, after: CoreState, actions: list[AnyAction]) -> None:
        follows = after.follow.real
        if follows is None:
            self.ahead = {}
        # A pause ends the stream, whatever is remembered of it.
        if follows is None or follows.last is None or after.lead.mode is Mode.PAUSED:
            self.begins = True
        for action in actions:
            if not isinstance(action, StreamAhead):
                continue
            flags, clock = after.sides.real.flags, after.sides.real.clock
            assert flags is not None and flags.ring_places, "only a robot with a ring gets these"
            effective = action.speed_percent * max(flags.override_percent, 1.0) * 1e-2
            assert effective <= SETUP.config.limit.told_percent + TOLERANCE, (
                "program speed times override is limited"
            )
            if self.begins and action.points:
                begins_at(after.sides.real, action.points[0].q)
                self.begins = False
            self.ahead |= {point.number: point for point in action.points}
            kept = {
                number: point
                for number, point in self.ahead.items()
                if (action.newest - number) % 32760 < flags.ring_places
            }
            self.ahead = kept
            coming = [p for p in kept.values() if clock.to_local(p.clock_ms * 1e-3) > self.pair.now]
            assert len(coming) <= flags.ring_places - 1, "no place that still counts is overwritten"
            self._steps(sorted(kept.values(), key=lambda point: point.clock_ms))

    def _steps(self, points: list[RobotSetpoint]) -> None:
        share = 1e-2 * SETUP.config.limit.told_percent
        for point in points:
            for name, value, low, high in zip(SETUP.names, point.q, SETUP.lower, SETUP.upper):
                assert low <= value <= high, f"{name} = {value} is outside [{low}, {high}]"
        for before, after in pairwise(points):
            passed = 1e-3 * (after.clock_ms - before.clock_ms)
            assert passed > 0.0, "times go up with the numbers"
            for a, b, v in zip(after.q, before.q, SETUP.velocity):
                assert abs(a - b) <= v * passed * share + TOLERANCE, "no step is too fast"

    def _stops(self, event: AnyEvent, actions: list[AnyAction]) -> None:
        done = {action.command for action in actions if isinstance(action, Send)}
        replies = [action for action in actions if isinstance(action, Reply)]
        assert len(replies) == isinstance(event, Operator), (
            "each command of the operator is answered once"
        )
        if isinstance(event, Operator):
            assert replies[0].id == event.id and replies[0].message
            if event.command == "STOP":
                assert {Command.STOP_REAL, Command.STOP_TWIN} <= done and replies[0].success, (
                    "STOP reaches both in the same step"
                )
            if event.command == "ESTOP":
                assert {Command.ESTOP_REAL, Command.ESTOP_TWIN} <= done and replies[0].success, (
                    "ESTOP reaches both in the same step"
                )

    def _emergency_stop(
        self, event: AnyEvent, before: CoreState, after: CoreState, actions: list[AnyAction]
    ) -> None:
        if (
            isinstance(event, Operator)
            and event.command == "RESET"
            and after.lead.mode is Mode.ESTOP
        ):
            self.reset_asked = True
        if before.lead.mode is Mode.ESTOP and after.lead.mode is not Mode.ESTOP:
            triggers = [action.trigger for action in actions if isinstance(action, Decided)]
            assert triggers[0] == "RESET_DONE" and after.lead.mode is Mode.STOPPED, (
                "an emergency stop is left by RESET only"
            )
            assert self.reset_asked, "and only if the operator asked for it"
        if after.lead.mode is not Mode.ESTOP:
            self.reset_asked = False

    def _bounded(self, before: CoreState, after: CoreState) -> None:
        for known, side in (
            (before.sides.real, after.sides.real),
            (before.sides.twin, after.sides.twin),
        ):
            if side.history is known.history:
                continue
            assert len(side.history) <= HISTORY
            assert all(a.time < b.time for a, b in zip(side.history, side.history[1:])), (
                "samples are in order"
            )
        assert len(after.lead.decisions) <= SETUP.config.decision_history


def begins_at(real: Side, q: Sequence[float]) -> None:
    """Check that the first set point of a stream is where the real robot is."""
    off = [abs(a - b) for a, b in zip(q, real.last.q)]
    assert max(off) <= 0.01, "a stream begins where the real robot is"


def is_fresh(side: Side, now: float, stale_ms: float) -> bool:
    """Return whether a side is known by a sample that was true not longer ago than it may be."""
    return (
        bool(side.connected and side.history)
        and now - side.last.time <= stale_ms * 1e-3 + side.clock.uncertainty + 1e-6
    )


def watched(pair: P) -> P:
    """Return a pair connected, IDLE and watched; commands and reports take their time."""
    pair.command_delay, pair.report_delay = 0.01, 0.01
    Watch(pair)
    pair.connect()
    return pair
