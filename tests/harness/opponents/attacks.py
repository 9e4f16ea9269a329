"""Clients that mean no good, each to be run in a process of its own.

Attack(port, seconds, seed) -> what was sent.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import socket
import struct
import time
from random import Random
from typing import Any

from harness.wires.gateway_client import connect

TOPIC = "twin/joint_states"
MANY = 60
"""Sockets of a slow-loris attack; twice what the gateway allows as clients."""


def handshake(port: int) -> socket.socket:
    """Open a web socket by hand; nothing is read but the answer's header."""
    line = socket.create_connection(("127.0.0.1", port), timeout=2.0)
    key = base64.b64encode(os.urandom(16)).decode()
    request = (
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    )
    line.sendall(f"{request}Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
    answer = b""
    while b"\r\n\r\n" not in answer:
        data = line.recv(1)
        if not data:
            raise ConnectionError(answer.decode(errors="replace"))
        answer += data
    if b" 101 " not in answer.split(b"\r\n")[0]:
        raise ConnectionError(answer.decode(errors="replace"))
    return line


def frame(payload: bytes, opcode: int = 1, final: bool = True, length: int | None = None) -> bytes:
    """Return a masked frame (mask zero); ``length`` may claim another size than it has."""
    size = len(payload) if length is None else length
    head = bytes([(0x80 if final else 0) | opcode])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 1 << 16:
        head += struct.pack(">BH", 0x80 | 126, size)
    else:
        head += struct.pack(">BQ", 0x80 | 127, size)
    return head + b"\0\0\0\0" + payload


def packet(**fields: Any) -> bytes:
    """Return a frame with one rosbridge packet."""
    return frame(json.dumps(fields).encode())


def flood(port: int, seconds: float, seed: int) -> int:
    """Send small packets as fast as the line takes them, good ones and bad ones; read nothing."""
    rng, sent, end = Random(seed), 0, time.monotonic() + seconds
    kinds = [
        packet(op="publish", topic="faults/flood", type="std_msgs/Float64", msg={"data": 1.0}),
        packet(op="call_service", service="/rosapi/get_time", args={}, id="x"),
        packet(op="subscribe", topic=TOPIC),
        packet(op="dance"),
        frame(b"{"),
        frame(b"", opcode=9),
        frame(b"\xff\xff"),
    ]
    while time.monotonic() < end:
        with contextlib.suppress(OSError), handshake(port) as line:
            while time.monotonic() < end:
                line.sendall(rng.choice(kinds) * 50)
                sent += 50
    return sent


def huge(port: int, seconds: float, seed: int) -> int:
    """Send packets of 10 MB, one that claims 2^62 bytes, and fragments that never end."""
    sent, end, body = 0, time.monotonic() + seconds, b'{"op":"publish","msg":"' + b"x" * 10_000_000
    while time.monotonic() < end:
        for part in (
            frame(body),
            frame(b"x", length=1 << 62),
            frame(b"[" * 60_000, final=False) + frame(b"[" * 60_000, 0, False) * 200,
        ):
            with contextlib.suppress(OSError), handshake(port) as line:
                line.sendall(part)
                sent += 1
    return sent


def nested(port: int, seconds: float, seed: int) -> int:
    """Send packets as deep as they may be long."""
    rng, sent, end = Random(seed), 0, time.monotonic() + seconds
    while time.monotonic() < end:
        depth = rng.choice((100, 10_000, 500_000))
        text = rng.choice(
            (b"[" * depth + b"]" * depth, b'{"a":' * depth + b"1" + b"}" * depth, b"[" * depth)
        )
        with contextlib.suppress(OSError), handshake(port) as line:
            line.sendall(
                frame(b'{"op":"publish","topic":"faults/deep","msg":{"data":' + text + b"}}")
            )
            sent += 1
            time.sleep(0.02)
    return sent


def slow_loris(port: int, seconds: float, seed: int) -> int:
    """Begin many handshakes and finish none, a byte at a time; begin anew what is closed."""
    lines: list[socket.socket] = []
    begun, end, request = (
        0,
        time.monotonic() + seconds,
        b"GET / HTTP/1.1\r\nHost: x\r\nX-Slow: " + b"y" * 10_000,
    )
    progress: dict[socket.socket, int] = {}
    while time.monotonic() < end:
        while len(lines) < MANY:
            with contextlib.suppress(OSError):
                lines.append(socket.create_connection(("127.0.0.1", port), timeout=1.0))
                begun += 1
        for line in list(lines):
            k = progress.get(line, 0)
            try:
                line.sendall(request[k : k + 1])
                progress[line] = k + 1
            except OSError:
                lines.remove(line)
                line.close()
        time.sleep(0.1)
    for line in lines:
        line.close()
    return begun


def stalled(port: int, seconds: float, seed: int) -> int:
    """Subscribe to everything that is fast, with an endless queue, and never read.

    Come again when thrown out.
    """
    begun, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        with contextlib.suppress(OSError), handshake(port) as line:
            begun += 1
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            for topic in (
                TOPIC,
                "real/ground_truth",
                "twin_controller/inputs",
                "joint_pose_controller/state",
            ):
                line.sendall(packet(op="subscribe", topic=topic, queue_length=1_000_000))
            line.settimeout(0.2)
            while time.monotonic() < end:
                line.sendall(frame(b"", opcode=10))  # a pong: it lives, it does not read
                time.sleep(0.1)
    return begun


def reader(port: int, seconds: float, seed: int) -> tuple[int, float]:
    """Be an honest client.

    Return how many joint states came in the time and the longest silence [s].
    """
    line = connect(port, 5.0).line
    line.send(json.dumps({"op": "subscribe", "topic": TOPIC, "throttle_rate": 10}))
    line.recv()
    count, longest, last = 0, 0.0, time.monotonic()
    end = last + seconds
    while last < end:
        line.recv()
        now = time.monotonic()
        count, longest, last = count + 1, max(longest, now - last), now
    line.close()
    return count, longest
