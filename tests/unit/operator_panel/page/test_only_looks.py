"""The judge lets a move go before a question of somebody who only looks."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from operator_panel.door import Answer
from operator_panel.page.work import programs_io
from unit.operator_panel.page.test_leading import Scene


class Judge:
    """Remembers the motions that it was asked for, and with how many samples."""

    def __init__(self) -> None:
        """Nobody has asked."""
        self.asked: list[tuple[str, int]] = []

    async def try_motion(self, motion: str, **fields: Any) -> Answer:
        """Give way to a move."""
        self.asked.append((motion, fields.get("samples", 0)))
        return Answer(False, "a move is judged first: ask again")


def test_who_judges_a_draft_gives_way_and_who_steps_does_not(tmp_path: Path) -> None:
    """A step begins by its answer; a program takes longer than the gate of a move waits."""
    scene, judge = Scene(tmp_path), Judge()
    scene.cell.try_motion = judge.try_motion  # type: ignore[method-assign]
    found = asyncio.run(scene.leading.judge_all())
    assert found.sentence == "Not judged: a move is judged first: ask again"
    asyncio.run(scene.leading.step())
    assert judge.asked == [("PROGRAM", 2), ("MOVE_JOINTS", 0)]


def test_the_question_before_a_run_gives_way() -> None:
    """The program's key is pressed later, and judged then."""
    from nicegui import Client, ui

    pressed: dict[str, Callable[[], Awaitable[None]]] = {}

    def button(text: str, command: str, style: str, press: Any) -> ui.button:
        pressed[text] = press
        return ui.button(text)

    judge = Judge()
    view: Any = SimpleNamespace(button=button, door=judge)
    with Client(ui.page("/programs")):
        programs_io._press(view, "Run", "RUN", "run-x", "run", "X")
    asyncio.run(pressed["Run"]())  # type: ignore[arg-type]
    assert judge.asked == [("PROGRAM", 2)]
