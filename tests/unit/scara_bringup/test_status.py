"""What runs can be seen: which cells, what each node uses, and what it says about itself."""

from __future__ import annotations

import io
import os
import shlex
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
import rospy
from harness.processes import wait_until
from harness.yaml_files import copy_configuration
from rich.console import Console
from scara_bringup.cell_node import _note_ready
from scara_bringup.cell_shell_node import SIGNALS, CellShell, Shown
from scara_bringup.plan import NodePlan, cell_plan
from scara_bringup.processes.controller_watch_node import ControllerWatch
from scara_bringup.processes.preflight_io import CannotStartError
from scara_bringup.status import running_io as running
from scara_bringup.status.running_io import usage_of
from scara_bringup.status.status import Usage, in_words, node_state
from scara_bringup.status.status_node import _print_cell
from scara_bringup.supervisor import Explain, SendSignal
from scara_bringup.terminal.browser_io import find_opener, open_page
from scara_bringup.terminal.screen_io import page_addresses, say, show_cell
from scara_ros.diagnosis import Diagnosis
from unit.scara_bringup.test_plan import DOORS

from scara_bringup import cell_shell_node

OK, WARN, ERROR = Diagnosis(0, "a", "fine"), Diagnosis(1, "b", "late"), Diagnosis(2, "c", "gone")
END = SendSignal(frozenset({"a"}), signal.SIGINT)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ((), "-"),
        ((OK,), "ok"),
        ((OK, WARN), "warning: late"),
        ((WARN, OK, ERROR), "ERROR: gone (and 1 more)"),
    ],
)
def test_the_worst_that_a_node_says_is_shown(said: tuple[Diagnosis, ...], words: str) -> None:
    """What is fine needs one word."""
    state = node_state("n", 1, Usage(1.0, 50.0), Usage(1.3, 60.0), 1.5, said)
    assert in_words(state) == words
    assert state.cpu_percent == pytest.approx(20.0) and state.memory_mb == 60.0


def test_a_node_that_has_ended_says_nothing_else() -> None:
    """Whatever it said before."""
    state = node_state("n", 1, Usage(1.0, 50.0), None, 1.5, (OK,))
    assert not state.alive and in_words(state) == "ENDED: see its log"


def test_processor_time_and_memory_are_the_kernels() -> None:
    """Of this very process; one that is gone has none."""
    used = usage_of(os.getpid())
    assert used is not None and used.processor_s > 0.0 and used.memory_mb > 1.0
    ended = subprocess.Popen(["true"])
    wait_until(lambda: usage_of(ended.pid) is None, 5.0, "a process that has ended")
    ended.wait()
    assert usage_of(ended.pid) is None


def cell_of(pid: int, folder: Path) -> running.RunningCell:
    """Describe a cell."""
    nodes = [running.RunningNode("gateway", 1, "rosrun a b", "log")]
    uri = "http://127.0.0.1:11311"
    return running.RunningCell(pid, "up", "r", "ideal", uri, "/", str(folder), {}, nodes)


@pytest.mark.parametrize(("plant", "title"), [("ideal", "r, stand-in ideal:"), ("", "r:")])
def test_a_cell_without_a_stand_in_shows_none(tmp_path: Path, plant: str, title: str) -> None:
    """A real robot behaves like no plant."""
    shown = io.StringIO()
    cell = msgspec.structs.replace(cell_of(1, tmp_path), plant=plant)
    _print_cell(Console(file=shown), cell, [])
    assert shown.getvalue().startswith(f"cell: {title} ./cell up, pid 1")


def test_a_cell_is_found_while_it_runs_and_by_its_user_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its file holds the pages' tokens."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    words = ["bash", "-c", "exec -a cell sleep 100"]
    with subprocess.Popen(words) as process:
        wait_until(lambda: running.is_bring_up(process.pid), 5.0, "a process called cell")
        cell = cell_of(process.pid, tmp_path)
        with running.announced(cell):
            assert running.running_cells() == [cell]
            file = tmp_path / running.FILE
            assert stat.S_IMODE(file.stat().st_mode) == 0o600
            assert msgspec.json.decode(file.read_bytes(), type=running.RunningCell) == cell
        assert running.running_cells() == []
        process.kill()


def test_a_cell_that_was_killed_is_forgotten(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its link is left behind, and its number may be another process's by now."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    with subprocess.Popen(["sleep", "100"]) as other:
        with running.announced(cell_of(other.pid, tmp_path)):
            assert running.running_cells() == []
            assert list(running.index().iterdir()) == []
        other.kill()
    assert not running.index().exists()


@pytest.mark.parametrize("content", [b"", b'{"pid": 1, "verb": "\xff"}'])
def test_a_file_that_is_damaged_is_forgotten(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, content: bytes
) -> None:
    """By a power cut; nobody else would remove its link."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    with running.announced(cell_of(1, tmp_path)):
        (tmp_path / running.FILE).write_bytes(content)
        assert running.running_cells() == []
        assert list(running.index().iterdir()) == []


@pytest.mark.parametrize(
    ("born", "found"),
    [("{boot} {ticks}", True), ("", True), ("{boot} {ticks}0", False), ("other {ticks}", False)],
)
def test_a_later_process_of_a_cells_number_is_not_that_cell(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, born: str, found: bool
) -> None:
    """After a power cut the bring-up of a container finds its own number and program there."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    monkeypatch.setattr(running, "is_bring_up", lambda _: True)
    boot, ticks = running.birth_of(os.getpid()).split()
    cell = msgspec.structs.replace(
        cell_of(os.getpid(), tmp_path), born=born.format(boot=boot, ticks=ticks)
    )
    with running.announced(cell):
        assert (running.running_cells() == [cell]) is found


def test_a_browser_is_opened_only_where_there_is_a_display(tmp_path: Path) -> None:
    """The token is on no command line: the browser gets a file that this user alone can read."""
    seen, opener = tmp_path / "seen", tmp_path / "open"
    opener.write_text(f'#!/bin/sh\necho "$@" >{seen}.part && mv {seen}.part {seen}\n')
    opener.chmod(0o755)
    address = "http://127.0.0.1:8080/?token=secret-of-the-tests"
    env = {"BROWSER": str(opener), "PATH": os.environ["PATH"]}
    assert find_opener(env) == "" and not open_page(address, tmp_path, env)
    assert open_page(address, tmp_path, {**env, "DISPLAY": ":9"})
    wait_until(seen.is_file, 5.0, "the browser")
    told = seen.read_text().strip()
    assert "secret" not in told and told.startswith("file://")
    page = Path(told.removeprefix("file://"))
    assert f"url={address}" in page.read_text() and stat.S_IMODE(page.stat().st_mode) == 0o600
    # A disk that takes no file ends no cell.
    assert not open_page(address, tmp_path / "missing", {**env, "DISPLAY": ":9"})


def test_a_cell_that_cannot_note_that_it_got_ready_runs_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It would end with the exit code of a wrong configuration, after which no unit restarts it."""
    file = tmp_path / "kept.json"
    file.write_text("torn")
    _note_ready(file)
    said = capsys.readouterr().err
    assert str(file) in said and "the cell runs with the change" in said


def test_a_change_is_proven_by_a_pair_that_works_and_once() -> None:
    """A pair in a fault may be the change's own fault; a person may still get it ready."""
    shown, notes = ("FAULT", "the pair does not align"), list[str]()
    watch = SimpleNamespace(last=lambda: shown, rest=lambda: notes.append("rests"))
    shell: Any = CellShell.__new__(CellShell)
    shell._watch, shell._works = watch, False
    shell._shown = Shown("up", "r", "ideal", on_works=(lambda: notes.append("proven"),))
    cell: Any = SimpleNamespace(nodes=cell_plan(DOORS, with_panel=True))
    shell._look_at_pair(cell)
    assert shell._not_working(cell) == "FAULT (the pair does not align)" and not notes
    shown = ("IDLE", "")
    shell._look_at_pair(cell)
    shell._look_at_pair(cell)
    assert notes == ["proven", "rests"]


def bare_shell(**parts: Any) -> Any:
    """Give a shell that has these parts only."""
    shell = CellShell.__new__(CellShell)
    for name, part in parts.items():
        setattr(shell, f"_{name}", part)
    return shell


@pytest.mark.parametrize("ignored", [True, False])
def test_a_cell_under_nohup_outlives_its_terminal(ignored: bool) -> None:
    """It is started with SIGHUP ignored, and leaves it so."""

    def start(_node: NodePlan) -> None:
        raise CannotStartError("no master")

    processes = SimpleNamespace(log_folder="log", start=start)
    shell = bare_shell(processes=processes, master=SimpleNamespace(uri="http://127.0.0.1:11311"))
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        signal.signal(signal.SIGHUP, signal.SIG_IGN if ignored else signal.SIG_DFL)
        with pytest.raises(CannotStartError, match="no master"):
            shell._run([], None, own_master=True)
        assert (signal.getsignal(signal.SIGHUP) == signal.SIG_IGN) is ignored
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_a_screen_that_is_gone_keeps_no_node_from_being_told_to_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ctrl-C ends the `tee` behind the cell first."""

    def write(_text: str) -> None:
        raise BrokenPipeError

    for stream in ("stdout", "stderr"):
        monkeypatch.setattr(sys, stream, SimpleNamespace(write=write, flush=lambda: None))
    sent = list[object]()
    processes = SimpleNamespace(
        signal=lambda *words: sent.append(words), last_lines=lambda *_: ["x"], log_of=str
    )
    shell = bare_shell(processes=processes, deadlines=SimpleNamespace(log_lines=1), watch=None)
    shell._perform([Explain("x", ("a",)), END], None)
    assert sent == [(END.names, END.number)]
    say("ready")


def test_a_master_that_hangs_keeps_no_node_from_being_told_to_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Calls of rospy wait for it without an end, when the cell gets ready and when it ends."""
    monkeypatch.setattr(cell_shell_node, "MASTER_PATIENCE", 0.0)
    answers, notes = threading.Event(), list[object]()

    def wait() -> None:
        answers.wait(5.0)
        notes.append("answered")

    watch = SimpleNamespace(last=lambda: ("IDLE", ""), rest=wait, close=wait)
    processes = SimpleNamespace(signal=lambda *words: notes.append(words))
    shell = bare_shell(watch=watch, works=False, shown=Shown("up", "r", ""), processes=processes)
    shell._look_at_pair(SimpleNamespace(nodes=[]))
    shell._perform([END], None)
    assert notes == [(END.names, END.number)]
    answers.set()


def test_the_watch_leaves_the_master_in_one_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the first of two hangs, rospy begins the second at the exit of the process."""
    told = list[str]()
    monkeypatch.setattr(rospy, "signal_shutdown", told.append)
    watch: Any = ControllerWatch.__new__(ControllerWatch)
    watch._subscriber = SimpleNamespace(unregister=lambda: told.append("topic"))
    watch.close()
    assert told == ["the cell ends"]


def test_a_pair_that_needs_a_person_is_told_with_its_mode(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And with the address of the page on which that is mended; it is not called ready."""
    trouble = "ESTOP (the drives of the real robot are off)"
    show_cell([], {"Operator's page": "http://here"}, "http://m", tmp_path, 5.0, trouble)
    said = capsys.readouterr().out
    assert f"the pair is not ready: {trouble}" in said and "ready after" not in said
    assert said.rstrip().endswith("http://here")


def test_the_addresses_of_the_pages_come_last(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing stands below them, and all of it fits on a screen of 24 lines and 80 columns."""
    monkeypatch.setenv("OPERATOR_PANEL_TOKEN", "t" * 43)
    monkeypatch.setenv("PENDANT_PAGE_TOKEN", "u" * 43)
    monkeypatch.delenv("SCARA_CONFIG_DIR", raising=False)
    monkeypatch.setenv("ROS_NAMESPACE", "/")  # as the bring-up sets it for a cell without a name
    nodes = cell_plan(DOORS, with_panel=True)
    addresses = page_addresses(DOORS, nodes, tmp_path)
    show_cell(nodes, addresses, "http://127.0.0.1:11311", Path("runs/now"), 5.0)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "cell: ready after 5.0 s; Ctrl-C ends it"
    assert lines[-1].strip() == f"http://127.0.0.1:18090/?token={'u' * 43}"
    assert f"http://127.0.0.1:18080/?token={'t' * 43}" in [line.strip() for line in lines[-4:]]
    assert len(lines) <= 23 and max(map(len, lines)) <= 80
    assert any("pendant run ARTICLE" in line for line in lines)
    assert not any("export ROS_NAMESPACE" in line for line in lines), "another shell needs none"
    assert page_addresses(DOORS, cell_plan(DOORS), tmp_path) == {}


def test_what_is_pasted_into_another_shell_keeps_its_words(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder's name may hold a space."""
    folder = tmp_path / "my cell"
    folder.mkdir()
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(copy_configuration(folder)))
    show_cell([], {}, "http://m", folder, 5.0)
    lines = [shlex.split(line) for line in capsys.readouterr().out.splitlines() if "export" in line]
    assert ["export", f"SCARA_CONFIG_DIR={folder}"] in lines
    words = ("rosrun", "cell_recorder", "recorder", f"_directory:={folder}")
    shell: Any = CellShell.__new__(CellShell)
    shell._processes = SimpleNamespace(pids=lambda: {"recorder": 1}, log_of=str)
    shell._master, shell._folder = SimpleNamespace(uri="http://m"), folder
    shell._shown, shell._doors = Shown("up", "r", ""), DOORS
    cell: Any = SimpleNamespace(nodes=[NodePlan("recorder", *words[1:3], words[3:])])
    told = shell._running(cell, {})
    (node,) = told.nodes
    assert shlex.split(node.command) == list(words)
    assert told.born == running.birth_of(os.getpid()) != ""
