"""The tools of ros-mcp, called as its hosts call them: run by the Python of its own venv.

Usage: ros_mcp_examples.py PORT NAMESPACE. Prints one line of JSON for each check, see
../checks.py. The test's own nodes are below NAMESPACE: see harness/clients/ros_side.py. The
server keeps an image in the folder in which the script runs.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import checks
from fastmcp import Client
from fastmcp.client.transports import StdioTransport

SERVER = Path(sys.executable).with_name("ros-mcp")
FOR_ROS_2 = ("get_parameters", "get_action_details", "get_action_status")
"""Tools that ask for what rosbridge has for ROS 2 only."""


class Examples:
    """The checks: each method whose name begins with ``check_`` is one, in this order."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, client: Client[Any], port: int, namespace: str
    ):
        self._loop = loop
        self._client = client
        self._port = port
        self._namespace = namespace
        self._called: set[str] = set()

    def _name(self, relative: str) -> str:
        return f"{self._namespace}/{relative}"

    def _tool(self, tool: str, **arguments: Any) -> dict[str, Any]:
        """Call a tool, and return what it has found."""
        self._called.add(tool)
        result = self._loop.run_until_complete(
            self._client.call_tool(tool, arguments, raise_on_error=False)
        )
        assert not result.is_error, result.content
        found = result.structured_content
        if found is None:
            texts = [part.text for part in result.content if part.type == "text"]
            found = {"content": [part.type for part in result.content]}
            if texts and texts[0].startswith("{"):
                found |= json.loads(texts[0])
        return found

    def check_connect(self) -> None:
        """The port is open, and ROS 1 behind it."""
        found = self._tool("connect_to_robot", ip="127.0.0.1", port=self._port)
        assert found["connectivity_test"]["port_check"]["open"], found
        target = {"ip": "127.0.0.1", "port": self._port}
        assert self._tool("ping_robots", targets=[target])["results"][0]["port_check"]["open"]
        assert self._tool("detect_ros_version")["version"] == "1"

    def check_listen_to_a_topic(self) -> None:
        """One message, and those of half a second."""
        states = {"topic": self._name("states"), "msg_type": "sensor_msgs/JointState"}
        assert self._tool("subscribe_once", **states)["msg"]["name"] == ["joint_1"]
        found = self._tool("subscribe_for_duration", duration=0.5, **states)
        assert found["collected_count"] >= 3, found

    def check_images(self) -> None:
        """Kept on disk, and shown again."""
        image = {"topic": self._name("image"), "msg_type": "sensor_msgs/Image"}
        assert "image" in self._tool("subscribe_once", expects_image="true", **image)["content"]
        assert "image" in self._tool("view_saved_image")["content"]

    def check_publish_right_after_advertise(self) -> None:
        """The tool returns, though it hears nothing for a second; and a node has heard it."""
        begun = time.monotonic()
        text = {"topic": self._name("question"), "msg_type": "std_msgs/String"}
        assert self._tool("publish_once", msg={"data": "by ros-mcp"}, **text)["success"]
        assert time.monotonic() - begun < 10.0
        found = self._tool("get_parameter", name=self._name("asked"))
        assert "by ros-mcp" in found["value"], found

    def check_call_a_service(self) -> None:
        """It answers with its fields."""
        asked = {"service_name": self._name("switch"), "service_type": "std_srvs/SetBool"}
        found = self._tool("call_service", request={"data": True}, **asked)
        assert found["success"] and found["result"]["message"] == "on", found

    def check_parameters(self) -> None:
        """Set, read and delete."""
        name = self._name("gain")
        assert self._tool("set_parameter", name=name, value="1.5")["successful"]
        assert json.loads(self._tool("get_parameter", name=name)["value"]) == 1.5
        assert self._tool("has_parameter", name=name)["exists"]
        assert self._tool("get_parameter_details", name=name)["type"] == "float"
        self._tool("delete_parameter", name=name)
        assert not self._tool("has_parameter", name=name)["exists"]

    def check_questions_about_topics(self) -> None:
        """Names and types, and who publishes."""
        states = self._name("states")
        assert states in self._tool("get_topics")["topics"]
        assert self._tool("get_topic_type", topic=states)["type"] == "sensor_msgs/JointState"
        assert self._tool("get_topic_details", topic=states)["publisher_count"] == 1

    def check_questions_about_services(self) -> None:
        """Names, types and fields."""
        switch = self._name("switch")
        assert switch in self._tool("get_services")["services"]
        assert self._tool("get_service_type", service=switch)["type"] == "std_srvs/SetBool"
        found = self._tool("get_service_details", service=switch)
        assert found["request"]["fields"] == {"data": "bool"} and found["provider_count"] == 1

    def check_questions_about_nodes(self) -> None:
        """Somebody publishes the states."""
        nodes = self._tool("get_nodes")["nodes"]
        found = [self._tool("get_node_details", node=node) for node in nodes]
        assert any(self._name("states") in node["publishers"] for node in found), found

    def check_questions_about_types(self) -> None:
        """Fields of a message."""
        found = self._tool("get_message_details", message_type="sensor_msgs/JointState")
        assert "position" in found["structure"]["sensor_msgs/JointState"]["fields"], found

    def check_action_servers(self) -> None:
        """Their names."""
        assert self._name("count") in self._tool("get_actions")["actions"]

    def check_tools_for_ROS_2_end_with_an_error_at_once(self) -> None:
        """ROS 1 has not what they ask for."""
        count = {"action": self._name("count"), "action_type": "actionlib/TestAction"}
        asked = ({"node_name": self._namespace}, count, {"action_name": self._name("count")})
        for tool, arguments in zip(FOR_ROS_2, asked):
            begun = time.monotonic()
            found = self._tool(tool, **arguments)
            assert "error" in found, f"{tool}: {found.get('note', found)}"
            took = time.monotonic() - begun
            assert took < 2.0, f"{tool} ended with an error after {took:.0f} s"

    def check_every_tool_that_reads_was_called(self) -> None:
        """Those that the server itself calls so."""
        robots = self._tool("get_verified_robots_list")["robot_specifications"]
        assert "robot_config" in self._tool("get_verified_robot_spec", name=robots[0])
        tools = self._loop.run_until_complete(self._client.list_tools())
        reading = {tool.name for tool in tools if tool.annotations.readOnlyHint}
        assert len(reading) > 15 and reading <= self._called, reading - self._called


def main() -> None:
    """Run all checks."""
    # asyncio.Runner would do, but Python 3.10 has none.
    loop = asyncio.new_event_loop()
    try:
        client = Client(StdioTransport(command=str(SERVER), args=[], keep_alive=True))
        loop.run_until_complete(client.__aenter__())
        examples = Examples(loop, client, int(sys.argv[1]), sys.argv[2])
        found = {name: getattr(examples, name) for name in vars(Examples)}
        checks.run("ros-mcp", version("ros-mcp"), found)
        loop.run_until_complete(client.close())
    finally:
        loop.close()


if __name__ == "__main__":
    main()
