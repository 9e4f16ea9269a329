"""How the operator panel starts, outlives a ROS master, refuses to start, and ends."""

from __future__ import annotations

import json
import signal
import time
import xmlrpc.client
from pathlib import Path

from harness.processes import Process, free_port, wait_until
from harness.ros import Ros
from harness.wires.operator_page import Panel, heard


def test_panel_outlives_a_roscore_and_is_registered_with_the_next(ros: Ros) -> None:
    """Open pages stay, and so does who is in control; the new master knows all topics again."""
    port, topic = free_port(), ros.name("twin_controller/state")
    uri = f"http://127.0.0.1:{port}"

    def master() -> Process:
        return ros.stage.start("rosmaster", "--core", "-p", str(port), env={"ROS_MASTER_URI": uri})

    def known() -> bool:
        try:
            _, _, (_, subscribers, _) = xmlrpc.client.ServerProxy(uri).getSystemState("/tests")
        except OSError:
            return False
        return topic in dict(subscribers)

    first = master()
    panel = Panel(ros, env={"ROS_MASTER_URI": uri})
    wait_until(known, 20.0, "the panel's subscriptions")
    with panel.live() as live:
        first.stop()
        master()
        wait_until(known, 20.0, "the panel's subscriptions at the next master")
        begun = time.monotonic()
        while time.monotonic() < begun + 1.0:  # what has waited, and something new
            live.recv(timeout=15.0)
        assert panel.process.output.count("to watch") == 1


def test_panel_runs_without_a_ros_master_and_ends_cleanly(ros: Ros) -> None:
    """Any start order works; it says what it waits for."""
    panel = Panel(ros, env={"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"})
    with panel.live() as live:
        assert "No ROS master answers" in heard(live, "frame")["text"]["why"]
    answer = panel.get("/api/twin")
    assert (answer.status, json.loads(answer.read())) == (503, {"error": "no ROS master answers"})
    assert "no ROS master yet" in panel.process.output
    panel.process.signal(signal.SIGTERM)
    assert panel.process.wait(15.0) == 0, panel.process.tail()


def test_token_is_made_in_ros_home_and_stays_out_of_the_log(ros: Ros, tmp_path: Path) -> None:
    """A log can be read by others."""
    node = ros.run(
        "operator_panel",
        "operator_panel",
        f"_port:={free_port()}",
        env={"ROS_HOME": str(tmp_path / "home")},
    )
    wait_until(lambda: "to watch" in node.output, 30.0, "the operator panel")
    file = tmp_path / "home" / "operator_token"
    assert file.stat().st_mode & 0o777 == 0o600 and file.read_text().strip() not in node.output
    assert str(file) in node.output
