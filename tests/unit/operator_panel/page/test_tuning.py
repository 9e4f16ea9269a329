"""The preview of gains is computed beside the event loop: STOP of every page is heard in it."""

from __future__ import annotations

import asyncio
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from harness.workspace import ROOT
from operator_panel.config import load_panel
from operator_panel.control.authority import Role
from operator_panel.door import Answer, Gains
from operator_panel.page import tuning_io
from operator_panel.page.view_io import PageView
from scara_config import load_robot

DEADLINE = 5.0
GAINS = {"position_p": 5200.0, "position_i": 900.0, "position_d": 268.0, "i_clamp": 12.0}


class Form:
    """The tuning form of a viewer's page; to search for an inertia takes until ``found`` is set."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Build it."""
        from nicegui import Client, ui

        def search(*_: object) -> float:
            self.searched += 1
            self.found.wait(DEADLINE)
            return 1.0

        self.searched, self.values = 0, GAINS
        self.found = threading.Event()
        self.switches: dict[str, bool] = {}
        monkeypatch.setattr(tuning_io, "largest_inertia", search)
        monkeypatch.setattr(ui, "run_javascript", lambda _: None)  # no browser is there
        tuning_io._inertia.cache_clear()
        door: Any = SimpleNamespace(gains=lambda _: Gains(self.values, {}, self.switches))
        viewer: Any = SimpleNamespace(role=Role.VIEWER)
        nobody: Any = None
        robot, config = load_robot(ROOT / "config"), load_panel(ROOT / "config")
        self.client = Client(ui.page("/tuning"))
        with self.client:
            self.form = tuning_io._Tuning(PageView(robot, config, nobody, door, nobody, viewer))
            self.form._refresh()

    async def preview(self) -> None:
        """Press the button."""
        with self.client:
            await self.form._preview()


@pytest.fixture
def form(monkeypatch: pytest.MonkeyPatch) -> Form:
    """Give a form."""
    return Form(monkeypatch)


def test_preview_lets_the_pages_event_loop_go_on(form: Form) -> None:
    """Or a STOP that comes meanwhile waits for it; what was found once is known to all pages."""

    async def press() -> int:
        pressed, turns = asyncio.create_task(form.preview()), 0
        while not pressed.done():
            await asyncio.sleep(0.01)
            # Those before the search has begun prove nothing.
            turns += form.searched
            if turns > 5:
                form.found.set()
        return turns

    assert asyncio.run(press()) > 5
    assert form.form._result.text.startswith("Typed gains: ")
    asyncio.run(form.preview())
    assert form.searched == 1


def test_preview_that_comes_late_is_not_shown_beside_other_gains(form: Form) -> None:
    """The form shows what is in force by now."""

    async def press() -> None:
        pressed = asyncio.create_task(form.preview())
        while not (form.searched or pressed.done()):
            await asyncio.sleep(0.01)
        form.values = GAINS | {"i_clamp": 6.0}
        with form.client:
            form.form._refresh()
        form.found.set()
        await pressed

    asyncio.run(press())
    assert form.form._result.text == ""


def test_gains_are_set_at_the_joint_for_which_they_were_typed(form: Form) -> None:
    """Whoever waits for control may choose another joint meanwhile."""
    taken, tuned = asyncio.Event(), []
    view: Any = form.form._view

    async def take(_: str) -> str:
        await taken.wait()
        return ""

    async def tune(*words: object) -> Answer:
        tuned.append(words)
        return Answer(True, "set")

    async def press() -> None:
        pressed = asyncio.create_task(form.form._set())
        await asyncio.sleep(0)
        form.switches = {"antiwindup": False}
        form.form._choice.set_value("joint_2")
        taken.set()
        await pressed

    view.desk, view.session.page, view.door.tune = SimpleNamespace(take=take), "v", tune
    form.switches = {"antiwindup": True}
    with form.client:
        form.form._refresh()
        asyncio.run(press())
    assert form.form._switches["antiwindup"].value is False, "joint_2 is shown by now"
    assert tuned == [("joint_1", GAINS, {"antiwindup": True})]


def test_the_note_leaves_it_to_the_answer_how_long_gains_last(form: Form) -> None:
    """In a cell with a name they are written to a copy, and last until that cell ends."""
    note = form.form._message.text
    assert "written" not in note and "the answer says how long" in note
