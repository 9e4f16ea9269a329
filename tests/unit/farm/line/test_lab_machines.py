"""A lab over TLS: other machines do its jobs with the same results, files come along."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from harness.machines.lab_project import DEADLINE_S, STEADY, WORDS, Lab
from harness.processes import Process, free_port, wait_until

HOST = "127.0.0.1"
READS = "print(sys.argv[1:], hash(tuple(pathlib.Path(sys.argv[1]).read_bytes()[-2_000_000:])))\n"
WRITES = """
bag = pathlib.Path(sys.argv[1])
(bag.parent / "report.json").write_bytes(bag.read_bytes()[::-1])
print(f"report: {bag.resolve().parent.as_uri()}/report.html")
print(bag, file=sys.stderr)
"""


@dataclass
class Two:
    """The desk of a lab and another machine, each with a project and keys of its own."""

    desk: Lab
    other: Lab
    port: int

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return f"tls://{HOST}:{self.port}"

    def invite(self, name: str = "pc_2") -> Path:
        """Let the other machine join the lab; return the invitation."""
        file = self.desk.folder / f"{name}.invitation"
        where = ("--address", f"{HOST}:{self.port}", "--file", str(file))
        self.desk.farm("invite", name, "--lab", *where)
        self.other.farm("join", str(file))
        return file

    def scheduler(self) -> Process:
        """Keep a scheduler at the desk."""
        kept = self.desk.start("scheduler", "--port", str(self.port), "--listen", HOST)
        wait_until(lambda: "use it:" in kept.output, DEADLINE_S, "the scheduler")
        return kept

    def worker(self, workers: int = 1) -> Process:
        """Let the other machine work."""
        working = self.other.start("worker", self.address, "--workers", str(workers))
        wait_until(lambda: f"{workers} workers at" in working.output, DEADLINE_S, "the worker")
        return working

    def asks(self, name: str) -> Process:
        """Let the desk ask for jobs."""
        words = (*WORDS, "--folder", str(self.desk.folder / name), "--scheduler", self.address)
        return self.desk.start(*words)

    def program(self, kind: str, text: str) -> None:
        """Let a program be these lines on both machines."""
        for lab in (self.desk, self.other):
            file = lab.folder / "devel" / "lib" / "twin_experiments" / kind
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"#!{sys.executable}\nimport pathlib, sys\n{text}")
            file.chmod(0o755)


@pytest.fixture
def two(tmp_path: Path) -> Iterator[Two]:
    """Give a test two machines; all of both is ended."""
    made = Two(Lab(tmp_path / "desk"), Lab(tmp_path / "other"), free_port())
    yield made
    made.other.stage.close()
    made.desk.stage.close()


def test_another_machine_gives_the_same_results_bit_for_bit(two: Two) -> None:
    """Points by their words; recordings by their content, though they are at the desk alone."""
    for lab in (two.desk, two.other):
        lab.judge(STEADY)
    two.program("replay_decisions", READS)
    two.program("report", WRITES)
    bags = [two.desk.folder / "runs" / name / "run.bag" for name in ("a", "b b", "c")]
    for number, bag in enumerate(bags):
        bag.parent.mkdir(parents=True)
        bag.write_bytes(bytes([number]) * 5_000_000 if number < 2 else b"")
    two.invite()
    two.scheduler()
    two.worker(2)
    jobs = {"points": WORDS, "replays": ("replay", *map(str, bags))}
    jobs["reports"] = ("report", *map(str, bags))
    for name, words in jobs.items():
        here = two.desk.run(f"{name}_here", words=words)
        reports = [bag.parent / "report.json" for bag in bags]
        kept = {file: file.read_bytes() for file in reports if file.exists()}
        for file in kept:
            file.unlink()
        far = two.desk.run(f"{name}_far", "--scheduler", two.address, words=words)
        assert far == here and here.count(b"\n") == len(two.desk.said(f"{name}_here"))
        assert {file: file.read_bytes() for file in reports if file.exists()} == kept
    assert len(kept) == 3
    files = list((two.other.folder / "runs" / "lab" / "files").iterdir())
    assert len(files) == 3 and all(len(file.name) == 64 for file in files)


def test_a_worker_that_is_killed_there_loses_nothing(two: Two) -> None:
    """The first job to come kills its worker with SIGKILL."""
    two.desk.judge(STEADY)
    here = two.desk.run("here")
    mark = two.other.folder / "mark"
    two.other.judge(
        "try:\n"
        f"    pathlib.Path({str(mark)!r}).touch(exist_ok=False)\n"
        "    os.kill(os.getppid(), signal.SIGKILL)\n"
        "    time.sleep(100.0)\n"
        f"except FileExistsError:\n    {STEADY}\n"
    )
    two.invite()
    two.scheduler()
    two.worker()
    assert two.desk.run("far", "--scheduler", two.address) == here
    assert mark.exists()


def test_another_version_of_the_project_does_no_jobs(two: Two) -> None:
    """Neither when it joins, nor when it was changed since; nor may such a lab ask."""
    for lab in (two.desk, two.other):
        lab.judge(STEADY)
        (lab.folder / "src").mkdir()
        (lab.folder / "src" / "one.py").write_text("a = 1\n")
    changed = two.other.folder / "src" / "one.py"
    two.invite()
    two.scheduler()
    changed.write_text("a = 2\n")
    refused = two.other.start("worker", two.address, "--workers", "1")
    assert refused.wait(DEADLINE_S) == 1 and "results could differ" in refused.output
    changed.write_text("a = 1\n")
    two.worker()
    two.desk.run("same", "--scheduler", two.address)
    changed.write_text("a = 2\n")
    later = two.desk.start(
        *WORDS, "--folder", str(two.desk.folder / "b"), "--scheduler", two.address
    )
    assert later.wait(DEADLINE_S) == 1 and "results could differ" in later.output
    (two.desk.folder / "src" / "one.py").write_text("a = 3\n")
    asks = two.desk.start(
        *WORDS, "--folder", str(two.desk.folder / "c"), "--scheduler", two.address
    )
    assert asks.wait(DEADLINE_S) == 1 and "the scheduler has" in asks.output


def test_a_member_that_is_revoked_is_put_out(two: Two) -> None:
    """At once, while it works; and it does not come in again until it is invited anew."""
    for lab in (two.desk, two.other):
        lab.judge(STEADY)
    two.invite()
    scheduler = two.scheduler()
    working = two.worker()
    two.desk.farm("revoke", "pc_2", "--lab")
    wait_until(lambda: "pc_2 1 is let in no more" in scheduler.output, DEADLINE_S, "its end")
    alone = two.desk.start(
        *WORDS, "--folder", str(two.desk.folder / "a"), "--scheduler", two.address
    )
    assert alone.wait(DEADLINE_S) == 1 and "has no workers" in alone.output
    os.kill(working.pid, signal.SIGTERM)
    refused = two.other.start("worker", two.address, "--workers", "1")
    assert refused.wait(DEADLINE_S) == 1 and "does not let this machine in" in refused.output
    two.invite()
    two.worker()
    two.desk.run("again", "--scheduler", two.address)


def test_who_is_in_no_lab_is_told_how(two: Two) -> None:
    """The farm's invitation is none for the lab."""
    file = two.desk.folder / "pc_2.invitation"
    two.desk.farm("invite", "pc_2", "--address", HOST, "--file", str(file))
    two.other.farm("join", str(file))
    alone = two.other.start("worker", two.address)
    assert alone.wait(DEADLINE_S) == 1 and "./cell farm invite NAME --lab" in alone.output
