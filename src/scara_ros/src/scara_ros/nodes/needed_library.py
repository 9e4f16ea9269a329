"""Say in one line that a library is missing, and what installs it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

MISSING = 1
"""Exit code of a program whose library is not installed."""


def require_library(name: str, scope: str, code: int = MISSING) -> None:
    """End this program with one line if a library is not installed.

    Args:
        name: As it is imported.
        scope: Of ``./cell setup``, that installs it.
        code: Exit code then.

    Raises:
        SystemExit: It is not installed.
    """
    if importlib.util.find_spec(name) is None:
        program = Path(sys.argv[0]).name
        print(
            f"{program}: the library {name} is not installed. To install it: ./cell setup {scope}",
            file=sys.stderr,
        )
        sys.exit(code)
