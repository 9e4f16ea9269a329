"""A thread that publishes what the engine has stepped through, so that no sample waits for it.

rospy hands each message to a thread for each listener. On a busy machine the engine waited longer
for those than it reckoned, and set points came 100 ms late.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import rospy
from typing_extensions import Self

from twin_controller.core.actions import Decided
from twin_controller.core.events import AnyEvent
from twin_controller.core.state import CoreState
from twin_controller.reporting.snapshots import latest

PERIOD_S = 0.02
"""So often what has come is published together; one wake costs more than a small message.

Our choice: two poll periods. Stamps tell when each was true, and nobody looks at it sooner."""
MOST = 2000
"""So many batches may wait, about ten seconds; then the oldest are lost, and counted."""
ENDING_S = 2.0


class Batch(NamedTuple):
    """What one look of the engine brought: inputs, the state after them, decisions, and when."""

    events: list[AnyEvent]
    state: CoreState
    decided: list[Decided]
    # Monotonic time of the newest input, and ROS time then. Not when the engine was done with it:
    # a replay knows no other, and at the end of a waiting time the two would differ.
    now: float
    stamp: rospy.Time


class PublisherThread:
    """Takes batches from the engine at once; a context manager that publishes what is left."""

    def __init__(self, publish: Callable[[list[Batch], int], None]) -> None:
        """Prepare; ``publish`` gets the batches of a period and how many before them were lost."""
        self._publish = publish
        self._batches: queue.Queue[Batch | None] = queue.Queue()
        # In all; only the engine's thread counts, so that no loss falls between two threads.
        self._lost = 0
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)

    def __enter__(self) -> Self:
        """Start."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Publish what waits, and end."""
        self._batches.put(None)
        self._thread.join(ENDING_S)

    def stepped(self, events: list[AnyEvent], state: CoreState, decided: list[Decided]) -> None:
        """Take a batch; returns at once."""
        if self._batches.qsize() >= MOST:
            # Nobody publishes: what is oldest is worth least. The replay is told by its numbers.
            with contextlib.suppress(queue.Empty):  # it was taken just now
                self._batches.get_nowait()
                self._lost += 1
        done = time.monotonic()
        now = latest(events, done)
        stamp = rospy.get_rostime()
        # A simulated clock begins at zero, and no stamp is below it.
        stamp -= rospy.Duration.from_sec(min(done - now, stamp.to_sec()))
        self._batches.put(Batch(events, state, decided, now, stamp))

    def _run(self) -> None:
        """Publish until told to end; an error ends the node as one of the engine does."""
        try:
            self._take_turns()
        except BaseException as error:
            self.failure = error
            raise

    def _take_turns(self) -> None:
        """Publish what a period has brought, with one wake; what comes after a silence at once."""
        due, told = time.monotonic(), 0
        while True:
            time.sleep(max(0.0, due - time.monotonic()))
            batches: list[Batch | None] = []
            with contextlib.suppress(queue.Empty):
                while not batches or batches[-1] is not None:
                    batches.append(self._batches.get_nowait())
            batches = batches or [self._batches.get()]
            due = time.monotonic() + PERIOD_S
            lost = self._lost
            found = [batch for batch in batches if batch is not None]
            if found:
                self._publish(found, lost - told)
            told = lost
            if batches[-1] is None:
                return
