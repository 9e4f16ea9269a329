"""What the scripts of the Python clients share: it needs no client and nothing of the project."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

BEGIN = "check_"
"""How the names of checks begin; the rest, with blanks, is the check's row in docs/clients.md."""


def run(client: str, version: str, found: Mapping[str, Callable[[], Any]]) -> None:
    """Print name and version, then each check and what went wrong, null if nothing did.

    Args:
        client: Its name.
        version: Its version.
        found: Functions by name, such as ``globals()``; all that begin with ``check_`` are run.
    """
    print(json.dumps({"client": client, "version": version}), flush=True)
    for name in [name for name in found if name.startswith(BEGIN)]:
        check = name.removeprefix(BEGIN).replace("_", " ")
        print(json.dumps({"check": check, "wrong": _outcome(found[name])}), flush=True)


def _outcome(check: Callable[[], Any]) -> str | None:
    try:
        check()
    except Exception as error:
        return f"{type(error).__name__}: {error}"[:200]
    return None
