"""Ask the second world for a motion, and let the browser play it."""

from __future__ import annotations

import json
import time
from typing import Any

import msgspec
from nicegui import ui

from operator_panel.page.view_io import PageView
from operator_panel.view.judged import Judged, judged, preview_refusal
from operator_panel.view.snapshot import Snapshot

SAMPLES = 300
"""Our choice: 15 kB for the browser, and a move of 3 s in steps of 10 ms."""
ONLY_LOOKS = {"samples": 2}
"""Fields of a question by which nothing moves. One with samples, here the fewest, is ended where a
move waits to be judged: a whole program takes longer than the gate of a move has patience."""


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
    """Return what would come of a motion that begins now.

    Args:
        view: The page.
        title: The motion in words.
        motion: As in scara_msgs/JudgeMotion.
        fields: Further fields of it; :data:`ONLY_LOOKS` unless the motion follows at once.
    """
    return judged(title, await view.door.try_motion(motion, **fields))


class LookFirst:
    """Sends a move, or only shows it while its switch is on."""

    def __init__(self, view: PageView) -> None:
        """Begin with the switch off."""
        self._view = view
        self._switches: list[ui.switch] = []
        self._is_on = False

    def build(self) -> None:
        """Build one more place of the switch."""

        def turn() -> None:
            self._is_on = bool(made.value)
            for switch in self._switches:
                switch.set_value(self._is_on)

        made = ui.switch("Only preview", on_change=turn)
        self._switches.append(made.classes("switch").props("dense"))
        needs_judge(self._view, made)

    async def send(self, command: str, title: str, **fields: Any) -> None:
        """Send a move, or show what would come of it."""
        if self._is_on:
            await play(self._view, title, command, **fields)
        else:
            await self._view.send(command, title, **fields)
