"""Faults of the ROS master.

Killed and started again, stopped and let go on, under a cell that moves.

The cell has a master of its own; it is looked at from outside only: by the master's own API, the
Modbus port, the tools.
"""

from __future__ import annotations

import contextlib
import json
import math
import signal
import time
from pathlib import Path

from scara_ros.starting.master_io import MasterClient

from harness.faults.rows import Row
from harness.live_cell import FOR_PEOPLE, LiveCell
from harness.processes import Process, wait_until
from harness.starter import PACKAGES
from harness.wires.gateway_client import RosbridgeClient, connect

NODES = tuple(node for node in PACKAGES if node not in FOR_PEOPLE)
AGAIN_S = 2.0
Registrations = set[tuple[str, str, str]]


class MasterCell(LiveCell):
    """All nodes that must stay registered, on a master that can be killed; a context manager."""

    def __init__(self, folder: Path) -> None:
        """Choose ports, and start the master."""
        super().__init__(folder)
        home = str(folder / "ros_home")
        self.environment = {"ROS_HOME": home, "ROS_LOG_DIR": f"{home}/log"}
        # Its links are those of a desk: a late process of the cell is no fault of the master.
        self.arguments = dict.fromkeys(("emulator", "twin_controller"), ("_links:=desk",))
        self.master = self.start_master()

    def __enter__(self) -> MasterCell:
        for node in NODES:
            self.start_node(node)
        wait_until(
            lambda: all(f"/{node}" in self.nodes() for node in NODES),
            60.0,
            f"all nodes; {self.nodes()}",
            period=0.1,
        )
        self.make_ready()
        self.pendant("override", "100")
        return self

    def __exit__(self, *_: object) -> None:
        self.master.signal(signal.SIGCONT)
        self.close()

    def start_master(self) -> Process:
        """Start a master and wait until it answers."""
        words = ("rosmaster", "--core", "-p", str(self.master_port))
        master = self.stage.start(*words, env=self.environment)
        wait_until(
            lambda: self.answers() or master.poll() is not None, 20.0, "a ROS master", period=0.01
        )
        return master

    def answers(self) -> bool:
        """Return whether the master answers."""
        with contextlib.suppress(OSError):
            return bool(MasterClient(self.master_uri, "/tests").ask("getPid"))
        return False

    def registrations(self) -> Registrations:
        """Return (kind, name, node) of everything that our nodes have registered."""
        found: Registrations = set()
        with contextlib.suppress(OSError):
            for kind, entries in zip(
                ("publisher", "subscriber", "service"),
                MasterClient(self.master_uri, "/tests").ask("getSystemState"),
            ):
                found |= {
                    (kind, name, node)
                    for name, nodes in entries
                    for node in nodes
                    if node.strip("/") in NODES
                }
        return found

    def settled(self) -> Registrations:
        """Return the registrations once they stay the same.

        The subscriptions of a client that has just left go first.
        """
        found: list[Registrations] = [set()]

        def same() -> bool:
            found.append(self.registrations())
            return found[-1] == found[-2] != set()

        wait_until(same, 20.0, "registrations that stay", period=0.7)
        return found[-1]

    def nodes(self) -> set[str]:
        """Return the nodes that offer a topic or a service."""
        return {node for _, _, node in self.registrations()}

    def home(self) -> None:
        """Lead the pair back to where it began."""
        self.make_ready()
        wait_until(lambda: self.command("HOME"), 60.0, "a way home", period=0.5)
        wait_until(
            lambda: abs(self.joint_1()) < 0.1 and self.mode() == "IDLE", 30.0, "home", period=0.3
        )

    def joint_1(self) -> float:
        """Read joint 1 of the robot [deg] from its registers."""
        return self.real_joints()[0]

    def command(self, command: str, **fields: object) -> bool:
        """Call ``twin_controller/command``, which the master has to know; return its success."""
        text = json.dumps({"command": command, **fields})
        return bool(self.call("twin_controller/command", text)["success"])


def master_killed(cell: MasterCell) -> list[Row]:
    """Kill the master under a moving pair: the move ends as commanded.

    With a new master all is there again within 2 s.
    """
    cell.home()
    before = cell.settled()
    target = [0.4, 0.3, -0.1, 0.0]
    assert cell.command("MOVE_JOINTS", joint_positions=target, speed_percent=3.0)
    wait_until(lambda: cell.joint_1() > 2.0, 10.0, "a robot under way", period=0.1)
    cell.master.signal(signal.SIGKILL)
    cell.master.wait(5.0)
    away_at = cell.joint_1()
    end = "the end of the move without a master"
    wait_until(lambda: cell.joint_1() > 22.8, 20.0, end, period=0.1)
    time.sleep(0.3)
    cell.master = cell.start_master()
    begun = time.monotonic()
    with contextlib.suppress(AssertionError):
        wait_until(lambda: before <= cell.registrations(), 10.0, period=0.05)
    assert before <= (there := cell.registrations()), (
        f"not registered again: {sorted(before - there)}"
    )
    again = time.monotonic() - begun
    return [
        Row(
            "roscore killed",
            "robot goes on without it [deg]",
            1.0,
            cell.joint_1() - away_at,
            at_least=True,
        ),
        Row("roscore killed", "all topics and services registered again after [s]", AGAIN_S, again),
        Row(
            "roscore killed",
            "services that answer",
            1.0,
            float(cell.command("STOP")),
            at_least=True,
        ),
        Row(
            "roscore killed",
            "new subscribers that get data",
            1.0,
            float(hears(cell)),
            at_least=True,
        ),
    ]


def master_stopped(cell: MasterCell, seconds: float) -> list[Row]:
    """SIGSTOP of the master: the pair goes on and new motion is followed.

    What needs the master is refused with the reason.
    """
    cell.home()
    with connect(cell.gateway_port) as client:
        for topic in ("twin/joint_states", "twin_controller/state"):
            client.ask(op="subscribe", topic=topic, throttle_rate=20)
        cell.master.signal(signal.SIGSTOP)
        words = ("pendant", "run", "TWO_POINT", "--port", str(cell.modbus_port))
        pendant = cell.stage.start("rosrun", "fanuc_emulator", *words)
        answered, twin, modes = _listen(client, seconds, pendant)
        cell.master.signal(signal.SIGCONT)
    cell.pendant("abort")
    return [
        Row("roscore silent", "a call over the gateway is answered after [s]", 3.0, answered),
        Row(
            "roscore silent", "twin follows a program of the robot [deg]", 5.0, twin, at_least=True
        ),
        Row("roscore silent", "times OFFLINE", 0.0, float(modes.count("OFFLINE"))),
    ]


def _listen(
    client: RosbridgeClient, seconds: float, pendant: Process
) -> tuple[float, float, list[str]]:
    """Call a service, listen.

    Return when it was refused, how far the twin's joint 1 went [deg] and the modes seen.

    Listens from the beginning, since the gateway lets a client go that answers no pings, and for
    ``seconds`` after the pendant has done its work.
    """
    begun = time.monotonic()
    client.say(op="call_service", service="/move_to", args={}, id="x", timeout=5.0)
    answered, furthest, modes = float("inf"), 0.0, [""]
    end = begun + seconds
    while time.monotonic() < end:
        if pendant.poll() is None:
            end = time.monotonic() + seconds
        packet = client.hear()
        if packet["op"] == "service_response":
            assert packet["result"] is False and "roscore" in packet["values"], packet
            answered = time.monotonic() - begun
        elif packet.get("topic") == "twin/joint_states":
            furthest = max(furthest, abs(math.degrees(packet["msg"]["position"][0])))
        elif packet["msg"].get("mode", modes[-1]) != modes[-1]:
            modes.append(packet["msg"]["mode"])
    return answered, furthest, modes


def hears(cell: MasterCell) -> bool:
    """Return whether a subscriber that comes now gets a message of each side."""
    return all(
        "header" in cell.tool("rostopic", "echo", "-n", "1", topic)
        for topic in ("/twin/joint_states", "/real/joint_states")
    )
