"""What learners have passed comes into the journal: the course's file of results, line by line.

The course needs no running cell, so its results lie in a file; whoever runs a cell beside it takes
what is new. How far that has come is kept only after the entries were written: a cell that is
killed meanwhile tells some again, with the same signature, and loses none.
"""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path

import msgspec
from scara_config.files.whole_file import write_whole

from cell_recorder.journal.entries import CourseResult, ExerciseMarked

RESULTS = "course/results.jsonl"
"""In the runs folder, as the course writes it."""
STARTED = "started.json"
"""Beside it, in each learner's folder."""
_LOG = logging.getLogger("rosout.course_results")


def signed_results(text: bytes) -> list[CourseResult]:
    """Return the lines of the file of results.

    Raises:
        msgspec.DecodeError: One is none, or nobody has signed it.
        UnicodeDecodeError: One is no text.
    """
    lines = [msgspec.json.decode(row, type=CourseResult) for row in text.splitlines()]
    if not all(line.signature for line in lines):
        raise msgspec.ValidationError("a line has no signature")
    return lines


class CourseResults:
    """Gives each result once."""

    def __init__(self, runs: Path, cell: str) -> None:
        """Look into ``runs``; ``cell`` is the journal's."""
        self._file = runs / RESULTS
        self._mark = self._file.with_name(f".told_{cell.replace('/', '_')}")
        self._seen_ns, self._taken, self._kept = 0, 0, 0
        # Nothing was told yet, or nobody knows: the signatures tell what came twice.
        with contextlib.suppress(OSError, ValueError):
            self._taken = self._kept = int(self._mark.read_text())

    def look(self, all_written: bool) -> list[ExerciseMarked]:
        """Return what is new.

        Args:
            all_written: Whether all entries that were given before are on the disk.
        """
        try:
            if all_written and self._kept != self._taken:
                write_whole(self._mark, str(self._taken).encode())
                self._kept = self._taken
            changed_ns = self._file.stat().st_mtime_ns
            if changed_ns == self._seen_ns:
                return []
            self._seen_ns = changed_ns
            lines = signed_results(self._file.read_bytes())
        except FileNotFoundError:
            return []
        except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
            _LOG.warning("%s: results are not told: %s", self._file, error)
            return []
        # The file was begun anew.
        if lines and lines[-1].number < self._taken:
            self._taken = 0
        new = [line for line in lines if line.number > self._taken]
        self._taken = max((line.number for line in new), default=self._taken)
        return [
            ExerciseMarked(
                marked=line.time,
                learner=line.learner,
                exercise=line.exercise,
                title=line.title,
                passed=line.passed,
                reason=line.reason,
                digest=line.digest,
                signature=line.signature,
            )
            for line in new
        ]
