"""What other people's rosbridge clients meet: a gateway, and nodes behind it."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from harness.clients.environments import SHARED, UPSTREAM, Environment
from harness.clients.ros_side import RosSide
from harness.opponents.running_gateway import RunningGateway
from harness.processes import wait_until
from harness.ros import Ros

HERE = Path(__file__).parent
UPSTREAM_VERSION = "0.11.17"
RunScript = Callable[..., list[str]]


@pytest.fixture(scope="module")
def gateway(ros_module: Ros) -> RunningGateway:
    """Start one gateway for the tests of a module."""
    return RunningGateway(ros_module)


@pytest.fixture
def nodes(gateway: RunningGateway) -> Iterator[RosSide]:
    """Start the ROS side."""
    side = RosSide(gateway.ros)
    yield side
    side.close()


@pytest.fixture
def run_script(gateway: RunningGateway, tmp_path: Path) -> RunScript:
    """Run a client's script to its end and return its lines.

    Its arguments are the gateway's port (another server's: ``port``) and ``args``; behind it in
    ``scripts`` is what it imports.
    """

    def run(client: Environment, scripts: list[Path], *args: str, port: int = 0) -> list[str]:
        script = scripts[0]
        if client.modules:
            script = client.put(tmp_path, *scripts, SHARED / "checks.js")
        process = gateway.ros.stage.start(
            *(client.program, str(script), str(port or gateway.port), *args),
            env=client.variables,
            cwd=tmp_path,
        )
        assert process.wait(120.0 if port else 60.0) == 0, process.tail()
        return process.output.splitlines()

    return run


@pytest.fixture(scope="module")
def server(ros_module: Ros, nodes_of_server: dict[str, str]) -> int:
    """Start server and rosapi as its launch file does; give its port."""
    port = ros_module.free_port()
    start = ros_module.stage.start
    words = ("bash", "-c", 'exec rosrun "$@"', "bash")
    start(*words, "rosapi", "rosapi_node", "__name:=rosapi", name="rosapi", env=nodes_of_server)
    given = (f"_port:={port}", "_address:=127.0.0.1")
    node = start(
        *words,
        "rosbridge_server",
        "rosbridge_websocket",
        *given,
        name="server",
        env=nodes_of_server,
    )
    wait_until(lambda: f"started at ws://127.0.0.1:{port}" in node.output, 30.0, "the server")
    return port


@pytest.fixture(scope="module")
def nodes_of_server(ros_module: Ros) -> dict[str, str]:
    """Return a shell's environment that has sourced the server's workspace, and ours before."""
    done = subprocess.run(
        ["bash", "-c", '. "$1" --extend >&2 && env -0', "bash", UPSTREAM],
        env=ros_module.env | {"ROS_NAMESPACE": "/"},
        capture_output=True,
        timeout=30.0,
        check=True,
    )
    found = dict(item.split("=", 1) for item in done.stdout.decode().split("\0") if "=" in item)
    version = subprocess.run(
        ["rosversion", "rosbridge_server"], env=found, capture_output=True, text=True, check=True
    )
    assert version.stdout.strip() == UPSTREAM_VERSION
    return found
