"""NiceGUI for pages that are served, and no more of it.

Its web-socket library can be a client too, by whichever of three HTTP libraries it finds; each
process with a page would load all of them: 11 MB. They stay importable for everybody else.
Import from here before anything else that imports NiceGUI.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

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
