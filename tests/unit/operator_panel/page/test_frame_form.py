"""A frame is saved as it stood in the form when Save was pressed, and shown on all pages."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from operator_panel.control.authority import Role
from operator_panel.page.view_io import PageView
from operator_panel.page.work.frames_io import _FrameForm
from operator_panel.view.snapshot import Snapshot
from scara_config.frames import TaughtFrame, load_frames
from scara_ros.names import Seat

POINTS_M = [(0.4, 0.0, 0.0), (0.5, 0.0, 0.0), (0.4, 0.1, 0.0)]


def test_a_frame_gets_the_number_that_was_chosen_when_it_was_saved(tmp_path: Path) -> None:
    """Whoever waits for control may choose another, or begin with the next frame."""
    from nicegui import Client, ui

    taken, answers = asyncio.Event(), []

    async def take(_: str) -> str:
        await taken.wait()
        return ""

    desk: Any = SimpleNamespace(
        arm=SimpleNamespace(set_frames=lambda _: None),
        taught=0,
        take=take,
        begin=lambda *_: 1,
        ended=lambda _, answer: answers.append(answer.message),
    )
    session: Any = SimpleNamespace(page="a", role=Role.OPERATOR)
    around: Any = SimpleNamespace(folder=tmp_path)
    nothing: Any = None

    async def press(form: _FrameForm) -> None:
        pressed = asyncio.create_task(form._store())
        await asyncio.sleep(0)
        form._number.set_value("2")
        form._name.set_value("next")
        form._again()
        taken.set()
        await pressed

    with Client(ui.page("/frames")):
        form = _FrameForm(PageView(nothing, nothing, around, nothing, desk, session))
        form._name.set_value("pallet")
        for point in POINTS_M:
            pose = np.eye(4)
            pose[:3, 3] = point
            form._poses.append(pose)
        asyncio.run(press(form))
    assert answers == ["pallet is user frame 1 in frames.yaml"]
    table = load_frames(tmp_path)
    assert (table.user, table.tool) == ({"uframe_1": TaughtFrame("pallet", (400.0, 0.0, 0.0))}, {})


def test_a_frame_that_one_page_has_taught_is_shown_on_all(tmp_path: Path) -> None:
    """A move to its number goes to where it is now, whichever page sends it."""
    from nicegui import Client, ui

    arm = SimpleNamespace(set_frames=lambda _: None)
    desk: Any = SimpleNamespace(arm=arm, taught=0, refusal=lambda *_: "")
    session: Any = SimpleNamespace(page="a", role=Role.OPERATOR, seat=Seat("operator", "1"))
    around: Any = SimpleNamespace(folder=tmp_path)
    nothing: Any = None
    pages = [PageView(nothing, nothing, around, nothing, desk, session) for _ in range(2)]
    frame = TaughtFrame("pallet", (400.0, 0.0, 0.0))
    with Client(ui.page("/frames")):
        forms = [_FrameForm(page) for page in pages]
        asyncio.run(forms[0]._stored("user", 1, frame))
        for page in pages:
            page.refresh(Snapshot(), False)
    assert [dict(page.frames.numbered("user")) for page in pages] == [{1: frame}] * 2
    assert all("user 1, pallet: X 400.0" in form._list.text for form in forms)
