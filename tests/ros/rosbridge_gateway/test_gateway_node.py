"""The node: its file, its port, its end, and a roscore that is not there yet."""

from __future__ import annotations

import shutil
import signal

import pytest
import websocket
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.wires.gateway_client import connect


def test_taken_port_ends_the_second_gateway(gateway: RunningGateway) -> None:
    """Exit code 2 and a text that names the port and what to do."""
    second = gateway.ros.run(
        "rosbridge_gateway", "gateway", f"_port:={gateway.port}", "__name:=second"
    )
    assert second.wait(20.0) == 2
    assert f"port 127.0.0.1:{gateway.port} cannot be opened" in second.output
    assert "_port:=NUMBER" in second.output
    assert "Traceback" not in second.output


@pytest.mark.parametrize("number", [signal.SIGTERM, *thorough(signal.SIGINT)])
def test_signal_ends_the_gateway_with_close_frames(ros: Ros, number: signal.Signals) -> None:
    """Clients hear a goodbye; exit code 0, no error."""
    gateway = RunningGateway(ros)
    client = gateway.client()
    client.subscribe("t", "std_msgs/String")
    gateway.node.signal(number)
    opcode, data = client.line.recv_data()
    assert opcode == websocket.ABNF.OPCODE_CLOSE and data[2:] == b"the gateway ends"
    assert gateway.node.wait(10.0) == 0
    assert "Traceback" not in gateway.node.output


@pytest.mark.parametrize("number", [signal.SIGINT, *thorough(signal.SIGTERM)])
def test_missing_roscore_is_said_once_and_waited_for(ros: Ros, number: signal.Signals) -> None:
    """Any start order works; a signal ends the waiting."""
    uri = f"http://127.0.0.1:{ros.free_port()}"
    node = ros.run("rosbridge_gateway", "gateway", env={"ROS_MASTER_URI": uri})
    ros.wait_until(
        lambda: f"no roscore at {uri}: waiting for it" in node.output, 20.0, "the remark"
    )
    node.signal(number)
    assert node.wait(10.0) == 0
    assert node.output.count("no roscore") == 1 and "Traceback" not in node.output


def test_gateway_waits_for_a_roscore_that_comes_late(ros: Ros) -> None:
    """The remark is followed by service."""
    port = ros.free_port()
    uri = f"http://127.0.0.1:{port}"
    door = ros.free_port()
    node = ros.run("rosbridge_gateway", "gateway", f"_port:={door}", env={"ROS_MASTER_URI": uri})
    ros.wait_until(lambda: "no roscore" in node.output, 20.0, "the remark")
    assert shutil.which("rosmaster", path=ros.env["PATH"])
    ros.stage.start("rosmaster", "--core", "-p", str(port), env={"ROS_MASTER_URI": uri})
    ros.wait_until(lambda: f"on 127.0.0.1:{door}" in node.output, 20.0, "the gateway's port")
    client = connect(door)
    assert client.call("/rosapi/get_time")["result"]
    client.line.close()


def test_client_that_goes_while_roscore_hangs_keeps_no_other_waiting(ros: Ros) -> None:
    """Its subscription leaves the graph once roscore goes on; others hear at once what is wrong."""
    port = ros.free_port()
    master = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
    roscore = ros.stage.start("rosmaster", "--core", "-p", str(port), env=master)
    gateway = RunningGateway(ros, env=master)
    leaver, other = gateway.client(), gateway.client()
    leaver.subscribe("t", "std_msgs/String")
    roscore.signal(signal.SIGSTOP)
    try:
        leaver.close()
        for _ in range(2):  # the first may be asked before the other is seen to have gone
            answer = other.ask(op="subscribe", topic="t", type="std_msgs/String")
            assert "roscore does not answer" in answer["msg"]
    finally:
        roscore.signal(signal.SIGCONT)
    other.subscribe("t", "std_msgs/String")
    gateway.end_clients()
