"""A subscriber of paho that does with states what the desk does: decode, keep the newest, count.

Usage: python -m bench.many_cells.paho_desk PORT. Words on its input: ``begin`` and ``end``.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from typing import Any

import paho.mqtt.client as mqtt
from farm.config import load_farm
from farm.desk.roster import Roster
from farm.keys import STATE, CellName, every, owner
from farm.wire import CellState, decode


class Receiver:
    """Holds a roster, as the desk."""

    def __init__(self, port: int) -> None:
        config = load_farm()
        self._roster, self._names = Roster(config.desk.silent_ms * 1e-3), dict[str, CellName]()
        self._ages: list[float] = []
        self._received = 0
        self._client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        self._client.on_message = self._take
        self._client.connect("127.0.0.1", port)
        self._client.subscribe(every("site", STATE).replace("*", "+"), 0)
        self._client.loop_start()

    def _take(self, _: Any, __: Any, message: mqtt.MQTTMessage) -> None:
        now, topic = time.time(), message.topic
        name = self._names.get(topic) or self._names.setdefault(topic, owner(topic))
        state = decode(message.payload, CellState)
        self._roster.shown(name, state, now)
        self._ages.append(now - state.stamp)
        self._received += 1

    def begin(self) -> dict[str, float]:
        """Begin to count ages."""
        self._ages.clear()
        return {"received": self._received}

    def end(self) -> dict[str, float]:
        """Return what was counted; states are counted since the start."""
        return {
            "received": self._received,
            "age_p50_ms": 1000.0 * statistics.median(self._ages),
            "age_p99_ms": 1000.0 * statistics.quantiles(self._ages, n=100)[98],
        }


def main(port: int) -> None:
    """Answer words until the input ends."""
    receiver = Receiver(port)
    print("{}", flush=True)
    for line in sys.stdin:
        word = {"begin": receiver.begin, "end": receiver.end}[line.strip()]
        print(json.dumps(word()), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
