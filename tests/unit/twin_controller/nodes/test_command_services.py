"""When a command was asked for is taken first of all, before anything that takes its time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, shifted
from scara_ros.gate.permit import Permit
from scara_ros.standstill import Standstill, said
from twin_controller.core.actions import MoveTwin, Reply
from twin_controller.core.events import Operator
from twin_controller.core.lead.modes import Mode
from twin_controller.nodes.command_services import CommandServices

from scara_msgs.srv import TwinCommandRequest

OTHER = shifted(HOME, 10.0, 5.0, 0.0)


class Cell:
    """The services in front of a core in virtual time; a move is held up on its way."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, held_by: str) -> None:
        """Connect; ``held_by``: what takes its time, "persons" or "judge"."""
        self.pair = Pair()
        self.pair.connect()
        self._held_by, self._standstill = held_by, Standstill(self.pair.now)
        self.meanwhile: Any = lambda: None
        clock = SimpleNamespace(monotonic=lambda: self.pair.now)
        monkeypatch.setattr("twin_controller.nodes.command_services.time", clock)
        self._services = CommandServices(
            SETUP,
            self,  # type: ignore[arg-type]
            self,  # type: ignore[arg-type]
            lambda *entry: None,
            self,  # type: ignore[arg-type]
        )

    @property
    def state(self) -> Any:
        """The core's, as the engine shows it."""
        return self.pair.state

    def stopped(self) -> None:
        """Note a stop, as the gate."""

    def judge(self, event: Operator) -> Permit:
        """Judge a command, as the gate."""
        if self._held_by == "judge" and event.command == "MOVE_JOINTS":
            self.meanwhile()
        return Permit(True, "")

    def unproven(self, person: str, token: str, read: bool) -> str:
        """Compare a token, as the persons; the file is slow."""
        if self._held_by == "persons" and read:
            self.meanwhile()
        return ""

    def asked(self, asked: float, now: float) -> float:
        """Say when a command was asked for, as the engine."""
        return asked if said(asked, now) else self._standstill.earliest(now)

    def ask(self, event: Operator) -> Reply:
        """Hand a command to the core, as the engine."""
        number = len(self.pair.replies) + 1
        self._standstill.seen(self.pair.now)
        self.pair.feed(msgspec.structs.replace(event, id=number))
        return self.pair.replies[number]

    def run(self, seconds: float) -> None:
        """Let time pass, the engine too."""
        for _ in range(round(seconds * 100)):
            self.pair.run(0.01)
            self._standstill.seen(self.pair.now)

    def call(self, command: str, **fields: Any) -> Any:
        """Call ``twin_controller/command``."""
        request = TwinCommandRequest(command=command, **fields)
        request._connection_header = {"callerid": "/test"}
        return self._services._command(request)


@pytest.mark.parametrize("held_by", ["persons", "judge"])
def test_a_move_that_was_asked_for_before_a_stop_is_not_accepted_after_it(
    held_by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked for at 0.0 s, STOP acknowledged at 0.2 s, the move reaches the core at 0.8 s."""
    cell = Cell(monkeypatch, held_by)
    stops: list[Any] = []

    def meanwhile() -> None:
        cell.run(0.2)
        stops.append(cell.call("STOP"))
        cell.run(0.6)

    cell.meanwhile = meanwhile
    answer = cell.call("MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0)
    assert [stop.success for stop in stops] == [True]
    assert (answer.success, answer.message) == (False, "cancelled by STOP, before it began")
    assert cell.state.lead.mode is Mode.STOPPED
    assert not any(isinstance(action, MoveTwin) for action in cell.pair.actions)


@pytest.mark.parametrize("stalled", [0.02, 0.05, 0.15, 0.4])
@pytest.mark.parametrize("stamped", [True, False])
def test_a_move_and_a_stop_that_waited_while_the_controller_stood_still(
    stalled: float, stamped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both are found side by side, the STOP is read first; the move was sent before it."""
    cell = Cell(monkeypatch, "nobody")
    cell.run(0.1)
    asked = cell.pair.now + 0.1 * stalled
    cell.pair.run(stalled)  # nobody notes that the engine runs
    assert cell.call("STOP").success
    answer = cell.call(
        "MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0, asked=asked if stamped else 0.0
    )
    assert (answer.success, answer.message) == (False, "cancelled by STOP, before it began")
    cell.run(1.0)
    assert cell.call("MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0).success
