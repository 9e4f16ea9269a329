"""The stream program of a robot that plans one motion after the other, without looking ahead."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from scara_config import Joint

from fanuc_emulator.plant.config import Plant, StreamFile

BREAK_S = 0.25
"""A motion after so long without one begins at rest [asm]: set points come each 10 ms."""

Targets = tuple[float, ...]


class StreamInterpreter:
    """``LBL[1]; J PR[1] R[2]% CNT100; JMP LBL[1]``, stepped once per interpolation period.

    PR[1] is read when the motion before it has been planned to its end; what is written meanwhile
    counts for the next one. What is planned is carried out later by a lag that grows with use.

    Args:
        file: Lags.
        velocities: Greatest joint speeds [rad/s or m/s], shape ``(n,)``.
        period: Interpolation period [s].

    Source:
        facts of published measurements: about 150 ms from PR[1] to its motion on an R-30iB, one
        interpolation period more with each motion on its stream interface.
    """

    def __init__(self, file: StreamFile, velocities: Sequence[float], period: float) -> None:
        self._file, self._velocities, self._period = file, tuple(velocities), period
        self._lag = 0
        self._idle = math.inf
        self.reset(())

    @property
    def lag(self) -> float:
        """From the planning of a motion to its beginning [s]."""
        return self._lag * self._period

    def reset(self, position: Targets) -> None:
        """Stand at ``position`` and forget what was planned."""
        self._end = self._output = position
        self._motion: deque[Targets] = deque()
        # Planned points, and how many periods each has to wait.
        self._planned: deque[tuple[int, Targets]] = deque()
        self._now = 0

    def step(self, wanted: Targets | None, speed: float) -> Targets:
        """Go on for one period and return where the axes should be.

        Args:
            wanted: ``PR[1]`` [rad or m], shape ``(n,)``; None: it is not valid, nothing new is
                planned.
            speed: Fraction 0..1 of the greatest speed; 0 ends what was planned where it is.
        """
        if speed <= 0.0:
            self.reset(self._output)
            self._idle += self._period
            return self._output
        self._now += 1
        if not self._motion and wanted is not None and wanted != self._end:
            self._plan(wanted, speed)
        if self._motion:
            self._planned.append((self._now + self._lag, self._motion.popleft()))
            self._idle = 0.0
        else:
            self._idle += self._period
        while self._planned and self._planned[0][0] <= self._now:
            self._output = self._planned.popleft()[1]
        return self._output

    def _plan(self, wanted: Targets, speed: float) -> None:
        """Plan a straight motion from the end of the last one; the filters round its corners."""
        if self._idle >= BREAK_S:
            # The lag grows, or begins anew after a long rest.
            file = self._file
            lag = file.lag_ms
            if self._idle < file.rest_s:
                lag = min(1e3 * self.lag + file.lag_step_ms, file.lag_largest_ms)
            self._lag = round(1e-3 * lag / self._period)
        begin, self._end = self._end, wanted
        longest = max(abs(b - a) / (v * speed) for a, b, v in zip(begin, wanted, self._velocities))
        # A rounding error must not cost a whole period.
        count = max(1, math.ceil(longest / self._period - 1e-9))
        for k in range(1, count):
            part = k / count
            self._motion.append(tuple([a + part * (b - a) for a, b in zip(begin, wanted)]))
        self._motion.append(wanted)


def interpreter_of(plant: Plant, joints: Sequence[Joint]) -> StreamInterpreter | None:
    """Return what carries out the stream program; None if each set point counts at once."""
    if plant.stream.look_ahead:
        return None
    velocities = [joint.velocity for joint in joints]
    return StreamInterpreter(plant.stream, velocities, plant.interpolation_period_ms / 1000.0)
