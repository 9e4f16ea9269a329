"""The faults of a storm: nodes that stand still or are killed, bad lines, clocks, stalls of all."""

from __future__ import annotations

import queue
import signal
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future

import psutil

from harness.faults.fault_cell import FaultCell
from harness.storm.rules.history import Strike
from harness.wires.clock_step import ClockStep
from harness.wires.damage import Delayed

SLOW_S = 0.01
WATCHDOG_S = 0.5
"""Within this the robot's own watchdog has stopped it, or a node has seen that it stood still."""
AGAIN_S = 2.5
"""A line to the twin is made again within this; only then does a stop reach it."""
STARTED_S = 8.0
"""A node that is started again is part of the cell within this."""
REAL = {"real": WATCHDOG_S}
TWIN = {"twin": AGAIN_S}
BOTH = {"real": WATCHDOG_S, "twin": AGAIN_S}
GRACE: Mapping[str, Mapping[str, float]] = {
    "emulator": REAL,
    "twin_controller": BOTH,
    "gateway": TWIN,
    "simulator": TWIN,
    "joint_pose_controller": TWIN,
}
"""Which sides a stop cannot reach while a node stands still, and how much longer."""
STARTS = {"emulator": "real", "simulator": "twin"}
"""Nodes whose end moves their side: a new one stands elsewhere."""


class Starter:
    """A thread that lives as long as this process, and starts nodes.

    The kernel ends a node with the thread that has started it (processes.py asks for that).
    """

    def __init__(self) -> None:
        """Begin without work."""
        self._work: queue.SimpleQueue[tuple[Callable[[], object], Future[None]]]
        self._work = queue.SimpleQueue()
        threading.Thread(target=self._serve, name="starter", daemon=True).start()

    def do(self, action: Callable[[], object]) -> None:
        """Do something in the thread that stays, and wait for its end."""
        done: Future[None] = Future()
        self._work.put((action, done))
        done.result()

    def _serve(self) -> None:
        while True:
            action, done = self._work.get()
            try:
                action()
            except BaseException as error:
                done.set_exception(error)
            else:
                done.set_result(None)


STARTER = Starter()
"""The one of this process."""


class Strikes:
    """Does one fault after the other, and notes them.

    Attributes: done: The faults so far. births: When a side began anew. down: Nodes that we have
    stopped or killed and that do not run yet.
    """

    def __init__(self, cell: FaultCell) -> None:
        """Break nothing yet."""
        self._cell = cell
        self._lock = threading.Lock()
        self._seen = False
        self.done: list[Strike] = []
        self.births: dict[str, list[float]] = {"real": [], "twin": []}
        self.down: set[str] = set()

    def strike(self, kind: str, *arguments: float | str) -> None:
        """Do a fault of names.py; its grace begins with its end."""
        words = " ".join(f"{a:g}" if isinstance(a, float) else a for a in arguments)
        actions: dict[str, Callable[..., Mapping[str, float]]] = {
            "halt": self._halt,
            "kill": self._kill,
            "line": self._line,
            "clock": self._clock,
            "stall": self._stall,
        }
        with self._lock:
            begun = time.time()
            self._seen = False
            grace = actions[kind](*arguments)
            self.done.append(Strike(f"{kind} {words}", begun, time.time(), grace, self._seen))

    def forget(self) -> None:
        """Begin a new scene."""
        self.done.clear()
        for births in self.births.values():
            births.clear()

    def _halt(self, node: str, seconds: float) -> Mapping[str, float]:
        self.down.add(node)
        self._cell.stop(node)
        time.sleep(seconds)
        self._seen = self._stands(node)
        self._cell.go_on(node)
        self.down.discard(node)
        return GRACE.get(node, {})

    def _kill(self, node: str, seconds: float) -> Mapping[str, float]:
        self.down.add(node)
        killed = self._cell.processes[node]
        self._cell.kill(node)
        self._seen = killed.poll() == -signal.SIGKILL
        if node in STARTS:
            self.births[STARTS[node]].append(time.time())
        time.sleep(seconds)
        STARTER.do(lambda: self._cell.start_node(node))
        self.down.discard(node)
        return dict.fromkeys(GRACE.get(node, {}), STARTED_S)

    def _line(self, which: str, how: str, seconds: float) -> Mapping[str, float]:
        relay = self._cell.modbus if which == "modbus" else self._cell.web
        self._seen = relay.connections() > 0
        if how == "cut":
            relay.cut(seconds > 0.05)
        elif how == "slow":
            relay.disturb(Delayed(SLOW_S))
            time.sleep(seconds)
            relay.heal()
        else:
            getattr(relay, how)(True)
            time.sleep(seconds)
            getattr(relay, how)(False)
        return REAL if which == "modbus" else TWIN

    def _clock(self, step_ms: float, seconds: float) -> Mapping[str, float]:
        """Put the robot's clock, and put it back."""
        self._seen = self._cell.modbus.connections() > 0
        self._cell.modbus.disturb(ClockStep(int(step_ms)))
        time.sleep(seconds)
        self._cell.modbus.heal()
        return REAL

    def _stall(self, seconds: float) -> Mapping[str, float]:
        """Let the whole cell stand still, as its machine would."""
        nodes = [name for name, process in self._cell.processes.items() if process.poll() is None]
        for node in nodes:
            self._cell.stop(node)
        time.sleep(seconds)
        self._seen = all(map(self._stands, nodes))
        for node in nodes:
            self._cell.go_on(node)
        return BOTH

    def _stands(self, node: str) -> bool:
        """Return whether the kernel says that a node's process is stopped."""
        try:
            return psutil.Process(self._cell.processes[node].pid).status() == psutil.STATUS_STOPPED
        except psutil.NoSuchProcess:
            return False
