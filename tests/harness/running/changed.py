"""Which tests a change can reach, by the declared arrows.

Usage: python -m harness.running.changed [COMMIT], from tests/. It prints one path a line: what the
files reach that differ from COMMIT. Without one, what is not committed yet; if that is nothing,
the last commit.

``./cell test --changed`` runs these, and whatever has changed contract, golden, all unit tests that
compute quickly and ``LIVE_CORE``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from harness.running.lanes import SLOW, STARTS, TIMED, part_of
from harness.running.rooms import ROOMS
from harness.workspace import ROOT

LIVE_CORE = ("tests/system/operation/test_cell.py", "tests/system/faults/test_stops.py")
"""What is run live whatever has changed: a cell that moves and stops, and stops under faults."""
IN_VIRTUAL_TIME = {"scara_control", "scara_simulation", "fanuc_emulator", "twin_controller"}
"""What tests/virtual_time puts together."""
BESIDE = {
    "camera": "scara_simulation",
    "test_emulator.py": "fanuc_emulator",
    "test_kinematics_server.py": "scara_control",
    "test_motion_nodes.py": "scara_control",
    "test_trajectory_server.py": "scara_control",
    "test_simulator.py": "scara_simulation",
    "test_tuning.py": "scara_simulation",
    "test_run_experiment.py": "twin_experiments",
    "test_epochs.py": "twin_controller",
    "test_health_watch.py": "twin_analysis",
    "test_wrong_values.py": "twin_controller",
}
"""Tests of tests/ros that are in no folder with the name of their room."""
NO_TESTS = ("docs/", "examples/", "README.md", "CHANGELOG.md", "CONTRIBUTING.md")
"""What contract tests hold, and nothing else."""
OF_ALL_TESTS = ("tests/conftest.py", "tests/harness/running/", "tests/harness/workspace.py")
"""What runs the tests: a change of it can reach each."""


class GitError(RuntimeError):
    """Git does not know what has changed; the text says why."""


def reached(rooms: Iterable[str]) -> set[str]:
    """Return rooms and all that stand on them."""
    found = set(rooms)
    while more := {room for room, below in ROOMS.items() if below & found} - found:
        found |= more
    return found


def room_of(file: str) -> str:
    """Return the room of a file of the product or of its tests; empty if it is of none."""
    first, *rest = file.split("/")
    if first == "config":
        return "scara_config"
    place = {"src": 0, "tests": 1}.get(first)
    name = rest[place] if place is not None and len(rest) > place + 1 else ""
    return name if name in ROOMS else ""


def reached_by(files: Iterable[str]) -> list[str]:
    """Return the tests that a change of these files can reach, beside those that always run.

    Slow unit tests of each room that is reached; of a room that has changed itself those too that
    wait for time or for others, its nodes; of the harness what uses it; all where the build has
    changed, or what runs the tests.

    Args:
        files: Their paths from the root of the project.
    """
    files = [file for file in files if not file.startswith(NO_TESTS)]
    own = {file for file in files if Path(file).name.startswith("test_")}
    product = {file for file in files if not file.startswith("tests/")}
    changed = {room_of(file) for file in product} - {""}
    if any(not room_of(file) and not file.startswith(("bench/", "setup/")) for file in product):
        changed = set(ROOMS)
    beneath = {file for file in files if file.startswith("tests/")} - own
    if any(file.startswith(OF_ALL_TESTS) for file in beneath):
        changed, beneath = set(ROOMS), set()
    rooms = reached(changed)
    found = {f"tests/unit/{part}" for part in SLOW if part.split("/")[0] in rooms}
    if rooms & IN_VIRTUAL_TIME:
        found.add("tests/virtual_time")
    found |= {f"tests/ros/{room}" for room in changed}
    beside = {file.split("/")[0] for file in product} & {"bench", "setup"}
    beside |= {"setup"} if "cell" in product else set()
    found |= {path for path in STARTS + TIMED if path.split("/")[2] in changed | beside}
    found |= {f"tests/ros/{name}" for name, room in BESIDE.items() if room in changed}
    found = {test for path in found for test in _files(path)}
    found |= {test for test in users_of(beneath) if _is_chosen(test)}
    found = {test for test in found if part_of(test) != "pages"}
    return sorted(found | {file for file in own if (ROOT / file).is_file()})


def _is_chosen(test: str) -> bool:
    """Return whether a test runs only where a change can reach it, and is no whole cell."""
    slow = test.startswith(tuple(f"tests/unit/{part}" for part in SLOW))
    return slow or test.startswith("tests/virtual_time/") or part_of(test) in ("nodes", "starts")


def users_of(files: Iterable[str]) -> set[str]:
    """Return the tests that use files of ``tests``, by as many steps as it takes.

    A file uses a module that it imports, and any file whose name it says; a conftest is used by the
    tests of its folder.
    """
    texts = {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in (ROOT / "tests").rglob("*.py")
    }
    found = waiting = set(files)
    while waiting:
        waiting = {user for user in texts for file in waiting if _uses(user, texts[user], file)}
        waiting -= found
        found = found | waiting
    return {file for file in found if Path(file).name.startswith("test_") and file in texts}


def _uses(user: str, text: str, file: str) -> bool:
    path = Path(file)
    if path.name == "conftest.py":
        return user.startswith(f"{path.parent.as_posix()}/")
    if path.stem not in text:
        return False
    package = ".".join(path.parent.parts[1:])
    taken = rf"from {re.escape(package)} import (?:\([^)]*|.*)\b{path.stem}\b"
    module = rf"\b{re.escape(f'{package}.{path.stem}')}\b"
    return f'"{path.name}"' in text or bool(re.search(f"{module}|{taken}", text))


def _files(path: str) -> list[str]:
    """Return the files of tests at a path, which may be a folder or not be there."""
    place = ROOT / path
    if place.is_file():
        return [path]
    return [file.relative_to(ROOT).as_posix() for file in sorted(place.rglob("test_*.py"))]


def changed_files(commit: str = "") -> list[str]:
    """Return the files that differ from a commit, new ones included.

    Raises:
        GitError: There is no such commit, or this is no clone.
    """
    new = _git("ls-files", "--others", "--exclude-standard")
    found = _git("diff", "--name-only", commit or "HEAD") + new
    return found or ([] if commit else _git("diff", "--name-only", "HEAD^"))


def _git(*words: str) -> list[str]:
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)
    if done.returncode:
        raise GitError(done.stderr.strip())
    return done.stdout.splitlines()


def main(words: list[str]) -> int:
    """Print the tests."""
    try:
        files = changed_files(*words[:1])
    except GitError as error:
        print(f"cell: what has changed? {error}", file=sys.stderr)
        return 2
    print("\n".join(reached_by(files)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
