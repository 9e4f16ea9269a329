"""A lab that is interrupted or killed leaves nothing behind and goes on; what is wrong is said."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.machines.lab_project import DEADLINE_S, JOBS, STEADY, WORDS, Lab
from harness.processes import free_port, wait_until
from scara_bringup.processes.ports_io import listeners, sockets


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    """Give a test a lab; all of it is ended."""
    made = Lab(tmp_path)
    yield made
    made.stage.close()


@pytest.mark.thorough
def test_an_interruption_ends_all_processes_and_the_lab_goes_on(lab: Lab) -> None:
    """Jobs and what they started too, though the signal reaches the first process alone.

    What was done is kept.

    A lab that is killed leaves no process either.
    """
    lab.judge(STEADY)
    whole = lab.run("whole")
    begun, hang = lab.folder / "begun", lab.folder / "hang"
    begun.mkdir()
    hang.mkdir()
    lab.judge(
        f"pathlib.Path({str(begun)!r}, str(os.getpid())).touch()\n"
        f"if len(os.listdir({str(begun)!r})) > 3:\n"
        f"    pathlib.Path({str(hang)!r}, str(os.getpid())).touch()\n"
        f"    len(os.listdir({str(hang)!r})) > 2 or os.fork()\n"
        f"    time.sleep(100.0)\n{STEADY}\n"
    )
    words = (*WORDS, "--folder", str(lab.folder / "part"), "--workers", "2")
    process = lab.start(*words)
    wait_until(lambda: len(os.listdir(hang)) == 2, DEADLINE_S, "two jobs that hang")
    inodes = {listener.inode: listener for listener in listeners()}
    ours = {int(line.split()[0]) for line in lab.stage.left_over()}
    seen = [inodes[i] for pid, _, held in sockets() if pid in ours for i in held & set(inodes)]
    assert seen and all(listener.is_loopback for listener in seen)
    os.kill(process.pid, signal.SIGINT)
    assert process.wait(DEADLINE_S) == 130
    assert "interrupted: go on with the same words" in process.output
    wait_until(lambda: not lab.stage.left_over(), DEADLINE_S, "the end of all processes")
    kept = list((lab.folder / "part").glob("[0-9]*.json"))
    assert 0 < len(kept) < JOBS
    process = lab.start(*words)
    wait_until(lambda: len(os.listdir(hang)) == 4, DEADLINE_S, "two jobs that hang again")
    os.kill(process.pid, signal.SIGKILL)
    wait_until(lambda: not lab.stage.left_over(), DEADLINE_S, "the end of all processes")
    lab.judge(STEADY)
    assert lab.run("part") == whole


@pytest.mark.thorough
def test_what_cannot_be_is_told(lab: Lab) -> None:
    """Addresses that are none or far away, a port that is taken, no worker, and no program."""
    port = str(free_port())
    for words, said in (
        (("worker", "192.168.1.7:8786"), "allowed is only this machine"),
        (("judge", "1,2,3", "--scheduler", "farm.example:1"), "allowed is only this machine"),
        (("worker", "127.0.0.1:x"), "allowed is HOST:PORT"),
        (("scheduler", "--listen", "0.0.0.0"), "at which other machines reach this one"),
    ):
        code, text = lab.say(*words)
        assert code == 2 and said in text
    scheduler = lab.start("scheduler", "--port", port)
    wait_until(lambda: "use it:" in scheduler.output, DEADLINE_S, "the scheduler")
    code, text = lab.say("scheduler", "--port", port)
    assert code == 1 and "cannot be listened on" in text
    joined = (*WORDS, "--folder", str(lab.folder / "a"), "--scheduler", f"127.0.0.1:{port}")
    code, text = lab.say(*joined)
    assert code == 1 and "has no workers" in text
    worker = lab.start("worker", f"127.0.0.1:{port}", "--workers", "1")
    wait_until(lambda: "1 workers at" in worker.output, DEADLINE_S, "the worker")
    code, text = lab.say(*joined)
    assert code == 1 and "judge: No such file" in text
    lab.judge(STEADY)
    assert lab.run("a", *joined[-2:]) == lab.run("here")
    os.kill(worker.pid, signal.SIGINT)
    assert worker.wait(DEADLINE_S) == 0
