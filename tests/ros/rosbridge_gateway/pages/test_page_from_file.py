"""Pages in a real browser: one of this machine's servers reads, one without an origin does not."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import rospy
from harness.opponents.running_gateway import RunningGateway
from harness.wires.browser import kept_chromium
from std_msgs.msg import String
from typing_extensions import Self

PAGE = """<!DOCTYPE html><title>page</title><script>
window.heard = [];
const line = new WebSocket(location.hash.slice(1));
line.onerror = () => window.heard.push("refused", "", "");
line.onmessage = (event) => window.heard.push(JSON.parse(event.data));
line.onopen = () => {
  line.send(JSON.stringify({op: "subscribe", topic: "TOPIC", type: "std_msgs/String"}));
  line.send(JSON.stringify({op: "call_service", id: "ask", service: "/rosapi/get_time"}));
  line.send(JSON.stringify({op: "call_service", id: "command",
    service: "/rosapi/set_param", args: {name: "TOPIC/gain", value: "1"}}));
};
</script>"""
FRAMED = """<!DOCTYPE html><title>site</title><script>
window.seen = {};
const knock = `const line = new WebSocket("DOOR");
  line.onopen = () => parent.postMessage("in", "*");
  line.onerror = () => parent.postMessage("refused", "*");`;
window.onmessage = (event) => {
  window.seen[event.source === window ? "page" : "frame"] = [event.origin, event.data];
};
window.onload = () => {
  const frame = document.createElement("iframe");
  frame.sandbox = "allow-scripts";
  frame.srcdoc = "<script>" + knock + "</" + "script>";
  document.body.append(frame);
  new Function(knock)();
};
</script><body></body>"""
DONE = "window.heard.length >= 3"


class Site(ThreadingHTTPServer):
    """One page at ``http://localhost:PORT/``; a context manager."""

    def __init__(self, body: str) -> None:
        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(body.encode())

            def log_message(self, *_: object) -> None:
                pass

        super().__init__(("127.0.0.1", 0), Handler)
        self.origin = f"http://localhost:{self.server_address[1]}"
        self._thread = threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self._thread.join()
        self.server_close()


def test_page_of_this_machine_reads_and_does_not_command(gateway: RunningGateway) -> None:
    """Without a token; its user may have opened it without knowing what it does."""
    topic = gateway.ros.name("notes")
    publisher = rospy.Publisher(topic, String, latch=True, queue_size=1)
    publisher.publish("for every eye")
    with kept_chromium() as browser, Site(PAGE.replace("TOPIC", topic)) as site:
        page = browser.new_page()
        page.goto(f"{site.origin}/#ws://127.0.0.1:{gateway.port}/")
        page.wait_for_function(DONE, timeout=20_000)
        heard: list[dict[str, Any]] = page.evaluate("window.heard")
    publisher.unregister()
    by_id = {packet.get("id", packet["op"]): packet for packet in heard}
    assert by_id["publish"]["msg"] == {"data": "for every eye"}
    assert by_id["ask"]["result"] is True
    assert by_id["command"]["result"] is False, by_id
    assert not rospy.has_param(f"{topic}/gain")


def test_page_opened_from_a_file_is_refused(gateway: RunningGateway, tmp_path: Path) -> None:
    """Its browser says null, which any web site's frame can say too; a token does not help it."""
    file = tmp_path / "page.html"
    file.write_text(PAGE, encoding="utf-8")
    with kept_chromium() as browser:
        page = browser.new_page()
        page.goto(f"{file.as_uri()}#ws://127.0.0.1:{gateway.port}/?token=drive")
        page.wait_for_function(DONE, timeout=20_000)
        assert page.evaluate("window.heard[0]") == "refused"


def test_sandboxed_frame_is_refused_where_its_page_may_connect(gateway: RunningGateway) -> None:
    """Its origin is null, whoever made it; a token that it was told does not help it."""
    door = f"ws://127.0.0.1:{gateway.port}/?token=drive"
    with kept_chromium() as browser, Site(FRAMED.replace("DOOR", door)) as site:
        page = browser.new_page()
        page.goto(site.origin)
        page.wait_for_function("window.seen.page && window.seen.frame", timeout=20_000)
        seen: dict[str, list[str]] = page.evaluate("window.seen")
    assert seen == {"page": [site.origin, "in"], "frame": ["null", "refused"]}
    gateway.ros.wait_until(
        lambda: "a page of 'null' may not connect" in gateway.node.output, 5.0, "the refusal"
    )
