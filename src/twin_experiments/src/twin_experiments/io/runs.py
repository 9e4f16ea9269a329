"""Folders of runs: one per run, and a link to the newest."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def new_run_folder(base: Path, stamp: str) -> Path:
    """Create ``base/stamp``, with a number appended if it is taken, and return it."""
    base.mkdir(parents=True, exist_ok=True)
    for number in range(1, 1000):
        folder = base / (stamp if number == 1 else f"{stamp}_{number}")
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise FileExistsError(f"{base}/{stamp}: taken a thousand times")


def link_latest(folder: Path) -> None:
    """Let ``latest`` beside ``folder`` point to it, at once, whatever it pointed to.

    A real folder is left alone.
    """
    link = folder.parent / "latest"
    fresh = folder.parent / f".latest_{os.getpid()}"
    fresh.symlink_to(folder.name)
    try:
        fresh.replace(link)
    except OSError:
        fresh.unlink()
        raise
