"""Look at every step of the core and hold it against the rules of the twin controller."""

from __future__ import annotations

from twin_controller.core.actions import AnyAction, Decided, Do, FollowTwin, MoveTwin, Perform, Reply, StreamReal
from twin_controller.core.events import AnyEvent, Operator
from twin_controller.core.rules.table import Mode
from twin_controller.core.state import HISTORY, CoreState, Side

from harness.pair import SETUP, Pair

LEADERS = {Mode.REAL_LEADS: "real", Mode.TWIN_LEADS: "twin", Mode.OPERATOR_LEADS: "operator"}
TWIN_FOLLOWS = (Mode.ALIGNING, Mode.REAL_LEADS)
REAL_FOLLOWS = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
MOVING = (Do.START_STREAM, Do.RELEASE_REAL, Do.RESUME_TWIN)
TOLERANCE = 1e-9


class Watch:
    """Checks each step of a pair; an assertion names the rule that is broken."""

    def __init__(self, pair: Pair) -> None:
        """Watch ``pair`` from now on."""
        self.pair = pair
        self.before = pair.state
        self.streamed: StreamReal | None = None
        self.reset_asked = False
        pair.watch = self.check

    def check(self, event: AnyEvent, actions: list[AnyAction]) -> None:
        """Check one step."""
        before, after = self.before, self.pair.state
        self._decisions(before, after, actions)
        self._leader(after)
        self._commands_to_move(event, before, after, actions)
        self._stream(after, actions)
        self._stops(event, actions)
        self._emergency_stop(event, before, after, actions)
        self._bounded(after)
        self.before = after

    def _decisions(self, before: CoreState, after: CoreState, actions: list[AnyAction]) -> None:
        mode, seq = before.mode.value, before.seq
        for decision in actions:
            if isinstance(decision, Decided):
                assert decision.mode_before == mode and decision.seq == seq + 1, "decisions follow each other without a gap"
                assert decision.why, "each decision has a reason"
                mode, seq = decision.mode_after, decision.seq
        assert (mode, seq) == (after.mode, after.seq), "the mode changes by decisions only"

    def _leader(self, after: CoreState) -> None:
        assert after.leader == LEADERS.get(after.paused_mode or after.mode, ""), "the leader is that of the mode"
        assert (after.paused_mode is not None) == (after.mode is Mode.PAUSED), "only PAUSED remembers a mode"

    def _commands_to_move(self, event: AnyEvent, before: CoreState, after: CoreState, actions: list[AnyAction]) -> None:
        active = after.paused_mode or after.mode
        for action in actions:
            moves = isinstance(action, FollowTwin | StreamReal | MoveTwin)
            if not moves and not (isinstance(action, Perform) and action.do in MOVING):
                continue
            for side, stale_ms in ((after.real, SETUP.config.real.stale_ms), (after.twin, SETUP.config.twin.stale_ms)):
                assert is_fresh(side, event.now, stale_ms), f"{action}: no command without fresh state"
            if isinstance(action, FollowTwin):
                assert active in TWIN_FOLLOWS, "the twin gets set points only while it follows or aligns"
            elif isinstance(action, StreamReal) or (isinstance(action, Perform) and action.do is Do.START_STREAM):
                assert active in REAL_FOLLOWS, "the real robot gets set points only while the twin or the operator leads"
            elif isinstance(action, MoveTwin):
                assert isinstance(event, Operator), "a move comes from the operator only"
            else:
                assert before.mode is Mode.PAUSED and active in LEADERS, "only a paused motion goes on"

    def _stream(self, after: CoreState, actions: list[AnyAction]) -> None:
        if after.stream is None or after.stream.last is None:
            self.streamed = None
        for action in actions:
            if not isinstance(action, StreamReal):
                continue
            for name, value, low, high in zip(SETUP.names, action.q, SETUP.lower, SETUP.upper):
                assert low <= value <= high, f"{name} = {value} is outside [{low}, {high}]"
            assert after.flags is not None and 0.0 < action.speed_percent <= 100.0
            effective = action.speed_percent * max(after.flags.override_percent, 1.0) * 1e-2
            assert effective <= SETUP.config.limit.speed_percent + TOLERANCE, "program speed times override is limited"
            if self.streamed is None or action.at <= self.streamed.at:
                off = [abs(a - b) for a, b in zip(action.q, after.real.last.q)]
                assert max(off) <= 0.01, "a stream begins where the real robot is"
            else:
                last = self.streamed
                for a, b, v in zip(action.q, last.q, SETUP.velocity):
                    allowed = v * (action.at - last.at) * SETUP.config.limit.step_margin
                    assert abs(a - b) <= allowed + TOLERANCE, "no step is faster than the joint"
            self.streamed = action

    def _stops(self, event: AnyEvent, actions: list[AnyAction]) -> None:
        done = {action.do for action in actions if isinstance(action, Perform)}
        replies = [action for action in actions if isinstance(action, Reply)]
        assert len(replies) == isinstance(event, Operator), "each command of the operator is answered once"
        if isinstance(event, Operator):
            assert replies[0].id == event.id and replies[0].message
            if event.command == "STOP":
                assert {Do.STOP_REAL, Do.STOP_TWIN} <= done and replies[0].success, "STOP reaches both in the same step"
            if event.command == "ESTOP":
                assert {Do.ESTOP_REAL, Do.ESTOP_TWIN} <= done and replies[0].success, "ESTOP reaches both in the same step"

    def _emergency_stop(self, event: AnyEvent, before: CoreState, after: CoreState, actions: list[AnyAction]) -> None:
        if isinstance(event, Operator) and event.command == "RESET" and after.mode is Mode.ESTOP:
            self.reset_asked = True
        if before.mode is Mode.ESTOP and after.mode is not Mode.ESTOP:
            triggers = [action.trigger for action in actions if isinstance(action, Decided)]
            assert triggers[0] == "RESET_DONE" and after.mode is Mode.STOPPED, "an emergency stop is left by RESET only"
            assert self.reset_asked, "and only if the operator asked for it"
        if after.mode is not Mode.ESTOP:
            self.reset_asked = False

    def _bounded(self, after: CoreState) -> None:
        for side in (after.real, after.twin):
            assert len(side.history) <= HISTORY
            assert all(a.t < b.t for a, b in zip(side.history, side.history[1:])), "samples are in order"
        assert len(after.decisions) <= SETUP.config.decision_history


def is_fresh(side: Side, now: float, stale_ms: float) -> bool:
    """Return whether a side is known by a sample that was true not longer ago than it may be."""
    return bool(side.connected and side.history) and now - side.last.t <= stale_ms * 1e-3 + side.clock.uncertainty + 1e-6
