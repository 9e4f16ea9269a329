"""Which commit a figure is of: whether the history has it, and how much has changed since."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from bench.rows import GROUPS

OLD = 30
"""A figure is old when its room has had more commits since."""
GIT_S = 10.0
CONTROL, SIMULATION = "src/scara_control", "src/scara_simulation"
WHOLE = ("config", "src")
ROOMS: dict[str, tuple[str, ...]] = {
    "kinematics": (CONTROL,),
    "tracking": (CONTROL, SIMULATION),
    "simulation": (SIMULATION,),
    "wires": ("src/fanuc_emulator", "src/twin_controller"),
    "ros": (CONTROL, "src/rosbridge_gateway"),
    "oracles": (CONTROL,),
    "recording": ("src/cell_recorder", "src/twin_experiments"),
    "what_if": ("src/what_if", SIMULATION, CONTROL),
    "farm": ("src/farm",),
    "health": ("src/twin_analysis", "src/fanuc_emulator"),
    "first_start": ("setup",),
}
"""What a group of figures depends on; the others depend on the whole product."""


def figures(content: Mapping[str, Any]) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield name, commit and rooms of all that results.json holds.

    Args:
        content: As in results.json.
    """
    group_of = {row: group for group, rows in GROUPS.items() for row in rows}
    for row in content.get("rows", ()):
        group = group_of.get(row["id"], "")
        yield row["id"], row.get("commit", ""), ROOMS.get(group, WHOLE)
    in_parts = [(kind, "part") for kind in ("what_if", "farm", "health")]
    for kind, key in (("demos", "series"), *in_parts):
        for entry in content.get(kind, ()):
            yield f"{kind} {entry[key]}", entry["commit"], ROOMS.get(kind, WHOLE)
    for kind in ("plants", "draws", "scaras", "first_start"):
        if kind in content:
            yield kind, content[kind]["commit"], ROOMS.get(kind, WHOLE)


def in_doubt(content: Mapping[str, Any], root: Path, limit: int = OLD) -> dict[str, str]:
    """Return the figures that nobody can be sure of any more, each with the reason.

    Args:
        content: As in results.json.
        root: Of the project, a git repository with its whole history.
        limit: So many commits of its rooms a figure may be behind.
    """
    asked = cache(lambda commit, rooms: reason(commit, rooms, root, limit))
    told = {name: asked(commit, rooms) for name, commit, rooms in figures(content)}
    return {name: why for name, why in told.items() if why}


def reason(commit: str, rooms: tuple[str, ...], root: Path, limit: int) -> str:
    """Say why a figure of a commit is in doubt; empty if it is not."""
    if not commit:
        return "of no commit"
    if commit.endswith("+"):
        return f"of files that differed from commit {commit[:-1]}"
    if git(root, "merge-base", "--is-ancestor", commit, "HEAD") is None:
        return f"of commit {commit}, which is not in the history"
    behind = int(git(root, "rev-list", "--count", f"{commit}..HEAD", "--", *rooms) or 0)
    if behind <= limit:
        return ""
    return f"old: {', '.join(rooms)} changed in more than {limit} commits since {commit}"


def is_whole(root: Path) -> bool:
    """Return whether this is a clone with its whole history."""
    return git(root, "rev-parse", "--is-shallow-repository") == "false"


def changed_files(root: Path) -> set[Path]:
    """Return the files that git knows and that differ from the commit; none outside a clone."""
    names = git(root, "diff", "--name-only", "HEAD") or ""
    return {root / line for line in names.splitlines()}


def git(root: Path, *words: str) -> str | None:
    """Return what git says, None if it fails."""
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *words], capture_output=True, text=True, timeout=GIT_S
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
