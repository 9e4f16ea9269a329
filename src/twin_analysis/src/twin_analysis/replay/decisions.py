"""Replay the twin controller's recorded inputs through its core.

Decisions and states are compared bit for bit.

A replay begins at the first recorded state and checks itself at each later one. Lost messages and
restarts of the controller are named; behind them it begins anew at the next recorded state.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from scara_ros.message_struct import struct_of
from twin_controller.core.actions import Decided
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState
from twin_controller.core.step import step
from twin_controller.reporting.snapshots import (
    decode_events,
    decode_state,
    encode_state,
    first_difference,
)

from scara_msgs.msg import Decision

EDGE_S = 0.3
"""So near to an end of the recording or of a life a decision may be missing.

Topics come and go one by one (our choice).
"""

NAN = float("nan")


@dataclass(frozen=True, slots=True)
class RecordedInput:
    """One message of ``twin_controller/inputs``.

    Attributes:
        at: When it was received, since the start of the recording [s].
        stamp_ns: When it was judged, ROS time [ns].
        seq: Number within the controller's life.
        data: Inputs.
        state: State before them, or empty.
        life: What tells one life of the controller from another.
    """

    at: float
    stamp_ns: int
    seq: int
    data: bytes
    state: bytes
    life: str = ""


class RecordedDecision(struct_of(Decision)):  # type: ignore[misc]
    """What ``twin_controller/decisions`` says of a decision.

    Times [s] of the controller's clock, NaN for none; ``who`` is None in a recording from before
    persons had names.
    """

    who: str | None = None

    def difference(self, other: RecordedDecision) -> str:
        """Return the first field in which two decisions differ, with both values.

        Empty if every bit is the same.
        """
        for name in self.__struct_fields__:
            mine, theirs = getattr(self, name), getattr(other, name)
            if name == "who" and None in (mine, theirs):
                continue
            same = _bits(mine) == _bits(theirs) if isinstance(mine, float) else mine == theirs
            if not same:
                return f"{name} = {theirs!r} instead of {mine!r}"
        return ""


def _bits(value: float) -> bytes:
    """Return a float's bits; all NaNs are one."""
    return struct.pack("<d", NAN if value != value else value)


def as_recorded(decided: Decided) -> RecordedDecision:
    """Return a decision of the core as it is published."""
    return RecordedDecision(
        seq=decided.seq,
        mode_before=decided.mode_before,
        event=decided.trigger,
        mode_after=decided.mode_after,
        leader=decided.leader,
        actions=decided.actions,
        why=decided.why,
        onset_real=NAN if decided.onset_real is None else decided.onset_real,
        onset_twin=NAN if decided.onset_twin is None else decided.onset_twin,
        onset_uncertainty=decided.onset_uncertainty,
        who=decided.who,
    )


@dataclass
class ReplayResult:
    """What a replay found.

    Attributes:
        messages: Messages of inputs that were replayed.
        inputs: Inputs in them.
        decisions: Decisions that were compared.
        snapshots: Recorded states that the replay was compared with.
        starts: When it began, and began anew [s].
        skipped: Messages before a state to begin with.
        lost: Where messages are missing, in words.
        restarts: Where the controller was started anew, in words; each of its lives is replayed by
            itself.
        unrecorded: Decisions of the replay at an end of the recording or of a life, where their
            topic was not recorded.
        outside: Recorded decisions to which there are no inputs.
        differences: Everything that is not the same, in words, in order.
    """

    messages: int = 0
    inputs: int = 0
    decisions: int = 0
    snapshots: int = 0
    starts: list[float] = field(default_factory=list)
    skipped: int = 0
    lost: list[str] = field(default_factory=list)
    restarts: list[str] = field(default_factory=list)
    unrecorded: int = 0
    outside: int = 0
    differences: list[str] = field(default_factory=list)

    @property
    def exact(self) -> bool:
        """True if something was compared, nothing was lost, and all of it was the same."""
        return self.compared and not self.differences and not self.lost

    @property
    def compared(self) -> bool:
        """Whether there was a decision or a state to compare with."""
        return bool(self.decisions or self.snapshots)


Recorded = Mapping[tuple[int, int], RecordedDecision]
"""Recorded decisions by stamp [ns] and number."""


class Replay:
    """One replay; feed it the messages in order, then ask for the result."""

    def __init__(
        self, setup_at: Callable[[float], Setup], recorded: Recorded, duration: float
    ) -> None:
        """Begin.

        Args:
            setup_at: Profile and numbers in force at a time [s].
            recorded: What was decided then.
            duration: Of the recording [s].
        """
        self._setup_at, self._recorded, self._duration = setup_at, recorded, duration
        self._state: CoreState | None = None
        self._last: RecordedInput | None = None
        self._matched: set[tuple[int, int]] = set()
        self._spans: list[list[int]] = []
        self._edges = [0.0, duration]
        self._found: list[tuple[float, str]] = []
        self._missing: list[tuple[float, str]] = []
        self._result = ReplayResult()

    def feed(
        self,
        message: RecordedInput,
        watch: Callable[[RecordedInput, CoreState], None] | None = None,
    ) -> None:
        """Replay one message; ``watch`` sees the state after it.

        Raises:
            SnapshotError: The message holds something else than inputs and states of this version.
        """
        self._check_sequence(message)
        self._last = message
        if message.state:
            self._meet(message)
        if self._state is None:
            self._result.skipped += 1
            return
        self._spans[-1][1] = message.stamp_ns
        self._result.messages += 1
        for event in decode_events(message.data):
            self._result.inputs += 1
            self._state, actions = step(self._setup, self._state, event)
            for action in actions:
                if isinstance(action, Decided):
                    self._judge(message, as_recorded(action))
        if watch is not None:
            watch(message, self._state)

    def finish(self) -> ReplayResult:
        """Look for recorded decisions that the replay did not make, and return everything."""
        for key in sorted(set(self._recorded) - self._matched):
            if any(first <= key[0] <= last for first, last in self._spans):
                found = self._recorded[key]
                self._found.append(
                    (
                        # Behind all differences that have a time.
                        math.inf,
                        f"decision #{found.seq} ({found.event}) was recorded but is not made again",
                    )
                )
            else:
                self._result.outside += 1
        for at, text in self._missing:
            if any(abs(at - edge) <= EDGE_S for edge in self._edges):
                self._result.unrecorded += 1
            else:
                self._found.append((at, text))
        self._result.differences = [
            text for _, text in sorted(self._found, key=lambda entry: entry[0])
        ]
        return self._result

    def _check_sequence(self, message: RecordedInput) -> None:
        """Name what is missing between the message before and this one."""
        last = self._last
        if last is None or (message.life == last.life and message.seq == last.seq + 1):
            return
        self._state = None
        # Where no life is told, a number that falls is a new one.
        if message.life != last.life or message.seq <= last.seq:
            self._edges += [last.at, message.at]
            self._result.restarts.append(f"{message.at:.3f} s: the controller was started anew")
        else:
            count = message.seq - last.seq - 1
            self._result.lost.append(
                f"{message.at:.3f} s: {count} messages of inputs are lost (between "
                f"{last.seq} and {message.seq})"
            )

    def _meet(self, message: RecordedInput) -> None:
        """Begin with a recorded state, or compare with it and go on from it."""
        recorded = decode_state(message.state)
        if self._state is None:
            self._setup = self._setup_at(message.at)
            self._result.starts.append(message.at)
            self._spans.append([message.stamp_ns, message.stamp_ns])
            self._state = recorded
            return
        self._result.snapshots += 1
        if encode_state(self._state) != message.state:
            different = first_difference(self._state, recorded) or "its encoding"
            self._found.append((message.at, f"{message.at:.3f} s: the state differs: {different}"))
            # On from what was true, or one difference would bring all that follow.
            self._state = recorded

    def _judge(self, message: RecordedInput, made: RecordedDecision) -> None:
        """Compare a decision with the recorded one."""
        key = (message.stamp_ns, made.seq)
        recorded = self._recorded.get(key)
        if recorded is not None:
            self._matched.add(key)
            self._result.decisions += 1
            if different := recorded.difference(made):
                self._found.append(
                    (message.at, f"{message.at:.3f} s: decision #{made.seq}: {different}")
                )
        else:
            text = f"{message.at:.3f} s: decision #{made.seq} ({made.event}) was not recorded"
            self._missing.append((message.at, text))


def replay(
    setup_at: Callable[[float], Setup],
    inputs: Iterable[RecordedInput],
    recorded: Recorded,
    duration: float,
) -> ReplayResult:
    """Replay a whole recording; see :class:`Replay`."""
    running = Replay(setup_at, recorded, duration)
    for message in inputs:
        running.feed(message)
    return running.finish()
