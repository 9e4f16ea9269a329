"""Inputs of the engine in their order, those that can wait without a wake of their own.

A wake of a thread costs more than the input itself, and the robot's readings come each poll period.
"""

from __future__ import annotations

import queue
import time
from collections import deque

from twin_controller.core.events import AnyEvent


class InputQueue:
    """Many threads put, one takes."""

    def __init__(self) -> None:
        """Begin empty."""
        self._inputs: deque[AnyEvent] = deque()
        # One for each input that wakes; what it holds is not looked at.
        self._wakes: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._closed = False

    def put(self, event: AnyEvent, wakes: bool = True) -> None:
        """Hand one input over; returns at once.

        Args:
            event: The input.
            wakes: Whoever takes is woken; else the input waits for the next one that wakes, or for
                the end of the time-out.
        """
        # First the input: who is woken must find it.
        self._inputs.append(event)
        if wakes:
            self._wakes.put(None)

    def close(self) -> None:
        """End whoever takes, after what has already come in."""
        self._closed = True
        self._wakes.put(None)

    def take(self, timeout: float) -> list[AnyEvent] | None:
        """Wait for an input that wakes, and return all that are there.

        Args:
            timeout: Wait at most so long [s]; then the list may be empty.

        Returns:
            The inputs in their order; None: the queue is closed, and all were taken.
        """
        end = time.monotonic() + timeout
        while True:
            woken = self._woken(0.0 if self._closed else end - time.monotonic())
            # As many as there are now, for others go on putting.
            batch = [self._inputs.popleft() for _ in range(len(self._inputs))]
            if batch:
                return batch
            if self._closed:
                return None
            if not woken:
                return batch
            # The wake was left of an input that had gone with those before it.

    def _woken(self, timeout: float) -> bool:
        """Wait for a wake and forget further ones; return whether one came in time."""
        try:
            self._wakes.get(timeout=max(timeout, 0.0))
        except queue.Empty:
            return False
        while not self._wakes.empty():
            self._wakes.get_nowait()
        return True
