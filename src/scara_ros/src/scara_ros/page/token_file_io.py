"""Tokens by which nodes of one user know each other: from the environment, or from a file.

Never from the command line or a parameter: anybody can read those.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
from collections.abc import Mapping
from pathlib import Path

TWIN_CONTROLLER_VARIABLE = "SCARA_TWIN_CONTROLLER_TOKEN"
TWIN_CONTROLLER_FILE = "twin_controller_token"
"""Where twin controller and gateway find the token of the twin controller's connection."""

_BYTES = 24  # our choice: 192 bits, 32 characters; nobody guesses that


class TokenError(RuntimeError):
    """The token's file cannot be used; the text says why and what to do."""


def token_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder of this user's tokens.

    Not ROS_HOME: each run of a cell has one of its own, and a node that is started beside the cell
    must find the same token.
    """
    return Path(environment.get("HOME") or Path.home()) / ".ros"


def read_token(variable: str, file: str | None, environment: Mapping[str, str]) -> str | None:
    """Return the token of ``variable``, else that of ``file``; None without both.

    Args:
        variable: Name of an environment variable; one that is not set or empty counts as none.
        file: Path, relative to :func:`token_folder`; a missing file is made, with a new token.
        environment: The environment.

    Raises:
        TokenError: The file cannot be read or made, others can read it, or it is empty.
    """
    given = environment.get(variable)
    if given or file is None:
        return given or None
    try:
        return owned_token(token_folder(environment) / file)
    except TokenError as error:
        raise TokenError(f"{error}; or set {variable}") from error


def owned_token(path: Path) -> str:
    """Return the token in a file that only its owner can read; a missing one is made.

    Raises:
        TokenError: The file cannot be read or made, others can read it, or it is empty.
    """
    try:
        if not path.exists():
            # Make the file with all its content at once: another node may make or read it just now
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=path.parent, prefix=f"{path.name}.")
            try:
                with os.fdopen(handle, "w", encoding="ascii") as stream:
                    stream.write(secrets.token_urlsafe(_BYTES) + "\n")
                with contextlib.suppress(
                    FileExistsError
                ):  # another node was quicker: its token counts
                    os.link(name, path)
            finally:
                os.unlink(name)
        if path.stat().st_mode & 0o077:
            raise TokenError(
                f"{path}: others can read it: chmod 600, or delete it to get a new one"
            )
        token = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise TokenError(f"{path}: cannot be used: {error}") from error
    if not token:
        raise TokenError(f"{path}: is empty: delete it to get a new one")
    return token
