"""Bare programs on the other side of some rows: ``python -m bench.bare_nodes empty_service|echo|record ...``."""

from __future__ import annotations

import asyncio
import sys
from typing import Any


def empty_service(name: str) -> None:
    """Offer an empty service."""
    import rospy
    from std_srvs.srv import Empty, EmptyResponse

    rospy.init_node("empty_service", anonymous=True)
    answer = EmptyResponse()
    rospy.Service(name, Empty, lambda _: answer)
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


if __name__ == "__main__":
    {"empty_service": empty_service, "echo": echo, "record": record}[sys.argv[1]](*sys.argv[2:])
