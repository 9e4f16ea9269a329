"""Ask the second world for a motion, and let the browser play it."""

from __future__ import annotations

import json
import time
from typing import Any

import msgspec
from nicegui import ui

from operator_panel.io.page.view import PageView
from operator_panel.view.judged import Judged, judged, preview_refusal
from operator_panel.view.snapshot import Snapshot

SAMPLES = 300
"""Our choice: 15 kB for the browser, and a move of 3 s in steps of 10 ms."""


def needs_judge(view: PageView, element: Any) -> None:
    """Enable an element only while a judge runs, else let its title say how to start one.

    A switch that is on stays enabled, so that it can be turned off.
    """
    shown: list[str] = []

    def show(snapshot: Snapshot, _: bool) -> None:
        why = preview_refusal(snapshot, time.monotonic())
        if shown != [why]:
            shown[:] = [why]
            element.props["title"] = why
            element.set_enabled(not why or getattr(element, "value", None) is True)

    view.after.append(show)


async def play(view: PageView, title: str, motion: str, **fields: Any) -> None:
    """Show what would come of a motion that begins now: verdict, ghost and curves.

    Args:
        view: The page.
        title: The motion in words.
        motion: As in scara_msgs/JudgeMotion.
        fields: Further fields of it.
    """
    ui.run_javascript(f"window.panel?.judging({json.dumps(title)})")
    found = await ask(view, title, motion, samples=SAMPLES, **fields)
    ui.run_javascript(f"window.panel?.judged({msgspec.json.encode(found).decode()})")


async def ask(view: PageView, title: str, motion: str, **fields: Any) -> Judged:
    """Return what would come of a motion that begins now; without ``samples`` only the verdict."""
    return judged(title, await view.door.try_motion(motion, **fields))
