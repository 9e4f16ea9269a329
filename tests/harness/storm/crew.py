"""The nodes that a storm needs beside those of the breakable cell, and who watches it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

from scara_config.profile import DEFAULT_PLANT

from harness.faults.fault_cell import ROBOT, FaultCell
from harness.running.standstill import MACHINE
from harness.starter import PACKAGES
from harness.storm.hands import Hands
from harness.storm.rules.history import SIDES, Decided, Entry, History, Told
from harness.storm.servos import joints_of
from harness.storm.strikes import Strikes

EXTRA = ("motion_server", "kinematics_server", "joint_vel_controller", "trajectory_server")


class Crew:
    """All that plays in a storm: the cell, the hands, the strikes."""

    def __init__(self, cell: FaultCell) -> None:
        """Open every door of a cell whose nodes run."""
        self.cell = cell
        self.hands = Hands(cell)
        self.strikes = Strikes(cell)
        self._clock = time.time() - MACHINE.now()
        self._joints = joints_of(ROBOT, DEFAULT_PLANT)

    def set_up(self, settings: str, plant: str) -> None:
        """Start another robot: its settings, and its plant with its draw."""
        self.cell.set_up(settings, plant)
        self._joints = joints_of(ROBOT, plant)

    def history(self, begun: float, **known: Any) -> History:
        """Return what was seen since ``begun`` together with what the storm itself knows."""
        cell = self.cell
        gaps = [(a + self._clock, b + self._clock) for a, b in MACHINE.gaps(begun - self._clock)]
        return History(
            begun,
            self._joints,
            {side: sorted(getattr(cell, side).truth(begun)) for side in SIDES},
            decisions=[_decided(d) for d in cell.decided(begun)],
            states=[_told(s) for s in list(cell.states) if _at(s) >= begun],
            audit=[_entry(e) for e in list(cell.audit) if _at(e) >= begun],
            gaps=gaps,
            ended=time.time(),
            **known,
        )

    def deaths(self) -> list[str]:
        """Return the nodes that have ended without us."""
        return [
            f"{node} ended with {process.poll()}: {process.tail(3)}"
            for node, process in self.cell.processes.items()
            if process.poll() is not None and node not in self.strikes.down
        ]

    def start_the_dead(self) -> list[str]:
        """Start again what has ended without us; return what it was."""
        dead = [node for node, p in self.cell.processes.items() if p.poll() is not None]
        found = self.deaths()
        for node in dead:
            if node in PACKAGES and node not in self.strikes.down:
                self.cell.start_node(node)
        return found


@contextmanager
def crew(cell: FaultCell) -> Iterator[Crew]:
    """Start what a storm needs beside the cell's nodes, and end it again."""
    with cell.beside(*EXTRA):
        try:
            made = Crew(cell)
            with closing(made.hands):
                assert not made.deaths(), made.deaths()
                yield made
        finally:
            cell.end("operator_panel")


def _at(message: Any) -> float:
    return float(message.header.stamp.to_sec())


def _decided(message: Any) -> Decided:
    fields = ("mode_before", "event", "mode_after", "leader", "why")
    return Decided(_at(message), *(getattr(message, name) for name in fields))


def _told(message: Any) -> Told:
    return Told(_at(message), message.mode, message.leader, message.holder)


def _entry(message: Any) -> Entry:
    return Entry(_at(message), message.who, message.what, bool(message.success))
