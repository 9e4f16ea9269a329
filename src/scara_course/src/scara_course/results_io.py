"""The file of results, and its exports as CSV and as xAPI statements."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import uuid
from collections.abc import Sequence
from pathlib import Path

import msgspec
from cell_recorder.journal.entries import CourseResult
from scara_config.files.whole_file import write_whole
from scara_ros.page.page_token_io import page_token, ros_home

from scara_course.results import HOME, decode, encode, signed, statement

FILE = "results.jsonl"
KEY_VARIABLE = "SCARA_COURSE_KEY"
KEY_FILE = "course_key"


class ResultsError(RuntimeError):
    """The results cannot be read or written; the text names file and line."""


def course_key() -> str:
    """Return the key of the signatures: of the environment, else of ROS_HOME, made if missing.

    Raises:
        TokenError: It cannot be used.
    """
    return page_token(KEY_VARIABLE, ros_home() / KEY_FILE)


def read_results(folder: Path) -> list[CourseResult]:
    """Return all results, the oldest first; none without a file.

    Raises:
        ResultsError: A line is no result.
        OSError: The file cannot be read.
    """
    path, found = folder / FILE, []
    # Split as bytes: str would also split at line separators inside of a reason.
    for place, line in enumerate(path.read_bytes().splitlines() if path.exists() else (), 1):
        try:
            found.append(decode(line))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise ResultsError(f"{path}, line {place}: is no result: {error}") from error
    return found


def add_result(folder: Path, result: CourseResult, key: str) -> CourseResult:
    """Add a result whole or not at all, with its number and signature; return it so.

    Raises:
        ResultsError: A line of the file is no result.
        OSError: The file cannot be read or written; it is as it was then.
    """
    folder.mkdir(parents=True, exist_ok=True)
    # Two commands at once: the second one waits, and reads what the first one has written.
    # On a file of its own, for the results are replaced by another file each time.
    with (folder / f".{FILE}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        held = read_results(folder)
        number = max((each.number for each in held), default=0) + 1
        whole = signed(msgspec.structs.replace(result, number=number), key)
        # Not appended: a line that was cut off would make the whole file unreadable.
        write_whole(folder / FILE, b"".join(map(encode, [*held, whole])))
    return whole


def export(folder: Path, results: Sequence[CourseResult]) -> tuple[Path, Path]:
    """Write results.csv and results_xapi.json; return both paths.

    Raises:
        OSError: They cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(CourseResult.__struct_fields__)
    writer.writerows(msgspec.structs.astuple(each) for each in results)
    made = [
        statement(each, str(uuid.uuid5(uuid.NAMESPACE_URL, f"{HOME}/{each.signature}")))
        for each in results
    ]
    paths = folder / "results.csv", folder / "results_xapi.json"
    write_whole(paths[0], text.getvalue().encode())
    write_whole(paths[1], (json.dumps(made, indent=1, ensure_ascii=False) + "\n").encode())
    return paths
