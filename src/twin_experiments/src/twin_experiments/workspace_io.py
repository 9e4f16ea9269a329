"""Ask git, the interpreter and the processor what a report is made with."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path

import rospkg

from twin_experiments.report.label.made_with import Workspace

UNKNOWN = "unknown"
PACKAGE = "twin_experiments"
LIBRARIES = ("numpy", "pybullet")
PROCESSORS = Path("/proc/cpuinfo")
GIT_DEADLINE_S = 10.0
# Without tags: the commit alone, whatever was released there.
DESCRIBE = ("describe", "--always", "--dirty=+", "--abbrev=7", "--exclude=*")


def this_workspace() -> Workspace:
    """Return what this machine and its workspace are now."""
    return Workspace(
        commit=commit_of(Path(__file__).resolve().parent),
        versions={
            PACKAGE: _package_version(),
            "Python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES},
        },
        processor=processor_of(PROCESSORS),
        cores=os.cpu_count() or 1,
        now=datetime.now(timezone.utc),
    )


def commit_of(folder: Path) -> str:
    """Return the commit that is checked out around ``folder``.

    Returns:
        Seven digits, with a plus if a file that git knows differs; ``unknown`` without git or
        outside a clone.
    """
    try:
        told = subprocess.run(
            ["git", "-C", str(folder), *DESCRIBE],
            capture_output=True,
            text=True,
            check=True,
            timeout=GIT_DEADLINE_S,
        )
    except (OSError, subprocess.SubprocessError):
        return UNKNOWN
    return told.stdout.strip() or UNKNOWN


def processor_of(listing: Path) -> str:
    """Return the processor's name in a listing such as /proc/cpuinfo, else ``unknown``."""
    try:
        lines = listing.read_text(encoding="utf-8").splitlines()
    except OSError:
        return UNKNOWN
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    # ARM's listing has no model name.
    return next(names, "") or platform.machine() or UNKNOWN


def _package_version() -> str:
    """Return the version in package.xml."""
    try:
        return str(rospkg.RosPack().get_manifest(PACKAGE).version)
    except rospkg.ResourceNotFound:
        return UNKNOWN
