"""What rows share: folder, console, peers that are installed once, cells that several rows look at."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console
from scara_config import Robot, load_robot

from bench.peers.install import install

T = TypeVar("T")


class Room:
    """One run of the bench.

    Attributes:
        folder: For logs, bags and what else the rows leave.
        console: For progress.
        robot: robot.yaml of the workspace.
    """

    def __init__(self, folder: Path, console: Console) -> None:
        self.folder, self.console = folder, console
        self.robot: Robot = load_robot()
        self._kept: dict[str, Any] = {}

    @functools.cached_property
    def peers(self) -> str:
        """Install the peers; return what is missing, empty when all is there."""
        return install(self.console, self.folder / "peers.log")

    def say(self, text: str) -> None:
        """Tell the user what takes time."""
        self.console.print(f"    {text}", markup=False, highlight=False)

    def once(self, key: str, make: Callable[[], T]) -> T:
        """Return what ``make`` returned the first time; a failure is kept too and raised again."""
        if key not in self._kept:
            try:
                self._kept[key] = make()
            except Exception as error:
                self._kept[key] = error
        kept = self._kept[key]
        if isinstance(kept, Exception):
            raise RuntimeError(str(kept)) from kept
        value: T = kept
        return value

    def place(self, name: str) -> Path:
        """Return a new folder for a row's files."""
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        return folder
