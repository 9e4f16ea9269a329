"""A program of the real robot is started for the page that asked for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest
from operator_panel.door import Answer
from operator_panel.page.work.programs_io import _Rows, _say
from scara_config.programs.tp.listing import Program
from unit.operator_panel.page.test_leading import Scene


def test_a_program_whose_page_hands_control_over_is_told_why_it_may_not_begin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is judged for seconds; meanwhile somebody else may have got control."""
    scene = Scene(tmp_path)
    told: list[str] = []

    async def pendant(*words: str, asked: float, barred: Callable[[], str]) -> Answer:
        told.append(barred())
        scene.cell.holder = "fitter 2"
        told.append(barred())
        return Answer(False, "")

    monkeypatch.setattr(scene.cell, "pendant", pendant, raising=False)
    asyncio.run(_say(scene.leading._view, "run", "ARTICLE"))
    assert told == ["", "fitter 2 holds control"]


def test_no_name_of_a_program_keeps_a_page_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file may have any name, and STOP is on the page."""
    from nicegui import Client, ui

    scene = Scene(tmp_path)
    monkeypatch.setattr(_Rows, "_programs", lambda _: (Program("A\\N", ()),))
    with Client(ui.page("/programs")) as client:
        _Rows(scene.leading._view, scene.lesson, ui.element("div"))
    assert "A\\N" in [each.props.get("data-program") for each in client.elements.values()]
