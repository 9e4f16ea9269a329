"""Eight web pages that mean no good, and what another client of the gateway feels of them.

Loopback only, for as long as is said: ``python -m harness.opponents.hostile_pages PORT SECONDS``.
"""

from __future__ import annotations

import base64
import contextlib
import io
import itertools
import json
import multiprocessing
import os
import socket
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from PIL import Image, PngImagePlugin

from harness.opponents.attacks import frame, packet
from harness.wires.gateway_client import connect

ORIGIN = "http://localhost:8080"
"""A page that may connect, and only look."""
PERIOD_S = 0.01
"""How often the other client asks."""


@dataclass(frozen=True)
class Answers:
    """How long [s] another client waited for its answers, and how many bytes the pages sent.

    ``plain`` are p99 and worst of two programs that did the same without any gateway meanwhile:
    what the machine makes everybody wait.
    """

    count: int
    median: float
    p99: float
    worst: float
    sent: int
    plain: tuple[float, float]


def _publish(data: bytes) -> bytes:
    return frame(b'{"op":"publish","topic":"t","msg":{"data":' + data + b"}}")


def _image(texts: int, length: int) -> bytes:
    """Return a packet in an image with so many texts of so many letters beside its picture."""
    notes = PngImagePlugin.PngInfo()
    for number in range(texts):
        notes.add_text(f"note{number}", "x" * length, zip=True)
    buffer = io.BytesIO()
    Image.new("RGB", (4, 4)).save(buffer, "png", pnginfo=notes)
    return packet(op="png", data=base64.b64encode(buffer.getvalue()).decode())


def brackets() -> Iterator[bytes]:
    """Send packets that are slow to decode: as long as a page may send, and 1 MB."""
    yield from itertools.cycle(
        [_publish(b"[" + b"[]," * 5000 + b"1]")] * 200 + [_publish(b"[" + b"[]," * 349_000 + b"1]")]
    )


def images() -> Iterator[bytes]:
    """Send images with texts that unpack to megabytes: 90 kB, and as long as a page may send."""
    yield from itertools.cycle([_image(12, 800_000)] * 20 + [_image(90, 800_000)])


def tiny_frames() -> Iterator[bytes]:
    """Send pings, empty packets and what is no JSON, as small as they can be."""
    yield from itertools.cycle((frame(b"", 9) * 3000, frame(b"") * 3000, frame(b"{") * 3000))


def fragments() -> Iterator[bytes]:
    """Send pieces of packets that never become whole."""
    for number in itertools.count():
        yield packet(op="fragment", id=number % 20, num=number % 9, total=9999, data="[" * 500)


def calls() -> Iterator[bytes]:
    """Ask what is answered at once, without end."""
    yield from itertools.repeat(packet(op="call_service", id="t", service="/rosapi/get_time") * 50)


def questions() -> Iterator[bytes]:
    """Ask what is long to answer."""
    names = (
        *("topics_and_raw_types", "nodes", "get_param_names", "services", "topics"),
        *("services_for_type", "service_providers"),
    )
    yield from itertools.cycle(
        [packet(op="call_service", service=f"/rosapi/{name}", fragment_size=1) for name in names]
    )


def subscriptions() -> Iterator[bytes]:
    """Subscribe all that moves in each form, in the smallest pieces, and end it again."""
    topics = ("twin/joint_states", "real/joint_states", "/diagnostics", "/rosout", "/tf", "none")
    for number in itertools.count():
        topic, form = topics[number % 6], ("png", "cbor", "none")[number % 3]
        yield packet(
            op="subscribe",
            topic=topic,
            type="std_msgs/String" if topic == "none" else None,
            id=str(number),
            compression=form,
            fragment_size=1 + number % 7,
            queue_length=10_000,
        )
        if number % 50 == 49:
            for one in topics:
                yield packet(op="unsubscribe", topic=one)


def nothing() -> Iterator[bytes]:
    """Come and go again."""
    return iter(())


PAGES = (brackets, images, tiny_frames, fragments, calls, questions, subscriptions, nothing)


def knock(port: int, origin: str) -> socket.socket:
    """Open a web socket as a browser's page does; read what comes from now on.

    Raises:
        OSError: The page was turned away.
    """
    line = socket.create_connection(("127.0.0.1", port), timeout=2.0)
    key = base64.b64encode(os.urandom(16)).decode()
    request = (
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
        f"Connection: Upgrade\r\nOrigin: {origin}\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n"
    )
    line.sendall(request.encode())
    if b" 101 " not in line.recv(1024):
        line.close()
        raise ConnectionRefusedError(f"a page of {origin} was turned away")
    line.setblocking(False)
    return line


def _visit(port: int, page: int, end: float) -> int:
    """Be one page until ``end`` (monotonic, [s]); come again when thrown out. Return bytes sent."""
    sent, forms = 0, itertools.cycle((ORIGIN, "null"))
    while time.monotonic() < end:
        with (
            contextlib.suppress(OSError),
            knock(port, ORIGIN if PAGES[page] is not nothing else next(forms)) as line,
        ):
            for data in PAGES[page]():
                left = memoryview(data)
                while left and time.monotonic() < end:
                    with contextlib.suppress(BlockingIOError):
                        if not line.recv(1 << 16):
                            raise ConnectionResetError
                    try:
                        gone = line.send(left)
                    except BlockingIOError:
                        time.sleep(0.001)  # a browser takes time, too
                        continue
                    left, sent = left[gone:], sent + gone
                if time.monotonic() >= end:
                    break
        time.sleep(0.002)
    return sent


def visit(port: int, seconds: float) -> int:
    """Be all eight pages at once, each in a thread; return how many bytes they sent."""
    end, sent = time.monotonic() + seconds, [0] * len(PAGES)

    def run(page: int) -> None:
        sent[page] = _visit(port, page, end)

    threads = [threading.Thread(target=run, args=(page,)) for page in range(len(PAGES))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return sum(sent)


def _ask(port: int, seconds: float) -> list[float]:
    """Be a program that asks for the time again and again; return how long [s] it waited."""
    line = connect(port).line
    question = json.dumps({"op": "call_service", "id": "q", "service": "/rosapi/get_time"})
    waits, end = [], time.monotonic() + seconds
    while (begun := time.monotonic()) < end:
        line.send(question)
        line.recv()
        waits.append(time.monotonic() - begun)
        time.sleep(max(0.0, PERIOD_S - waits[-1]))
    line.close()
    return waits


def _echo(seconds: float) -> list[float]:
    """Be two programs, one of which asks as often; return how long [s] it waited each time."""
    line, other = socket.socketpair()
    if os.fork() == 0:
        line.close()
        while data := other.recv(1 << 10):
            other.send(data)
        os._exit(0)
    other.close()
    waits, end = [], time.monotonic() + seconds
    while (begun := time.monotonic()) < end:
        line.send(b"q" * 100)
        line.recv(1 << 10)
        waits.append(time.monotonic() - begun)
        time.sleep(max(0.0, PERIOD_S - waits[-1]))
    line.close()
    os.wait()
    return waits


def beside_pages(port: int, seconds: float) -> Answers:
    """Measure another client's answers beside eight hostile pages, each side in a process."""
    with ProcessPoolExecutor(3, mp_context=multiprocessing.get_context("spawn")) as pool:
        pages = pool.submit(visit, port, seconds)
        plain = pool.submit(_echo, seconds)
        waits = np.array(pool.submit(_ask, port, seconds).result())
        sent, echoed = pages.result(), np.array(plain.result())
    p50, p99 = np.percentile(waits, (50, 99))
    beside = float(np.percentile(echoed, 99)), float(echoed.max())
    return Answers(len(waits), float(p50), float(p99), float(waits.max()), sent, beside)


if __name__ == "__main__":
    answers = beside_pages(int(sys.argv[1]), float(sys.argv[2]))
    print(
        f"{answers.count} answers beside eight hostile pages that sent {answers.sent / 1e6:.1f} MB:"
        f" {1e3 * answers.median:.2f} ms median, {1e3 * answers.p99:.1f} ms p99, "
        f"{1e3 * answers.worst:.1f} ms worst; without a gateway "
        f"{1e3 * answers.plain[0]:.1f} and {1e3 * answers.plain[1]:.1f} ms"
    )
