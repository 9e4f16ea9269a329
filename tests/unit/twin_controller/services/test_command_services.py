"""When a command was asked for is taken first of all, before anything that takes its time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from harness.pair import HOME, SETUP, idle_pair, ramp, shifted
from scara_ros.gate.permit import Permit
from scara_ros.standstill import Standstill, said
from twin_controller.core.actions import MoveTwin, Reply
from twin_controller.core.events import Operator
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.standing import unseen
from twin_controller.services.command_services_node import CommandServices

from scara_msgs.srv import TwinCommandRequest

OTHER = shifted(HOME, 10.0, 5.0, 0.0)


class Cell:
    """The services in front of a core in virtual time; a move is held up on its way."""

    local = "operator"
    """Whose own the programs of this machine are, as the persons say."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, held_by: str) -> None:
        """Connect; ``held_by``: what takes its time, "persons" or "judge"."""
        self.pair = idle_pair()
        self._held_by, self._standstill = held_by, Standstill(self.pair.now)
        self.meanwhile: Any = lambda: None
        clock = SimpleNamespace(monotonic=lambda: self.pair.now)
        monkeypatch.setattr("twin_controller.services.command_services_node.time", clock)
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
        self.heard = event
        self.pair.feed(msgspec.structs.replace(event, id=number))
        return self.pair.replies[number]

    def wait_to_stand(self, since: float, timeout: float) -> str:
        """Wait until both sides stand, as the engine."""
        end = self.pair.now + timeout
        while self.pair.now < end and unseen(SETUP, self.pair.state, since):
            self.run(0.01)
        return unseen(SETUP, self.pair.state, since)

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
        stops.append(cell.call("STOP", at_once=True))
        cell.run(0.6)

    cell.meanwhile = meanwhile
    answer = cell.call("MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0)
    assert [stop.sent for stop in stops] == [True]
    assert (answer.success, answer.message) == (False, "cancelled by STOP, before it began")
    assert cell.state.lead.mode is Mode.STOPPED
    assert not cell.pair.made(MoveTwin)


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
    assert cell.call("STOP", at_once=True).sent
    answer = cell.call(
        "MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0, asked=asked if stamped else 0.0
    )
    assert (answer.success, answer.message) == (False, "cancelled by STOP, before it began")
    cell.run(1.0)
    assert cell.call("MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0).success


@pytest.mark.parametrize("command", ["STOP", "PAUSE", "ESTOP"])
def test_a_stop_is_answered_when_both_are_seen_to_stand(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the middle of a move; who does not wait hears only that it was sent."""
    cell = Cell(monkeypatch, "nobody")
    cell.run(0.1)
    assert cell.call("MOVE_JOINTS", joint_positions=OTHER, speed_percent=20.0).success
    cell.run(0.5)
    begun = cell.pair.now
    answer = cell.call(command)
    assert answer.success and answer.sent and answer.message.endswith("; both stand")
    still = SETUP.config.change.still_time_ms * 1e-3
    assert begun + still <= cell.pair.now < begun + SETUP.config.stop.answer_ms * 1e-3
    assert not unseen(SETUP, cell.state, begun)
    sent = cell.call(command, at_once=True)
    assert sent.sent and not sent.success and sent.message.startswith("sent: ")


def test_a_stop_that_no_robot_shows_is_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    """The program goes on whatever is sent: the answer says so, and what is left to do."""
    cell = Cell(monkeypatch, "nobody")
    cell.run(0.1)
    cell.pair.start_program(ramp(HOME, shifted(HOME, 60.0), 5.0))
    cell.run(0.5)
    cell.pair.command_real = lambda command: None  # type: ignore[method-assign]
    answer = cell.call("STOP")
    assert answer.sent and not answer.success
    assert "the real robot is not seen to stand: look at the robot" in answer.message


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_side_that_does_not_answer_is_not_seen_to_stand(
    side: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stop that is sent to nobody is no success either."""
    cell = Cell(monkeypatch, "nobody")
    cell.run(0.1)
    cell.pair.link(side, False)
    cell.run(0.5)
    answer = cell.call("STOP")
    name = {"real": "the real robot", "twin": "the twin"}[side]
    assert answer.sent and not answer.success and f"{name} does not answer" in answer.message


def test_a_refused_stop_was_not_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair that is stopped cannot be paused."""
    cell = Cell(monkeypatch, "nobody")
    cell.run(0.1)
    assert cell.call("STOP").success
    answer = cell.call("PAUSE")
    assert not answer.success and not answer.sent and answer.message == "the pair is stopped"


@pytest.mark.parametrize(
    ("caller", "address", "fields", "local"),
    [
        ("/rosservice", "127.0.0.1", {}, "operator"),
        ("/cell_2/rosservice", "127.0.0.1", {}, "operator"),
        ("/gateway/operator@127.0.0.1", "127.0.0.1", {}, ""),
        ("/cell_2/gateway", "127.0.0.1", {}, ""),
        ("/rosbridge_websocket", "127.0.0.1", {}, ""),
        ("/farm/ann@desk", "127.0.0.1", {}, ""),
        ("", "127.0.0.1", {}, ""),
        ("/rosservice", "0.0.0.0", {}, ""),
        ("/rosservice", "127.0.0.1", {"person": "foreman"}, ""),
        ("/rosservice", "127.0.0.1", {"session": "1"}, ""),
    ],
)
def test_program_of_this_machine_is_its_persons_own(
    monkeypatch: pytest.MonkeyPatch, caller: str, address: str, fields: dict[str, str], local: str
) -> None:
    """Not a client of gateway or farm, nor where the network may call, nor a person by name."""
    found = "twin_controller.services.command_services_node.rosgraph.network.get_bind_address"
    monkeypatch.setattr(found, lambda: address)
    cell = Cell(monkeypatch, "persons")
    request = TwinCommandRequest(command="HOME", **fields)
    request._connection_header = {"callerid": caller}
    cell._services._command(request)
    assert cell.heard.local == local
