"""Steps that are only shown: a switch, one for all places where steps are sent."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from operator_panel.io.page.preview.asking import needs_judge, play
from operator_panel.io.page.view import PageView


class LookFirst:
    """Sends a move, or only shows it while its switch is on."""

    def __init__(self, view: PageView) -> None:
        """Begin with the switch off."""
        self._view = view
        self._switches: list[ui.switch] = []
        self._is_on = False

    def build(self) -> None:
        """Build one more place of the switch."""
        made = ui.switch("Only preview", on_change=lambda event: self._turn(bool(event.value)))
        self._switches.append(made.classes("switch").props("dense"))
        needs_judge(self._view, made)

    def _turn(self, is_on: bool) -> None:
        self._is_on = is_on
        for switch in self._switches:
            switch.set_value(is_on)

    async def send(self, command: str, title: str, **fields: Any) -> None:
        """Send a move, or show what would come of it."""
        if self._is_on:
            await play(self._view, title, command, **fields)
        else:
            await self._view.send(command, title, **fields)
