"""Processes, ports and the master as the bring-up meets them on a real machine."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import nullcontext
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from harness.processes import free_port, is_alive, wait_until
from harness.yaml_files import changed_yaml
from scara_bringup.cell_node import Wishes, run
from scara_bringup.config import Ports, load_doors
from scara_bringup.named.turn_io import LOCK, StartTurn
from scara_bringup.plan import CONTROLLER, EMULATOR, NodePlan, cell_plan
from scara_bringup.processes import output_io
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_bringup.processes.master_io import MasterAddress, MasterProbe
from scara_bringup.processes.output_io import make_output, runs_of
from scara_bringup.processes.ports_io import listening_ports, owner_of
from scara_bringup.processes.preflight_io import (
    CannotStartError,
    check_before_start,
    refuse_two_robots,
)
from scara_bringup.processes.processes_io import Processes
from scara_bringup.terminal import screen_io
from scara_config import config_directory
from scara_ros.shell.program_io import FAILED

from scara_bringup import cell_node


def plain(name: str, *arguments: str) -> NodePlan:
    """Plan a program that is no ROS node."""
    return NodePlan(name, "", arguments[0], arguments[1:])


@pytest.fixture
def listener() -> Iterator[int]:
    """Give a port that this very process listens at."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def test_listening_port_is_seen_with_its_owner(listener: int) -> None:
    """The owner is found in /proc by the socket's inode."""
    assert listener in listening_ports()
    assert owner_of(listener).startswith(f"pid {os.getpid()} (")


def test_free_port_has_no_owner() -> None:
    """Nobody is accused."""
    port = free_port()
    assert port not in listening_ports()
    assert owner_of(port) == ""


def test_connection_is_no_listener(listener: int) -> None:
    """Only listening sockets take a port."""
    with socket.create_connection(("127.0.0.1", listener)) as client:
        assert client.getsockname()[1] not in listening_ports()


def test_output_and_exit_code_of_a_child_are_kept(tmp_path: Path) -> None:
    """The last lines are what a person needs when it has died."""
    with Processes(tmp_path / "log", os.environ) as processes:
        processes.start(plain("seq", "bash", "-c", "seq 30; echo oops >&2; exit 7"))
        ended = wait_until(processes.ended, 5.0)
        assert ended == [("seq", 7)]
        assert processes.ended() == [], "an end is told once"
        assert processes.last_lines("seq", 3) == ["29", "30", "oops"]
    assert processes.last_lines("never_started", 3) == []


def test_what_a_python_node_prints_is_in_its_log_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file is no terminal: without help the last lines of a node that is killed would be lost."""
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    with Processes(tmp_path / "log", os.environ) as processes:
        processes.start(
            plain("chatter", sys.executable, "-c", "import time; print('up'); time.sleep(1000)")
        )
        wait_until(lambda: processes.last_lines("chatter", 1) == ["up"], 10.0, "the first line")


def test_signal_reaches_the_whole_group(tmp_path: Path) -> None:
    """A node's own children end with it."""
    with Processes(tmp_path / "log", os.environ) as processes:
        processes.start(plain("family", "bash", "-c", "sleep 1000 & echo $!; wait"))
        child = int(wait_until(lambda: processes.last_lines("family", 1), 5.0)[0])
        processes.signal(["family", "unknown"], signal.SIGTERM)
        wait_until(processes.ended, 5.0)
        wait_until(lambda: not is_alive(child), 5.0, "the end of the grandchild")


def test_leaving_the_context_kills_what_ignores_every_signal(tmp_path: Path) -> None:
    """An error in the bring-up itself leaves nothing behind."""
    with (
        pytest.raises(RuntimeError, match="a fault"),
        Processes(tmp_path / "log", os.environ) as processes,
    ):
        processes.start(
            plain("deaf", "bash", "-c", "trap '' INT TERM; echo up; while :; do sleep 0.1; done")
        )
        wait_until(lambda: processes.last_lines("deaf", 1), 5.0)
        raise RuntimeError("a fault")
    assert not is_alive(processes.pids()["deaf"])


def test_children_die_with_a_bring_up_that_is_killed(tmp_path: Path) -> None:
    """Not even SIGKILL of the bring-up leaves a node behind."""
    script = (
        "import os, time\nfrom pathlib import Path\n"
        "from scara_bringup.processes.processes_io import Processes\n"
        "from scara_bringup.plan import NodePlan\n"
        f"p = Processes(Path({str(tmp_path)!r}), os.environ)\n"
        "print(p.start(NodePlan('child', '', 'sleep', ('1000',))), flush=True)\ntime.sleep(1000)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        # Until setpriv has replaced itself by the child, the kernel does not know yet that it shall
        # die with its parent.
        wait_until(
            lambda: Path(f"/proc/{child}/comm").read_text() == "sleep\n", 20.0, "the child itself"
        )
        parent.kill()
    wait_until(lambda: not is_alive(child), 20.0, "the end of the child")


@pytest.mark.parametrize(
    ("uri", "host", "port", "local"),
    [
        ("http://127.0.0.1:11311", "127.0.0.1", 11311, True),
        ("http://localhost:11311/", "localhost", 11311, True),
        ("http://10.0.0.7:11311", "10.0.0.7", 11311, False),
    ],
)
def test_master_address_is_split(uri: str, host: str, port: int, local: bool) -> None:
    """Only a master of this machine can be started by the bring-up."""
    address = MasterAddress.of(uri)
    assert (address.host, address.port, address.is_local) == (host, port, local)


@pytest.mark.parametrize(
    "uri", ["", "127.0.0.1:11311", "http://127.0.0.1", "http://127.0.0.1:port", "http://:11311"]
)
def test_wrong_master_address_is_refused(uri: str) -> None:
    """The text shows the value and what it should look like."""
    with pytest.raises(
        ValueError, match=r"ROS_MASTER_URI = .*must be like http://127\.0\.0\.1:11311"
    ):
        MasterAddress.of(uri)


def test_silent_listener_is_no_master(listener: int) -> None:
    """A port that accepts and says nothing does not hang the bring-up."""
    assert not MasterProbe(f"http://127.0.0.1:{listener}", timeout=0.2).answers()


class _Quiet(SimpleXMLRPCRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


@pytest.fixture
def fake_master() -> Iterator[str]:
    """Give the address of a stand-in for a ROS master.

    It has one node, one service and one topic.
    """
    with SimpleXMLRPCServer(("127.0.0.1", 0), _Quiet, allow_none=True) as server:
        uri = f"http://127.0.0.1:{server.server_address[1]}"
        state = [[["/twin/joint_states", ["/simulator"]]], [], [["/move_to", ["/motion_server"]]]]
        nodes = {"/simulator": uri, "/dead": f"http://127.0.0.1:{free_port()}"}
        server.register_function(lambda caller: [1, "", 1], "getPid")
        server.register_function(lambda caller: [1, "", state], "getSystemState")
        server.register_function(
            lambda caller, name: [1, "", nodes[name]] if name in nodes else [-1, "unknown", ""],
            "lookupNode",
        )
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield uri
        server.shutdown()
        thread.join()


def test_names_of_services_and_topics_come_from_the_master(fake_master: str) -> None:
    """Only published topics count."""
    assert MasterProbe(fake_master).services_and_topics() == (
        frozenset({"/move_to"}),
        frozenset({"/twin/joint_states"}),
    )


def test_registered_node_counts_only_if_it_answers(fake_master: str) -> None:
    """The entry of a node that was killed does not stop a new cell."""
    probe = MasterProbe(fake_master)
    assert [probe.is_running(name) for name in ("/simulator", "/dead", "/unknown")] == [
        True,
        False,
        False,
    ]


def test_taken_port_is_refused_before_anything_starts(listener: int) -> None:
    """The text names port, node and owner."""
    nodes = [NodePlan("emulator", "fanuc_emulator", "emulator", port=listener)]
    with pytest.raises(
        CannotStartError,
        match=rf"port {listener}, wanted by emulator, is taken by pid {os.getpid()}",
    ):
        check_before_start(nodes, MasterProbe(f"http://127.0.0.1:{free_port()}"))


def test_port_of_the_master_taken_by_something_else_is_refused(listener: int) -> None:
    """What answers there is no ROS master."""
    with pytest.raises(
        CannotStartError, match=rf"port {listener}, wanted by the ROS master, is taken"
    ):
        check_before_start([], MasterProbe(f"http://127.0.0.1:{listener}", timeout=0.2))


def test_a_port_that_two_want_is_refused() -> None:
    """By both names; with the master's too, where none answers yet."""
    master, port = free_port(), free_port()
    nodes = [NodePlan("gateway", "p", "e", port=port), NodePlan("panel", "p", "e", port=port)]
    with pytest.raises(CannotStartError, match=f"port {port} is wanted by gateway and by panel"):
        check_before_start(nodes, MasterProbe(f"http://127.0.0.1:{master}"))
    nodes = [NodePlan("gateway", "p", "e", port=master)]
    with pytest.raises(CannotStartError, match="wanted by gateway and by the ROS master"):
        check_before_start(nodes, MasterProbe(f"http://127.0.0.1:{master}"))


@pytest.mark.parametrize("host", ["192.0.2.9", "robot.example", "127.0.0.1.example"])
def test_a_stand_in_beside_a_robot_elsewhere_is_refused(host: str) -> None:
    """`./cell demo` would lead that robot; either one by itself is what somebody means."""
    both = cell_plan(load_doors(), ())
    with pytest.raises(CannotStartError, match=rf"real\.host is {host}, .*--without emulator"):
        refuse_two_robots(both, host)
    refuse_two_robots(cell_plan(load_doors(), (EMULATOR,)), host)
    refuse_two_robots(cell_plan(load_doors(), (CONTROLLER,)), host)
    for here in ("127.0.0.1", "localhost"):
        refuse_two_robots(both, here)


def test_a_demo_beside_a_real_robots_address_starts_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As somebody starts it after a day with the robot."""
    copied = copy_with_ports(config_directory(), tmp_path / "config")
    file = copied / "twin_controller.yaml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("host: 127.0.0.1", "host: 192.0.2.9", 1), encoding="utf-8")
    # What the command leaves there is put back.
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE", "ROS_MASTER_URI"):
        monkeypatch.setenv(name, os.environ.get(name, ""))
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(copied))
    output = tmp_path / "run"
    wishes = Wishes(
        None, None, output, (), free_port(), Ports(), False, experiments=("real_leads",)
    )
    assert run(wishes) == (FAILED, None)
    assert "real.host is 192.0.2.9" in capsys.readouterr().err and not output.exists()


def test_a_cell_with_a_real_robot_shows_its_address_and_no_stand_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What `./cell status` says; the stand-in's address leads nowhere."""
    copied, seen = copy_with_ports(config_directory(), tmp_path / "config"), []
    changed_yaml(copied / "twin_controller.yaml", copied, ["real", "host"], "192.0.2.9")
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE", "ROS_MASTER_URI", "ROS_HOME"):
        monkeypatch.setenv(name, os.environ.get(name, ""))
    monkeypatch.setenv("PYTHONUNBUFFERED", "1")
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(copied))

    def shell_of(*parts: Any) -> Any:
        seen.append(parts)
        return SimpleNamespace(run=lambda *_: 0)

    warm = SimpleNamespace(of_this_process=lambda *_: nullcontext())
    monkeypatch.setattr(cell_node, "WarmParent", warm)
    monkeypatch.setattr(cell_node, "Processes", lambda *_: nullcontext())
    monkeypatch.setattr(cell_node, "CellShell", shell_of)
    for without in ((EMULATOR,), (CONTROLLER,)):
        ports, output = Ports(free_port(), free_port()), tmp_path / without[0]
        run(Wishes(None, None, output, without, free_port(), ports, False))
    found = [(doors.modbus.host, shown.plant) for *_, doors, _, shown in seen]
    assert found == [("192.0.2.9", ""), ("127.0.0.1", "ideal")]


def test_a_cell_without_a_name_waits_for_one_that_is_starting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody listens yet at the ports that the other one has chosen."""
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE", "ROS_MASTER_URI"):
        monkeypatch.setenv(name, os.environ.get(name, ""))
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    other, steps = StartTurn(tmp_path / "runs", lambda: None), list[str]()

    def say(text: str) -> None:
        steps.append(text)
        other.end()

    def look(*_: object) -> bool:
        steps.append("looks at its ports")
        raise CannotStartError("enough")

    monkeypatch.setattr(screen_io, "say", say)
    monkeypatch.setattr(cell_node, "check_before_start", look)
    wishes = Wishes(None, None, tmp_path / "run", (), free_port(), Ports(), False)
    assert run(wishes) == (FAILED, None)
    assert steps == [
        "cell: another cell is starting: waiting until it is ready",
        "looks at its ports",
    ]
    # Where no turn can be had, it does without.
    monkeypatch.setenv("CELL_ROOT", str(tmp_path / "runs" / LOCK))
    assert run(wishes) == (FAILED, None) and steps[2:] == ["looks at its ports"]


def test_second_cell_in_one_namespace_is_refused(fake_master: str) -> None:
    """Nodes of the same name would shut each other down."""
    nodes = [NodePlan(name, "p", name) for name in ("simulator", "dead")]
    with pytest.raises(CannotStartError, match=r"run already in namespace /: simulator;"):
        check_before_start(nodes, MasterProbe(fake_master))


def test_running_master_is_used_and_a_missing_one_is_started(fake_master: str) -> None:
    """The answer says whether to start one."""
    assert check_before_start([], MasterProbe(fake_master)) is False
    assert check_before_start([], MasterProbe(f"http://127.0.0.1:{free_port()}")) is True


def test_master_of_another_machine_is_not_started_here() -> None:
    """The text says where to start it."""
    with pytest.raises(CannotStartError, match="another machine: start roscore there"):
        check_before_start([], MasterProbe("http://192.0.2.1:11311", timeout=0.2))


def test_recordings_stay_in_runs_or_in_the_folder_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A person's own folder around the output is none of the recorder's business."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    runs = tmp_path / "runs"
    assert runs_of(runs / "2030", None) == runs
    assert runs_of(tmp_path / "home" / "mine", None) == tmp_path / "home" / "mine"
    assert runs_of(tmp_path / "home" / "mine", tmp_path / "home") == tmp_path / "home"


def test_output_without_a_wish_is_named_by_the_time_in_the_workspace(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """CELL_ROOT is set by env.sh."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    folder = make_output(None)
    assert folder.is_dir() and folder.parent == tmp_path / "runs"


def test_two_runs_that_begin_in_one_second_share_no_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One would write into the logs and the recording of the other."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    moment = datetime(2030, 5, 1, 12)
    monkeypatch.setattr(output_io, "datetime", SimpleNamespace(now=lambda: moment))
    names = ["2030-05-01_12-00-00", "2030-05-01_12-00-00_2", "2030-05-01_12-00-00_3"]
    assert [make_output(None).name for _ in names] == names


def test_file_in_the_place_of_the_output_is_an_error(tmp_path: Path) -> None:
    """Nothing is overwritten."""
    (tmp_path / "file").write_text("x")
    with pytest.raises(OSError, match="File exists"):
        make_output(tmp_path / "file")
