"""What is always visible: mode, leader and why in words, control, STOP."""

from __future__ import annotations

import time

from nicegui import ui

from operator_panel.io.page.view import PageView, live, plain
from operator_panel.view.snapshot import Snapshot

THEMES = (
    (None, "brightness_auto", "as the browser"),
    (False, "light_mode", "light"),
    (True, "dark_mode", "dark"),
)


def build_header(view: PageView, title: str) -> None:
    """Build the bar and the banners below it."""
    with ui.element("header").classes("bar"):
        with ui.element("div").classes("bar-mode").props('data-tone="mode"'):
            live("mode", "mode-title")
            with ui.element("div").classes("mode-leader"):
                plain("Leader: ")
                live("leader")
        with ui.element("div").classes("bar-why"):
            live("why", "why")
            with ui.element("div").classes("bar-sub"):
                plain(title, "cell-name")
                live("motion")
        _control(view)
        _theme()
        with ui.element("div").classes("bar-stop"):
            _stop("ESTOP", "E-STOP", "estop", "Emergency stop: drives off, latched until RESET")
            _stop("STOP", "STOP", "stop", "Stop both. Keys: Escape or space")
    with ui.element("div").classes("banner banner-no-stop").props('role="alert"'):
        plain("", "no-stop-text")
    with ui.element("div").classes("banner banner-lost").props('role="alert"'):
        plain("", "lost-text")
    with ui.element("div").classes("banner banner-silent").props('role="alert"'):
        plain("", "silent-text")
    _question(view)


def _stop(command: str, text: str, style: str, title: str) -> None:
    """A stop is never greyed out, for nobody, and acts when it is pressed down: see web/stop.js.

    What became of it stands below it.
    """
    with ui.element("div").classes("stop-place"):
        with (
            ui.element("button")
            .classes(f"stop-button {style}")
            .props(f'type=button title="{title}" data-stop="{command}"')
            .mark(command.lower())
        ):
            plain(text)
        plain("", "stop-answer").props(f'role="status" data-stop-answer="{command}"')


def _theme() -> None:
    """A button that goes round: as the browser, light, dark; the browser remembers it."""
    mode = ui.dark_mode(None)
    state = {"index": 0}
    button = ui.button(color=None).props("flat round dense size=sm").classes("theme")

    def show(index: int) -> None:
        state["index"] = index % len(THEMES)
        value, icon, words = THEMES[state["index"]]
        mode.set_value(value)
        button.props(f'icon={icon} title="Colours: {words}" aria-label="Colours: {words}"')

    def turn() -> None:
        show(state["index"] + 1)
        ui.run_javascript(f"localStorage.setItem('panel_theme', '{state['index']}')")

    button.on_click(turn)
    show(0)

    async def recall() -> None:
        kept = await ui.run_javascript("localStorage.getItem('panel_theme')", timeout=5.0)
        if isinstance(kept, str) and kept.isdigit():
            show(int(kept))

    ui.timer(0.1, recall, once=True)


def _control(view: PageView) -> None:
    """Who is in control, and the buttons to take or leave it."""
    with ui.element("div").classes("bar-control"):
        text = ui.label("").classes("control-text").mark("control")
        if not view.is_operator:
            text.set_text("Watching only")
            return
        ask = ui.button(
            "Ask for control", on_click=lambda: view.desk.ask(view.session.page), color=None
        )
        leave = ui.button(
            "Release", on_click=lambda: view.desk.release(view.session.page), color=None
        )
        for button, name in ((ask, "ask"), (leave, "release")):
            button.props("unelevated no-caps dense").classes("button small").mark(name)

    def show(_: Snapshot, __: bool) -> None:
        authority = view.authority
        asked = authority.asker == view.session.page
        if view.has_control:
            words = f"{view.session.name.capitalize()}: in control"
        elif asked:
            words = f"Asked {view.desk.name_of(authority.holder)} for control"
        else:
            words = f"{view.desk.name_of(authority.holder).capitalize()} is in control"
        text.set_text(words)
        ask.set_text("Ask for control" if authority.holder else "Take control")
        ask.set_visibility(not view.has_control and not asked)
        leave.set_visibility(view.has_control)

    view.after.append(show)


def _question(view: PageView) -> None:
    """What the holder is asked by another operator."""
    if not view.is_operator:
        return
    with ui.element("div").classes("banner banner-ask") as banner:
        text = ui.label("").mark("question")
        ui.button(
            "Hand over", on_click=lambda: view.desk.answer(view.session.page, True), color=None
        ).props("unelevated no-caps dense").classes("button primary small").mark("grant")
        ui.button(
            "Keep", on_click=lambda: view.desk.answer(view.session.page, False), color=None
        ).props("unelevated no-caps dense").classes("button small").mark("keep")
    banner.set_visibility(False)

    def show(_: Snapshot, __: bool) -> None:
        asked = view.has_control and bool(view.authority.asker)
        banner.set_visibility(asked)
        if asked:
            left = max(
                0, round(view.config.control.answer_s - (time.monotonic() - view.authority.asked))
            )
            asker = view.desk.name_of(view.authority.asker).capitalize()
            text.set_text(
                f"{asker} asks for control. Without an answer it is handed over in {left} s."
            )

    view.after.append(show)
