"""A page that was opened from a file, in a real browser: it reads, and does not command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import rospy
from harness.opponents.running_gateway import RunningGateway
from harness.wires.browser import chromium
from std_msgs.msg import String

PAGE = """<!DOCTYPE html><title>page</title><script>
window.heard = [];
const line = new WebSocket(location.hash.slice(1));
line.onmessage = (event) => window.heard.push(JSON.parse(event.data));
line.onopen = () => {
  line.send(JSON.stringify({op: "subscribe", topic: "TOPIC", type: "std_msgs/String"}));
  line.send(JSON.stringify({op: "call_service", id: "ask", service: "/rosapi/get_time"}));
  line.send(JSON.stringify({op: "call_service", id: "command",
    service: "/rosapi/set_param", args: {name: "TOPIC/gain", value: "1"}}));
};
</script>"""
DONE = "window.heard.length >= 3"


@pytest.mark.parametrize("token", ["", "?token=drive"], ids=["without", "with_a_token"])
def test_page_opened_from_a_file_reads_and_does_not_command(
    gateway: RunningGateway, tmp_path: Path, token: str
) -> None:
    """Whatever token it brings: the origin that a browser gives it proves nothing."""
    topic = gateway.ros.name("notes")
    publisher = rospy.Publisher(topic, String, latch=True, queue_size=1)
    publisher.publish("for every eye")
    file = tmp_path / "page.html"
    file.write_text(PAGE.replace("TOPIC", topic), encoding="utf-8")
    with chromium(tmp_path) as browser:
        page = browser.new_page()
        page.goto(f"{file.as_uri()}#ws://127.0.0.1:{gateway.port}/{token}")
        page.wait_for_function(DONE, timeout=20_000)
        heard: list[dict[str, Any]] = page.evaluate("window.heard")
    publisher.unregister()
    by_id = {packet.get("id", packet["op"]): packet for packet in heard}
    assert by_id["publish"]["msg"] == {"data": "for every eye"}
    assert by_id["ask"]["result"] is True
    assert by_id["command"]["result"] is False, by_id
    assert not rospy.has_param(f"{topic}/gain")
