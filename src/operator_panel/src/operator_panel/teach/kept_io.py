"""The draft that all pages share, kept in a file: each edit is written whole before it is shown."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from scara_config import ConfigError, Robot
from scara_config.profile import PROGRAM_ENDING
from scara_config.writer import replace_file
from scara_ros.page.page_library_io import run

from operator_panel.teach.draft import Draft, TeachError, draft_of, empty
from operator_panel.teach.history import Edits

FIRST = "TAUGHT"


class Lesson:
    """One draft for all pages. Not thread-safe: it lives in the page's event loop.

    Attributes:
        history: The draft and its past.
        trouble: Why an older draft could not be read, in the reader's words; empty: all is well.
        runner: Name of the page that runs the draft now; empty: none.
        saved: How often the draft was saved as one of the robot's programs; pages look at it.
    """

    def __init__(self, folder: Path, robot: Robot) -> None:
        """Read the draft that was written last.

        A file that cannot be read stays as it is; a new draft gets another name.

        Args:
            folder: Of the drafts of this cell; made when it is needed.
            robot: Its joints.
        """
        self._folder, self._robot = folder, robot
        self._writing = asyncio.Lock()
        self.trouble = self.runner = ""
        self.saved = 0
        files = sorted(folder.glob(f"*{PROGRAM_ENDING}"), key=lambda file: file.stat().st_mtime_ns)
        self.history = Edits(self._new(files))

    def _new(self, files: list[Path]) -> Draft:
        if files:
            try:
                return draft_of(files[-1].read_text(encoding="utf-8"), self._robot, str(files[-1]))
            except (TeachError, OSError, UnicodeDecodeError) as error:
                self.trouble = str(error)
        taken = {file.stem for file in files}
        names = (FIRST, *(f"{FIRST}_{number}" for number in range(2, len(files) + 2)))
        return empty(next(name for name in names if name not in taken), self._robot)

    @property
    def draft(self) -> Draft:
        """As it is now."""
        return self.history.draft

    @property
    def path(self) -> Path:
        """Its file."""
        return self._folder / f"{self.draft.program.name}{PROGRAM_ENDING}"

    async def edit(self, change: Callable[[Edits], Edits]) -> Edits:
        """Change the draft; it counts once its file is on the disk.

        Raises:
            TeachError: The change is refused, or cannot be written; the draft is as before.
        """
        # Two pages that edit at once would start from one draft, and one edit would be lost.
        async with self._writing:
            made = change(self.history)
            try:
                await run.io_bound(self._write, made.draft)
            except ConfigError as error:
                raise TeachError(f"not kept: {error}") from error
            self.history, self.trouble = made, ""
            return made

    def _write(self, draft: Draft) -> None:
        path = self._folder / f"{draft.program.name}{PROGRAM_ENDING}"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if path != self.path and path.exists():
                # Another draft had this name: it is not lost, nor is one before that.
                number, before = 1, path.with_name(f"{path.name}.before")
                while before.exists():
                    number += 1
                    before = path.with_name(f"{path.name}.before_{number}")
                path.replace(before)
        except OSError as error:
            raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error
        replace_file(path, draft.text)
