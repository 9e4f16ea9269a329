"""Tab Target: what it says of a position is of what is chosen now."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from operator_panel.door import Answer
from operator_panel.page import target_io
from operator_panel.page.target_io import _TargetForm
from operator_panel.page.view_io import PageView, push_button
from scara_config.frames import TaughtFrame, save_frame
from unit.operator_panel.page.test_leading import Scene


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scene:
    """Give a page in control, without a browser; P1 is a position of its robot."""
    from nicegui import ui

    made = Scene(tmp_path / "drafts")
    around: Any = SimpleNamespace(folder=tmp_path, positions={"P1": (0.5, -0.25, 0.1)})
    arm: Any = SimpleNamespace(axes=(), set_frames=lambda _: None)
    made.leading._view.around, made.desk.arm = around, arm
    monkeypatch.setattr(ui, "run_javascript", lambda _: None)
    return made


def teach(view: PageView, x_mm: float) -> None:
    """Let user frame 1 be there."""
    save_frame(view.around.folder, "user", 1, TaughtFrame("pallet", (x_mm, 0.0, 0.0)))
    view.read_frames()


def test_a_position_is_asked_about_again_once_its_frame_is_taught_anew(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Text and ghost would stay where no Move leads any more."""
    from nicegui import Client, context, ui

    view, clients = scene.leading._view, []
    asked: list[Callable[[], Coroutine[Any, Any, None]]] = []

    async def judge(frame: int, **_: Any) -> Answer:
        return Answer(False, f"frame at {view.frames.numbered('user')[frame].xyz_mm}")

    def later(_: float, ask: Callable[[], Coroutine[Any, Any, None]], once: bool) -> None:
        clients.append(context.client)
        asked.append(ask)

    monkeypatch.setattr(scene.cell, "judge", judge, raising=False)
    monkeypatch.setattr(ui, "timer", later)
    teach(view, 400.0)
    with Client(ui.page("/target")) as client:
        form = _TargetForm(view)
        form._fill(("0", "0", "0"))
        form._frame.set_value("1")
    asyncio.run(asked[-1]())
    assert form._text.text == "Not reachable: frame at (400.0, 0.0, 0.0)"
    asked.clear()
    # From no event of the page, as when another one has taught it.
    teach(view, 500.0)
    (ask,) = asked
    assert clients[-1] is client
    asyncio.run(ask())
    assert form._text.text == "Not reachable: frame at (500.0, 0.0, 0.0)"
    view.read_frames()
    save_frame(view.around.folder, "user", 2, TaughtFrame("other", (1.0, 0.0, 0.0)))
    view.read_frames()
    assert len(asked) == 1, "the chosen one is as it was"


def test_a_named_position_is_of_the_base_whatever_frame_was_chosen_before(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """P1 in the frame of an earlier move is another place: both robots would go there."""
    from nicegui import Client, ui

    view = scene.leading._view
    presses: dict[str, Callable[[], Any]] = {}
    sent: list[dict[str, Any]] = []

    def button(text: str, on_click: Callable[[], Any], **how: Any) -> ui.button:
        presses[text] = on_click
        return push_button(text, on_click, **how)

    async def send(**fields: Any) -> None:
        sent.append(fields)

    monkeypatch.setattr(target_io, "push_button", button)
    monkeypatch.setattr(ui, "timer", lambda *_, **__: None)
    teach(view, 400.0)
    with Client(ui.page("/target")):
        form = _TargetForm(view)
        form._frame.set_value("1")
        presses["P1"]()
        asyncio.run(form._go(send))
    (fields,) = sent
    assert [fields[axis] for axis in "xyz"] == pytest.approx([0.5, -0.25, 0.1])
    assert "frame" not in fields
