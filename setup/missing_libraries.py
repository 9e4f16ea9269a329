"""Print which libraries of requirements.txt the interpreter that runs this does not have.

CMakeLists.txt asks the interpreter of the nodes, before it builds them.
"""

from __future__ import annotations

import re
from importlib import metadata
from pathlib import Path

REQUIREMENTS = Path(__file__).with_name("requirements.txt")


def missing() -> list[str]:
    """Return the names of the libraries that are not there, in any version."""
    text = REQUIREMENTS.read_text(encoding="utf-8")
    names = re.findall(r"^([\w.-]+)", text, re.MULTILINE)
    return [name for name in names if not is_there(name)]


def is_there(name: str) -> bool:
    """Return whether a library is installed."""
    try:
        metadata.distribution(name)
    except metadata.PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    print(", ".join(missing()))
