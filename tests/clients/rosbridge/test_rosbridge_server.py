"""The same scripts at rosbridge_server 0.11.17 of ROS 1, side by side with the gateway.

No Debian package has it: its users build it in a catkin workspace. `./cell test --clients` does so
too, and writes a table of what it does.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from harness.clients.environments import NOT_BUILT, UPSTREAM, results
from harness.clients.ros_side import RosSide
from harness.clients.rosbridge import Client, rosbridge_clients
from harness.ros import Ros

pytestmark = pytest.mark.skipif(not UPSTREAM, reason=NOT_BUILT)

HERE = Path(__file__).parent
FOR_ROS_2 = "tools for ROS 2 end with an error at once"
CLIENTS = [
    pytest.param(client, id=client.environment.name)
    for client in rosbridge_clients()
    if client.environment.name != "own"
]


@pytest.fixture
def nodes(ros_module: Ros) -> Iterator[RosSide]:
    """Start the ROS side."""
    side = RosSide(ros_module)
    yield side
    side.close()


@pytest.mark.parametrize("client", CLIENTS)
def test_what_the_clients_find_at_rosbridge_server_is_written_down(
    server: int,
    ros_module: Ros,
    nodes: RosSide,
    run_script: Any,
    client: Client,
    upstream_record: dict[Any, Any],
) -> None:
    """All of it works at the gateway; here some may fail. Tools for ROS 2 end with errors."""
    scripts = [HERE / script for script in client.scripts]
    found, wrong = results(
        run_script(client.environment, scripts, ros_module.namespace, port=server)
    )
    upstream_record[found] = wrong
    assert len(wrong) == client.checks
    if client.environment.name.startswith("ros_mcp"):
        # Parameters and details of an action end with an error as they do here.
        assert "get_action_status: No status" in str(wrong[FOR_ROS_2])
