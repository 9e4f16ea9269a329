"""A button of tab Teach that is pressed twice, as by a glove, edits once."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from pathlib import Path

import pytest
from operator_panel.page.work.teach_io import _Teach
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft
from unit.operator_panel.page.test_leading import ROBOT, Scene


def up(draft: Draft) -> Draft:
    """Return the draft with line 3 one place up."""
    return teach.moved(draft, ROBOT, 3, -1)


def gone(draft: Draft) -> Draft:
    """Return the draft without line 3."""
    return teach.deleted(draft, ROBOT, 3)


@pytest.mark.parametrize(("name", "once"), [("Up", up), ("Delete", gone)])
def test_second_press_of_an_edit_that_is_being_written_is_told_and_not_done(
    tmp_path: Path, name: str, once: object
) -> None:
    """It would be of the line that was chosen before the first one moved or took it."""
    from nicegui import Client, ui

    scene = Scene(tmp_path)
    before, write = scene.lesson.draft, scene.lesson._write

    def slow(draft: Draft) -> None:
        time.sleep(0.1)
        write(draft)

    scene.lesson._write = slow  # type: ignore[method-assign]
    with Client(ui.page("/teach")):
        form = _Teach(scene.leading._view, scene.lesson)
        form._leading.choose(3)
        act = partial(form._move, -1) if name == "Up" else form._delete

        async def twice() -> None:
            await asyncio.gather(form._press(name, act), form._press(name, act))

        asyncio.run(twice())
        assert scene.lesson.draft == once(before)  # type: ignore[operator]
        assert form._said.text == f"{name} was not done: {name} before it had not ended."
        asyncio.run(form._press(name, act))
    assert scene.lesson.draft != once(before)  # type: ignore[operator]
    assert form._said.text == ""
