"""The recordings that somebody looks back to: each read once, by a program of low priority."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import time
from pathlib import Path

import msgspec
from scara_ros.shell.program_io import command_of

from operator_panel.link.reporter_io import be_nice
from operator_panel.retelling.lines import LENGTH, unpacked
from operator_panel.retelling.recorded_past import RecordedLook, RecordedPast
from operator_panel.retelling.run_folders_io import RunFolderError, bag_of
from operator_panel.view.frame import FrameMaker

KEPT = 3
"""Recordings that are held at most; our choice: three operators at a desk."""
TURN = 50
"""Lines that are taken before others get their turn; our choice: a millisecond."""
PATIENCE_S = 1.0  # our choice: how long a first question waits; then the page asks again


class _Reading:
    """One recording and the program that reads it."""

    def __init__(self, bag: Path, past: RecordedPast) -> None:
        """Begin when :meth:`run` is awaited, by ``task``."""
        self.task: asyncio.Task[None] | None = None
        self.bag, self.past = bag, past
        # One that was written to since is another recording, and read anew.
        self.written = bag.stat().st_mtime_ns
        self.asked = time.monotonic()
        self.failure = ""
        self.ended = False
        # Another recording has taken its place; its program may not even have begun then.
        self.dropped = False
        # Set once there is something to look at, or once nothing will come.
        self.first = asyncio.Event()
        self._process: asyncio.subprocess.Process | None = None

    def is_of(self, bag: Path) -> bool:
        """Return whether the bag is still the one that is read."""
        return bag == self.bag and bag.stat().st_mtime_ns == self.written

    async def run(self, config_dir: Path) -> None:
        """Read to the end; what goes wrong is kept in ``failure``."""
        try:
            await self._read(config_dir)
        except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
            self.failure = f"the recording cannot be read: {error}"
        finally:
            self.ended = True
            self.first.set()
            self.stop()

    async def _read(self, config_dir: Path) -> None:
        command = (*command_of("operator_panel", "retell", os.environ), str(self.bag))
        self._process = process = await asyncio.create_subprocess_exec(
            *command,
            "--config-dir",
            str(config_dir),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            preexec_fn=be_nice,
            start_new_session=True,
        )
        assert process.stdout is not None and process.stderr is not None
        if self.dropped:
            self.stop()
        # Read beside it: who complains at length into a full pipe would stand still.
        said = asyncio.ensure_future(process.stderr.read())
        try:
            # Take all lines; where many have come at once, others get their turn too
            count = 0
            while True:
                size = int.from_bytes(await process.stdout.readexactly(LENGTH), "big")
                self.past.take(unpacked(await process.stdout.readexactly(size)))
                count += 1
                if count % TURN == 0:
                    self.first.set()
                    await asyncio.sleep(0)
        except asyncio.IncompleteReadError:
            await process.wait()  # it has told all, or says why not
        finally:
            self.stop()
            await process.wait()
            lines = (await said).decode(errors="replace").strip().splitlines()
        if process.returncode:
            self.failure = lines[-1] if lines else f"retell: exit code {process.returncode}"

    def stop(self) -> None:
        """End the program if it runs."""
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)


class Recordings:
    """Answers what the page would have shown at a moment of a recording."""

    def __init__(
        self, folder: Path, config_dir: Path, robot: str, maker: FrameMaker, window_s: float
    ) -> None:
        """Hold nothing yet.

        Args:
            folder: Of the runs.
            config_dir: Configuration of the page.
            robot: Name of the robot that the page can show.
            maker: Makes its frames.
            window_s: So far back the charts look [s].
        """
        self._folder, self._config_dir = folder, config_dir
        self._robot, self._maker, self._window_s = robot, maker, window_s
        self._held: dict[str, _Reading] = {}

    async def look(self, run: str, at: float) -> RecordedLook | None:
        """Return a moment; None while none has been read yet: ask again.

        Raises:
            RunFolderError: There is no such recording, it is of another robot, or cannot be read.
        """
        reading = await self._reading(run)
        reading.asked = time.monotonic()
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(reading.first.wait(), PATIENCE_S)
        if reading.task is not None and reading.task.done():
            reading.task.result()  # what nobody has foreseen is no silence
        if reading.dropped:
            return None
        if reading.failure:
            # Forgotten, so that whoever asks next has it tried again; another page, that waits for
            # this one too, may have done so.
            if self._held.get(run) is reading:
                del self._held[run]
            raise RunFolderError(f"{run}: {reading.failure}")
        head = reading.past.head
        if head is not None and head.robot not in ("", self._robot):
            raise RunFolderError(
                f"{run} was recorded with {head.robot}, and this page shows {self._robot}: start "
                f"it with SCARA_ROBOT={head.robot}"
            )
        found = reading.past.look(at, self._window_s)
        if found is None and reading.ended:
            raise RunFolderError(f"{run} holds nothing that a page shows")
        return found

    async def _reading(self, run: str) -> _Reading:
        """Return the recording; one that is not held is begun, and the least asked for goes."""
        bag = await asyncio.to_thread(bag_of, self._folder, run)
        held = self._held.get(run)
        try:
            if held is not None and held.is_of(bag):
                return held
        except OSError as error:
            raise RunFolderError(f"{run} cannot be read: {error.strerror}") from error
        if held is not None:
            self._forget(run)
        while len(self._held) >= KEPT:
            self._forget(min(self._held, key=lambda name: self._held[name].asked))
        made = self._held[run] = _Reading(bag, RecordedPast(run, self._maker))
        made.task = asyncio.create_task(made.run(self._config_dir), name=f"retell {run}")
        return made

    def _forget(self, run: str) -> None:
        reading = self._held.pop(run)
        reading.dropped = True
        reading.stop()

    def close(self) -> None:
        """End what is being read."""
        for run in tuple(self._held):
            self._forget(run)
