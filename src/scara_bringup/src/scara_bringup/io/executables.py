"""Where a node's executable is.

This finds what rosrun finds, without its 0.4 s of processor time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

SYSTEM = "/usr"
"""Prefix of Debian's own packages."""


def command_of(package: str, executable: str, env: Mapping[str, str]) -> list[str]:
    """Return the words that start a node.

    They name its file in one of catkin's prefixes, else rosrun, which also says why it finds none.

    Args:
        package: Name of the package.
        executable: Name of the node's script or program.
        env: Environment of the node; its CMAKE_PREFIX_PATH names the workspaces, the chosen one
            first.
    """
    for prefix in (*env.get("CMAKE_PREFIX_PATH", "").split(os.pathsep), SYSTEM):
        file = Path(prefix) / "lib" / package / executable
        if prefix and file.is_file() and os.access(file, os.X_OK):
            return [str(file)]
    return ["rosrun", package, executable]
