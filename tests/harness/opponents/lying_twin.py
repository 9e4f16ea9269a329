"""A web-socket server that lies about the twin.

What is true at a stamp follows from the stamp alone.
"""

from __future__ import annotations

import json
import math
import threading
import time
from collections import Counter
from collections.abc import Callable
from random import Random
from typing import Any

from scara_config import load_robot
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from harness.workspace import ROOT

JOINTS = load_robot(ROOT / "config").twin_joints
PERIOD_S = 2.0
PAUSE_S = 0.002
BURST = 20
"""Packets between two pauses."""
BOOT = 1_700_000_000.0
"""ROS time when the monotonic clock read 0."""

Message = dict[str, Any]
Change = Callable[[Random, Message], None]
Damage = Callable[[Random, bytes], bytes]


def truth(stamp: float) -> tuple[list[float], list[float]]:
    """Return positions and speeds in SI at a stamp.

    The twin swings between 20 % and 90 % of one half of each range.
    """
    q, qdot = [], []
    for k, joint in enumerate(JOINTS):
        half = joint.upper if joint.upper > 0.0 else joint.lower
        phase = 2.0 * math.pi * (math.fmod(stamp, PERIOD_S) / PERIOD_S + 0.13 * k)
        q.append(half * (0.55 + 0.35 * math.sin(phase)))
        qdot.append(half * 0.35 * math.cos(phase) * 2.0 * math.pi / PERIOD_S)
    return q, qdot


def true_message(stamp: float) -> Message:
    """Return a sensor_msgs/JointState as rosbridge carries it."""
    seconds = int(stamp)
    q, qdot = truth(seconds + round((stamp - seconds) * 1e9) * 1e-9)
    header = {
        "seq": 0,
        "stamp": {"secs": seconds, "nsecs": round((stamp - seconds) * 1e9)},
        "frame_id": "",
    }
    return {
        "header": header,
        "name": [joint.name for joint in JOINTS],
        "position": q,
        "velocity": qdot,
        "effort": [0.0] * len(q),
    }


class LyingTwin:
    """Publishes joint states as fast as it can; a context manager.

    ``lies`` counts what was told, ``sent`` all packets; ``told`` holds each true stamp, and whether
    there was a lie at it.
    """

    def __init__(self, seed: int) -> None:
        """Lie by chance, never twice in a row."""
        self.lies: Counter[str] = Counter()
        self.told: dict[float, bool] = {}
        self.sent = 0
        self.honest = False
        self._rng, self._rate = Random(seed), 0.5
        self._server = serve(self._attend, "127.0.0.1", 0, compression=None, ping_interval=None)
        self.url = f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    def __enter__(self) -> LyingTwin:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._server.shutdown()
        self._thread.join(5.0)

    def _attend(self, line: ServerConnection) -> None:
        lied = False
        try:
            while self.sent % BURST or not self._stop.wait(PAUSE_S):
                message = true_message(BOOT + time.monotonic())
                lied = not self.honest and not lied and self._rng.random() < self._rate
                stamp = message["header"]["stamp"]
                at = stamp["secs"] + stamp["nsecs"] * 1e-9
                self.told[at] = lied or self.told.get(at, False)
                self.sent += 1
                line.send(self._lie(message) if lied else _packet(message), text=True)
        except ConnectionClosed:
            return

    def _lie(self, message: Message) -> bytes:
        name = self._rng.choice(sorted({**CHANGES, **DAMAGES}))
        self.lies[name] += 1
        if name in CHANGES:
            CHANGES[name](self._rng, message)
            return _packet(message)
        return DAMAGES[name](self._rng, _packet(message))


def _packet(message: Message) -> bytes:
    return json.dumps({"op": "publish", "topic": "twin/joint_states", "msg": message}).encode()


def _set(field: str, value: Callable[[Random, float, int], Any]) -> Change:
    """Replace one joint's number; the function gets generator, true value and joint."""

    def change(rng: Random, message: Message) -> None:
        k = rng.randrange(len(JOINTS))
        message[field][k] = value(rng, message[field][k], k)

    return change


def _shift(rng: Random, message: Message) -> None:
    message["header"]["stamp"]["secs"] += rng.choice((-3600, 3600, -1, 1))


def _garble(rng: Random, data: bytes) -> bytes:
    """Change one digit of the numbers: sometimes it is too small to be noticed."""
    places = [k for k, byte in enumerate(data) if 0x30 <= byte <= 0x39]
    at = rng.choice(places)
    return data[:at] + rng.choice(b"0123456789").to_bytes() + data[at + 1 :]


CHANGES: dict[str, Change] = {
    "NaN": _set("position", lambda rng, q, k: math.nan),
    "infinite speed": _set("velocity", lambda rng, v, k: math.inf),
    "null": _set("position", lambda rng, q, k: None),
    "text": _set("position", lambda rng, q, k: str(q)),
    "true": _set("position", lambda rng, q, k: True),
    "huge": _set("position", lambda rng, q, k: 10 ** rng.randint(3, 400)),
    "sign of a position": _set("position", lambda rng, q, k: -q),
    "sign of a speed": _set("velocity", lambda rng, v, k: -v),
    "65535": _set("position", lambda rng, q, k: 65535),
    "degrees": _set("position", lambda rng, q, k: q * 180.0 / math.pi),
    "beyond the range": _set(
        "position", lambda rng, q, k: JOINTS[k].upper + 0.1 * (JOINTS[k].upper - JOINTS[k].lower)
    ),
    "joint missing": lambda rng, m: m["name"].pop(),
    "joint twice": lambda rng, m: m["name"].__setitem__(0, m["name"][1]),
    "fewer positions": lambda rng, m: m["position"].pop(),
    "more speeds": lambda rng, m: m["velocity"].append(0.0),
    "no header": lambda rng, m: m.pop("header"),
    "shifted stamp": _shift,
    "stamp of another type": lambda rng, m: m["header"].__setitem__(
        "stamp", rng.choice((None, 7, "now", [1, 2], {"secs": 1}))
    ),
    "other order": lambda rng, m: m.update(
        {field: m[field][::-1] for field in ("name", "position", "velocity", "effort")}
    ),
}
DAMAGES: dict[str, Damage] = {
    "truncated": lambda rng, data: data[: rng.randrange(len(data))],
    "twice": lambda rng, data: data + data,
    "one digit": _garble,
    "garbage": lambda rng, data: rng.randbytes(rng.randint(1, 300)),
    "no text": lambda rng, data: data[:50] + b"\xff\xfe" + data[52:],
    "nested": lambda rng, data: b"[" * 5000 + data,
    "another type": lambda rng, data: rng.choice(
        (b"null", b"7", b"[]", b'"text"', b'{"op": 7}', b'{"op": "publish", "msg": []}')
    ),
}
