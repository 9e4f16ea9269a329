"""Tab Target: what it says of a position is of what is chosen now."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from operator_panel.door import Answer
from operator_panel.page.target_io import _TargetForm
from scara_config.frames import TaughtFrame, save_frame
from unit.operator_panel.page.test_leading import Scene


def test_a_position_is_asked_about_again_once_its_frame_is_taught_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Text and ghost would stay where no Move leads any more."""
    from nicegui import Client, context, ui

    scene = Scene(tmp_path / "drafts")
    view, clients = scene.leading._view, []
    asked: list[Callable[[], Coroutine[Any, Any, None]]] = []
    around: Any = SimpleNamespace(folder=tmp_path, positions={})
    arm: Any = SimpleNamespace(axes=(), set_frames=lambda _: None)
    view.around, view.desk.arm = around, arm

    async def judge(frame: int, **_: Any) -> Answer:
        return Answer(False, f"frame at {view.frames.numbered('user')[frame].xyz_mm}")

    def teach(x_mm: float) -> None:
        save_frame(tmp_path, "user", 1, TaughtFrame("pallet", (x_mm, 0.0, 0.0)))
        view.read_frames()

    def later(_: float, ask: Callable[[], Coroutine[Any, Any, None]], once: bool) -> None:
        clients.append(context.client)
        asked.append(ask)

    monkeypatch.setattr(scene.cell, "judge", judge, raising=False)
    monkeypatch.setattr(ui, "run_javascript", lambda _: None)  # no browser is there
    monkeypatch.setattr(ui, "timer", later)
    teach(400.0)
    with Client(ui.page("/target")) as client:
        form = _TargetForm(view)
        form._fill(("0", "0", "0"))
        form._frame.set_value("1")
    asyncio.run(asked[-1]())
    assert form._text.text == "Not reachable: frame at (400.0, 0.0, 0.0)"
    asked.clear()
    # From no event of the page, as when another one has taught it.
    teach(500.0)
    (ask,) = asked
    assert clients[-1] is client
    asyncio.run(ask())
    assert form._text.text == "Not reachable: frame at (500.0, 0.0, 0.0)"
    view.read_frames()
    save_frame(tmp_path, "user", 2, TaughtFrame("other", (1.0, 0.0, 0.0)))
    view.read_frames()
    assert len(asked) == 1, "the chosen one is as it was"
