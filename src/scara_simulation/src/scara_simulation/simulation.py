"""The simulated cell on its nominal time axis: world, control, pause and reset.

No clock is read here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import msgspec

from scara_simulation.joints.control import JointControl
from scara_simulation.joints.loop import LoopState


class World(Protocol):
    """What the simulation needs of a physics engine."""

    def read(self) -> tuple[list[float], list[float]]:
        """Return positions and velocities."""

    def step(self, efforts: Sequence[float]) -> None:
        """Advance by one time step."""

    def reset(self, positions: Sequence[float]) -> None:
        """Put the joints there, at rest."""


class SimulationError(RuntimeError):
    """The physics has left the numbers."""


class Snapshot(msgspec.Struct, frozen=True):
    """State of the joints at a nominal time; efforts are those of the step before.

    ``loops`` is empty most of the time; ``watched`` holds (stamp, state) of the watched loops for
    each step since the last snapshot.
    """

    step: int
    stamp_ns: int
    positions: list[float]
    velocities: list[float]
    efforts: list[float]
    loops: list[LoopState]
    watched: list[tuple[int, LoopState]] = []


class Timing(msgspec.Struct, frozen=True):
    """The nominal time axis.

    It says how many steps lie between two snapshots and between two with the loops' states.
    """

    step_ns: int
    epoch_ns: int
    steps_per_snapshot: int
    steps_per_loop_state: int


class Simulation:
    """Steps the world under control; step k ends at ``base + k * step_ns``.

    The axis of the set points is seconds since the epoch, which never moves; the base moves when
    time was skipped.
    """

    def __init__(
        self, world: World, control: JointControl, start: Sequence[float], timing: Timing
    ) -> None:
        """Put the world at the start pose [rad] or [m], at the nominal time of ``timing``."""
        self._world = world
        self.control = control
        self._start = list(start)
        self._timing = timing
        self._base_ns = timing.epoch_ns
        self.steps = 0
        self.watched: tuple[int, ...] = ()
        """Joints whose loops are told for each step; may be set at any time."""
        self._seen: list[tuple[int, LoopState]] = []
        self.reset()

    @property
    def dt(self) -> float:
        """Length of a step [s]."""
        return self._timing.step_ns * 1e-9

    @property
    def stamp_ns(self) -> int:
        """Nominal time of the present state [ns]."""
        return self._base_ns + self.steps * self._timing.step_ns

    def stamp_before(self, steps: int) -> int:
        """Return the nominal time of the state so many steps before the present one [ns]."""
        return self.stamp_ns - steps * self._timing.step_ns

    @property
    def now(self) -> float:
        """Nominal time of the present state on the axis of the set points [s]."""
        return (self.stamp_ns - self._timing.epoch_ns) * 1e-9

    def axis_time(self, stamp_ns: int) -> float:
        """Convert a nominal time to the axis of the set points [s]."""
        return (stamp_ns - self._timing.epoch_ns) * 1e-9

    def reset(self) -> None:
        """Return to the start pose and forget every command; time goes on."""
        self._world.reset(self._start)
        self.control.reset()
        self._q, self._qdot = self._world.read()
        self._efforts = [0.0] * len(self._start)

    def restart(self, start: Sequence[float]) -> None:
        """Return to another start pose, as :meth:`reset` does."""
        self._start = list(start)
        self.control.start(start)
        self.reset()

    def skip(self, duration_ns: int) -> None:
        """Let the nominal time jump; set points keep their due times.

        Where it jumps back, they were sent by the clock of before and go with it.
        """
        self._base_ns += duration_ns
        if duration_ns < 0:
            self.control.postpone(duration_ns * 1e-9)

    def thaw(self, duration_ns: int) -> None:
        """Go on after a pause of ``duration_ns``.

        Set points are due that much later, so motion goes on where it stood.
        """
        self._base_ns += duration_ns
        self.control.postpone(duration_ns * 1e-9)

    def snapshot(self, *, with_loops: bool) -> Snapshot:
        """Return the present state."""
        loops = (
            [loop.state(q, v) for loop, q, v in zip(self.control.loops, self._q, self._qdot)]
            if with_loops
            else []
        )
        seen, self._seen = self._seen, []
        return Snapshot(self.steps, self.stamp_ns, self._q, self._qdot, self._efforts, loops, seen)

    def advance(self, steps: int) -> list[Snapshot]:
        """Run ``steps`` steps and return the snapshots that fall due on the way.

        Raises:
            SimulationError: A joint's position is no number any more.
        """
        world, control, timing = self._world, self.control, self._timing
        snapshots: list[Snapshot] = []
        since_epoch_ns = self._base_ns - timing.epoch_ns
        for _ in range(steps):
            now = (since_epoch_ns + self.steps * timing.step_ns) * 1e-9
            self._efforts = control.efforts(now, self._q, self._qdot)
            world.step(self._efforts)
            self._q, self._qdot = world.read()
            self.steps += 1
            for k in self.watched:
                self._seen.append(
                    (self.stamp_ns, control.loops[k].state(self._q[k], self._qdot[k]))
                )
            if self.steps % timing.steps_per_snapshot == 0:
                # Seldom is enough: what is no number stays so.
                if not all(map(math.isfinite, self._q)):
                    raise SimulationError(f"step {self.steps}: joint positions are {self._q}")
                snapshots.append(
                    self.snapshot(with_loops=self.steps % timing.steps_per_loop_state == 0)
                )
        return snapshots
