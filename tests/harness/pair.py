"""The twin controller's core between two ideal robots in virtual time.

Each side has a clock of its own, with an offset and a drift; commands and reports may be late by a
constant delay.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Callable
from copy import copy
from functools import cache, partial
from itertools import count
from typing import Any, TypeVar

import msgspec
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.config import load_twin_controller
from twin_controller.core import actions, events
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup
from twin_controller.core.state import initial_state
from twin_controller.core.step import step

from harness.plants.known_robot import knowing
from harness.sides import ROBOT, Joints, Path_, RealSide, TwinSide, ramp
from harness.workspace import ROOT

__all__ = ["HOME", "ROBOT", "SETUP", "WATCHED", "Pair", "idle_pair", "ramp", "seen_pair", "shifted"]

replace = msgspec.structs.replace

REAL_PERIOD_S = 0.002
"""How often the ideal real robot renews its readings."""
REAL_DELAY_MS = 18.3
"""How late the ideal real robot does its set points; the core has measured it beforehand."""


SETUP = Setup(ROBOT, knowing(load_twin_controller(ROBOT, ROOT / "config"), ROBOT, REAL_DELAY_MS))
WATCHED = Setup(
    ROBOT,
    replace(SETUP.config, separation=replace(SETUP.config.separation, enabled=True, sensors=("",))),
)
"""With one sensor that sees people; it has no name."""
HOME = SETUP.home
PLAN_ROWS = 16
KEEPS = (list, dict, set, deque)
Kind = TypeVar("Kind", bound=actions.Action)
Watch = Callable[[events.AnyEvent, list[actions.AnyAction]], None]


class Pair(RealSide, TwinSide):
    """The core between two simulated sides; ``run`` lets virtual time pass."""

    def __init__(
        self,
        real: Joints = HOME,
        twin: Joints = HOME,
        real_clock: float = 5000.0,
        twin_clock: float = 1.7e9,
        setup: Setup = SETUP,
        places: int = 0,
    ) -> None:
        """Place both sides.

        The clocks are the offsets of their clocks from the controller's [s]; ``places``: how many
        set points the real robot takes ahead of their time.
        """
        self.setup = setup
        RealSide.__init__(self, real, REAL_DELAY_MS * 1e-3)
        TwinSide.__init__(self, twin)
        self.places = places
        self.state = initial_state(setup)
        self.now = 100.0
        self.real_clock, self.twin_clock = real_clock, twin_clock
        self.real_drift = self.twin_drift = 0.0
        self.command_delay = self.report_delay = 0.0
        self.noise: Callable[[], float] = lambda: 0.0
        self.actions: list[actions.AnyAction] = []
        self.replies: dict[int, actions.Reply] = {}
        self.inputs: list[events.AnyEvent] = []
        self.watch: Watch = lambda event, made: None
        self._poll_due: float | None = None
        self._fed = -math.inf
        self._due: list[tuple[float, int, Callable[[], object]]] = []
        self._order = count()

    def feed(self, event: events.AnyEvent) -> list[actions.AnyAction]:
        """Give one input to the core and let the sides obey what it decides."""
        self._fed = self.now
        self.inputs.append(event)
        self.state, made = step(self.setup, self.state, event)
        self.actions += made
        self.watch(event, made)
        for action in made:
            if isinstance(action, actions.Reply):
                self.replies[action.id] = action
            elif self.command_delay:
                self._later(self.command_delay, partial(self._obey, action))
            else:
                self._obey(action)
        return made

    def connect(self) -> None:
        """Bring both links up and wait until the controller is idle."""
        self.link("real", True)
        self.link("twin", True)
        self.run(1.0)
        self.until(Mode.IDLE, 30.0)

    def link(self, side: str, up: bool) -> None:
        """Bring one link up or down."""
        setattr(self, f"{side}_up", up)
        self.feed(events.LinkChanged(self.now, side, up, "" if up else "cut"))  # type: ignore[arg-type]

    def operate(self, command: str, **arguments: object) -> actions.Reply:
        """Send one command of the operator and return the answer."""
        number = len(self.replies) + 1
        self.feed(events.Operator(self.now, command, number, **arguments))  # type: ignore[arg-type]
        return self.replies[number]

    def do(self, command: str, run: float = 0.0, **arguments: object) -> None:
        """Give a command of the operator that is accepted, and let ``run`` [s] pass."""
        reply = self.operate(command, **arguments)
        assert reply.success, reply.message
        self.run(run)

    def control(self, action: str, person: str = "", **arguments: object) -> actions.Reply:
        """Let somebody take, ask for, hand over, deny, release or keep control."""
        number = len(self.replies) + 1
        self.feed(events.ControlAsked(self.now, action, number, person, **arguments))  # type: ignore[arg-type]
        return self.replies[number]

    def start_program(self, path: Path_, run: float = 0.0) -> None:
        """Start a program on the real robot's own side, and let ``run`` [s] pass."""
        self.run_program(path, self.now)
        self.run(run)

    def move_twin(self, path: Path_, run: float = 0.0) -> None:
        """Let the twin move by its own pose controller, and let ``run`` [s] pass."""
        super().move_twin(path)
        self.run(run)

    def jog_real(self, path: Path_) -> None:
        """Move the real robot without a program."""
        self.real_path, self.real_path_start = path, self.now

    def alarm(self, text: str) -> None:
        """Raise an alarm that stops the real robot."""
        self.raise_alarm()
        if self.real_up:
            self.feed(events.RealAlarm(self.now, text))

    def warn(self, text: str) -> None:
        """Let the real robot show a warning; without a text the person there has cleared it."""
        self.feed(events.RealAlarm(self.now, text, stops=False))

    def order_twin(self, do: actions.Command, number: int) -> None:
        """Give the twin a motion command that is not ours."""
        self.command_twin(do, number, self.now)

    @property
    def mode(self) -> Mode:
        """The controller's mode."""
        return self.state.lead.mode

    @property
    def why(self) -> str:
        """Why it is in that mode."""
        return self.state.lead.why

    def made(self, kind: type[Kind], since: int = 0) -> list[Kind]:
        """Return the actions of a kind since the given index of actions."""
        return [action for action in self.actions[since:] if isinstance(action, kind)]

    def performed(self, since: int = 0) -> list[actions.Command]:
        """Return the commands that either side was sent since the given index of actions."""
        return [action.command for action in self.made(actions.Send, since)]

    def decisions(self) -> list[actions.Decided]:
        """Return all decisions so far."""
        return self.made(actions.Decided)

    def triggers(self, since: int = 0) -> list[str]:
        """Return the triggers decided on since the given index of decisions."""
        return [decision.trigger for decision in self.decisions()[since:]]

    def far(self) -> float:
        """Return the largest deviation of a joint, both at one instant, in border units."""
        pairs = zip(self.real_q, self.twin_q, SETUP.scale)
        return max(abs(a - b) / scale for a, b, scale in pairs)

    def see(self, x: float | dict[str, float], duration: float, age: float = 0.0) -> None:
        """Let time pass while a sensor sees a person at ``x`` [m] every 50 ms, ``age`` [s] late.

        Sensors with names: where each of them sees somebody.
        """
        for _ in range(round(duration / 0.05)):
            for sensor, place in (x if isinstance(x, dict) else {"": x}).items():
                self.feed(events.PersonSeen(self.now, (place, 0.0, 0.0), age, sensor))
            self.run(0.05)

    def until(self, mode: Mode, limit: float = 10.0) -> None:
        """Let time pass until the controller is in a mode; see :meth:`run_until`."""
        self.run_until(lambda: self.mode is mode, limit)

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
        raise AssertionError(
            f"not within {limit} s; mode {self.mode}: {self.why}; motion {self.motion}"
        )

    def _millisecond(self) -> None:
        self.now = round(self.now + 0.001, 6)
        self.real_clock += self.real_drift * 1e-3
        self.twin_clock += self.twin_drift * 1e-3
        tick = round(self.now * 1000)
        while self._due and self._due[0][0] <= self.now:
            heapq.heappop(self._due)[2]()
        self.move_real(self.now)
        self.move_simulated(self.now, self.now + self.twin_clock)
        if self._poll_due is None or self.now >= self._poll_due:
            # Each 9.7 ms, so that the polls scan the phase of the robot's readings.
            self._poll_due = (self._poll_due or self.now) + 0.0097
            if self.real_up:
                self._report_real()
        if self.twin_up and tick % 10 == 7:
            self._report_twin()
        if self.twin_up and tick % 20 == 8:
            self._report_plan()
        if self.twin_up and tick % 50 == 9:
            remote = self.now + self.twin_clock
            self.feed(events.ClockProbe(self.now, self.now - 0.0008, self.now, remote - 0.0004))
        if tick % 10 == 0 and self.now - self._fed >= 0.0095:
            # Each input lets time pass, as in the engine.
            self.feed(events.Tick(self.now))

    def _report_real(self) -> None:
        clock = math.floor((self.now + self.real_clock) * 1000) // 2 * 2
        q, qdot = self.real_at(clock * 1e-3 - self.real_clock)
        event = events.RealMeasured(
            now=self.now,
            sent=self.now - 0.0005,
            received=self.now,
            clock_ms=clock % (1 << 31),
            motion=JointMotion.measured(self._noisy(q), qdot, 1e-3 * clock),
            own_program=self.own_program,
            streaming=self.streaming,
            paused=self.paused,
            drives_on=self.drives,
            fault=self.fault,
            speed_percent=self.override * self.program_percent * 1e-2,
            override_percent=self.override,
            ring_places=self.places,
            ring_read=self.ring_read,
            operation_mode=self.operation_mode,
        )
        self._report(event, lambda: self.real_up)

    def _report_twin(self) -> None:
        q, qdot = self._noisy(self.twin_q), self.twin_speed(self.now)
        motion = JointMotion.measured(q, qdot, self.now + self.twin_clock)
        event = events.TwinMeasured(self.now, motion)
        self._report(event, lambda: self.twin_up)
        self.report_motion()

    def report_motion(self) -> None:
        """Report the state of the twin's pose controller."""
        shown, applied = self.shown_motion(self.now), min(100.0, self.limit)
        still = shown in ("idle_pair", "paused", "estopped")
        target, peak = self.announced if shown == "moving" else ((), 0.0)
        event = events.TwinMotion(
            *(self.now, shown, 100.0, applied, self.limit, self.command_id, still, ""),
            target=target,
            peak_percent=peak,
        )
        self._report(event, lambda: self.twin_up)

    def _report_plan(self) -> None:
        rows = self.coming(PLAN_ROWS)
        if rows:
            points = tuple(
                JointMotion.measured(q, qdot, 0.01 * k) for k, (q, qdot) in enumerate(rows)
            )
            coming = Setpoints(SETUP.names, points)
            event = events.TwinPlan(self.now, self.now + self.twin_clock, coming)
            self._report(event, lambda: self.twin_up)

    def _noisy(self, q: Joints) -> Joints:
        return tuple(value + self.noise() * scale for value, scale in zip(q, SETUP.scale))

    def _later(self, delay: float, call: Callable[[], object]) -> None:
        heapq.heappush(self._due, (self.now + delay, next(self._order), call))

    def _report(self, event: events.AnyEvent, up: Callable[[], bool]) -> None:
        if not self.report_delay:
            self.feed(event)
            return

        def arrive() -> None:
            if up():
                fields = {"now": self.now} | (
                    {"received": self.now} if isinstance(event, events.RealMeasured) else {}
                )
                self.feed(replace(event, **fields))

        self._later(self.report_delay, arrive)

    def _obey(self, action: actions.AnyAction) -> None:
        match action:
            case actions.SendTwin():
                self.perform_twin(action, self.now)
            case actions.SendReal() if self.real_up:
                self.command_real(action.command)
            case actions.FollowTwin() if self.twin_up:
                self.take_follow(action, self.now)
            case actions.StreamReal() if self.real_up:
                self._later(
                    action.send_at - self.now,
                    lambda: self.setpoints.append((self.now, action.setpoint.q)),
                )
            case actions.StreamAhead() if self.real_up:
                points = {
                    point.number: (point.clock_ms * 1e-3 - self.real_clock, point.q)
                    for point in action.points
                }
                self.give_ahead(points, action.newest)
            case actions.OverrideReal() if self.real_up:
                self.override = float(round(action.speed_percent))
            case actions.CapTwin() if self.twin_up:
                self.limit = action.speed_percent
            case actions.MoveTwin():
                accepted = self.twin_up and self.motion == "idle"
                if accepted:
                    target = action.target if action.command == "MOVE_JOINTS" else HOME
                    self.move_twin(ramp(self.twin_q, target, 1.5))
                text = "done" if accepted else f"refused: {self.motion}"
                self.feed(events.MoveEnded(self.now, accepted, text, action.number))


def idle_pair(**arguments: Any) -> Pair:
    """Return a connected pair, IDLE at home; see :class:`Pair` for the arguments."""
    made = copy(_connected(**arguments))
    # What the core gives is never changed; what the pair keeps it in is.
    vars(made).update({k: copy(v) for k, v in vars(made).items() if isinstance(v, KEEPS)})
    return made


@cache
def _connected(**arguments: Any) -> Pair:
    """Return a pair that has just come up, for copies of it."""
    made = Pair(**arguments)
    made.connect()
    assert not made._due, "what is under way would come to the pair that is copied"
    return made


def seen_pair(far: float | dict[str, float], setup: Setup = WATCHED) -> Pair:
    """Return a connected pair, IDLE at home, whose sensors see a person far away."""
    made = Pair(setup=setup)
    made.link("real", True)
    made.link("twin", True)
    made.see(far, 2.5)
    assert made.mode is Mode.IDLE
    return made


def shifted(q: Joints, *border: float) -> Joints:
    """Return ``q`` moved by the given amounts in degrees and millimetres."""
    return tuple(
        value + amount * scale
        for value, amount, scale in zip(q, (*border, 0, 0, 0, 0), SETUP.scale)
    )
