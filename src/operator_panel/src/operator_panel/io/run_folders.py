"""The folder of recorded runs on the disk."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

from operator_panel.runs import RUN, Run, may_be_shown, size_text, verdict

REPORT = "report.html"
LISTED = 50


def list_runs(folder: Path) -> list[Run]:
    """Return the newest runs, newest first; an empty list if there is no folder."""
    try:
        found = [
            entry
            for entry in folder.iterdir()
            if entry.is_dir() and not entry.is_symlink() and RUN.fullmatch(entry.name)
        ]
        dated = sorted(((entry.stat().st_mtime, entry) for entry in found), reverse=True)[:LISTED]
    except OSError:
        return []
    return [_run(entry, when) for when, entry in dated]


def file_of(folder: Path, run: str, file: str) -> Path | None:
    """Return the path of a file that may be shown, None if there is none or it may not be."""
    path = folder / run / file
    return path if may_be_shown(run, file) and path.is_file() and not path.is_symlink() else None


def _run(folder: Path, when: float) -> Run:
    size = sum(bag.stat().st_size for bag in folder.glob("*.bag") if bag.is_file())
    has_report = (folder / REPORT).is_file()
    clock = datetime.fromtimestamp(when).strftime("%Y-%m-%d %H:%M")
    return Run(
        folder.name,
        clock,
        size_text(size) if size else "no bag",
        _verdict(folder) if has_report else "",
        has_report,
    )


def _verdict(folder: Path) -> str:
    try:
        return verdict(json.loads((folder / "report.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, AttributeError):
        return ""
