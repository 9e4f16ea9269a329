"""Machines in network namespaces, each with a line of its own to the first one.

Needs root, iproute2 and /dev/net/tun; see ip-netns(8).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from typing_extensions import Self

NET = "10.77.0"
CARRIER = Path(__file__).with_name("slow_line.py")


def missing() -> str:
    """Return why this machine cannot have namespaces; empty: it can."""
    if os.geteuid() != 0:
        return "needs root"
    if not shutil.which("ip"):
        return "needs iproute2"
    if not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        return "needs /dev/net/tun"
    name = f"probe_{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True, check=False)
    if made.returncode:
        return made.stderr.strip()
    subprocess.run(["ip", "netns", "del", name], check=True)
    return ""


@dataclass(frozen=True)
class Line:
    """What a line does to each packet that a machine sends.

    Attributes:
        delay_ms: How late each is.
        loss_percent: How many are lost.
    """

    delay_ms: float
    loss_percent: float


class Machines:
    """A first machine and others around it; a context manager that removes them.

    Attributes:
        names: Their namespaces, the first one's first.
    """

    def __init__(self, others: int, line: Line) -> None:
        """Make them."""
        mark = f"{os.getpid():x}"
        self.names = [f"m{number}_{mark}" for number in range(others + 1)]
        self._mark, self._line = mark, line
        self._carriers: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Self:
        try:
            self._make()
        except BaseException:
            self._remove()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._remove()

    def address(self, number: int) -> str:
        """Return where a machine is reached by the others."""
        return f"{NET}.{number + 1}"

    def words(self, number: int, command: Sequence[str]) -> list[str]:
        """Return a command that runs on a machine."""
        return [str(_ip()), "netns", "exec", self.names[number], *command]

    def cut(self, number: int, cut: bool) -> None:
        """Cut a machine's line, or mend it."""
        first, device = self.names[0], self._plug(number)
        self._ip("-n", first, "link", "set", device, "down" if cut else "up")
        if not cut:  # the kernel forgets the way with the device
            self._ip("-n", first, "route", "add", f"{self.address(number)}/32", "dev", device)

    def _make(self) -> None:
        first = self.names[0]
        for name in self.names:
            self._ip("netns", "add", name)
            self._ip("-n", name, "link", "set", "lo", "up")
        self._ip("-n", first, "addr", "add", f"{self.address(0)}/32", "dev", "lo")
        for number, name in enumerate(self.names[1:], 1):
            device, own = self._plug(number), self.address(number)
            line = (str(self._line.delay_ms), str(self._line.loss_percent), str(number))
            words = (sys.executable, str(CARRIER), first, name, device, *line)
            carrier = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
            self._carriers.append(carrier)
            assert carrier.stdout is not None
            assert carrier.stdout.readline() == "ready\n", "the line was not made"
            self._ip("-n", name, "addr", "add", f"{own}/32", "dev", device)
            self.cut(number, cut=False)
            self._ip("-n", name, "link", "set", device, "up")
            self._ip("-n", name, "route", "add", f"{NET}.0/24", "dev", device)

    def _remove(self) -> None:
        for carrier in self._carriers:
            carrier.terminate()
            carrier.wait()
        for name in reversed(self.names):
            subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)

    def _plug(self, number: int) -> str:
        return f"p{number}_{self._mark}"

    @staticmethod
    def _ip(*words: str) -> None:
        subprocess.run(["ip", *words], check=True)


def _ip() -> Path:
    found = shutil.which("ip")
    assert found is not None, "needs iproute2"
    return Path(found)
