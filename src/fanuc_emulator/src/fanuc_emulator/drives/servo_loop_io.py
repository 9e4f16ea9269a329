"""Run the controller in real time, and wake seldom for it.

Ticks have absolute deadlines. When a tick is computed makes no difference to what it brings, so it
is computed when somebody reads, or when the loop's own thread wakes.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from scara_config.frames import LETTERS, WORDS, Kind
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.values import Pose

from fanuc_emulator.controller import Controller
from fanuc_emulator.snapshot import Snapshot

Change = Callable[[Controller], None]
Observer = Callable[[Snapshot, float], None]

WAKE_S = 0.01
"""So often the thread wakes, whoever reads: a wake costs more than a tick.

Our choice: a usual poll period. Observers hear of a tick at most so late, with its own time."""


class ServoLoop:
    """Own the controller: writes come in through a mailbox, readers get the newest snapshot.

    Tick ``k`` is due at ``base + k dt / (1 + drift)`` on the monotonic clock: the controller's
    quartz paces its servo. A write takes part in the first tick due after its arrival, however late
    that tick is computed.

    Args:
        controller: Stepped by this loop alone.
        dt: Interpolation period on the controller's own clock [s].
        drift_ppm: By how much that clock runs fast.
        observe: Called after each tick, by whoever computes it, with the snapshot and the monotonic
            time at which it was true.
    """

    def __init__(
        self, controller: Controller, dt: float, drift_ppm: float, observe: Observer | None = None
    ) -> None:
        self.failure: BaseException | None = None
        self.ended = threading.Event()
        self._controller = controller
        self._newest = controller.snapshot()
        self._period = dt / (1.0 + drift_ppm * 1e-6)
        self._wake_period = max(1, round(WAKE_S / self._period)) * self._period
        self._observe = observe
        # Any thread appends, only who holds `_stepping` takes; deque does both without a lock.
        self._mailbox: deque[tuple[float, Change]] = deque()
        # Held by whoever computes ticks.
        self._stepping = threading.Lock()
        # None: the loop does not run yet, or no more.
        self._base: float | None = None
        self._tick = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="servo_loop", daemon=True)

    def __enter__(self) -> ServoLoop:
        self._base = time.monotonic()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(timeout=1.0)

    @property
    def snapshot(self) -> Snapshot:
        """What the robot shows now; from any thread."""
        self._catch_up()
        return self._newest

    def frame(self, kind: Kind, number: int) -> tuple[float, ...]:
        """Return X Y Z W P R of a frame as it is now [mm, deg]; from any thread."""
        pose = self._controller.registers.read(Indexed(WORDS[kind], (float(number),)))
        assert isinstance(pose, Pose)
        return pose.values[: len(LETTERS)]

    def post(self, change: Change) -> None:
        """Apply ``change`` to the controller before the next tick; changes keep their order."""
        self._mailbox.append((time.monotonic(), change))

    def _run(self) -> None:
        """Catch up now and then until stopped, also while nobody reads."""
        try:
            while not self._stop.is_set() and self.failure is None:
                time.sleep(self._wake_period)
                self._catch_up()
        finally:
            with self._stepping:
                self._base = None
            self.ended.set()

    def _catch_up(self) -> None:
        """Compute all ticks that are due; an error is kept in ``failure`` and ends the loop."""
        with self._stepping:
            base, now = self._base, time.monotonic()
            try:
                while base is not None and (due := base + (self._tick + 1) * self._period) <= now:
                    self._tick += 1
                    # With the writes that had arrived by then.
                    while self._mailbox and self._mailbox[0][0] <= due:
                        self._mailbox.popleft()[1](self._controller)
                    self._newest = self._controller.step()
                    if self._observe is not None:
                        self._observe(self._newest, due)
            # Whoever computes may be a reader: the error is the loop's and must not end that
            # thread.
            except BaseException as error:
                self.failure, self._base = error, None
