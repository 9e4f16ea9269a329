"""A replay gives the same decisions and states again, and tells when it does not."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import msgspec
import pytest
from harness.pair import SETUP, Pair
from harness.recording import Recording, eventful
from twin_analysis.replay.decisions import (
    RecordedDecision,
    RecordedInput,
    Replay,
    ReplayResult,
    replay,
)
from twin_controller.core.events import TwinMeasured
from twin_controller.core.setup import Setup
from twin_controller.reporting.snapshots import SnapshotError, decode_events, encode_events


class Kept(NamedTuple):
    """A recording that no test changes."""

    inputs: tuple[RecordedInput, ...]
    decisions: dict[tuple[int, int], RecordedDecision]
    duration: float


@pytest.fixture(scope="module")
def kept() -> Kept:
    """Record an eventful run once."""
    recording: Recording = eventful(Pair())
    return Kept(tuple(recording.inputs), dict(recording.decisions), recording.duration)


def run(
    kept: Kept, inputs: list[RecordedInput] | None = None, decisions: dict | None = None
) -> ReplayResult:
    """Replay a recording, with other inputs or decisions if given."""
    chosen = kept.inputs if inputs is None else inputs
    return replay(
        lambda at: SETUP, chosen, kept.decisions if decisions is None else decisions, kept.duration
    )


def test_an_eventful_run_replays_without_a_difference(kept: Kept) -> None:
    """Leads of both sides, pause, emergency stop, a lost link, refusals.

    Every decision and every state again.
    """
    result = run(kept)
    assert result.differences == [] and result.lost == [] and result.restarts == []
    assert result.exact
    assert result.decisions + result.unrecorded == len(kept.decisions) >= 8
    assert result.snapshots == (len(kept.inputs) - 1) // 40
    assert result.messages == len(kept.inputs) and result.skipped == 0


def test_a_replay_begins_at_the_first_state(kept: Kept) -> None:
    """A recording that starts in the middle of the controller's life, between two states."""
    result = run(kept, list(kept.inputs[100:]))
    assert (result.skipped, result.messages) == (20, len(kept.inputs) - 120)
    assert result.exact
    assert result.outside == sum(key[0] < kept.inputs[120].stamp_ns for key in kept.decisions)


def test_where_nothing_was_compared_nothing_is_exact(kept: Kept) -> None:
    """A recording of half a second holds one state to begin with, and no decision."""
    result = run(kept, list(kept.inputs[:30]), {})
    assert result.messages and not result.lost and not result.differences
    assert (result.decisions, result.snapshots, result.exact) == (0, 0, False)


def test_an_input_that_was_different_is_found_by_the_next_state(kept: Kept) -> None:
    """One joint of one sample off by the smallest amount: the state check names it."""
    inputs = list(kept.inputs)
    for number in range(50, len(inputs)):
        events = decode_events(inputs[number].data)
        place = next((k for k, event in enumerate(events) if isinstance(event, TwinMeasured)), None)
        if place is not None:
            event = events[place]
            q = (event.motion.q[0] + 1e-15, *event.motion.q[1:])
            motion = msgspec.structs.replace(event.motion, q=q)
            events[place] = msgspec.structs.replace(event, motion=motion)
            inputs[number] = replace(inputs[number], data=encode_events(events))
            break
    result = run(kept, inputs)
    assert not result.exact
    assert "the state differs: sides.twin = " in result.differences[0]
    assert len(result.differences) < 5, "behind the difference it goes on from the recorded state"


def test_a_decision_that_was_recorded_otherwise_is_a_difference(kept: Kept) -> None:
    """Every field counts, every bit."""
    keys = sorted(kept.decisions)[3:7]
    one, two, three, four = (kept.decisions[key] for key in keys)
    changed = msgspec.structs.replace
    others = (
        changed(one, why="x"),
        changed(two, onset_uncertainty=two.onset_uncertainty + 1e-12),
        changed(three, actions=(*three.actions, "DANCE")),
        changed(four, who="somebody else"),
    )
    result = run(kept, decisions={**kept.decisions, **dict(zip(keys, others))})
    names = ("why = ", "onset_uncertainty = ", "actions = ", "who = ")
    assert len(result.differences) == len(keys)
    for text, name, key in zip(result.differences, names, keys):
        assert name in text and f"decision #{key[1]}" in text


def test_a_recording_from_before_persons_had_names_is_replayed_as_before(kept: Kept) -> None:
    """What it does not say is no difference."""
    old = {key: msgspec.structs.replace(each, who=None) for key, each in kept.decisions.items()}
    assert run(kept, decisions=old).exact


def test_a_decision_that_is_not_made_again_is_a_difference(kept: Kept) -> None:
    """The record holds one more than the core decides."""
    key = sorted(kept.decisions)[3]
    ghost = (key[0], 9999)
    result = run(
        kept,
        decisions={**kept.decisions, ghost: msgspec.structs.replace(kept.decisions[key], seq=9999)},
    )
    assert result.differences == [
        f"decision #9999 ({kept.decisions[key].event}) was recorded but is not made again"
    ]


def test_a_decision_that_was_not_recorded_is_a_difference_except_at_the_edges(kept: Kept) -> None:
    """Topics are connected one after the other; in the middle nothing may be missing."""
    middle = next(
        k
        for k in sorted(kept.decisions)
        if 1.0 < k[0] * 1e-9 - kept.inputs[0].stamp_ns * 1e-9 < kept.duration - 1.0
    )
    fewer = {key: decision for key, decision in kept.decisions.items() if key != middle}
    assert "was not recorded" in run(kept, decisions=fewer).differences[0]
    short = Kept(
        kept.inputs, fewer, next(i.at for i in kept.inputs if i.stamp_ns == middle[0]) + 0.1
    )
    result = replay(
        lambda at: SETUP, [i for i in kept.inputs if i.at <= short.duration], fewer, short.duration
    )
    assert result.differences == [] and result.unrecorded == 1


def test_lost_messages_are_named_and_the_replay_goes_on_behind_them(kept: Kept) -> None:
    """A gap in the numbers is no difference, but the replay is not exact any more."""
    inputs = [message for message in kept.inputs if not 90 < message.seq <= 95]
    result = run(kept, inputs)
    assert result.lost == [
        f"{inputs[90].at:.3f} s: 5 messages of inputs are lost (between 90 and 96)"
    ]
    assert not result.exact and result.differences == []
    assert len(result.starts) == 2


def test_a_restart_of_the_controller_is_named(kept: Kept) -> None:
    """The numbers begin anew; each life has its own configuration."""
    later, ns = 100.0, 10**11
    again = [
        replace(m, at=m.at + later, stamp_ns=m.stamp_ns + ns, life="2") for m in kept.inputs[100:]
    ]
    decisions = {
        **kept.decisions,
        **{(key[0] + ns, key[1]): d for key, d in kept.decisions.items()},
    }
    asked: list[float] = []

    def setup_at(at: float) -> Setup:
        asked.append(at)
        return SETUP

    result = replay(setup_at, [*kept.inputs, *again], decisions, kept.duration + later)
    assert result.restarts == [f"{again[0].at:.3f} s: the controller was started anew"]
    assert result.exact and result.lost == []
    assert asked == [kept.inputs[0].at, again[20].at]


@pytest.mark.parametrize("place", ["end of the first life", "start of the second life"])
def test_a_decision_may_be_missing_where_a_life_ends_or_begins(kept: Kept, place: str) -> None:
    """A process that is killed, or not yet connected, does not publish what it decided."""
    key = sorted(kept.decisions)[3]
    fewer = {k: decision for k, decision in kept.decisions.items() if k != key}
    at = next(m.at for m in kept.inputs if m.stamp_ns == key[0])
    if place.startswith("end"):
        first = [m for m in kept.inputs if m.at <= at + 0.1]
        second = [
            replace(m, at=m.at + 50.0, stamp_ns=m.stamp_ns + 1, life="2") for m in kept.inputs[:40]
        ]
    else:
        begin = max(k for k, m in enumerate(kept.inputs) if m.state and m.at < at)
        first = [replace(m, stamp_ns=m.stamp_ns - 10**12, life="0") for m in kept.inputs[:40]]
        second = [replace(m, at=50.0 + 0.005 * k) for k, m in enumerate(kept.inputs[begin:])]
        second = [m for m in second if m.at < 51.0]
    result = replay(lambda _: SETUP, [*first, *second], fewer, 200.0)
    missing = [
        text for text in result.differences if "was not recorded" in text and f"#{key[1]} " in text
    ]
    assert missing == [] and result.unrecorded >= 1


def test_bytes_of_another_version_are_refused(kept: Kept) -> None:
    """They are named, not misread."""
    with pytest.raises(SnapshotError, match="inputs: "):
        run(kept, [replace(kept.inputs[0], data=b"\x01")])


def test_a_watcher_sees_each_state(kept: Kept) -> None:
    """So history can be read from a recording."""
    seen = []
    running = Replay(lambda at: SETUP, kept.decisions, kept.duration)
    for message in kept.inputs[:50]:
        running.feed(message, lambda message, state: seen.append((message.seq, state.lead.mode)))
    assert [number for number, _ in seen] == list(range(1, 51))
