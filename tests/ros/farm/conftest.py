"""Programs of one farm, and its desk's page in a browser."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import Process, Stage, free_port, wait_until
from harness.workspace import ROOT, workspace_environment

TOKEN = "token-of-the-farms-page"
DEADLINE_S = 30.0
START_S = 90.0
"""A start is no timed test: alone it takes 1.5 s."""


class Farm:
    """Starts programs of one farm."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "farm"
        self.stage = Stage(
            folder / "processes", {**workspace_environment(), "FARM_DESK_TOKEN": TOKEN}
        )
        self._router, self.port = str(free_port()), free_port()

    @property
    def address(self) -> str:
        """Of the desk's page, without its token."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def opened(self) -> str:
        """What a person opens."""
        return f"{self.address}/?token={TOKEN}"

    def start(self, *words: str) -> Process:
        """Start a program of the farm, or of the bench."""
        words = (sys.executable, "-m", *words, "--router-port", self._router)
        return self.stage.start(*words, cwd=ROOT)

    def desk(self) -> Process:
        """Start the desk, and wait until its page can be opened."""
        where = ("--folder", str(self.folder), "--port", str(self.port))
        desk = self.start("farm", "--person", "ann", *where)
        wait_until(lambda: "?token=" in desk.output, START_S, "the page's address")
        return desk


@pytest.fixture
def farm(tmp_path: Path) -> Iterator[Farm]:
    """Give a test a farm; all of it is ended."""
    made = Farm(tmp_path)
    yield made
    made.stage.close()
