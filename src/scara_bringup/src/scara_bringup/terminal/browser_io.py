"""Open a page in the person's browser, where there is a display."""

from __future__ import annotations

import html
import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

OPENERS = ("xdg-open", "sensible-browser", "x-www-browser")
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def find_opener(env: Mapping[str, str]) -> str:
    """Return the program that opens an address in a browser, empty if there is none or no display.

    Args:
        env: The environment; ``BROWSER`` in it names a program that is taken before all others.
    """
    if not any(env.get(name) for name in DISPLAYS):
        return ""
    names = (env.get("BROWSER", ""), *OPENERS)
    return next((found for name in names if name and (found := shutil.which(name))), "")


def open_page(address: str, folder: Path, env: Mapping[str, str] | None = None) -> bool:
    """Open ``address`` in a browser and return whether one was started.

    The address brings a token, and everybody on the machine can read a command line. So the browser
    gets a file that only this user can read, which leads on.

    Args:
        address: With its token.
        folder: Where that file is written.
        env: The environment; default: this process's.
    """
    env = os.environ if env is None else env
    opener = find_opener(env)
    if not opener:
        return False
    file = folder / "open_operator_page.html"
    target = html.escape(address, quote=True)
    # The cell runs without it, also with a disk that takes no file.
    try:
        file.unlink(missing_ok=True)
        with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(
                f'<!doctype html><meta http-equiv="refresh" content="0; url={target}">'
                f'<a href="{target}">The operator\'s page</a>\n'
            )
        subprocess.Popen(
            [opener, file.as_uri()],
            env=dict(env),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    except OSError:
        return False
    return True
