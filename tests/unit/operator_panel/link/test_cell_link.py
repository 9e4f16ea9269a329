"""What takes seconds to begin is ended by a stop that comes meanwhile, and holds none up."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
import rospy
from harness.workspace import ROOT
from operator_panel.config import load_panel, load_surroundings
from operator_panel.control.authority import Role, refusal
from operator_panel.door import Answer
from operator_panel.link.cell_link_node import CellLink
from operator_panel.view.snapshot import CellState
from scara_config import load_robot
from scara_ros.gate.permit import Permit
from scara_ros.names import Seat
from scara_ros.services.service_client_node import ServiceClient

FOLDER = ROOT / "config"
KEY = '#!/bin/sh\necho begun > "{0}/begun"\nsleep {1}\necho "$1" > "{0}/pressed"\n'
"""A pendant: it needs a while until the key is down."""
SLOW_S = 5.0
Press = Callable[[CellLink], Awaitable[None]]


def link_with(folder: Path, monkeypatch: pytest.MonkeyPatch, takes: float) -> CellLink:
    """Return a link without a master, whose pendant takes ``takes`` [s]."""
    program = folder / "lib" / "fanuc_emulator" / "pendant"
    program.parent.mkdir(parents=True)
    program.write_text(KEY.format(folder, takes))
    program.chmod(0o755)
    monkeypatch.setenv("CMAKE_PREFIX_PATH", str(folder), prepend=":")
    robot = load_robot(FOLDER)
    around = load_surroundings(robot, FOLDER)
    return CellLink(robot, load_panel(FOLDER), around, FOLDER, {})


async def until(condition: Callable[[], bool]) -> None:
    """Let the others run until ``condition`` holds."""
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        await asyncio.sleep(0.005)


async def stop(link: CellLink) -> None:
    """Press STOP; there is no twin controller that would answer."""
    await link.stop(Seat(), "STOP")


async def pause(link: CellLink) -> None:
    """Press PAUSE likewise."""
    await link.command(Seat(), "PAUSE")


async def stop_elsewhere(link: CellLink) -> None:
    """Another client's stop shows in the mode."""
    link._listening._change(ended=time.monotonic())


def may_command(link: CellLink) -> str:
    """Return why operator 1 may not command, as the page's desk does."""
    return refusal(Role.OPERATOR, "operator 1", link._listening.snapshot().state)


def hands(link: CellLink, holder: str) -> None:
    """Let the controller say who holds control."""
    state = CellState("IDLE", holder=holder, not_in_control=f"{holder} holds control: ask for it")
    link._listening._change(state=state)


async def hand_over(link: CellLink) -> None:
    """Give control to somebody who has asked for it."""
    hands(link, "fitter 2")


STOPPED = "a stop or a pause came"


@pytest.mark.parametrize(
    ("press", "why"),
    [
        (stop, STOPPED),
        (pause, STOPPED),
        (stop_elsewhere, STOPPED),
        (hand_over, "fitter 2 holds control"),
    ],
)
@pytest.mark.parametrize("when", ["judged", "started"])
def test_a_program_that_was_asked_for_before_a_stop_is_not_started_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, press: Press, why: str, when: str
) -> None:
    """Nor after control was handed over; while the judge works, and while the pendant starts."""
    link = link_with(tmp_path, monkeypatch, SLOW_S)
    hands(link, "operator 1")
    judged = asyncio.Event()

    async def judge(*_: str) -> Permit:
        await judged.wait()
        return Permit(True, "")

    async def scene() -> Answer:
        barred = partial(may_command, link)
        running = asyncio.create_task(
            link.pendant("run", "X", asked=time.monotonic(), barred=barred)
        )
        await asyncio.sleep(0)
        if when == "started":
            judged.set()
            await until((tmp_path / "begun").exists)
        await press(link)
        judged.set()
        return await asyncio.wait_for(running, SLOW_S)

    monkeypatch.setattr(link._program_gate, "judge", judge)
    answer = asyncio.run(scene())
    assert not answer.success and why in answer.message
    assert (tmp_path / "begun").exists() == (when == "started")
    assert not (tmp_path / "pressed").exists()


@pytest.mark.parametrize("words", [("run", "X"), ("override", "50")])
def test_a_key_is_pressed_unless_a_program_is_older_than_a_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, str]
) -> None:
    """An override moves nothing, and whoever presses Run behind a stop knows of it."""
    link = link_with(tmp_path, monkeypatch, 0.0)
    hands(link, "operator 1")

    async def scene() -> Answer:
        asked = time.monotonic()
        await stop(link)
        if words[0] == "run":
            asked = time.monotonic()
        return await link.pendant(*words, asked=asked, barred=partial(may_command, link))

    assert asyncio.run(scene()).success
    assert (tmp_path / "pressed").read_text() == f"{words[0]}\n"


def test_the_gripper_is_not_switched_behind_a_newer_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part would fall, or a hand be gripped."""
    link = link_with(tmp_path, monkeypatch, 0.0)
    link._listening._change(ended=math.inf)
    answer = asyncio.run(link.grip(True, asked=time.monotonic()))
    assert "a stop or a pause came" in answer.message


@pytest.mark.parametrize("ending", ["PAUSE", "STANDSTILL"])
def test_what_ends_a_motion_waits_for_no_move_that_is_not_answered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    """Whoever presses it expects that nothing begins: somebody's move is with its judge."""
    link, judged = link_with(tmp_path, monkeypatch, 0.0), threading.Event()
    heard: list[str] = []

    def obey(_: ServiceClient, command: str, **__: object) -> SimpleNamespace:
        heard.append(command)
        if command == "MOVE":
            judged.wait(10.0)
        return SimpleNamespace(success=True, sent=True, message=command)

    async def scene() -> Answer:
        moving = asyncio.create_task(link.command(Seat(), "MOVE"))
        try:
            await until(lambda: heard == ["MOVE"])
            return await asyncio.wait_for(link.command(Seat(), ending), 5.0)
        finally:
            judged.set()
            await moving

    monkeypatch.setattr(rospy.core, "is_initialized", lambda: True)
    monkeypatch.setattr(ServiceClient, "__call__", obey)
    assert asyncio.run(scene()) == Answer(True, ending)
    assert heard == ["MOVE", ending]
