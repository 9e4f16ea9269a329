"""A virtual cell with a late machine: what arrives late, stands still, or reads a clock badly."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import msgspec
from scara_config import Robot
from scara_simulation.simulation import Snapshot
from twin_controller.config import load_twin_controller
from twin_controller.core.actions import StreamAhead, StreamReal
from twin_controller.core.events import AnyEvent, RealMeasured, Tick, TwinMeasured
from twin_controller.core.sides.own_gap import OwnGaps
from twin_controller.robot_sample import RobotSample

from harness.plants.known_robot import knowing
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files
from harness.virtual_cell.timing import SHIPPED, Delays
from harness.workspace import ROOT


def desk_files(robot: str) -> CellFiles:
    """Return a cell whose links forgive what a busy machine does, as `./cell up` starts it.

    Its controller knows its robot.
    """
    files = load_files(robot)
    controller = load_twin_controller(files.robot, ROOT / "config", "desk")
    return replace(files, controller=knowing(controller, files.robot))


class TroubledCell(VirtualCell):
    """A cell whose processes can stand still, whose writes can be late, whose clocks jitter."""

    def __init__(
        self,
        files: CellFiles,
        delays: Delays = SHIPPED,
        late_write: float = 0.0,
        late_answer: float = 0.0,
        clock_jitter: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Build a cell in which nothing is connected yet.

        Args:
            files: The cell.
            delays: How late each way is.
            late_write: Largest extra delay of a set point on its way to the robot [s].
            late_answer: Largest extra delay of one answer of the robot in ten [s].
            clock_jitter: Largest error of a stamp of either side, to both sides [s].
            seed: Of what is drawn.
        """
        self._source = random.Random(seed)
        self._clock_jitter, self._late_write = clock_jitter, late_write
        self._late_answer, self._answer_at = late_answer, 0.0
        self._frozen = False
        self._left: list[AnyEvent] = []
        self._late: list[StreamReal] = []
        super().__init__(files, delays, seed=seed)
        if clock_jitter:
            self.real.stamps_off_ms = self._off_ms
        self.gaps = OwnGaps(files.controller.own_gap)
        self._write_setpoint: Callable[[StreamReal], None] = self.real._due
        self.real._due = self._due  # type: ignore[method-assign]
        self._write_ahead: Callable[[StreamAhead], None] = self.real.stream_ahead
        self._write_at = 0.0
        if late_write:
            self.real.stream_ahead = self._write_late  # type: ignore[method-assign]
        self._answered: Callable[..., None] = self.real._hand_over
        self.real._hand_over = self._hand_over  # type: ignore[method-assign]

    def put(self, event: AnyEvent) -> None:
        """Give one input to the core, or keep it while the controller stands still."""
        event = self._misread(event)
        if not self._frozen:
            self.gaps.look(self.clock())
            super().put(event)
        elif not isinstance(event, Tick) and not self._asked(event):
            self._left.append(event)

    def stand_controller(self, duration: float) -> None:
        """Let the controller's process stand still from now on; then it finds what was left."""
        self._frozen = True
        self.schedule.after(duration, self._wake)

    def stand_robot(self, duration: float) -> None:
        """Let the robot ramp down and stand for a moment, without a word about it."""
        group = self.real.robot._motion
        go_on = group.step
        group.step = lambda override, hold: go_on(override, True)  # type: ignore[method-assign]
        self.schedule.after(duration, lambda: delattr(group, "step"))

    def stand_simulator(self, duration: float) -> None:
        """Let the simulator stand still from now on; then it catches up as its node does."""
        simulation, config = self.twin.simulation, self.files.simulation
        go_on, stood = simulation.advance, 0

        def advance(steps: int) -> list[Snapshot]:
            nonlocal stood
            stood += steps
            if stood * config.dt < duration:
                return []
            del simulation.advance  # type: ignore[attr-defined]
            made_up_for = min(stood, round(config.max_catch_up_ms * 1e-3 / config.dt))
            simulation.skip((stood - made_up_for) * config.step_ns)
            return go_on(made_up_for)

        simulation.advance = advance  # type: ignore[method-assign]

    def _asked(self, event: AnyEvent) -> bool:
        """Return whether an answer of the robot waits: the next is not asked for before."""
        waits = any(isinstance(left, RealMeasured) for left in self._left)
        return isinstance(event, RealMeasured) and waits

    def _wake(self) -> None:
        """Write what is due, and judge all that waited, as the engine does."""
        self._frozen = False
        late, self._late = self._late, []
        for action in late:
            self._write_setpoint(action)
        now = self.clock()
        gap = self.gaps.look(now)
        super().put(Tick(now, gap, self.gaps.stood))
        left, self._left = self._left, []
        for event in left:
            if isinstance(event, RealMeasured):
                event = msgspec.structs.replace(event, now=now)
            super().put(event)

    def _write_late(self, action: StreamAhead) -> None:
        """Write set points ahead late, too; those behind them wait for their turn on the line."""
        late = self._source.random() * self._late_write
        self._write_at = max(self._write_at, self.schedule.now + late)
        self.schedule.after(self._write_at - self.schedule.now, lambda: self._write_ahead(action))

    def _due(self, action: StreamReal) -> None:
        if self._frozen:
            self._late.append(action)
            return
        if not self._late_write:
            self._write_setpoint(action)
            return
        late = self._source.random() * self._late_write
        self.schedule.after(late, lambda: self._write_setpoint(action))

    def _hand_over(self, sample: RobotSample, sent: float, received: float) -> None:
        late = 0.0
        if self._late_answer and self._source.random() < 0.1:
            late = self._source.random() * self._late_answer
        # Nobody asks before he is answered: a late answer makes those behind it late too.
        self._answer_at = max(self._answer_at, self.schedule.now + late)
        due = self._answer_at - self.schedule.now
        self.schedule.after(due, lambda: self._answered(sample, sent, received))

    def _misread(self, event: AnyEvent) -> AnyEvent:
        """Shift a stamp of the twin by what its clock is read wrongly."""
        if self._clock_jitter and isinstance(event, TwinMeasured):
            off = self._source.uniform(-self._clock_jitter, self._clock_jitter)
            moved = msgspec.structs.replace(event.motion, time=event.motion.time + off)
            return msgspec.structs.replace(event, motion=moved)
        return event

    def _off_ms(self) -> int:
        """Return what the next stamp of the robot is wrong by."""
        return round(self._source.uniform(-self._clock_jitter, self._clock_jitter) * 1e3)


def fastest_percent(cell: VirtualCell, since: float) -> float:
    """Return the largest speed of the real robot since then [percent of a joint's largest].

    By finite differences of its true positions: another route than its own velocities.
    """
    limits = _velocities(cell.files.robot)
    rows = [row for row in cell.real.truth if row[0] >= since]
    worst = 0.0
    for (t, q, _), (later, p, _) in pairwise(rows):
        for a, b, limit in zip(q, p, limits):
            worst = max(worst, abs(b - a) / (later - t) / limit)
    return 100.0 * worst


def fastest_twin_percent(cell: VirtualCell, since: float) -> float:
    """Return the largest speed of the twin since then [percent of a joint's largest].

    By its own true velocities: the steps after a stall are made at once.
    """
    limits = _velocities(cell.files.robot)
    rows = [qdot for at, _, qdot in cell.twin.truth if at >= since]
    return 100.0 * max(abs(v) / limit for row in rows for v, limit in zip(row, limits))


def _velocities(robot: Robot) -> tuple[float, ...]:
    return tuple(joint.velocity for joint in robot.twin_joints)
