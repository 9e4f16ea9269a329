"""Invented cells that send their states by paho, as bench.synthetic does by zenoh.

Usage: python -m bench.many_cells.paho_cells PORT CELLS RATE_HZ SECONDS FIRST
"""

from __future__ import annotations

import sys
import time

import paho.mqtt.client as mqtt
from farm.keys import STATE, checked
from farm.link.shown import ShownState, show
from farm.wire import encode

from bench.synthetic.invented import Invented

QOS = 0
"""As the farm's states: a newer one replaces what is lost."""


def main(port: int, count: int, rate_hz: float, seconds: float, first: int) -> None:
    """Connect, say so, send, and say how many states were sent."""
    cells = [Invented(first + k, 0.0) for k in range(count)]
    shown = [ShownState(0) for _ in cells]
    topics = [checked("site", "practice", cell.name).key(STATE) for cell in cells]
    clients = [_connected(port) for _ in cells]
    print("connected", flush=True)
    put, begun = 0, time.monotonic()
    due = begun
    while due - begun < seconds:
        for k, cell in enumerate(cells):
            if (left := due + k / (count * rate_hz) - time.monotonic()) > 1e-3:
                time.sleep(left)
            shown[k], state = show(shown[k], cell.pair(time.time()), remote=False)
            clients[k].publish(topics[k], encode(state), QOS)
            put += 1
        due += 1.0 / rate_hz
    for client in clients:
        client.disconnect()
        client.loop_stop()
    print(f"{put} states put", flush=True)


def _connected(port: int) -> mqtt.Client:
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
    client.connect("127.0.0.1", port)
    client.loop_start()
    while not client.is_connected():
        time.sleep(0.01)
    return client


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[3:5]), int(sys.argv[5]))
