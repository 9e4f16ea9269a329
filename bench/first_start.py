"""The first start on a bare Debian 12 that is made for it: how long it takes, and how much it adds.

It needs root, debootstrap and a network; see setup/fresh_machine.sh. README.md shows its figures.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import Any

from harness.faults.rows import Row
from rich.console import Console

from bench import page

LINE = "./cell setup run"
"""What is timed: the set-up that `./cell up` and `./cell demo` make at their first start."""
DEADLINE_S = 3600.0
SETUP_LIMIT_S = 600.0
"""Of the first start, with packages from a mirror nearby; our choice."""
TOOK = re.compile(r"^took ([0-9.]+) s$", re.MULTILINE)
ADDED = re.compile(r", (\d+) MB more on the disk$", re.MULTILINE)


def run(folder: Path, console: Console) -> list[Row]:
    """Measure the first start as root and as a user with sudo, and write the pages.

    Args:
        folder: Where the machine is made.
        console: For what the machine says.

    Returns:
        The time of the set-up against our limit.

    Raises:
        RuntimeError: A command failed on the machine.
    """
    load = os.getloadavg()[0]
    told = _on_a_bare_machine(folder / "machine", console)
    found = figures(told)
    page.write({**page.so_far(), "first_start": page.measured(found, load)})
    return [Row("first start", "set-up [s]", SETUP_LIMIT_S, found["setup_s"])]


def figures(told: str) -> dict[str, Any]:
    """Return the slower one of both persons: the set-up [s], and what it adds to the disk [MB].

    Args:
        told: What the fresh machine printed.

    Raises:
        RuntimeError: It did not print the figures of both.
    """
    took, added = [float(text) for text in TOOK.findall(told)], ADDED.findall(told)
    if not len(took) == len(added) == 2:
        raise RuntimeError(f"the fresh machine printed {len(took)} times and {len(added)} sizes")
    return {"setup_s": max(took), "added_mb": max(map(int, added))}


def _on_a_bare_machine(folder: Path, console: Console) -> str:
    """Type the line on a machine made anew, and return what it prints."""
    words = ("bash", "-c", f"'TIMEFORMAT=\"took %R s\"; time {LINE}'")
    script = str(page.ROOT / "setup" / "fresh_machine.sh")
    done = subprocess.run(
        [script, str(folder), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=DEADLINE_S,
    )
    console.print(done.stdout, markup=False, highlight=False)
    if done.returncode != 0:
        raise RuntimeError(f"{script} ended with exit code {done.returncode}; see above")
    return done.stdout
