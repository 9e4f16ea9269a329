"""A real robot and a twin in virtual time, for tests of the twin controller's core.

Both sides are ideal movers with a clock of their own: the twin obeys follow packets and motion commands at once, the
real robot runs programs or follows set points after a constant lag. Nothing here shares code with the core.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path

from scara_config import load_robot
from twin_controller.config import load_twin_controller
from twin_controller.core.actions import AnyAction, CapTwin, Decided, Do, FollowTwin, MoveTwin, Perform, Reply, StreamReal
from twin_controller.core.events import (
    AnyEvent,
    ClockProbe,
    LinkChanged,
    MoveEnded,
    Operator,
    RealMeasured,
    Tick,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.state import Setup, initial_state
from twin_controller.core.step import step

ROOT = Path(__file__).resolve().parents[2]
ROBOT = load_robot(ROOT / "config")
SETUP = Setup(ROBOT, load_twin_controller(ROBOT, ROOT / "config"))
HOME = SETUP.home
Joints = tuple[float, ...]
Path_ = Callable[[float], Joints]


class Pair:
    """The core between two simulated sides; ``run`` lets virtual time pass."""

    def __init__(self, real: Joints = HOME, twin: Joints = HOME, real_clock: float = 5000.0, twin_clock: float = 1.7e9) -> None:
        """Place both sides; the clocks are the offsets of their clocks from the controller's [s]."""
        self.state = initial_state(SETUP.config)
        self.now = 100.0
        self.real_q, self.twin_q = real, twin
        self.real_clock, self.twin_clock = real_clock, twin_clock
        self.real_up = self.twin_up = False
        self.own_program = self.streaming = self.paused = self.fault = False
        self.drives = True
        self.starts_stream = True
        self.real_path: Path_ | None = None
        self.real_path_start = 0.0
        self.twin_path: Path_ | None = None
        self.twin_path_start = 0.0
        self.announce = 0.1
        self.motion = "idle"
        self.command_id = 0
        self.limit = 100.0
        self.follow: FollowTwin | None = None
        self.setpoints: deque[tuple[float, Joints]] = deque()
        self.stream_lag = SETUP.config.real.follow_lag_ms * 1e-3
        self.noise: Callable[[], float] = lambda: 0.0
        self.actions: list[AnyAction] = []
        self.replies: dict[int, Reply] = {}
        self.inputs: list[AnyEvent] = []

    def feed(self, event: AnyEvent) -> list[AnyAction]:
        """Give one input to the core and let the sides obey what it decides."""
        self.inputs.append(event)
        self.state, actions = step(SETUP, self.state, event)
        self.actions += actions
        for action in actions:
            self._obey(action)
        return actions

    def connect(self) -> None:
        """Bring both links up and wait until the controller is idle."""
        self.link("real", True)
        self.link("twin", True)
        self.run(1.0)
        self.run_until(lambda: self.state.mode == "IDLE", 30.0)

    def link(self, side: str, up: bool) -> None:
        """Bring one link up or down."""
        setattr(self, f"{side}_up", up)
        self.feed(LinkChanged(self.now, side, up, "" if up else "cut"))  # type: ignore[arg-type]

    def operate(self, command: str, **arguments: object) -> Reply:
        """Send one command of the operator and return the answer."""
        number = len(self.replies) + 1
        self.feed(Operator(self.now, command, number, **arguments))  # type: ignore[arg-type]
        return self.replies[number]

    def run(self, duration: float) -> None:
        """Let time pass in steps of 1 ms; each side reports at its own rate."""
        for _ in range(round(duration * 1000)):
            self._millisecond()

    def run_until(self, condition: Callable[[], bool], limit: float) -> None:
        """Let time pass until ``condition`` holds.

        Raises:
            AssertionError: It does not within ``limit`` seconds.
        """
        for _ in range(round(limit * 1000)):
            if condition():
                return
            self._millisecond()
        raise AssertionError(f"not within {limit} s; mode {self.state.mode}: {self.state.why}; motion {self.motion}")

    def _millisecond(self) -> None:
        self.now = round(self.now + 0.001, 6)
        tick = round(self.now * 1000)
        self._move()
        if self.real_up and tick % 10 == 3:
            self._report_real()
        if self.twin_up and tick % 10 == 7:
            self._report_twin()
        if self.twin_up and tick % 20 == 8:
            self._report_plan()
        if self.twin_up and tick % 50 == 9:
            remote = self.now + self.twin_clock
            self.feed(ClockProbe(self.now, self.now - 0.0008, self.now, remote - 0.0004))
        if tick % 10 == 0:
            self.feed(Tick(self.now))

    def _move(self) -> None:
        if self.real_path and not self.paused and self.drives:
            self.real_q = self.real_path(self.now - self.real_path_start)
        elif self.streaming and not self.paused and self.drives:
            while self.setpoints and self.setpoints[0][0] <= self.now - self.stream_lag:
                self.real_q = self.setpoints.popleft()[1]
        if self.motion == "following" and self.follow is not None:
            age = min(self.now + self.twin_clock - self.follow.stamp, 0.05)
            self.twin_q = tuple(
                p + age * (v + 0.5 * age * a) for p, v, a in zip(self.follow.q, self.follow.qdot, self.follow.qddot)
            )
        elif self.motion in ("announcing", "moving") and self.twin_path is not None:
            elapsed = self.now - self.twin_path_start
            self.motion = "announcing" if elapsed < 0 else "moving"
            self.twin_q = self.twin_path(elapsed)
            if self.twin_path(elapsed) == self.twin_path(1e3):
                self.motion = "idle"

    def _report_real(self) -> None:
        clock = int((self.now + self.real_clock) * 1000) // 2 * 2
        age = self.now + self.real_clock - clock * 1e-3
        q = self.real_path(self.now - age - self.real_path_start) if self.real_path and not self.paused else self.real_q
        rate = _rate(self.real_path, self.now - age - self.real_path_start) if not self.paused else (0.0,) * len(q)
        q = tuple(value + self.noise() * scale for value, scale in zip(q, SETUP.scale))
        self.feed(
            RealMeasured(
                now=self.now, sent=self.now - 0.0005, received=self.now, clock_ms=clock % (1 << 31), q=q, qdot=rate,
                own_program=self.own_program, streaming=self.streaming, paused=self.paused, drives_on=self.drives,
                fault=self.fault, speed_percent=100.0, override_percent=100.0,
            )
        )  # fmt: skip

    def _report_twin(self) -> None:
        q = tuple(value + self.noise() * scale for value, scale in zip(self.twin_q, SETUP.scale))
        rate = _rate(self.twin_path, self.now - self.twin_path_start) if self.motion == "moving" else (0.0,) * len(q)
        if self.motion == "following" and self.follow is not None:
            rate = self.follow.qdot
        self.feed(TwinMeasured(self.now, self.now + self.twin_clock, q, rate))
        self.report_motion()

    def report_motion(self) -> None:
        """Report the state of the twin's pose controller."""
        still = self.motion not in ("announcing", "moving", "following")
        self.feed(TwinMotion(self.now, self.motion, 100.0, min(100.0, self.limit), self.limit, self.command_id, still, ""))

    def _report_plan(self) -> None:
        if self.motion not in ("announcing", "moving") or self.twin_path is None:
            return
        times = tuple(0.01 * k for k in range(16))
        start = self.now - self.twin_path_start
        rows = tuple(self.twin_path(start + t) for t in times)
        rates = tuple(_rate(self.twin_path, start + t) for t in times)
        self.feed(TwinPlan(self.now, self.now + self.twin_clock, times, rows, rates, tuple((0.0,) * len(HOME) for _ in times)))

    def _obey(self, action: AnyAction) -> None:
        match action:
            case Perform():
                self._perform(action)
            case FollowTwin() if self.motion in ("idle", "following") and self.twin_up:
                self.motion, self.follow = "following", action
            case StreamReal() if self.real_up:
                self.setpoints.append((self.now, action.q))
            case CapTwin():
                self.limit = action.speed_percent
            case MoveTwin():
                self.move_twin(ramp(self.twin_q, action.target, 1.0))
                self.feed(MoveEnded(self.now, True, "done"))
            case Reply():
                self.replies[action.id] = action
            case Decided():
                pass

    def _perform(self, action: Perform) -> None:
        do = action.do
        if do in (Do.STOP_TWIN, Do.PAUSE_TWIN, Do.RESUME_TWIN, Do.ESTOP_TWIN, Do.RESET_TWIN) and self.twin_up:
            self.command_id = action.id
            self.motion = {
                Do.STOP_TWIN: "estopped" if self.motion == "estopped" else "idle",
                Do.PAUSE_TWIN: "paused",
                Do.RESUME_TWIN: "moving",
                Do.ESTOP_TWIN: "estopped",
                Do.RESET_TWIN: "idle",
            }[do]
            self.follow = None
        if not self.real_up:
            return
        if do is Do.STOP_REAL:
            self.own_program = self.streaming = self.paused = False
            self.real_path = None
        elif do is Do.HOLD_REAL:
            self.paused = True
        elif do is Do.RELEASE_REAL:
            self.paused = False
        elif do is Do.ESTOP_REAL:
            self.drives = False
            self.real_path, self.own_program, self.streaming = None, False, False
        elif do is Do.RESET_REAL:
            self.drives, self.fault = True, False
        elif do is Do.START_STREAM and self.starts_stream and not self.own_program:
            self.streaming = True

    def run_program(self, path: Path_) -> None:
        """Start a program on the real robot's own side."""
        self.own_program, self.streaming = True, False
        self.real_path, self.real_path_start = path, self.now

    def end_program(self) -> None:
        """End it; the robot stays where it is."""
        self.own_program, self.real_path = False, None

    def move_twin(self, path: Path_) -> None:
        """Let the twin move by its own pose controller, announced as that does."""
        self.motion, self.twin_path, self.twin_path_start = "announcing", path, self.now + self.announce

    def decisions(self) -> list[Decided]:
        """Return all decisions so far."""
        return [action for action in self.actions if isinstance(action, Decided)]


def ramp(start: Joints, end: Joints, duration: float) -> Path_:
    """Return a smooth path between two poses."""

    def at(t: float) -> Joints:
        u = min(max(t / duration, 0.0), 1.0)
        s = u**3 * (10 - 15 * u + 6 * u * u)
        return tuple(a + s * (b - a) for a, b in zip(start, end))

    return at


def _rate(path: Path_ | None, t: float) -> Joints:
    if path is None:
        return (0.0,) * len(HOME)
    return tuple((b - a) / 2e-4 for a, b in zip(path(t - 1e-4), path(t + 1e-4)))


def shifted(q: Joints, *border: float) -> Joints:
    """Return ``q`` moved by the given amounts in degrees and millimetres."""
    return tuple(value + amount * scale for value, amount, scale in zip(q, (*border, 0, 0, 0, 0), SETUP.scale))
