"""Two cells at one master, one in ROS's own spelling of a namespace, know nothing of each other."""

from __future__ import annotations

import json
import re
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

import pytest
import rosbag
from harness.live_cell import NODES, LiveCell
from harness.processes import Process, free_port, wait_until
from harness.ros import Master
from jsonschema import Draft202012Validator

pytestmark = [pytest.mark.system, pytest.mark.thorough]
SHARED = ("/diagnostics", "/tf", "/tf_static")


class Shown(LiveCell):
    """A cell with its frames and its page."""

    def show(self) -> None:
        """Start what people look at."""
        self.page_port = free_port()
        words = (f"_port:={self.page_port}", f"_runs_dir:={self.folder}")
        self.arguments["operator_panel"] = words
        for node in ("robot_state_publisher", "operator_panel"):
            self.start_node(node)

    def get(self, path: str) -> str:
        """Return what the page answers; empty while it does not."""
        try:
            url = f"http://127.0.0.1:{self.page_port}{path}"
            with urllib.request.urlopen(url, timeout=5.0) as answer:
                text: str = answer.read().decode()
        except OSError:
            return ""
        return text

    def record(self) -> Path:
        """Begin a recording; return its path."""
        answer = self.call("recorder/start")
        assert answer["success"], answer
        return Path(answer["path"])


@pytest.fixture(scope="module")
def cells(
    ros_master: Master, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Shown, Shown, list[Process]]]:
    """Give one cell without a namespace and one in ``cell_2``, both ready."""
    folder = tmp_path_factory.mktemp("cells")
    first = Shown(folder / "cell_1", ros_master.uri)
    second = Shown(folder / "cell_2", ros_master.uri, "cell_2")
    try:
        started = [cell.start() for cell in (first, second)]
        for cell, bringup in zip((first, second), started):
            cell.wait_ready(bringup)
            cell.show()
        yield first, second, started
    finally:
        with ThreadPoolExecutor() as pool:
            list(pool.map(Shown.close, (first, second)))


def test_cells_are_apart_in_every_way(cells: tuple[Shown, Shown, list[Process]]) -> None:
    """Names, ESTOP, page, recordings, frames, diagnostics."""
    first, second, _ = cells
    for cell in (first, second):
        wait_until(lambda cell=cell: cell.get("/api/twin"), 30.0, "a page that knows the pair")
        judge_api(cell)
    bags = {"/": first.record(), "/cell_2": second.record()}
    assert bags["/cell_2"].parent.name.endswith("_cell_2")

    estop = second.call("twin_controller/command", "{command: ESTOP}")
    assert estop["success"], estop
    wait_until(lambda: second.mode() == "ESTOP", 10.0, "an emergency stop of cell_2")
    assert first.mode() == "IDLE"

    def moved() -> None:
        answer = first.call("move_to", "{x: 0.51, y: 0.16, z: 0.10, speed_percent: 50}")
        assert answer["success"], answer

    first.beside_lost_links(moved)
    assert second.mode() == "ESTOP"
    assert second.real_joints()[:2] == pytest.approx([0.0, 0.0], abs=0.02), "cell_2 stood still"
    wait_until(lambda: "mergency" in second.get("/events.csv"), 10.0, "the alarm on cell_2's page")
    assert "mergency" not in first.get("/events.csv")

    for service, cell in (("stop", first), ("reset", second), ("stop", second)):
        answer = cell.call(f"twin_controller/{service}")
        assert answer["success"], (service, answer)
    wait_until(lambda: first.mode() == "STOPPED", 10.0, "a stop by Trigger")

    for namespace, cell in (("/", first), ("/cell_2", second)):
        assert cell.call("recorder/stop")["success"]
        judge_bag(bags[namespace], namespace)


def judge_api(cell: Shown) -> None:
    """Check what programs without ROS get: the schema's document, a stream of them, HEAD."""
    judge = Draft202012Validator(json.loads(cell.get("/api/twin/schema.json")))
    judge.validate(json.loads(cell.get("/api/twin")))
    address = f"http://127.0.0.1:{cell.page_port}/api/twin"
    with urllib.request.urlopen(f"{address}/stream", timeout=5.0) as stream:
        assert stream.headers["Content-Type"].startswith("text/event-stream")
        begun = [line for line in islice(stream, 12) if line.startswith(b"data: ")]
    stamps = [json.loads(line.removeprefix(b"data: "))["stamp"] for line in begun]
    # Ten a second go out whether or not the pair has said something new by then.
    assert len(stamps) == 6 and stamps == sorted(stamps) and stamps[0] < stamps[-1], stamps
    head = urllib.request.Request(address, method="HEAD")
    with urllib.request.urlopen(head, timeout=5.0) as answer:
        assert (answer.status, answer.read()) == (200, b"")


def judge_bag(path: Path, namespace: str) -> None:
    """Check that a bag holds one cell's own senders, frames and statuses."""
    prefix = namespace.strip("/")
    with rosbag.Bag(str(path)) as bag:
        seen = set()
        for topic, message, _, header in bag.read_messages(
            topics=list(SHARED), return_connection_header=True
        ):
            seen.add(topic)
            sender = header["callerid"]
            sender = sender.decode() if isinstance(sender, bytes) else sender
            assert sender.rpartition("/")[0] == namespace.rstrip("/"), (topic, sender)
            if topic == "/diagnostics":
                assert all(s.name.startswith(f"{namespace.rstrip('/')}/") for s in message.status)
                continue
            for transform in message.transforms:
                names = (transform.child_frame_id, transform.header.frame_id)
                assert all(name.startswith("cell_2/") == bool(prefix) for name in names), names
        assert seen == set(SHARED)
        kinds = bag.get_type_and_topic_info().topics
        joined = f"/{prefix}/robot_description" if prefix else "/robot_description"
        assert kinds[joined].msg_type == "std_msgs/String"


def test_third_cell_in_a_taken_namespace_is_refused(
    cells: tuple[Shown, Shown, list[Process]], ros_master: Master, tmp_path: Path
) -> None:
    """However it is spelled; what is no name is refused too."""
    refused = {
        "/cell_2/": "run already in namespace /cell_2",
        "cell-2": "ROS_NAMESPACE = 'cell-2': allowed are",
    }
    third = [
        LiveCell(tmp_path / str(number), ros_master.uri, name)
        for number, name in enumerate(refused)
    ]
    try:
        started = [cell.start() for cell in third]
        for bringup, said in zip(started, refused.values()):
            assert bringup.wait(20.0) == 1
            assert said in bringup.output
    finally:
        for cell in third:
            cell.close()


def test_each_node_says_once_that_it_is_ready(
    cells: tuple[Shown, Shown, list[Process]],
) -> None:
    """One line each, in its log."""
    first, second, _ = cells
    for cell in (first, second):
        for node in NODES:
            text = (cell.output / "log" / f"{node}.log").read_text(encoding="utf-8")
            assert len(re.findall(rf"\b{node} is ready", text)) == 1, node
