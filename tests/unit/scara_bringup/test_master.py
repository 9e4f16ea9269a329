"""The cell's master: Debian's, on loopback only, closed to web pages."""

from __future__ import annotations

import http.client
import os
import sys
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import free_port, wait_until
from scara_bringup.plan import NodePlan
from scara_bringup.processes.master_io import MasterProbe
from scara_bringup.processes.ports_io import listeners
from scara_bringup.processes.preflight_io import CannotStartError, node_address
from scara_bringup.processes.processes_io import Processes

LOOPBACK = {"ROS_IP": "127.0.0.1", "ROS_HOSTNAME": "127.0.0.1"}
RUN = "from scara_bringup.processes.master_node import main; main()"


@pytest.fixture
def master(tmp_path: Path) -> Iterator[int]:
    """Start the master as the bring-up does; give its port."""
    port = free_port()
    env = {**os.environ, **LOOPBACK, "ROS_HOME": str(tmp_path)}
    with Processes(tmp_path / "log", env) as processes:
        words = ("-c", RUN, "--core", "-p", str(port))
        processes.start(NodePlan("master", "", sys.executable, words))
        probe = MasterProbe(f"http://127.0.0.1:{port}")
        wait_until(probe.answers, 20.0, "a ROS master")
        yield port


def test_master_serves_nodes_and_refuses_pages(master: int) -> None:
    """A page can neither end it nor tell a node of a publisher."""
    body = xmlrpc.client.dumps(("/evil", "/x", 1), "setParam")
    for headers in ({"Origin": "http://localhost:3000"}, {"Host": "evil.example"}):
        connection = http.client.HTTPConnection("127.0.0.1", master, timeout=5.0)
        connection.request("POST", "/", body, headers)
        assert connection.getresponse().status == 403
        connection.close()
    proxy = xmlrpc.client.ServerProxy(f"http://localhost:{master}/")
    assert proxy.getParamNames("/test")[2] == []  # type: ignore[index]


def test_master_listens_at_loopback_only(master: int) -> None:
    """Read from the kernel."""
    assert {at.address for at in listeners() if at.port == master} == {"127.0.0.1"}


@pytest.mark.parametrize("env", [{}, {"ROS_IP": "127.0.0.1"}, {"ROS_IP": "", "ROS_HOSTNAME": ""}])
def test_cell_without_an_address_of_its_own_stays_at_loopback(env: dict[str, str]) -> None:
    """Without any variable rospy would open everything."""
    assert node_address(env, network=False) == LOOPBACK


def test_local_name_is_kept() -> None:
    """What rospy takes for loopback is no reason to refuse."""
    assert node_address({"ROS_HOSTNAME": "localhost"}, False)["ROS_HOSTNAME"] == "localhost"


@pytest.mark.parametrize(
    ("env", "text"),
    [
        ({"ROS_IP": "192.168.1.5"}, "ROS_IP = 192.168.1.5 would open"),
        ({"ROS_IP": "127.0.0.1", "ROS_HOSTNAME": "cell-7"}, "ROS_HOSTNAME = cell-7 would open"),
        ({"ROS_IP": "0.0.0.0"}, "say --network if that is meant"),
    ],
)
def test_address_of_the_network_is_refused_unless_it_is_allowed(
    env: dict[str, str], text: str
) -> None:
    """A ROS_IP left in the user's shell opened the whole cell without a word."""
    with pytest.raises(CannotStartError, match=text):
        node_address(env, network=False)
    assert node_address(env, network=True)["ROS_HOSTNAME"] in env.values()
