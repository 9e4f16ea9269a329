"""A project of its own for a lab, whose judge is a few lines; one for each machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import farm.desk.lines.machines_io  # noqa: F401  it adds its words
from farm.desk.command_line_io import app as farm_words
from farm.lab.command_line_io import app as lab_words
from typer.testing import CliRunner

from harness.processes import Process, Stage, free_port, wait_until
from harness.workspace import ROOT, workspace_environment

BUILT = ("devel", "src", "config", "setup")
HOST = "127.0.0.1"
DEADLINE_S = 60.0
JOBS = 6
WORDS = ("judge", "0.5,0.1,0.1", "--variations", str(JOBS), "--seed", "3")
STEADY = "print(sys.argv[1:], sum(map(ord, sys.argv[1])) / 7)"


class Lab:
    """A project of its own, whose judge is a few lines, or the built one's by links."""

    def __init__(self, folder: Path, *, built: bool = False) -> None:
        self.folder = folder
        self.program = folder / "devel" / "lib" / "what_if" / "judge"
        if built:
            folder.mkdir()
            for name in BUILT:
                (folder / name).symlink_to(ROOT / name)
        else:
            self.program.parent.mkdir(parents=True)
        self.environment = {
            **workspace_environment(),
            "CELL_ROOT": str(folder),
            "FARM_KEYS": str(folder / "keys"),
        }
        self.stage = Stage(folder / "processes", self.environment)
        self.here: tuple[str, ...] = ()

    def judge(self, text: str) -> None:
        """Let the judge be these lines."""
        self.program.write_text(
            f"#!{sys.executable}\nimport os, pathlib, signal, sys, time\n{text}"
        )
        self.program.chmod(0o755)

    def start(self, *words: str, by: Sequence[str] = ()) -> Process:
        """Start ``./cell lab``; ``by`` stands before it, such as what leads into a namespace."""
        return self.stage.start(*by, sys.executable, "-m", "farm.lab", *words)

    def farm(self, *words: str) -> str:
        """Do a word of ``./cell farm`` in this process, and return what it says."""
        done = CliRunner().invoke(farm_words, words, env=self.environment)
        assert done.exit_code == 0, done.output
        return done.output

    def say(self, *words: str) -> tuple[int, str]:
        """Do a word of ``./cell lab`` in this process; return its exit code and what it says."""
        done = CliRunner().invoke(lab_words, words, env=self.environment)
        if not isinstance(done.exception, SystemExit | None):
            raise done.exception
        return done.exit_code, done.output

    def work_here(self) -> None:
        """Let the runs to come share a scheduler and its worker; else each starts its own."""
        address = f"{HOST}:{free_port()}"
        self.here = ("--scheduler", address)
        kept = self.start("scheduler", "--port", address.rpartition(":")[2])
        wait_until(lambda: "use it:" in kept.output, DEADLINE_S, "the scheduler here")
        working = self.start("worker", address, "--workers", "1")
        wait_until(lambda: "1 workers at" in working.output, DEADLINE_S, "the worker here")

    def run(self, name: str, *more: str, words: Sequence[str] = WORDS, code: int = 0) -> bytes:
        """Ask for the jobs in this process, and return the results."""
        ended, text = self.say(*words, "--folder", str(self.folder / name), *(more or self.here))
        assert ended == code, text
        return self.results(name)

    def results(self, name: str) -> bytes:
        """Return the results of a run."""
        return (self.folder / name / "results.jsonl").read_bytes()

    def said(self, name: str) -> list[str]:
        """Return what each job of a run said."""
        lines = self.results(name).splitlines()
        return [str(json.loads(line)["said"]) for line in lines]
