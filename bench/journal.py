"""What a campaign has measured so far, written at once, so that one that was ended can go on."""

from __future__ import annotations

import json
import subprocess
from collections import defaultdict
from pathlib import Path
from typing import Any

from harness.faults.rows import Row

from bench.record import or_infinite

NAME = "scenarios.jsonl"
MEASURED = ("bench", "config", "src", "tests/harness")
"""What a figure depends on: the product, and what measures it."""


class JournalError(RuntimeError):
    """A campaign cannot be continued; the text says why."""


class Journal:
    """The entries of a campaign.

    One JSON object a line, in the order in which the scenarios ended.
    """

    def __init__(self, folder: Path, root: Path) -> None:
        """Read what ``folder`` holds; begin anew if it holds nothing.

        Args:
            folder: Of the campaign.
            root: Of the project, a git repository.

        Raises:
            JournalError: Its entries were measured on other files than those that are there now, or
                this is no git repository.
        """
        self._path = folder / NAME
        self._known: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
        commit = folder / "commit.txt"
        if not self._path.exists():
            commit.write_text(_git(root, "rev-parse", "HEAD"), encoding="ascii")
            return
        changed = _git(
            root, "diff", "--stat", commit.read_text(encoding="ascii").strip(), "--", *MEASURED
        )
        if changed:
            raise JournalError(
                f"{folder}: what was measured there has changed since, begin a new "
                f"campaign:\n{changed}"
            )
        text = self._path.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]  # the campaign may have been killed while it wrote
        self._path.write_text(whole, encoding="utf-8")
        for line in whole.splitlines():
            entry = json.loads(line)
            self._known[entry["scenario"]].append(entry)

    def take(self, scenario: str) -> tuple[list[Row], float, list[str]] | None:
        """Return rows, seconds and repeats of the next known run of a scenario.

        None if it is still to be run.
        """
        if not self._known[scenario]:
            return None
        entry = self._known[scenario].pop(0)
        return [_row(record) for record in entry["rows"]], entry["seconds"], entry["repeated"]

    def add(self, scenario: str, rows: list[Row], seconds: float, missed: list[str]) -> None:
        """Append what a scenario has measured.

        What was missed each time that it had to be repeated is kept too.
        """
        entry = {"scenario": scenario, "seconds": round(seconds, 1), "repeated": missed}
        with self._path.open("a", encoding="utf-8") as journal:
            journal.write(json.dumps({**entry, "rows": [row.record() for row in rows]}) + "\n")


def unfinished(runs: Path) -> Path:
    """Return the newest campaign below ``runs`` that was ended before its table.

    Raises:
        JournalError: There is none.
    """
    found = [
        path.parent
        for path in sorted(runs.glob(f"*/{NAME}"))
        if not (path.parent / "bench.json").exists()
    ]
    if not found:
        raise JournalError(f"{runs}: no campaign to be continued")
    return found[-1]


def _row(record: dict[str, Any]) -> Row:
    """Return the row of a record, whose infinite figure is null."""
    fields = {key: value for key, value in record.items() if key != "holds"}
    return Row(**{**fields, "measured": or_infinite(record["measured"])})


def _git(root: Path, *words: str) -> str:
    try:
        return subprocess.run(
            ["git", "-C", str(root), *words], check=True, capture_output=True, text=True
        ).stdout
    except subprocess.CalledProcessError as error:
        raise JournalError(
            f"git {words[0]} in {root}: {error.stderr.strip()}: a campaign notes which "
            "version it measured"
        ) from error
