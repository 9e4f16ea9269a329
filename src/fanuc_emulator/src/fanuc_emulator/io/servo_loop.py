"""Run the controller in real time.

A thread on absolute deadlines, catching up when it wakes late.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from fanuc_emulator.controller import Controller
from fanuc_emulator.snapshot import Snapshot

Change = Callable[[Controller], None]
Observer = Callable[[Snapshot, float], None]


class ServoLoop:
    """Own the controller: writes come in through a mailbox, the newest snapshot goes out.

    Tick ``k`` is due at ``base + k dt / (1 + drift)`` on the monotonic clock: the controller's
    quartz paces its servo. A write takes part in the first tick due after its arrival, however late
    that tick is computed.

    Args:
        controller: Stepped by this thread alone.
        dt: Interpolation period on the controller's own clock [s].
        drift_ppm: By how much that clock runs fast.
        observe: Called after each tick with the snapshot and the monotonic time at which it is
            true.
    """

    def __init__(
        self, controller: Controller, dt: float, drift_ppm: float, observe: Observer | None = None
    ) -> None:
        self.snapshot = controller.snapshot()
        self.failure: BaseException | None = None
        self.ended = threading.Event()
        self._controller = controller
        self._period = dt / (1.0 + drift_ppm * 1e-6)
        self._observe = observe
        self._mailbox: deque[tuple[float, Change]] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="servo_loop", daemon=True)

    def __enter__(self) -> ServoLoop:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(timeout=1.0)

    def post(self, change: Change) -> None:
        """Apply ``change`` to the controller before the next tick; changes keep their order."""
        self._mailbox.append((time.monotonic(), change))

    def _run(self) -> None:
        """Step until stopped; an error ends the loop and is kept in ``failure``."""
        try:
            base, tick = time.monotonic(), 0
            while not self._stop.is_set():
                tick += 1
                due = base + tick * self._period
                wait = due - time.monotonic()
                if wait > 0.0:
                    time.sleep(wait)
                while self._mailbox and self._mailbox[0][0] <= due:
                    self._mailbox.popleft()[1](self._controller)
                self.snapshot = self._controller.step()
                if self._observe is not None:
                    self._observe(self.snapshot, due)
        except BaseException as error:
            self.failure = error
        finally:
            self.ended.set()
