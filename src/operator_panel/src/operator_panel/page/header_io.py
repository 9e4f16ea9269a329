"""What is always visible: mode and why in words, what became of a command, control, STOP."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import ui
from scara_ros.page.page_library_io import button_of, plain

from operator_panel.door import Answer
from operator_panel.page.picture.look_back_io import build_past_note
from operator_panel.page.view_io import PageView, live, push_button
from operator_panel.view.progress import SHOWN
from operator_panel.view.snapshot import Snapshot

THEMES = (
    (None, "brightness_auto", "as the browser"),
    (False, "light_mode", "light"),
    (True, "dark_mode", "dark"),
)


def build_header(view: PageView, title: str) -> None:
    """Build the bar, which has the colour of the mode over its whole width."""
    with ui.element("header").classes("bar").props('data-tone="mode"'):
        with ui.element("div").classes("bar-mode"):
            plain(title, "cell-name")
            live("mode", "mode-title")
            live("motion", "mode-motion")
        _control(view)
        _theme()
        with ui.element("div").classes("bar-stop"):
            _stop("ESTOP", "E-STOP", "estop", "Emergency stop: drives off, latched until RESET")
            _stop("STOP", "STOP", "stop", "Stop both. Keys: Escape or space")
        # One place for the reason, commands, questions and troubles of the line: nothing moves
        # when one comes.
        with ui.element("div").classes("strip"):
            live("why", "why", "p").props('tabindex=0 aria-label="Why"')
            with ui.element("ul").classes("commands-told").props('aria-live="polite"'):
                for place in range(SHOWN):
                    ui.element("li").props(f"data-command={place}").classes("command-line")
            build_past_note()
            _question(view)
            with ui.element("div").classes("banner banner-lost").props('role="alert"'):
                plain("", "lost-text")
            with ui.element("div").classes("banner banner-silent").props('role="alert"'):
                plain("", "silent-text")
        # In full width, over the upper edge of the page: nothing is as urgent.
        with ui.element("div").classes("banner banner-no-stop").props('role="alert"'):
            plain("", "no-stop-text")


def _stop(command: str, text: str, style: str, title: str) -> None:
    """A stop is never greyed out, for nobody, and acts when it is pressed down: see web/stop.js.

    What became of it stands below it.
    """
    with ui.element("div").classes("stop-place"):
        pressed = button_of(text, f"stop-button {style}", f'title="{title}" data-stop="{command}"')
        pressed.mark(command.lower())
        plain("", "stop-answer").props(f'role="status" data-stop-answer="{command}"')


def _theme() -> None:
    """A button that goes round: as the browser, light, dark; the browser remembers it."""
    mode = ui.dark_mode(None)
    state = {"index": 0}
    button = ui.button(color=None).props("flat round dense").classes("theme")

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
    """Who is in control, and the button to ask whoever is; a command takes what is free."""
    page = view.session.page
    with ui.element("div").classes("bar-control"):
        text = ui.label("").classes("control-text").mark("control")
        if not view.is_operator:
            text.set_text("Watching only")
            return
        ask = _button(view, "Ask for control", "ask", lambda: view.desk.ask(page))

    def show(snapshot: Snapshot, _: bool) -> None:
        state = snapshot.state
        holder = state.holder if state is not None else ""
        asked = state is not None and state.asker == view.name
        if holder == view.name:
            words = f"{_begun(view.name)}: in control"
        elif asked:
            words = f"Asked {holder} for control"
        else:
            words = f"{_begun(holder) or 'Nobody'} is in control"
        text.set_text(words)
        ask.set_visibility(holder not in ("", view.name) and not asked)

    view.after.append(show)


def _begun(name: str) -> str:
    """Return a name at the beginning of a sentence; its other letters stay as they are."""
    return name[:1].upper() + name[1:]


def _button(
    view: PageView, text: str, name: str, press: Callable[[], Awaitable[Answer]], style: str = ""
) -> ui.button:
    """Make a button about control; what the twin controller refuses is shown."""

    async def send() -> None:
        answer = await press()
        if not answer.success:
            view.tell(answer, text)

    return push_button(text, send, style).mark(name)


def _question(view: PageView) -> None:
    """What the holder is asked by another operator."""
    if not view.is_operator:
        return
    page = view.session.page
    with ui.element("div").classes("banner banner-ask") as banner:
        text = ui.label("").mark("question")
        _button(view, "Hand over", "grant", lambda: view.desk.answer(page, True), "primary")
        _button(view, "Keep", "keep", lambda: view.desk.answer(page, False))
    banner.set_visibility(False)

    def show(snapshot: Snapshot, _: bool) -> None:
        state = snapshot.state
        if state is None or state.holder != view.name or not state.asker:
            banner.set_visibility(False)
            return
        banner.set_visibility(True)
        text.set_text(
            f"{_begun(state.asker)} asks for control. "
            f"Without an answer it is handed over in {state.answer_left:.0f} s."
        )

    view.after.append(show)
