"""What became of mutants before, so that a run that was ended can go on."""

from __future__ import annotations

import hashlib
from pathlib import Path

import msgspec

from harness.mutants.trial import Verdict
from harness.workspace import ROOT

FILE = ROOT / "build" / "mutants.jsonl"


class Entry(msgspec.Struct, frozen=True):
    """One mutant's verdict; ``mutant`` is the digest of the module's whole text with its fault."""

    mutant: str
    verdict: Verdict


class Record:
    """A file that grows by a line with each verdict."""

    def __init__(self, file: Path, go_on: bool) -> None:
        """Read what is there, or begin anew.

        Args:
            file: Its folder is made.
            go_on: Keep what the file holds. A verdict counts for the same text of the module only;
                tests that have changed since are not noticed.
        """
        self._file, self._known = file, dict[str, Verdict]()
        file.parent.mkdir(parents=True, exist_ok=True)
        if not go_on:
            file.write_bytes(b"")
        elif file.exists():
            # A run that was killed may have left half a line at the end.
            lines = file.read_bytes().split(b"\n")[:-1]
            entries = [msgspec.json.decode(line, type=Entry) for line in lines]
            self._known = {entry.mutant: entry.verdict for entry in entries}
            file.write_bytes(b"".join(line + b"\n" for line in lines))

    def known(self, path: str, source: str) -> Verdict | None:
        """Return the verdict on this text of a module in the run before, None without one."""
        return self._known.get(_digest(path, source))

    def add(self, path: str, source: str, verdict: Verdict) -> None:
        """Note a verdict at once."""
        with self._file.open("ab") as file:
            file.write(msgspec.json.encode(Entry(_digest(path, source), verdict)) + b"\n")


def _digest(path: str, source: str) -> str:
    return hashlib.sha256(f"{path}\n{source}".encode()).hexdigest()
