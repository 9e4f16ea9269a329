"""Runs the simulation in real time.

It has one thread, absolute deadlines, and one lock for everything that touches the simulation.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from scara_simulation.config import SimulationConfig
from scara_simulation.health import Status
from scara_simulation.real_time import DeadlineReport, PhysicsPace, WakeTimes
from scara_simulation.simulation import Simulation, Snapshot

# Steps by hand under one hold of the lock: commands and a pause get in between.
_CHUNK = 100
_CHANGE_PERIOD_NS = 100_000_000


class RealTimeRunner:
    """Wakes, runs the steps that are due, hands out snapshots and reports."""

    def __init__(
        self,
        simulation: Simulation,
        config: SimulationConfig,
        *,
        factor: float,
        follow_system_clock: bool,
        publish: Callable[[Sequence[Snapshot]], None],
        report: Callable[[Status], None],
    ) -> None:
        """Be ready to :meth:`run`.

        Args:
            simulation: What to run.
            config: Wake period, catch-up, report rate.
            factor: Simulated time per real time; 0: as fast as possible.
            follow_system_clock: Move the nominal time axis when the system's clock is stepped.
            publish: Gets the snapshots of each wake, outside the lock.
            report: Gets the status at the report rate and when it has changed.
        """
        self.lock = threading.Lock()
        # Taken before the other one: states leave in the order of their stamps, and none after the
        # answer to a pause.
        self._telling = threading.Lock()
        self.simulation = simulation
        self._config, self._factor, self._follow = config, factor, follow_system_clock
        self._publish, self._report = publish, report
        self.paused = False
        self._begin(time.monotonic_ns())
        # Made by hand while paused: of the pause, they alone are simulated time.
        self._paused_steps = 0
        self._failure: Exception | None = None
        self._stalls = self._clock_steps = self._refused = 0
        self._last_refusal = ""

    def run(self, stopped: Callable[[], bool]) -> None:
        """Run until ``stopped``; an error of the simulation or of :meth:`fail` ends it."""
        with self.lock:
            self._begin(time.monotonic_ns())
        while not stopped():
            now = self._wait()
            with self._telling:
                with self.lock:
                    snapshots = self._run_due(now)
                if snapshots:
                    self._publish(snapshots)
            self._report_if_due(now)
            if self._failure is not None:
                raise self._failure

    def _wait(self) -> int:
        """Sleep until the next wake and return when it was."""
        if self._factor == 0.0 and not self.paused:
            time.sleep(0.0)  # lets the other threads in
            return time.monotonic_ns()
        time.sleep(self._deadlines.wait_ns(time.monotonic_ns()) * 1e-9)
        now = time.monotonic_ns()
        self._deadlines.woke(now)
        return now

    def _begin(self, now_ns: int) -> None:
        """Let step 0, the first deadline and the first report period begin now, in system time."""
        config = self._config
        # The nominal time axis is the system clock of this moment; later steps of that clock are
        # followed one by one.
        self._clock_offset_ns = time.time_ns() - now_ns
        if self._follow:
            self.simulation.skip(now_ns + self._clock_offset_ns - self.simulation.stamp_ns)
        self._deadlines = WakeTimes(int(config.wake_period_ms * 1e6), now_ns)
        self._pace = PhysicsPace(
            config.step_ns, self._factor, int(config.max_catch_up_ms * 1e6), now_ns
        )
        # Since when, from which step, and what the last period of reporting has shown.
        none = DeadlineReport(0, 0, 0.0, 0.0, 0.0)
        self._window = (now_ns, self.simulation.steps, none, 0.0, False)
        # Until a pause, also one that ends before the period does.
        self._whole = not self.paused
        # When, and what of it a change of is reported at once.
        self._reported = (now_ns, (False, 0, 0, 0))

    def fail(self, error: Exception) -> None:
        """End :meth:`run` with ``error``."""
        # rospy logs an error of a callback and goes on, so the loop's own thread has to end.
        self._failure = error

    def refuse(self, text: str) -> None:
        """Count a refused command."""
        self._refused += 1
        self._last_refusal = text

    def pause(self) -> None:
        """Stop simulated time; what was true before is published when this returns."""
        with self._telling, self.lock:
            if not self.paused:
                self.paused, self._whole, self._paused_steps = True, False, 0

    def unpause(self) -> None:
        """Let simulated time go on.

        Set points are postponed by the pause, so motion goes on where it stood.
        """
        with self.lock:
            if not self.paused:
                return
            self.paused = False
            if self._factor > 0.0:
                # The pace counts the steps made by hand, the rest of the pause is no simulated
                # time.
                missing = self._pace.restart(time.monotonic_ns(), self._paused_steps)
                if self._follow:
                    self.simulation.thaw(missing * self._config.step_ns)

    def reset(self) -> None:
        """Return to the start pose and forget every command."""
        with self.lock:
            self.simulation.reset()

    def step(self, count: int) -> bool:
        """Run ``count`` steps by hand; False if the simulation is not paused."""
        while count > 0:
            chunk = min(count, _CHUNK)
            with self._telling:
                with self.lock:
                    if not self.paused:
                        return False
                    snapshots = self.simulation.advance(chunk)
                    self._paused_steps += chunk
                self._publish(snapshots)
            count -= chunk
        return True

    def _run_due(self, now_ns: int) -> list[Snapshot]:
        if self.paused:
            return []
        if self._factor == 0.0:
            return self.simulation.advance(
                self._config.physics_rate_hz // self._config.joint_states_rate_hz
            )
        due, skipped = self._pace.due(now_ns)
        if skipped:
            self._stalls += 1
            if self._follow:
                self.simulation.skip(skipped * self._config.step_ns)
        return self.simulation.advance(due)

    def _report_if_due(self, now_ns: int) -> None:
        began, steps = self._window[:2]
        reported_ns, last = self._reported
        changed = (self.paused, self._stalls, self._clock_steps, self._refused)
        if now_ns - began >= 1_000_000_000 // self._config.diagnostics_rate_hz:
            # The nominal time axis moves when the system's clock was stepped. Slewing moves both
            # clocks alike.
            step = time.time_ns() - time.monotonic_ns() - self._clock_offset_ns
            if self._follow and abs(step) > self._config.clock_step_limit_ms * 1e6:
                with self.lock:
                    self.simulation.skip(step)
                self._clock_offset_ns += step
                self._clock_steps += 1
            speed = (self.simulation.steps - steps) * self._config.step_ns / (now_ns - began)
            with self.lock:  # a pause that begins now belongs to the next period
                whole, self._whole = self._whole, not self.paused
            self._window = (now_ns, self.simulation.steps, self._deadlines.report(), speed, whole)
        elif changed == last or now_ns - reported_ns < _CHANGE_PERIOD_NS:
            return
        self._reported = (now_ns, changed)
        self._report(self.status())

    def status(self) -> Status:
        """Return how the simulation is doing."""
        control = self.simulation.control
        return Status(
            paused=self.paused,
            whole=self._window[4],
            steps=self.simulation.steps,
            real_time_factor=self._window[3],
            deadlines=self._window[2],
            stalls=self._stalls,
            skipped_steps=self._pace.skipped_steps,
            clock_steps=self._clock_steps,
            saturated_steps=control.saturated_steps_of,
            limited_steps=control.limited_steps,
            refused=self._refused,
            last_refusal=self._last_refusal,
        )
