"""Bare programs on the other side of some rows.

``python -m bench.bare_nodes NAME ..., see the last line``.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any


def empty_service(name: str) -> None:
    """Offer an empty service."""
    import rospy
    from std_srvs.srv import Empty, EmptyResponse

    rospy.init_node("empty_service", anonymous=True)
    answer = EmptyResponse()
    rospy.Service(name, Empty, lambda _: answer)
    rospy.spin()


def constant_service(name: str) -> None:
    """Answer forward_kinematics with always the same pose: the message's own cost."""
    import rospy
    from geometry_msgs.msg import Quaternion

    from scara_msgs.srv import ForwardKinematics, ForwardKinematicsResponse

    rospy.init_node("constant_service", anonymous=True)
    rospy.Service(
        name,
        ForwardKinematics,
        lambda _: ForwardKinematicsResponse(
            True, "", 0.5, 0.1, 0.1, Quaternion(0.7, -0.7, 0.0, 0.0), "righty", 0.0
        ),
    )
    rospy.spin()


def echo(port: str) -> None:
    """Echo web-socket messages; one that begins with a blank goes to all clients."""
    from websockets.asyncio.server import broadcast, serve

    clients: set[Any] = set()

    async def answer(connection: Any) -> None:
        clients.add(connection)
        try:
            async for message in connection:
                if message[0] == " ":
                    broadcast(clients, message)
                else:
                    await connection.send(message)
        finally:
            clients.discard(connection)

    async def run() -> None:
        async with serve(answer, "127.0.0.1", int(port), compression=None):
            print("listening", flush=True)
            await asyncio.Future()

    asyncio.run(run())


def record(path: str, *topics: str) -> None:
    """Record topics as rosbag does by default."""
    import rosbag
    import rospy

    rospy.init_node("bare_recorder", anonymous=True)
    bag = rosbag.Bag(path, "w")

    def keep(message: Any, topic: str) -> None:
        header = message._connection_header
        raw = (header["type"], message._buff, header["md5sum"], None, None)
        bag.write(topic, raw, raw=True, connection_header={**header, "topic": topic})

    for topic in topics:
        rospy.Subscriber(topic, rospy.AnyMsg, keep, topic, queue_size=1000, tcp_nodelay=True)
    rospy.spin()
    bag.close()


def sink(port: str) -> None:
    """Take web-socket messages, parse each, remember when; answer "end" with all times."""
    from websockets.asyncio.server import serve

    async def take(connection: Any) -> None:
        arrivals = []
        async for message in connection:
            if message == "end":
                await connection.send(json.dumps(arrivals))
            else:
                json.loads(message)
                arrivals.append(time.monotonic())

    async def run() -> None:
        async with serve(take, "127.0.0.1", int(port), compression=None):
            print("listening", flush=True)
            await asyncio.Future()

    asyncio.run(run())


def poll(
    modbus_port: str, sink_port: str, offset: str, count: str, device: str, seconds: str
) -> None:
    """Poll registers at 100 Hz on absolute deadlines and send each block on.

    Print words, times of reading and of arrival.
    """
    import websocket
    from pymodbus.client import ModbusTcpClient

    client = ModbusTcpClient("127.0.0.1", port=int(modbus_port), retries=0)
    client.connect()
    line = websocket.create_connection(f"ws://127.0.0.1:{sink_port}", sockopt=((6, 1, 1),))
    reads, due = [], time.monotonic()
    for _ in range(int(100 * float(seconds))):
        words = client.read_holding_registers(
            int(offset), count=int(count), device_id=int(device)
        ).registers
        reads.append((time.monotonic(), words))
        line.send(json.dumps({"op": "publish", "topic": "/setpoint", "msg": {"words": words}}))
        due += 0.01
        time.sleep(max(0.0, due - time.monotonic()))
    line.send("end")
    print(json.dumps({"reads": reads, "arrivals": json.loads(line.recv())}), flush=True)


if __name__ == "__main__":
    {
        "empty_service": empty_service,
        "constant_service": constant_service,
        "echo": echo,
        "record": record,
        "sink": sink,
        "poll": poll,
    }[sys.argv[1]](*sys.argv[2:])
