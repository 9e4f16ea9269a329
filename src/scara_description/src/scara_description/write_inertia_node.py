"""Bring the inertia of a URDF file up to date with its masses and collision shapes; no ROS needed.

Usage: rosrun scara_description write_inertia FILE
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

from scara_description.inertia import ShapeError, with_inertia


def main() -> None:
    """Rewrite the file named on the command line.

    Say what was wrong and leave it as it is otherwise.
    """
    if len(sys.argv) != 2:
        sys.exit("usage: write_inertia FILE")
    path = Path(sys.argv[1])
    try:
        before = path.read_text(encoding="utf-8")
        after = with_inertia(before)
    except (OSError, ET.ParseError, ShapeError) as error:
        sys.exit(f"{path}: {error}")
    if after == before:
        print(f"{path}: up to date")
        return
    path.write_text(after, encoding="utf-8")
    print(f"{path}: inertia written")
