"""The engine's inputs: in their order, and a wake only where one is needed."""

from __future__ import annotations

import threading
import time

from harness.processes import wait_until
from twin_controller.core.events import AnyEvent, Tick
from twin_controller.engine.input_queue_io import InputQueue

LONG_S = 5.0


def test_inputs_keep_their_order_whether_they_wake_or_not() -> None:
    """An input that waited is taken before the one that wakes, and is not lost behind it."""
    inputs = InputQueue()
    events: list[AnyEvent] = [Tick(float(k)) for k in range(6)]
    for k, event in enumerate(events):
        inputs.put(event, wakes=k == 2)
    assert inputs.take(LONG_S) == events


def test_an_input_that_can_wait_wakes_nobody_and_waits_no_longer_than_the_time_out() -> None:
    """Whoever takes sleeps on until the next one that wakes, or to the end of its time."""
    inputs, taken = InputQueue(), []
    inputs.put(Tick(1.0), wakes=False)
    begun = time.monotonic()
    assert inputs.take(0.02) == [Tick(1.0)]
    assert time.monotonic() - begun >= 0.02
    taker = threading.Thread(target=lambda: taken.append(inputs.take(LONG_S)), daemon=True)
    taker.start()
    inputs.put(Tick(2.0), wakes=False)
    taker.join(0.2)
    assert taker.is_alive() and not taken, "the input woke whoever takes"
    inputs.put(Tick(3.0))
    taker.join(LONG_S)
    assert taken == [[Tick(2.0), Tick(3.0)]]


def test_a_wake_that_is_left_over_gives_no_empty_batch() -> None:
    """Two inputs come, the first wake takes both: the second one's wake finds nothing."""
    inputs = InputQueue()
    inputs.put(Tick(1.0))
    assert inputs.take(LONG_S) == [Tick(1.0)]
    inputs._wakes.put(None)  # as of an input that came between the wake and the look
    begun = time.monotonic()
    assert inputs.take(0.05) == []
    assert time.monotonic() - begun >= 0.05


def test_nothing_is_lost_when_many_threads_put() -> None:
    """Each thread's own inputs stay in their order."""
    inputs, taken = InputQueue(), []
    threads = [
        threading.Thread(
            target=lambda n=number: [  # type: ignore[misc]
                inputs.put(Tick(n + 1e-4 * k), wakes=k % 3 == 0) for k in range(1000)
            ]
        )
        for number in range(4)
    ]
    for thread in threads:
        thread.start()

    def all_taken() -> bool:
        taken.extend(inputs.take(0.01) or [])
        return len(taken) >= 4000

    wait_until(all_taken, LONG_S, "all inputs")
    for number in range(4):
        own = [event.now for event in taken if int(event.now) == number]
        assert len(own) == 1000 and own == sorted(own)


def test_what_came_in_before_the_end_is_still_taken() -> None:
    """Then whoever takes is told that nothing comes any more."""
    inputs = InputQueue()
    inputs.put(Tick(1.0), wakes=False)
    inputs.close()
    assert inputs.take(LONG_S) == [Tick(1.0)]
    assert inputs.take(LONG_S) is None
    assert inputs.take(LONG_S) is None
