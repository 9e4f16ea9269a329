"""A proxy in a process of its own.

What the test itself is busy with must not look like a slow line.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import threading
from multiprocessing.connection import Connection
from typing import Any

from scara_ros.process.scheduling_io import go_first
from typing_extensions import Self

from harness.wires.damage import Fault
from harness.wires.proxy import Proxy, Units

DEADLINE_S = 5.0


class Relay:
    """The remote control of a :class:`harness.wires.proxy.Proxy`; a context manager."""

    def __init__(self, target: int, units: Units) -> None:
        """Start relaying to ``target``."""
        context = multiprocessing.get_context("spawn")
        self._line, far = context.Pipe()
        self._lock = threading.Lock()
        self._process = context.Process(target=_serve, args=(far, target, units), daemon=True)
        self._process.start()
        far.close()
        self.port: int = self._ask("port")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def cut(self, reset: bool = False) -> None:
        """End all connections; ``reset``: without a farewell."""
        self._ask("cut", reset)

    def refuse(self, on: bool) -> None:
        """Stop listening and cut; or listen again."""
        self._ask("refuse", on)

    def freeze(self, on: bool) -> None:
        """Let nothing pass; or let everything pass again."""
        self._ask("freeze", on)

    def disturb(self, fault: Fault) -> None:
        """Do ``fault`` to each unit from now on."""
        self._ask("fault", fault)

    def heal(self) -> None:
        """End all faults."""
        self._ask("heal")

    def connections(self) -> int:
        """Return how many connections stand."""
        return int(self._ask("connections"))

    def report(self) -> dict[str, float]:
        """Return what the present fault has noted, for example how often it has struck, by kind."""
        return dict(self._ask("report"))

    def close(self) -> None:
        """End the process."""
        self._line.close()
        self._process.join(DEADLINE_S)
        if self._process.is_alive():
            self._process.kill()

    def _ask(self, *question: Any) -> Any:
        with self._lock:
            if question[0] != "port":
                self._line.send(question)
            assert self._line.poll(DEADLINE_S * 4), f"the relay does not answer {question}"
            return self._line.recv()


def _serve(line: Connection, target: int, units: Units) -> None:
    """Run the proxy until the other end of ``line`` closes.

    A busy machine shall not make the line slower than it is meant to be.
    """
    go_first()
    with Proxy(target, units) as proxy, contextlib.suppress(EOFError, OSError):
        line.send(proxy.port)
        while True:
            method, *args = line.recv()
            line.send(_obey(proxy, method, args))


def _obey(proxy: Proxy, method: str, args: list[Any]) -> Any:
    if method == "fault":
        (proxy.fault,) = args
        return None
    if method == "report":
        return getattr(proxy.fault, "report", {})
    found = getattr(proxy, method)
    return found(*args) if callable(found) else found
