"""Rows service_call, gateway.

What a call and a web-socket client cost on top of the bare libraries.
"""

from __future__ import annotations

import json
import os
import select
import sys
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import websocket
import websockets
from harness.processes import free_port, wait_until
from harness.ros import Ros
from scara_bringup.config import Ports
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config import config_directory, load_robot
from scara_config.writer import write_values

from bench.record import Beside, Goal, Record, interleaved, median, of_rounds
from bench.room import Room
from bench.timing import timed

CALL_ROUNDS, CALLS = 9, 300
TRIP_ROUNDS, TRIPS, CLIENTS = 30, 50, 20
TOPIC, WATCHED = "/bench/joint_states", "/bench/watched"


def service_call(room: Room) -> Record:
    """Forward kinematics through rospy against an empty service, both connections kept."""
    ros = room.ros
    # A caller and a node on two processors wait 20 or 70 us for each other, as the scheduler
    # happens to place them: one for all.
    everywhere = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(everywhere)})
    try:
        ros.run("scara_control", "kinematics_server")
        ros.stage.start(
            sys.executable, "-m", "bench.bare_nodes", "empty_service", ros.name("empty")
        )
        ros.stage.start(
            sys.executable, "-m", "bench.bare_nodes", "constant_service", ros.name("constant")
        )
        return _service_call(ros)
    finally:
        os.sched_setaffinity(0, everywhere)


def _service_call(ros: Ros) -> Record:
    """Measure, once all three answer."""
    import rospy
    from std_srvs.srv import Empty

    from scara_msgs.srv import ForwardKinematics

    for name in ("forward_kinematics", "empty", "constant"):
        ros.wait_for_service(name, 30.0)
    forward = rospy.ServiceProxy(ros.name("forward_kinematics"), ForwardKinematics, persistent=True)
    empty = rospy.ServiceProxy(ros.name("empty"), Empty, persistent=True)
    constant = rospy.ServiceProxy(ros.name("constant"), ForwardKinematics, persistent=True)
    pose = [0.3, 0.8, -0.1]
    assert forward(pose).success and constant(pose).success
    samples = interleaved(
        CALL_ROUNDS,
        lambda: timed(lambda: forward(pose), CALLS),
        lambda: timed(empty, CALLS),
        lambda: timed(lambda: constant(pose), CALLS),
    )
    forward.close()
    empty.close()
    value, tail, spread = of_rounds(samples[0], median, 1e6)
    other, other_tail, other_spread = of_rounds(samples[1], median, 1e6)
    return Record(
        "service_call",
        value,
        other,
        "us",
        (Goal("ratio", 1.2),),
        measured="kinematics_server's forward_kinematics, three joints, all checks, pose as "
        "position and quaternion",
        against="an empty service (std_srvs/Empty) of a bare rospy node, called likewise; "
        "caller and nodes on one processor",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=CALL_ROUNDS,
        beside=(
            Beside(
                "ours / a bare node that answers the same message with a constant",
                median(samples[0]) / median(samples[2]),
                "",
            ),
        ),
    )


def _joint_states() -> dict[str, Any]:
    """Return one message as the simulator publishes it."""
    names = [joint.name for joint in load_robot().twin_joints]
    return {
        "header": {"seq": 1, "stamp": {"secs": 1700000000, "nsecs": 123456789}, "frame_id": ""},
        "name": names,
        "position": [0.123456789012, 1.234567890123, -0.101234567890, 0.5],
        "velocity": [0.523456789012, -1.134567890123, 0.201234567890, 0.1],
        "effort": [12.3456789012, -3.34567890123, 17.1234567890, 0.3],
    }


class _Gateway:
    """A gateway, a bare echo server and their clients."""

    def __init__(self, room: Room, stack: ExitStack) -> None:
        ros, self._stack = room.ros, stack
        self.port, echo_port = free_port(), free_port()
        config = copy_with_ports(
            config_directory(), room.place("gateway_config"), Ports(gateway=self.port)
        )
        write_values(
            config / "gateway.yaml", {("ping_interval",): 20.0, ("ping_timeout",): 20.0}
        )  # our clients take turns
        ros.run("rosbridge_gateway", "gateway", f"_config_dir:={config}")
        echo = ros.stage.start(sys.executable, "-m", "bench.bare_nodes", "echo", str(echo_port))
        wait_until(lambda: "listening" in echo.output, 20.0, "the echo server")
        wait_until(
            lambda: self._open(self.port) is not None, 30.0, "the gateway's port", period=0.2
        )
        self.text = json.dumps(_joint_states())
        self.client, self.bare = self._connect(self.port), self._connect(echo_port)
        self.listeners = [self._connect(self.port) for _ in range(CLIENTS)]
        self.bare_listeners = [self._connect(echo_port) for _ in range(CLIENTS)]
        self.bare_speaker = self._connect(echo_port)
        for topic in (TOPIC, WATCHED):
            self._say(
                self.client,
                op="advertise",
                topic=topic,
                type="sensor_msgs/JointState",
                queue_size=10,
            )
        self._say(self.client, op="subscribe", topic=TOPIC, type="sensor_msgs/JointState")
        for listener in self.listeners:
            self._say(listener, op="subscribe", topic=WATCHED, type="sensor_msgs/JointState")
        self.packet = f'{{"op":"publish","topic":"{TOPIC}","msg":{self.text}}}'
        self.shared = f'{{"op":"publish","topic":"{WATCHED}","msg":{self.text}}}'
        wait_until(self._flows, 20.0, "joint states through the gateway", period=0.2)

    def _open(self, port: int) -> Any:
        try:
            return self._connect(port)
        except OSError:
            return None

    def _connect(self, port: int) -> Any:
        line = websocket.create_connection(
            f"ws://127.0.0.1:{port}", timeout=5.0, sockopt=((6, 1, 1),), suppress_origin=True
        )
        self._stack.callback(line.close)
        return line

    @staticmethod
    def _say(line: Any, **packet: Any) -> None:
        line.send(json.dumps(packet))

    def _flows(self) -> bool:
        """Send until everybody gets it; then take what is left on the lines."""
        for packet, lines in ((self.packet, [self.client]), (self.shared, self.listeners)):
            self.client.send(packet)
            for line in lines:
                line.settimeout(0.5)
                try:
                    while '"publish"' not in line.recv():
                        pass
                except websocket.WebSocketTimeoutException:
                    return False
                finally:
                    line.settimeout(5.0)
        return True

    def answer_pings(self) -> None:
        """Answer what the servers have asked while other clients were at work.

        A silent client is dropped after a second.
        """
        lines = [self.client, self.bare, self.bare_speaker, *self.listeners, *self.bare_listeners]
        while readable := select.select(lines, [], [], 0.0)[0]:
            for line in readable:
                line.recv_data_frame(control_frame=True)

    def round(self, call: Callable[[], object]) -> list[float]:
        """Time calls, with all lines quiet before."""
        self.answer_pings()
        return timed(call, TRIPS)

    def trip(self) -> None:
        """Send a message and wait until the gateway brings it back from ROS."""
        self.client.send(self.packet)
        self.client.recv()

    def bare_trip(self) -> None:
        """Send the same bytes and wait for the echo."""
        self.bare.send(self.packet)
        self.bare.recv()

    def fan_out(self) -> None:
        """Send a message and wait until all clients have it."""
        self.client.send(self.shared)
        for line in self.listeners:
            line.recv()

    def bare_fan_out(self) -> None:
        """Send the same bytes and wait until all clients of the bare server have them."""
        self.bare_speaker.send(" " + self.shared)
        for line in (*self.bare_listeners, self.bare, self.bare_speaker):
            line.recv()


def gateway(room: Room) -> Record:
    """Joint states there and back through gateway and ROS, and from one to twenty clients."""
    with ExitStack() as stack:
        lines = _Gateway(room, stack)
        there, echo, fan, bare_fan = interleaved(
            TRIP_ROUNDS,
            lambda: lines.round(lines.trip),
            lambda: lines.round(lines.bare_trip),
            lambda: lines.round(lines.fan_out),
            lambda: lines.round(lines.bare_fan_out),
        )
    value, tail, spread = of_rounds(there, median, 1e6)
    other, other_tail, other_spread = of_rounds(echo, median, 1e6)
    fan_ratio = median(fan) / median(bare_fan)
    return Record(
        "gateway",
        value,
        other,
        "us",
        (Goal("ratio", 3.0),),
        measured="client -> gateway -> ROS topic -> gateway -> client: sensor_msgs/JointState, "
        "parsed, checked, converted twice",
        against=f"a bare websockets {websockets.__version__} echo of the same bytes, no "
        "compression, the same client",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=TRIP_ROUNDS,
        beside=(
            Beside(
                f"from one client to {CLIENTS} by ROS, until the last has it",
                median(fan) * 1e6,
                "us",
            ),
            Beside(
                f"ours / websockets' broadcast to {CLIENTS + 2} clients",
                fan_ratio,
                "",
                "<= 3",
                fan_ratio <= 3.0,
            ),
        ),
    )
