"""Questions about a recording: its new name, and whether it may go for ever."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import plain

from operator_panel.control.fields import error_text, parse_run_name
from operator_panel.page.view_io import push_button
from operator_panel.runs import Run


async def ask_name(old: str) -> str:
    """Ask for a new name; return it, empty if nothing was chosen."""

    def check(text: str) -> str | None:
        return error_text(lambda: parse_run_name(text))

    with ui.dialog() as dialog, ui.element("div").classes("card confirm"):
        plain("New name of the recording", "confirm-title", "h2")
        field = ui.input("Name", value=old, validation=check)
        field.props("dense outlined stack-label no-error-icon autofocus").classes("field")
        field.mark("new-run-name")

        def take() -> None:
            if field.validate() and parse_run_name(field.value):
                dialog.submit(parse_run_name(field.value))

        field.on("keydown.enter", take)
        with ui.element("div").classes("row-line"):
            push_button("Cancel", lambda: dialog.submit(""))
            push_button("Rename", take, "primary")
    chosen = await dialog
    dialog.delete()
    return str(chosen or "")


async def ask_delete(one: Run) -> bool:
    """Ask whether a recording may be deleted; return whether it may."""
    with ui.dialog() as dialog, ui.element("div").classes("card confirm"):
        with ui.element("h2").classes("confirm-title"):
            ui.label(f"Delete {one.name}?")
        with ui.element("p"):
            what = "the recording and its report" if one.has_report else "the recording"
            ui.label(f"{one.size}, {one.when}: {what} cannot be brought back.")
        with ui.element("div").classes("row-line"):
            push_button("Cancel", lambda: dialog.submit(False), props="autofocus")
            push_button("Delete for ever", lambda: dialog.submit(True), "primary")
    chosen = await dialog
    dialog.delete()
    return bool(chosen)
