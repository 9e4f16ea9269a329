"""Outbox: what waits for a client is bounded, newest first to matter, throttled without ageing."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.protocol.latest import Outbox


def drained(outbox: Outbox, now: float) -> list[bytes]:
    """Return all that may go out at ``now``."""
    return list(iter(lambda: outbox.pop(now), None))


def source(outbox: Outbox, times: list[float]) -> Iterator[tuple[float, float]]:
    """Feed a message at each time to topic t; yield when each one goes out and when it came."""
    for came, following in zip(times, [*times[1:], times[-1] + 10.0]):
        outbox.put_message("t", repr(came).encode(), came)
        now: float | None = came
        while now is not None and now < following:
            for data in drained(outbox, now):
                yield now, float(data)
            now = outbox.next_due()


def test_answers_go_before_messages_and_in_order() -> None:
    """An answer must not wait behind a stream."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.0, 0)
    outbox.put_message("t", b"message", 0.0)
    outbox.put_answer(b"first")
    outbox.put_answer(b"second")
    assert drained(outbox, 0.0) == [b"first", b"second", b"message"]


def test_slow_client_gets_the_newest_message_of_each_topic() -> None:
    """What a client has not taken is replaced by what is newer, and counted."""
    outbox = Outbox(10, 1000, len)
    for topic in ("a", "b"):
        outbox.subscribe(topic, 0.0, 0)
        for number in range(100):
            outbox.put_message(topic, f"{topic}{number}".encode(), 0.001 * number)
    assert drained(outbox, 1.0) == [b"a99", b"b99"]
    assert outbox.dropped == 2 * 99


def test_queue_length_keeps_so_many_messages() -> None:
    """A client that wants every message asks for a queue; the oldest give way."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.0, 3)
    for number in range(5):
        outbox.put_message("t", str(number).encode(), 0.0)
    assert drained(outbox, 0.0) == [b"2", b"3", b"4"]
    assert outbox.dropped == 2


def test_topics_take_turns() -> None:
    """A topic with a long queue does not hold up another one."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("a", 0.0, 5)
    outbox.subscribe("b", 0.0, 5)
    for number in range(2):
        outbox.put_message("a", f"a{number}".encode(), 0.0)
    outbox.put_message("b", b"b0", 0.0)
    assert drained(outbox, 0.0) == [b"a0", b"b0", b"a1"]


def test_throttled_fast_source_is_not_aged() -> None:
    """Every second message of 200 Hz goes out at 100 Hz as it comes, whatever the jitter."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.010, 1)
    times = [0.005 * k + (0.0002 if k % 3 else -0.0002) for k in range(200)]
    sent = list(source(outbox, times))
    assert 99 <= len(sent) <= 101
    assert all(now == came for now, came in sent[:-1])
    assert outbox.dropped == 0


def test_last_message_of_a_throttled_topic_arrives() -> None:
    """A message that came too early is sent later when no newer one comes."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.1, 0)
    outbox.put_message("t", b"first", 0.0)
    assert drained(outbox, 0.0) == [b"first"]
    outbox.put_message("t", b"last", 0.01)
    assert drained(outbox, 0.01) == []
    due = outbox.next_due()
    assert due is not None and 0.1 <= due <= 0.15
    assert drained(outbox, due) == [b"last"]
    assert outbox.next_due() is None


def test_throttled_queue_goes_out_at_the_interval() -> None:
    """queue_length with throttle_rate: nothing is lost, one message per interval."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.1, 10)
    sent = list(source(outbox, [0.0, 0.001, 0.002, 0.003]))
    assert [came for _, came in sent] == [0.0, 0.001, 0.002, 0.003]
    assert all(0.099 < b - a < 0.101 for (a, _), (b, _) in pairwise(sent))


@given(st.lists(st.floats(0.0, 2.0), min_size=2, max_size=60, unique=True), st.floats(0.001, 0.5))
def test_throttle_keeps_its_rate_and_loses_no_last_message(
    times: list[float], interval: float
) -> None:
    """Over any span at most span / interval + 1.2 messages go out, and the last one always does."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", interval, 0)
    sent = list(source(outbox, sorted(times)))
    assert sent[-1][1] == max(times)
    went = [now for now, _ in sent]
    for first, last in combinations(range(len(went)), 2):
        most = (went[last] - went[first]) / interval + 1.2 + 1e-6
        assert last - first + 1 <= most


def test_a_throttled_topic_that_was_silent_has_nothing_to_make_up_for() -> None:
    """After a pause the messages of a burst go out at the interval too."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.1, 10)
    sent = list(source(outbox, [0.0, 5.0, 5.001, 5.002, 5.003]))
    assert [now for now, _ in sent[1:]] == pytest.approx([5.0, 5.1, 5.2, 5.3])


def test_answers_are_bounded() -> None:
    """A client that takes no answers cannot make the gateway grow."""
    outbox = Outbox(2, 1000, len)
    assert outbox.put_answer(b"1") and outbox.put_answer(b"2") and not outbox.put_answer(b"3")


def test_unsubscribed_topic_leaves_nothing_behind() -> None:
    """What waits of a topic goes with its subscription."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.0, 5)
    outbox.put_message("t", b"1", 0.0)
    outbox.unsubscribe("t")
    outbox.put_message("t", b"2", 0.0)
    assert drained(outbox, 1.0) == [] and outbox.next_due() is None


def test_changed_subscription_keeps_its_turn() -> None:
    """Subscribing again does not circumvent the throttle."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 1.0, 0)
    outbox.put_message("t", b"1", 0.0)
    assert drained(outbox, 0.0) == [b"1"]
    outbox.subscribe("t", 1.0, 0)
    outbox.put_message("t", b"2", 0.5)
    assert drained(outbox, 0.5) == [] and drained(outbox, 1.5) == [b"2"]


def test_shorter_interval_counts_at_once() -> None:
    """From the last message, for what waits and for what comes; a longer one begins with it."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 60.0, 0)
    for number, now in enumerate((0.0, 49.0, 50.0)):  # the second goes out a little early
        outbox.put_message("t", b"%d" % number, now)
        assert drained(outbox, now) == ([b"0"], [b"1"], [])[number]
    outbox.subscribe("t", 2.0, 0)
    assert drained(outbox, 50.9) == [] and drained(outbox, 51.0) == [b"2"]
    outbox.put_message("t", b"3", 53.0)
    assert drained(outbox, 53.0) == [b"3"]
    outbox.subscribe("t", 60.0, 0)
    outbox.put_message("t", b"4", 55.0)
    assert drained(outbox, 55.0) == [b"4"] and outbox.next_due() is None


def test_a_long_queue_is_bounded_in_bytes_too() -> None:
    """A page that asks for 10,000 pictures and takes one an hour would fill the memory."""
    outbox = Outbox(10, 1000, len)
    outbox.subscribe("t", 0.0, 10_000)
    for number in range(100):
        outbox.put_message("t", b"%100d" % number, float(number))
    outbox.subscribe("big", 0.0, 10)
    for number in range(3):
        outbox.put_message("big", b"%2000d" % number, 0.0)
    kept = {int(data) for data in drained(outbox, 1e9)}
    assert kept == {*range(90, 100), 2}, "the newest of each topic"
    outbox.unsubscribe("t")
    for number in range(20):
        outbox.put_message("big", b"%100d" % number, 1e9)
    assert len(drained(outbox, 2e9)) == 10, "what was taken takes no room"
