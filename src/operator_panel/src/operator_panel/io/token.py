"""The operator's token: given, or made once and kept in a file that only its owner can read."""

from __future__ import annotations

import hmac
import os
import secrets
from pathlib import Path

FILE = "operator_token"
VARIABLE = "OPERATOR_PANEL_TOKEN"


class TokenError(RuntimeError):
    """The token's file cannot be used; the text says why."""


def ros_home() -> Path:
    """Return the folder where ROS keeps what is this user's own."""
    return Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")


def operator_token(given: str, folder: Path) -> str:
    """Return ``given``, the environment's token, or that of the file in ``folder``, made if it is missing.

    Raises:
        TokenError: The file cannot be read or made, others can read it, or it is empty.
    """
    given = given or os.environ.get(VARIABLE, "")
    if given:
        return given
    file = folder / FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return _read(file)
    except OSError as error:
        raise TokenError(f"{file}: cannot be made: {error.strerror}") from error
    with os.fdopen(handle, "w", encoding="ascii") as stream:
        stream.write(secrets.token_urlsafe(16) + "\n")
    return _read(file)


def is_token(offered: str, token: str) -> bool:
    """Compare without telling by the time it takes how much fits."""
    return hmac.compare_digest(offered.encode(), token.encode())


def _read(file: Path) -> str:
    try:
        if file.stat().st_mode & 0o077:
            raise TokenError(f"{file}: others can read it: chmod 600, or delete it to get a new one")
        token = file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise TokenError(f"{file}: cannot be read: {error}") from error
    if not token:
        raise TokenError(f"{file}: is empty: delete it to get a new one")
    return token
