"""A motion node says for whom it moves the twin, before it does; it waits for nobody for long."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from scara_control.motion import command_listener_node as command_listener
from scara_control.motion.command_listener_node import AGAIN_S, OWN, Lending
from scara_ros.services.service_connection_io import ServiceError


class Controller:
    """The twin controller's service, as far as it is asked here."""

    def __init__(self, *_: Any, **__: Any) -> None:
        """Lend the twin."""
        self.by: list[str] = []
        self.begun: list[str] = []
        self.answer: bool | None = True

    def __call__(self, action: str, by: str) -> SimpleNamespace:
        """Remember who is said to move it."""
        assert action == "LEND"
        self.by.append(by)
        if self.answer is None:
            raise ServiceError("no such service")
        return SimpleNamespace(success=self.answer)

    def start(self, action: str, by: str) -> None:
        """Remember it; nobody waits for an answer."""
        assert action == "LEND"
        self.begun.append(by)


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> tuple[Lending, Controller, SimpleNamespace]:
    """Give what says it, who hears it, and the time."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(command_listener, "ServiceClient", Controller)
    monkeypatch.setattr(command_listener.time, "monotonic", lambda: clock.now)
    made = Lending()
    return made, made._control, clock  # type: ignore[return-value]


def by(caller: str) -> SimpleNamespace:
    """Return a message of this caller."""
    return SimpleNamespace(_connection_header={"callerid": caller})


def test_each_motion_is_said_and_one_that_goes_on_once_in_a_while(
    said: tuple[Lending, Controller, SimpleNamespace],
) -> None:
    """A jog of 20 messages a second, a move that takes long: neither waits for the answer."""
    made, heard, clock = said
    assert made.say(by("/rosservice")) and made.say(by("/rosservice"))
    for _ in range(10):
        clock.now += 0.3 * AGAIN_S
        assert made.say(by("/rosservice"), goes_on=True)
    assert len(heard.by) == 2
    assert heard.begun == ["/rosservice"] * 2
    assert made.say(by("/rostopic_7"), goes_on=True), "another sender is said at once"
    assert heard.by[-1] == "/rostopic_7"


def test_what_another_motion_node_passes_on_is_its_own_to_say(
    said: tuple[Lending, Controller, SimpleNamespace],
) -> None:
    """Nor is anything said of a message that names nobody."""
    made, heard, _ = said
    for message in (*(by(f"/cell_2/{name}") for name in OWN), SimpleNamespace(), by("")):
        assert not made.say(message)
    assert heard.by == []


@pytest.mark.parametrize("answer", [False, None])
def test_refusal_and_silence_of_the_controller_lend_nothing(
    said: tuple[Lending, Controller, SimpleNamespace], answer: bool | None
) -> None:
    """The motion begins and is judged as ever; no twin controller is needed to move a twin."""
    made, heard, _ = said
    heard.answer = answer
    assert not made.say(by("/rosservice")) and not made.say(by("/rosservice"), goes_on=True)
    assert len(heard.by) == 1
