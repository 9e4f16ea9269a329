"""Jobs that go to other machines with their files, and how a worker does one."""

from __future__ import annotations

import os
import tempfile
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from distributed import Client, Worker, get_worker

from farm.lab.io.carried.exchange import bring, fetch
from farm.lab.io.carried.parcel import (
    SETTINGS,
    Answer,
    Packer,
    Parcel,
    as_there,
    put_down,
    unpacked,
    written,
)
from farm.lab.io.carried.store import MOST_BYTES, Store
from farm.lab.io.carried.version import Version, refusal, version_of
from farm.lab.io.running import LabError, Processes, Result, perform, program_of, root
from farm.lab.plan import Job

FILES = Path("runs", "lab", "files")
"""Where a machine of the lab keeps files that came from others, within the project."""
TRIES = 2
"""How often a file is fetched that went again before it was used."""


class Parcels:
    """To workers of other machines: files go before, by way of the scheduler."""

    def __init__(self, version: Version, say: Callable[[str], None]) -> None:
        """Tell workers that this machine has ``version``, and ``say`` what takes time."""
        self._packer, self._say = Packer(version), say
        self._parcels: dict[str, Parcel] = {}

    def begin(self, client: Client, jobs: Sequence[Job]) -> Callable[[bytes], bytes]:
        """Give the scheduler all files that it has not yet.

        Raises:
            LabError: A file cannot be read, they are too large, or cannot be kept there.
        """
        self._parcels = {job.name: self._packer.pack(job) for job in jobs}
        files = self._packer.files
        try:
            held = sum(file.stat().st_size for file in files.values())
            if held > MOST_BYTES:
                raise LabError(
                    f"{len(files)} files of together {held / 1e6:.0f} MB: allowed are "
                    f"{MOST_BYTES / 1e6:.0f} MB: name fewer recordings at a time"
                )
            if files:
                self._say(f"{len(files)} files of together {held / 1e6:.1f} MB go to the scheduler")
            for digest, file in files.items():
                bring(client, digest, file, uuid.uuid4().hex)
        except OSError as error:
            why = error.strerror or str(error)
            raise LabError(f"files cannot be given to the scheduler: {why}") from error
        return do_parcel

    def sent(self, job: Job) -> bytes:
        """Return it with its files' digests, as JSON."""
        return msgspec.json.encode(self._parcels[job.name])

    def came(self, job: Job, answer: bytes) -> Result:
        """Return its result, and write its files.

        Raises:
            LabError: The worker refused it.
            OSError: A file cannot be written.
        """
        came = msgspec.json.decode(answer, type=Answer)
        if came.result is None:
            raise LabError(came.refused or "a worker sent no result")
        put_down(came, self._parcels[job.name])
        return came.result


def do_parcel(parcel: bytes) -> bytes:
    """Run a job where a worker is, with files of another machine; both as JSON."""
    asked = msgspec.json.decode(parcel, type=Parcel)
    worker = get_worker()
    try:
        why = refusal(version_of(root()), asked.version, "the lab that asks")
        if why:
            raise LabError(why)
        answer = _done(asked, worker)
    except (LabError, OSError) as error:
        answer = Answer(refused=f"worker {worker.address}: {error}")
    return msgspec.json.encode(answer)


def _done(parcel: Parcel, worker: Worker) -> Answer:
    """Run a job in a folder of its own.

    Raises:
        LabError: A file cannot be had.
        OSError: The folder cannot be used, or there is no such program.
    """
    with tempfile.TemporaryDirectory(prefix="lab_") as name:
        folder = Path(name).resolve()
        job, files = unpacked(parcel, folder)
        for target, each in files.items():
            target.parent.mkdir()
            _put(worker, Store(root() / FILES), each.digest, target)
        environment = {k: v for k, v in os.environ.items() if k not in SETTINGS} | parcel.settings
        processes = Processes(environment, folder)
        command = program_of(job, root() / "devel")
        result = perform(job, command, processes, lambda text: as_there(text, files))
        return Answer(msgspec.structs.replace(result, words=parcel.job.words), written(job, files))


def _put(worker: Worker, store: Store, digest: str, target: Path) -> None:
    """Put a file where a job finds it.

    Raises:
        LabError: The scheduler has it no more, or it goes again at once.
        OSError: It cannot be kept.
    """
    for _ in range(TRIES):
        if store.copy(digest, target):
            return
        fetch(worker, store, digest)
    if not store.copy(digest, target):
        raise LabError(f"the file {digest} goes as soon as it comes: {FILES} is full")
