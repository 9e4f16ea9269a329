"""A button of tab Teach acts once, as by a glove, and on the line that was chosen when pressed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.yaml_files import copy_configuration
from operator_panel.door import Answer
from operator_panel.page.work.draft_files_io import DraftFiles
from operator_panel.page.work.teach_io import _Teach
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft, TeachError
from operator_panel.teach.places import position_of
from scara_config.programs.files import program_files
from scara_config.programs.tp.listing import Position
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


@pytest.mark.parametrize("name", ["Touch up", "Record J"])
def test_an_edit_is_of_the_line_that_was_chosen_when_it_was_pressed(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where its place is, is asked first; whoever waits for that may choose another line."""
    from nicegui import Client, ui

    scene, found = Scene(tmp_path), asyncio.Event()
    before = scene.lesson.draft
    here = position_of(ROBOT, {joint.name: 0.0 for joint in ROBOT.joints} | {"joint_1": 0.5})

    async def positions(_: object) -> list[Position]:
        await found.wait()
        return [here]

    monkeypatch.setattr(ui, "run_javascript", lambda _: None)  # no browser is there
    with Client(ui.page("/teach")):
        form = _Teach(scene.leading._view, scene.lesson)
        monkeypatch.setattr(form._places, "positions", positions)
        form._leading.choose(1)
        act = form._touch_up if name == "Touch up" else partial(form._record, "J")

        async def press() -> None:
            pressed = asyncio.create_task(form._press(name, act))
            await asyncio.sleep(0)
            form._leading.choose(3)
            form._joint.set_value("7")
            found.set()
            await pressed

        asyncio.run(press())
    done = teach.recorded(before, ROBOT, 1, here, "J", 50.0, None)
    if name == "Touch up":
        done = teach.touched_up(before, ROBOT, 1, here)
    assert scene.lesson.draft == done


def test_second_press_of_step_is_told_and_moves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both robots would go on before they stand where the first leads them."""
    from nicegui import Client, ui

    scene = Scene(tmp_path)
    view, cell = scene.leading._view, scene.cell
    presses: dict[str, Any] = {}

    async def slow(motion: str, **fields: Any) -> Answer:
        await asyncio.sleep(0)
        return Answer(False, "no judge runs")

    def button(text: str, *given: Any) -> ui.element:
        presses[text] = given[-1]
        return ui.element()

    monkeypatch.setattr(view, "button", button)
    monkeypatch.setattr(cell, "try_motion", slow)
    with Client(ui.page("/teach")):
        form = _Teach(view, scene.lesson)
        form._leading.choose(0)

        async def twice() -> None:
            await asyncio.gather(presses["Step"](), presses["Step"]())

        asyncio.run(twice())
    assert len(cell.sent) == 1
    assert form._said.text == "Step was not done: Step before it had not ended."


@pytest.mark.parametrize("judged_first", [True, False])
def test_a_draft_that_changes_behind_the_question_of_run_is_not_run(
    tmp_path: Path, judged_first: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All pages share it: who has said yes knows neither its lines nor its verdict."""
    from nicegui import Client, ui

    scene = Scene(tmp_path)
    view, cell = scene.leading._view, scene.cell
    cell.refuses = "the run would begin"

    async def judged(motion: str, **fields: Any) -> Answer:
        if not judged_first:
            scene.teach(gone(scene.lesson.draft))
        return Answer(False, "no judge runs")

    monkeypatch.setattr(cell, "try_motion", judged)
    with Client(ui.page("/teach")):
        form = _Teach(view, scene.lesson)
        asyncio.run(form._question())
        shown = form._verdict.text, form._confirm.visible
        if judged_first:
            scene.teach(gone(scene.lesson.draft))
        asyncio.run(form._run())
    changed = "the draft has changed since it was judged: press Run again"
    told = ("Not judged: no judge runs", True) if judged_first else (f"T{changed[1:]}", False)
    assert shown == told
    assert (form._said.text, cell.sent) == (f"Run: {changed}", [])


def test_why_the_draft_is_locked_is_taken_back_with_the_lock(tmp_path: Path) -> None:
    """Whoever reads it would wait for an end that has come; what was said since stays."""
    from nicegui import Client, ui

    scene = Scene(tmp_path)
    with Client(ui.page("/teach")):
        form = _Teach(scene.leading._view, scene.lesson)

        def said(runner: str) -> str:
            scene.lesson.runner = runner
            form._refresh(scene.cell.snapshot(), False)
            return str(form._said.text)

        assert said("operator 2") == "operator 2 runs it: STOP first, or wait for its end"
        assert said("") == ""
        said("operator 2")
        form._say("good", "TAUGHT has ended.")
        assert said("") == "TAUGHT has ended."


def test_save_replaces_the_program_that_it_has_asked_about(tmp_path: Path) -> None:
    """Another page renames the draft while the question stands: nobody said yes to that name."""
    from nicegui import Client, ui

    folder, scene = copy_configuration(tmp_path), Scene(tmp_path / "drafts")
    view, lesson = scene.leading._view, scene.lesson
    view.around = SimpleNamespace(folder=folder)  # type: ignore[assignment]
    before = {file: file.read_text() for file in program_files(folder).values()}
    said: list[str] = []

    async def attempt(_: str, act: Callable[[], Any]) -> None:
        try:
            await act()
        except TeachError as error:
            said.append(str(error))

    async def edit(*_: object) -> None:
        """Edit nothing."""

    def rename(name: str) -> None:
        scene.teach(teach.renamed(lesson.draft, ROBOT, name))

    with Client(ui.page("/teach")):
        files = DraftFiles(view, lesson, attempt, edit, lambda: "")
        rename("ARTICLE")
        asyncio.run(files._asked())
        assert files._question.text.startswith("ARTICLE is there already")
        rename("TWO_POINT")
        asyncio.run(files._replace())
    assert said == ["the draft is TWO_POINT by now, not ARTICLE: press Save again"]
    assert {file: file.read_text() for file in program_files(folder).values()} == before
