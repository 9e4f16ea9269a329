"""A whole cell in virtual time.

    with VirtualCell("fanuc_sr6ia") as cell:
        cell.connect()
        cell.run_program("ARTICLE")
        cell.move_to((0.51, 0.16, 0.10), speed_percent=50.0)
        cell.real.truth, cell.twin.truth

Another plant, controller or world is another ``CellFiles``; other ways and clocks are ``Delays``
and ``Clocks``.
The same arguments give the same figures to the last digit.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from functools import partial

from scara_simulation.world_io import World
from twin_controller.core.actions import (
    AnyAction,
    CapTwin,
    Decided,
    FollowTwin,
    MoveTwin,
    OverrideReal,
    Reply,
    SendReal,
    SendTwin,
    StreamAhead,
    StreamReal,
)
from twin_controller.core.events import (
    AnyEvent,
    LinkChanged,
    MoveEnded,
    Operator,
    RealMeasured,
    Tick,
)
from twin_controller.core.follow.ahead import reaches_ahead
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.standing import unseen
from twin_controller.core.setup import Setup
from twin_controller.core.state import initial_state
from twin_controller.core.step import step
from twin_experiments.run.standstill import Activity, observe, still_for
from typing_extensions import Self

from harness.virtual_cell.files import CellFiles, load_files
from harness.virtual_cell.real_side import RealSide
from harness.virtual_cell.schedule import SECOND, Schedule, SideClock, Wire
from harness.virtual_cell.simulator import open_world
from harness.virtual_cell.timing import CLOCKS, SHIPPED, Clocks, Delays
from harness.virtual_cell.twin_side import TwinSide

TICK = 0.01
FRESH_S = 0.5
ENDED_MODES = ("STOPPED", "STANDSTILL", "ESTOP", "FAULT", "OFFLINE", "PAUSED")


class CellError(RuntimeError):
    """The cell did not do what it was asked for; the text says why."""


class VirtualCell:
    """Core, stand-in, simulator and motion nodes on one virtual clock; a context manager."""

    def __init__(
        self,
        robot: str | CellFiles,
        delays: Delays = SHIPPED,
        clocks: Clocks = CLOCKS,
        tamper: Callable[[AnyAction], AnyAction] = lambda action: action,
        seed: int = 0,
    ) -> None:
        """Build a cell in which nothing is connected yet.

        Args:
            robot: Name of a profile, or its files with what is to be different.
            delays: How late each way is.
            clocks: The sides' clocks.
            tamper: Changes what the core decides, to see whether a figure notices.
            seed: Of the jitter.
        """
        self.files = load_files(robot) if isinstance(robot, str) else robot
        self.setup = Setup(self.files.robot, self.files.controller)
        self.schedule = Schedule()
        self._clocks, self._tamper = clocks, tamper
        self._state = initial_state(self.setup)
        self.decisions: list[Decided] = []
        self.replies: dict[int, Reply] = {}
        self.mode, self.why = "OFFLINE", "started"
        self._real_is_up = False
        wire = partial(self._wire, source=random.Random(seed))
        self._to_twin = wire(delays.to_twin, delays.jitter)
        self._world: World = open_world(self.files)
        self.real = RealSide(
            self.schedule,
            self.files,
            delays,
            wire(delays.write, 0.0),
            self.clock,
            self._sampled,
        )
        self.twin = TwinSide(
            self.schedule,
            self.files,
            self._world,
            SideClock(self.schedule, clocks.twin_offset, clocks.twin_drift_ppm),
            wire(delays.topic, 0.0),
            wire(delays.from_twin, delays.jitter),
            self.clock,
            self.put,
        )
        self._put_ns = 0
        self.schedule.every(TICK, self._tick, first=0.001)
        said = 1.0 / self.setup.config.state_rate_hz
        self.schedule.every(said, self._say_state, first=0.002)
        self._seen = [0, 0]
        self._activities = [Activity(), Activity()]
        share = self.files.experiments.metrics.moving_speed_percent * 1e-2
        self._slow = [joint.velocity * share for joint in self.files.robot.twin_joints]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Free the physics engine."""
        self._world.close()

    def clock(self) -> float:
        """Return the controller's monotonic clock [s]."""
        return self._clocks.controller_offset + self.schedule.now

    def connect(self) -> None:
        """Bring both links up and wait until the pair stands aligned."""
        self.put(LinkChanged(self.clock(), "twin", True, ""))
        self.schedule.run(0.5)

        def ready() -> bool:
            motion = self._state.sides.twin.motion
            idle = self.mode == "IDLE" and motion is not None and motion.state == "idle"
            return idle and self.still_for() > FRESH_S

        self.wait_whatever(ready, 30.0, "IDLE")

    def run_program(self, name: str, override_percent: float = 100.0) -> None:
        """Start a program on the robot's own pendant and wait for its end.

        Raises:
            CellError: It does not run or does not end, or the controller ended the motion.
        """
        deadlines = self.files.experiments.deadlines_s
        self.real.pendant(override_percent, self.files.program_number(name))
        self.wait_until(lambda: self.real.running, deadlines.service, f"{name} to run")
        self.wait_until(lambda: not self.real.running, deadlines.program, f"{name} to end")

    def move_to(
        self,
        point: Sequence[float],
        speed_percent: float,
        yaw: float | None = None,
        path: str = "",
        speed_mm_s: float = 0.0,
    ) -> None:
        """Send the twin's tool to a point [m] by its own side's service, and wait for the answer.

        With ``yaw`` [rad] its tool shall be turned so; with a ``path`` it goes along a line.

        Raises:
            CellError: It was refused or aborted, or the controller ended the motion.
        """
        answers: list[tuple[bool, str]] = []

        def ended(success: bool, text: str) -> None:
            answers.append((success, text))

        self.twin.move_to.begin(point, speed_percent, "", ended, yaw, path, speed_mm_s)
        deadline = self.files.experiments.deadlines_s.move
        self.wait_until(lambda: bool(answers), deadline, f"move_to {tuple(point)}")
        if not answers[0][0]:
            raise CellError(f"move_to {tuple(point)}: {answers[0][1]}")

    def operate(self, command: str, **arguments: object) -> Reply:
        """Give one command of the operator and return the answer."""
        number = len(self.replies) + 1
        self.put(Operator(self.clock(), command, number, **arguments))  # type: ignore[arg-type]
        return self.replies[number]

    def refusals(self) -> dict[str, str]:
        """Return why each command is refused now, as the state shows it."""
        return refusals(self.setup, self._state, self.clock())

    def unseen(self, since: float) -> str:
        """Return which side was not seen to stand since ``since`` by the controller's clock [s]."""
        return unseen(self.setup, self._state, since)

    def wait_still(self, duration: float) -> None:
        """Wait, from now on, until both have stood still for ``duration`` [s] in IDLE."""
        begun = self.schedule.now

        def still() -> bool:
            passed = self.schedule.now - begun
            return min(self.still_for(), passed) >= duration and self.mode == "IDLE"

        limit = self.files.experiments.deadlines_s.still + duration
        self.wait_until(still, limit, "both sides to stand still in IDLE")

    def wait_until(self, done: Callable[[], bool], limit: float, what: str) -> None:
        """Let time pass until ``done`` holds, which is asked every 10 ms.

        Raises:
            CellError: Not within ``limit`` [s], or the controller ended the motion.
        """
        self.wait_whatever(done, limit, what, ENDED_MODES)

    def wait_whatever(
        self, done: Callable[[], bool], limit: float, what: str, ended: Sequence[str] = ()
    ) -> None:
        """Let time pass until ``done`` holds; only a mode of ``ended`` ends the wait."""
        end = self.schedule.now + limit
        while not done():
            if self.mode in ended:
                raise CellError(
                    f"waiting for {what}: the controller went to {self.mode}: {self.why}"
                )
            if self.schedule.now > end:
                raise CellError(
                    f"waited {limit:g} s in vain for {what}; {self.mode}: {self.why}; "
                    f"refused: {self.twin.refused[-1:]}"
                )
            self.schedule.run(TICK)

    def still_for(self) -> float:
        """Return for how long both sides have stood still [s], by their ground truth."""
        for k, truth in enumerate((self.real.truth, self.twin.truth)):
            for at, _, qdot in truth[self._seen[k] :]:
                self._activities[k] = observe(self._activities[k], at, qdot, self._slow)
            self._seen[k] = len(truth)
        return still_for(self._activities, self.schedule.now, FRESH_S)

    def put(self, event: AnyEvent) -> None:
        """Give one input to the core, and let both sides have what it decides."""
        self._put_ns = self.schedule.now_ns
        self._state, actions = step(self.setup, self._state, event)
        for action in actions:
            self._carry_out(self._tamper(action))

    def _tick(self) -> None:
        """Let time pass where no input has, as the engine does."""
        # In whole nanoseconds: as floats two ticks are a hair nearer than a tick to each other.
        if self.schedule.now_ns - self._put_ns >= TICK * SECOND:
            self.put(Tick(self.clock()))

    def _sampled(self, event: RealMeasured) -> None:
        """Give a sample of the robot to the core; the first one says that its link is up."""
        if not self._real_is_up:
            self._real_is_up = True
            self.put(LinkChanged(event.now, "real", True, ""))
        self.put(event)

    def _carry_out(self, action: AnyAction) -> None:
        match action:
            case Decided():
                self.decisions.append(action)
                self.mode, self.why = str(action.mode_after), action.why
            case FollowTwin():
                self._to_twin.send(partial(self.twin.follow, action))
            case StreamReal():
                self.real.stream(action)
            case StreamAhead():
                self.real.stream_ahead(action)
            case SendTwin():
                self._to_twin.send(partial(self.twin.perform, action))
            case SendReal():
                self.real.perform(action.command)
            case CapTwin():
                self._to_twin.send(partial(self.twin.cap, action.speed_percent))
            case OverrideReal():
                self.real.override(action.speed_percent)
            case MoveTwin():
                self._to_twin.send(
                    partial(self.twin.move, action, partial(self._move_ended, action.number))
                )
            case Reply():
                self.replies[action.id] = action

    def _say_state(self) -> None:
        """Publish the part of the controller's state that the twin's nodes need."""
        ahead = reaches_ahead(self.setup, self._state.sides.real)
        self.twin.hear_state(self._state.follow.response.longest, ahead, self.mode, self.why)

    def _move_ended(self, number: int, success: bool, message: str) -> None:
        self.put(MoveEnded(self.clock(), success, message, number))

    def _wire(self, delay: float, jitter: float, source: random.Random) -> Wire:
        return Wire(self.schedule, delay, jitter, source)
