"""The robot's registers and signals: read on request, searched by any word."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui
from scara_ros.page.page_library_io import plain

from operator_panel.page.view_io import PageView, push_button
from operator_panel.view.robot.registers import Entry, matching


def build_registers(view: PageView) -> None:
    """Build the button, the search and the list."""
    _Registers(view)


class _Registers:
    def __init__(self, view: PageView) -> None:
        self._view = view
        self._read_now: Sequence[Entry] = ()
        with ui.element("div").classes("row-line"):
            self._search = ui.input("Search", on_change=self._show)
            self._search.props("dense outlined stack-label clearable").classes("field grow")
            button = push_button("Read", self._read, props='title="Read all registers once"')
            button.mark("read-registers").set_enabled(view.is_operator)
        self._text = ui.label("Registers and signals of the robot: press Read.").classes("preview")
        self._list = ui.element("ul").classes("registers").props('aria-label="Registers"')

    async def _read(self) -> None:
        self._text.set_text("Reading ...")
        found, why = await self._view.door.registers()
        if why:
            self._text.set_text(why)
            self._text.classes(add="bad")
            return
        self._text.classes(remove="bad")
        self._read_now = found
        self._show()

    def _show(self) -> None:
        if not self._read_now:
            return
        found = matching(self._read_now, self._search.value or "")
        self._text.set_text(f"{len(found)} of {len(self._read_now)}, as they were when Read")
        self._list.clear()
        with self._list:
            for entry in found:
                with ui.element("li").classes("register"):
                    plain(entry.name, "register-name")
                    ui.label(entry.value).classes("register-value")
                    ui.label(
                        f"{entry.kind} {entry.address}, raw {entry.raw}: {entry.meaning}"
                    ).classes("row-text")
