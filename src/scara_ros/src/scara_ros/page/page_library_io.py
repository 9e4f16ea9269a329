"""What all pages that NiceGUI serves share: the library, their files, small controls, the server.

Its web-socket library can be a client too, by whichever of three HTTP libraries it finds; each
process with a page would load all of them: 11 MB. They stay importable for everybody else.
Import from here before anything else that imports NiceGUI.
"""

from __future__ import annotations

import asyncio
import html
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

CLIENTS = ("aiohttp", "requests", "tornado")


@contextmanager
def _without(names: tuple[str, ...]) -> Iterator[None]:
    """Let imports of libraries fail that are not loaded yet, as if they were not installed."""
    absent = [name for name in names if name not in sys.modules]
    for name in absent:
        sys.modules[name] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


with _without(CLIENTS):
    from nicegui import app, background_tasks, run, ui

__all__ = ["app", "background_tasks", "run", "ui"]
KNOCK_PERIOD_S = 0.02
PLAIN_BUTTON = "button plain-button"
"""Classes of a button or a link that looks like the server's buttons."""


class WebFolder:
    """A folder of style sheets and scripts that is served below an address."""

    def __init__(self, address: str, folder: Path) -> None:
        """Serve it."""
        self._address = address
        # In the files' addresses, so that a browser that has kept an older version asks again.
        self._version = max(int(file.stat().st_mtime) for file in folder.rglob("*"))
        app.add_static_files(address, str(folder), max_cache_age=0)

    def add(self, style: str, script: str) -> None:
        """Let the page that is being built load a style sheet and a script."""
        style, script = (f"{self._address}/{name}?{self._version}" for name in (style, script))
        ui.add_head_html(f'<link rel="stylesheet" href="{style}">')
        ui.add_body_html(f'<script type="module" src="{script}"></script>')


def offer(address: str, answer: Callable[..., Any], method: str = "GET") -> None:
    """Offer an address beside the page."""
    app.add_api_route(address, answer, methods=[method], include_in_schema=False)


def plain(text: str, style: str = "", tag: str = "span") -> ui.element:
    """Make a place with a fixed text."""
    return ui.html(html.escape(text), sanitize=False, tag=tag).classes(style)


def button_of(text: str, style: str = "", props: str = "") -> ui.element:
    """Make a button that the browser hears, not the server."""
    made = ui.element("button").classes(style).props(f"type=button {props}")
    with made:
        plain(text)
    return made


def tabs_of(
    texts: Mapping[str, str],
    data: str,
    style: str = "segmented",
    heard: Callable[[str], None] | None = None,
) -> ui.element:
    """Make a row of tabs that the browser hears.

    Args:
        texts: What stands on each tab, by its value.
        data: Name of the attribute with its value, without ``data-``.
        style: Classes of the row.
        heard: What the server does too, with the value of a tab that was pressed.
    """
    row = ui.element("div").classes(style).props("role=tablist")
    fill_tabs(row, texts, data, heard)
    return row


def fill_tabs(
    row: ui.element,
    texts: Mapping[str, str],
    data: str,
    heard: Callable[[str], None] | None = None,
    chosen: str = "",
) -> None:
    """Put tabs into a row in place of those that were there.

    Args:
        row: Of :func:`tabs_of`.
        texts: As there, and so ``data`` and ``heard``.
        data: Name of the attribute.
        heard: What the server does too.
        chosen: The tab that is chosen; empty: the browser chooses one.
    """
    row.clear()
    with row:
        for value, text in texts.items():
            tab = button_of(text, props="role=tab")
            # Not in the text of props, which is read as a Python literal: people type names, and
            # one with a backslash would raise.
            tab.props[f"data-{data}"] = value
            if chosen:
                tab.props["aria-selected"] = str(value == chosen).lower()
            if heard is not None:
                tab.on("click", partial(heard, value))


def serve_pages(
    host: str, port: int, title: str, served: Callable[[], None] | None = None, **options: Any
) -> None:
    """Serve what was built, until SIGINT or SIGTERM.

    Args:
        host: Where to listen.
        port: The port.
        title: Of the page.
        served: Called once the server answers there: it listens only after its start-up handlers.
        options: Further ones of ``ui.run``.
    """

    async def knock(told: Callable[[], None]) -> None:
        while True:
            try:
                _, writer = await asyncio.open_connection(host, port)
            except OSError:
                await asyncio.sleep(KNOCK_PERIOD_S)
            else:
                writer.close()
                told()
                return

    if served is not None:
        app.on_startup(lambda: background_tasks.create(knock(served), name="knock"))
    ui.run(
        host=host,
        port=port,
        title=title,
        show=False,
        reload=False,
        tailwind=False,
        show_welcome_message=False,
        timeout_graceful_shutdown=1,
        **options,
    )
