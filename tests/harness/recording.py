"""What the twin controller would publish for replay while a pair runs in virtual time.

Inputs with states, and decisions.
"""

from __future__ import annotations

from twin_analysis.replay.decisions import RecordedDecision, RecordedInput, as_recorded
from twin_controller.core.actions import AnyAction, Decided
from twin_controller.core.events import AnyEvent
from twin_controller.reporting.snapshots import encode_events, encode_state

from harness.pair import Pair

EPOCH = 1.7e9


class Recording:
    """Everything since it was made.

    ``batch`` inputs make a message, every ``every``-th message carries the state before it.
    """

    def __init__(self, pair: Pair, batch: int = 3, every: int = 40) -> None:
        """Attach to a pair."""
        self.inputs: list[RecordedInput] = []
        self.decisions: dict[tuple[int, int], RecordedDecision] = {}
        self._pair, self._batch, self._every = pair, batch, every
        self._begun = pair.now
        self._events: list[AnyEvent] = []
        self._decided: list[Decided] = []
        self._before = pair.state
        pair.watch = self._take

    @property
    def duration(self) -> float:
        """How long it is [s]."""
        return self._pair.now - self._begun

    def finish(self) -> Recording:
        """Publish what is left."""
        if self._events:
            self._publish()
        return self

    def _take(self, event: AnyEvent, actions: list[AnyAction]) -> None:
        self._events.append(event)
        self._decided += [action for action in actions if isinstance(action, Decided)]
        if len(self._events) == self._batch:
            self._publish()

    def _publish(self) -> None:
        at = self._pair.now - self._begun
        stamp_ns = round((EPOCH + self._pair.now) * 1e9)
        number = len(self.inputs)
        state = encode_state(self._before) if number % self._every == 0 else b""
        self.inputs.append(
            RecordedInput(at, stamp_ns, number + 1, encode_events(self._events), state)
        )
        for decided in self._decided:
            self.decisions[stamp_ns, decided.seq] = as_recorded(decided)
        self._events, self._decided, self._before = [], [], self._pair.state


def eventful(pair: Pair, batch: int = 3, every: int = 40) -> Recording:
    """Record a pair through both leads, a pause, an emergency stop, a lost link and refusals."""
    from harness.pair import HOME, ramp, shifted

    away = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
    pair.connect()
    recording = Recording(pair, batch, every)
    pair.run(0.5)
    pair.start_program(ramp(HOME, away, 0.5))
    pair.run(1.5)
    pair.end_program()
    pair.run_until(lambda: pair.state.lead.mode == "IDLE", 10.0)
    pair.run(0.5)
    pair.move_twin(ramp(pair.twin_q, HOME, 1.0))
    pair.run(0.5)
    pair.operate("PAUSE")
    pair.run(0.5)
    pair.operate("RESUME")
    pair.run(3.0)
    pair.operate("DANCE")
    pair.operate("ESTOP")
    pair.run(1.0)
    pair.link("twin", False)
    pair.run(0.3)
    pair.link("twin", True)
    pair.run(0.7)
    return recording.finish()
