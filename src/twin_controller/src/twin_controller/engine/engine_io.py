"""Run the core: one thread takes all inputs in their order and carries its decisions out."""

from __future__ import annotations

import concurrent.futures
import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import msgspec
from scara_ros.standstill import Standstill, said

from twin_controller.core.actions import (
    AnyAction,
    CapTwin,
    Decided,
    FollowTwin,
    Grip,
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
    ControlAsked,
    GripAnswered,
    LinkChanged,
    MoveEnded,
    Operator,
    RealMeasured,
    Tick,
    TwinMeasured,
)
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.standing import unseen
from twin_controller.core.setup import Setup
from twin_controller.core.sides.own_gap import OwnGaps
from twin_controller.core.state import CoreState, initial_state
from twin_controller.core.step import step
from twin_controller.engine.input_queue_io import InputQueue
from twin_controller.robot.real_link_io import RealLink
from twin_controller.twin.twin_link_io import TwinLink

_LOG = logging.getLogger("rosout.engine")
TICK = 0.01
_TWIN_LEADS_NOBODY = (Mode.IDLE, Mode.REAL_LEADS)
ALIVE = 0.1
"""An engine that has not looped for so long [s] hangs. Our choice: ten ticks."""


Stepped = Callable[[list[AnyEvent], CoreState, list[Decided]], None]
"""Hears of a batch of inputs, the state after it, and the decisions in it."""


class Engine:
    """Owner of the core's state; a context manager."""

    def __init__(self, setup: Setup, real: RealLink, twin: TwinLink, stepped: Stepped) -> None:
        """Wire the engine.

        Args:
            setup: Profile and numbers.
            real: Link to the real robot.
            twin: Link to the twin.
            stepped: Told after each batch.
        """
        self._setup, self._real, self._twin, self._tell = setup, real, twin, stepped
        self._inputs = InputQueue()
        self._replies: dict[int, Future[Reply]] = {}
        self._replies_lock = threading.Lock()
        self._number = 0
        self.state = initial_state(setup)
        self._stepped = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="engine", daemon=True)
        self.failure: BaseException | None = None
        self._looped = float("-inf")
        self._standstill = Standstill(time.monotonic())

    def __enter__(self) -> Engine:
        """Start."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop after what has already come in."""
        self._inputs.close()
        self._thread.join(timeout=2.0)

    @property
    def running(self) -> bool:
        """Whether the engine still decides; ``failure`` says why not."""
        return self._thread.is_alive()

    @property
    def alive(self) -> bool:
        """Whether the engine has decided a moment ago; it may hang in what it publishes or logs."""
        return self.failure is None and time.monotonic() - self._looped < ALIVE

    def asked(self, asked: float, now: float) -> float:
        """Return when a command was asked for, or the earliest time at which that may have been.

        Args:
            asked: What its sender says, by the monotonic clock [s]; 0: nothing.
            now: When it is read [s].
        """
        return asked if said(asked, now) else self._standstill.earliest(now)

    def put(self, event: AnyEvent) -> None:
        """Hand one input over; returns at once, from any thread."""
        # A reading of a twin that leads nobody waits for the robot's next one, a tick at most: only
        # how far both are apart is judged by it. A twin that begins to move says so by its plan.
        waits = isinstance(event, TwinMeasured) and self.state.lead.mode in _TWIN_LEADS_NOBODY
        self._inputs.put(event, wakes=not waits)

    def operate(self, command: str, timeout: float = 2.0, **arguments: Any) -> Reply:
        """Hand one command of the operator over and wait for the answer; see :meth:`ask`."""
        return self.ask(Operator(time.monotonic(), command, **arguments), timeout)

    def ask(self, event: Operator | ControlAsked, timeout: float = 2.0) -> Reply:
        """Hand one input over that is answered, under a number of its own, and wait for that.

        Raises:
            TimeoutError: The engine did not answer in time.
        """
        future: Future[Reply] = Future()
        with self._replies_lock:
            self._number += 1
            number = self._number
            self._replies[number] = future
        # Only now: the answer may come at once, and somebody has to wait for it.
        self.put(msgspec.structs.replace(event, id=number))
        try:
            return future.result(timeout)
        except concurrent.futures.TimeoutError as error:  # TimeoutError itself from Python 3.11 on
            raise TimeoutError(f"no answer within {timeout:g} s") from error
        finally:
            with self._replies_lock:
                self._replies.pop(number, None)

    def wait_to_stand(self, since: float, timeout: float) -> str:
        """Wait until both sides are seen to stand that were told to stop at ``since`` [s].

        Returns:
            Which side was not seen to stand within ``timeout`` [s], in words; empty: both were.
        """
        with self._stepped:
            self._stepped.wait_for(lambda: not unseen(self._setup, self.state, since), timeout)
            return unseen(self._setup, self.state, since)

    def _run(self) -> None:
        try:
            gaps = OwnGaps(self._setup.config.own_gap)
            while True:
                batch = self._inputs.take(TICK)
                if batch is None:
                    return
                now = time.monotonic()
                self._standstill.seen(now)
                gap = gaps.look(now)
                if gaps.stood:
                    # First of all: what waits in the batch is judged without the gap.
                    batch.insert(0, Tick(now, gap, gaps.stood))
                if not batch:
                    # Each input lets time pass, and time-outs are judged by it; so where none comes
                    # a tick does.
                    batch.append(Tick(now))
                self._process(batch)
                # Behind the batch: an engine that hangs in one is not alive.
                self._looped = time.monotonic()
        except BaseException as error:
            self.failure = error
            raise

    def _process(self, batch: list[AnyEvent]) -> None:
        decided: list[Decided] = []
        newest = next((e for e in reversed(batch) if isinstance(e, RealMeasured)), None)
        for k, event in enumerate(batch):
            # What is decided now is aimed from now: time in the queue is no lag of the robot.
            now = time.monotonic()
            if isinstance(event, RealMeasured):
                overtaken = newest is not None and event.clock_ms != newest.clock_ms
                batch[k] = event = msgspec.structs.replace(event, now=now, overtaken=overtaken)
            elif isinstance(event, Tick):
                batch[k] = event = msgspec.structs.replace(event, now=now)
            self.state, actions = step(self._setup, self.state, event)
            for action in actions:
                self._carry_out(action)
                if isinstance(action, Decided):
                    _LOG.debug("%s -> %s: %s", action.trigger, action.mode_after, action.why)
                    decided.append(action)
        with self._stepped:
            self._stepped.notify_all()
        self._tell(batch, self.state, decided)

    def _carry_out(self, action: AnyAction) -> None:
        match action:
            case FollowTwin():
                self._twin.follow(action)
            case StreamReal():
                self._real.stream(action)
            case StreamAhead():
                self._real.stream_ahead(action)
            case SendTwin():
                stamp = self.state.sides.twin.clock.to_remote(time.monotonic())
                self._twin.perform(action, stamp, self.state.sides.twin.usable)
            case SendReal():
                self._real.perform(action.command)
            case CapTwin():
                self._twin.cap(action.speed_percent)
            case OverrideReal():
                self._real.override(action.speed_percent)
            case MoveTwin():
                # The answer comes in the link's thread, so it queues up like all inputs.
                self._twin.move(
                    action,
                    lambda ok, text: self.put(MoveEnded(time.monotonic(), ok, text, action.number)),
                )
            case Grip(side="real", on=on):
                self._real.grip(on)
            case Grip(on=on):
                self._twin.grip(
                    on, lambda ok, text: self.put(GripAnswered(time.monotonic(), "twin", ok, text))
                )
            case Reply():
                with self._replies_lock:
                    future = self._replies.get(action.id)
                if future is not None and not future.done():
                    future.set_result(action)

    def link_changed(self, side: str, connected: bool, reason: str) -> None:
        """Report a link's change; the callback of both links."""
        self.put(
            LinkChanged(time.monotonic(), "real" if side == "real" else "twin", connected, reason)
        )
