"""Old names of executables that moved to another package."""

from __future__ import annotations

import importlib
import sys

from scara_ros.nodes.running import run


def run_moved(package: str, node: str, now_in: str) -> None:
    """Run ``now_in``'s executable ``node`` in place of ``package``'s; say the new name on stderr.

    The import goes by name: an old package declares no dependency on the new one, which may use it.
    """
    text = f"rosrun {package} {node}: it moved; use: rosrun {now_in} {node}"
    print(text, file=sys.stderr, flush=True)
    run(importlib.import_module(f"{now_in}.nodes.{node}").main)
