"""A job with all that it needs on another machine, and what comes back.

A file is a word of a job. It travels by its content and lies in a folder of the job's own there, so
in what the job says that folder is named as the one here: results are the same, sign for sign.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import msgspec
from scara_config.profile import CHOICE, PLANT_CHOICE

from farm.lab.io.carried.store import digest_of
from farm.lab.io.carried.version import Version
from farm.lab.io.running import LabError, Result
from farm.lab.plan import OF_BAGS, Job

SETTINGS = (CHOICE, PLANT_CHOICE)
"""Of the environment, what decides what a job computes."""
WRITTEN = {"report": (".html", ".json", ".png")}
"""Kinds that write files beside their recording, and which: nothing else is taken from a worker."""


class Input(msgspec.Struct, frozen=True):
    """A file of a job.

    Attributes:
        place: Which of the job's words it is.
        folder: Where it is on the asking machine.
        name: Its name there.
        digest: sha256.
    """

    place: int
    folder: str
    name: str
    digest: str


class Parcel(msgspec.Struct, frozen=True):
    """A job for another machine.

    Attributes:
        job: It.
        inputs: Its files.
        version: Of the asking machine.
        settings: See :data:`SETTINGS`; those that are set.
    """

    job: Job
    inputs: tuple[Input, ...]
    version: Version
    settings: dict[str, str]


class Written(msgspec.Struct, frozen=True):
    """A file that a job wrote beside its recording."""

    name: str
    content: bytes


class Answer(msgspec.Struct, frozen=True):
    """What comes back: a result with the files that belong to it, or why there is none."""

    result: Result | None = None
    files: tuple[Written, ...] = ()
    refused: str = ""


class Packer:
    """Makes parcels; each file is read once, however many jobs have it."""

    def __init__(self, version: Version) -> None:
        """Say that this machine has ``version``."""
        self._version = version
        self._digests: dict[Path, str] = {}
        self._settings = {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}

    def pack(self, job: Job) -> Parcel:
        """Return a job with its files.

        Raises:
            LabError: A file cannot be read.
        """
        inputs = []
        for place, word in enumerate(job.words):
            file = Path(word)
            if place == 0 and (job.kind in OF_BAGS or file.is_file()):
                inputs.append(self._input(place, file))
        return Parcel(job, tuple(inputs), self._version, self._settings)

    @property
    def files(self) -> dict[str, Path]:
        """Where the files of all parcels are, by their digests."""
        return {digest: file for file, digest in self._digests.items()}

    def _input(self, place: int, file: Path) -> Input:
        try:
            if file not in self._digests:
                self._digests[file] = digest_of(file)
        except OSError as error:
            raise LabError(f"{file}: {error.strerror}") from error
        return Input(place, str(file.parent), file.name, self._digests[file])


def unpacked(parcel: Parcel, folder: Path) -> tuple[Job, dict[Path, Input]]:
    """Return a job with the words that it has on this machine, and where its files belong.

    Args:
        parcel: It.
        folder: Of the job alone.

    Raises:
        LabError: A file's name leads elsewhere.
    """
    words, files = list(parcel.job.words), {}
    for each in parcel.inputs:
        if each.name != Path(each.name).name or each.name in ("", ".", ".."):
            raise LabError(f"{each.name!r}: is no name of a file")
        target = folder / str(each.place) / each.name
        files[target] = each
        words[each.place] = str(target)
    return msgspec.structs.replace(parcel.job, words=tuple(words)), files


def as_there(text: str, files: dict[Path, Input]) -> str:
    """Return a job's text with its folders named as on the asking machine."""
    for target, each in files.items():
        there, here = Path(each.folder), target.parent
        if there.is_absolute():
            text = text.replace(here.as_uri(), there.as_uri())
        text = text.replace(str(target), str(there / each.name)).replace(str(here), str(there))
    return text


def written(job: Job, files: Iterable[Path]) -> tuple[Written, ...]:
    """Return what a job wrote beside its files, and belongs to its result.

    Raises:
        OSError: It cannot be read.
    """
    found = []
    for folder in sorted({file.parent for file in files}):
        for file in sorted(folder.iterdir()):
            if file.suffix in WRITTEN.get(job.kind, ()) and file.is_file():
                found.append(Written(file.name, file.read_bytes()))
    return tuple(found)


def put_down(answer: Answer, parcel: Parcel) -> None:
    """Write the files of a result to where the job would have written them here.

    Raises:
        LabError: One is none that such a job writes.
        OSError: One cannot be written.
    """
    allowed = WRITTEN.get(parcel.job.kind, ())
    for each in answer.files:
        if Path(each.name).name != each.name or Path(each.name).suffix not in allowed:
            raise LabError(f"{each.name!r}: a worker sent a file that no {parcel.job.kind} writes")
        (Path(parcel.inputs[0].folder) / each.name).write_bytes(each.content)
