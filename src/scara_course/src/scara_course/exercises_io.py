"""The folders of the exercises, and what a learner gets and hands in."""

from __future__ import annotations

import hashlib
import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scara_config import ConfigError, Robot, load
from scara_config.files.whole_file import write_whole
from scara_config.loader import load_text, package_folder

from scara_course.exercise import Exercise, ExerciseTask
from scara_course.marking import Table

ANSWERS, CARD = "answers.yaml", "card.md"


def exercises_folder() -> Path:
    """Return the folder of all exercises.

    Raises:
        ConfigError: ROS cannot find this package.
    """
    return package_folder("scara_course") / "exercises"


def load_exercises(folder: Path | None = None) -> list[Exercise]:
    """Return all exercises, in the order of their numbers.

    Raises:
        ConfigError: A file is missing or wrong, or two have one number.
    """
    found = [
        Exercise(
            path.parent.name,
            load(path, ExerciseTask),
            load_text(path.with_name(CARD)),
            _check(path),
        )
        for path in sorted((folder or exercises_folder()).glob("*/task.yaml"))
    ]
    found.sort(key=lambda each: each.task.number)
    for number, each in enumerate(found, 1):
        if each.task.number != number:
            raise ConfigError(f"{each.name}/task.yaml: number = {each.task.number}, not {number}")
    return found


def _check(task: Path) -> object:
    """Return the module check.py beside a task.yaml."""
    path = task.with_name("check.py")
    # A name of its own: the modules of all exercises are called check.
    spec = importlib.util.spec_from_file_location(f"scara_course_{task.parent.name}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ConfigError(f"{path}: there is no such module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def draw(exercise: Exercise, learner: str) -> Table:
    """Return a learner's numbers: the same on every machine; empty if there are none."""
    if not hasattr(exercise.check, "draw"):
        return {}
    # Not by hash(): Python salts it anew in each process.
    words = hashlib.sha256(f"{exercise.name}/{learner}".encode()).digest()
    drawn: Table = exercise.check.draw(np.random.default_rng(list(words)))
    return drawn


def start(exercise: Exercise, learner: str, robot: Robot, folder: Path, anew: bool) -> list[Path]:
    """Lay out what a learner needs; return the files that were written.

    Args:
        exercise: Which one.
        learner: For whom.
        robot: Whose lengths and limits count.
        folder: Of this learner's exercise.
        anew: Write a file of answers that is there again, empty.

    Raises:
        OSError: It cannot be written.
    """
    given = draw(exercise, learner)
    texts = {CARD: exercise.card}
    if hasattr(exercise.check, "material"):
        texts |= exercise.check.material(given, robot)
    # What a learner has written is kept, unless somebody asks for an empty file.
    if given and (anew or not (folder / ANSWERS).exists()):
        texts[ANSWERS] = exercise.answers_file(learner, given, robot)
    for name, text in texts.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
    return [folder / name for name in texts]


def digest_of(files: Sequence[Path]) -> str:
    """Return the SHA-256 over files, one after the other, in hexadecimal.

    Raises:
        OSError: One cannot be read.
    """
    digest = hashlib.sha256()
    for path in files:
        with path.open("rb") as stream:
            # In blocks: a recording may be larger than the memory.
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
