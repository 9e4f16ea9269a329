"""The built workspace's environment, taken from env.sh once, whatever shell started pytest."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Settings of the calling shell that would make a test's outcome depend on it.
_OTHERS = (
    "ROS_NAMESPACE",
    "ROS_HOSTNAME",
    "ROS_LOG_DIR",
    "CELL_TEST_MARK",
    "SCARA_CONFIG_DIR",
    "SCARA_ROBOT",
    "SCARA_PLANT",
    "SCARA_SETTINGS",
)


@functools.cache
def workspace_environment() -> dict[str, str]:
    """Return the environment that a shell has after ``source env.sh``.

    Raises:
        RuntimeError: The workspace is not built; the text says what to do.
    """
    script = 'set -e; source "$1/env.sh" >&2; env -0'
    done = subprocess.run(
        ["bash", "-c", script, "bash", str(ROOT)], capture_output=True, timeout=30
    )
    if done.returncode != 0:
        raise RuntimeError(f"env.sh failed: {done.stderr.decode(errors='replace').strip()}")
    pairs = (item.split("=", 1) for item in done.stdout.decode().split("\0") if "=" in item)
    env = dict(pairs)
    for name in _OTHERS:
        env.pop(name, None)
    env["ROS_IP"] = "127.0.0.1"
    env["PYTHONUNBUFFERED"] = "1"  # logs are read while the processes run
    return env


def enter_workspace() -> None:
    """Give this very process the workspace's environment and import path."""
    env = workspace_environment()
    os.environ.update(env)
    for name in _OTHERS:
        os.environ.pop(name, None)
    for folder in reversed(env.get("PYTHONPATH", "").split(":")):
        if folder and folder not in sys.path:
            sys.path.insert(1, folder)
