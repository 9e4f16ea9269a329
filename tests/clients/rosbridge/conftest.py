"""What other people's rosbridge clients meet: a gateway, and nodes behind it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from harness.clients.environments import SHARED, Environment
from harness.clients.ros_side import RosSide
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros

HERE = Path(__file__).parent
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
