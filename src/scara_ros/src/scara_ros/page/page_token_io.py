"""Where a page is found: its port, its address, and the token that the address brings.

The token is of the environment, or kept in a file. It is never taken from the command line, which
everybody on the machine can read, and rospy writes its parameters to the parameter server.
"""

from __future__ import annotations

import os
import re
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

from scara_ros.page.token_file_io import TokenError, owned_token

FORM = re.compile(r"[A-Za-z0-9_-]{16,}")
"""Long enough that guessing is hopeless, and as it stands in an address."""


class PageError(RuntimeError):
    """A page cannot be served; the text says why."""


def listen(host: str, port: int) -> socket.socket:
    """Listen there.

    Raises:
        PageError: It is not free, or nobody may listen there.
    """
    try:
        return socket.create_server((host, port))
    except OSError as error:
        raise PageError(f"{host}:{port} cannot be listened on: {error.strerror}") from error


def ros_home() -> Path:
    """Return the folder where ROS keeps what is this user's own."""
    return Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")


def refuse_token_in(words: Sequence[str], variable: str, file: Path) -> None:
    """Raise if a token stands on the command line ``words``; say where it may stand.

    Raises:
        TokenError: There is one.
    """
    if any(word.startswith("_token:=") for word in words):
        raise TokenError(
            "_token:= is not taken: everybody on this machine can read it. "
            f"Set {variable}, or write the token into {file}"
        )


def page_token(variable: str, file: Path) -> str:
    """Return the token of the environment's ``variable``, else that of ``file``, made if missing.

    Raises:
        TokenError: The file cannot be used, or the token is too short or has other signs than
            letters, digits, dash and underline.
    """
    given = os.environ.get(variable, "")
    if given:
        return _checked(given, variable)
    return _checked(owned_token(file), f"{file}, which you may delete to get a new one")


def address(host: str, port: int, token: str) -> str:
    """Return the address to open; an empty token gives the address without one."""
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}/" + (f"?token={token}" if token else "")


def shown_address(host: str, port: int, token: str, file: Path) -> str:
    """Return the address to print; a log, which others may read, gets the token's place instead."""
    shown = token if sys.stdout.isatty() else f"TOKEN, which is in {file} unless it was given"
    return address(host, port, shown)


def _checked(token: str, place: str) -> str:
    if not FORM.fullmatch(token):
        raise TokenError(
            f"{place}: the token has {len(token)} signs: at least 16 are needed, "
            "letters, digits, dash and underline only"
        )
    return token
