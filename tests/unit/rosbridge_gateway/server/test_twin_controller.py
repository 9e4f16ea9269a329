"""The twin controller's own link at a gateway with the shipped rights."""

from __future__ import annotations

import queue
import threading

from harness.opponents.graph_and_clients import DEADLINE, TWIN_CONTROLLER, Cell, MakeCell
from harness.pair import SETUP
from harness.processes import wait_until
from harness.wires.proxy import Proxy
from twin_controller.twin.rosbridge_access_io import Access
from twin_controller.twin.twin_link_io import TwinLink

WANTED = {
    "subscribe": {"twin/joint_states", "twin/joint_setpoints", "twin/gripper"}
    | {"joint_pose_controller/state"},
    "advertise": {"joint_pose_controller/follow", "joint_pose_controller/speed_limit_percent"}
    | {"motion_command"},
}


def wishes_of(cell: Cell) -> dict[str, set[str]]:
    """Return what the graph was asked for, as soon as it is all."""
    found: dict[str, set[str]] = {op: set() for op in WANTED}
    while any(WANTED[op] - found[op] for op in WANTED):
        op, _, topic, *_ = cell.graph.done.get(timeout=DEADLINE)
        found[op].add(topic.removeprefix("/cell/"))
    return found


def test_all_that_the_twin_controller_wants_is_granted(make_cell: MakeCell) -> None:
    """Known by its token; other nodes publish some of its topics too."""
    cell = make_cell()
    for topic in WANTED["advertise"]:
        cell.graph.publishers[f"/cell/{topic}"] = ["/trajectory_server"]
    changes: queue.Queue[tuple[str, bool, str]] = queue.Queue()
    url, access = f"ws://127.0.0.1:{cell.server.port}", Access(TWIN_CONTROLLER)
    with TwinLink(SETUP, lambda *_: None, lambda *told: changes.put(told), url, access):
        assert changes.get(timeout=DEADLINE) == ("twin", True, "")
        wishes_of(cell)
        assert cell.server.statistics().refused == 0
    wait_until(lambda: cell.server.statistics().clients == 0, DEADLINE)
    assert any(line.endswith("came as twin_controller") for line in cell.log)


def test_idle_sockets_during_a_lost_line_do_not_keep_it_off(cell: Cell) -> None:
    """The link is cut, strangers take all places, and it is back by itself."""
    connected, lost = threading.Event(), threading.Event()

    def changed(_: str, up: bool, why: str) -> None:
        (connected if up else lost).set()

    access = Access(TWIN_CONTROLLER)
    with (
        Proxy(cell.server.port) as line,
        TwinLink(SETUP, lambda *_: None, changed, f"ws://127.0.0.1:{line.port}", access),
    ):
        assert connected.wait(DEADLINE)
        line.refuse(True)
        assert lost.wait(DEADLINE)
        for _ in range(32):
            stranger = cell.client()
            stranger.say(op="subscribe", topic="t", type="T")
            stranger.time()
        connected.clear()
        line.refuse(False)
        assert connected.wait(DEADLINE)
