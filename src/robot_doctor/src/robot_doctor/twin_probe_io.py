"""Ask the twin's gateway for its time, over the web socket."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

from twin_controller.twin.rosbridge_access_io import Access, shown
from twin_controller.twin.rosbridge_socket_io import (
    LinkSettings,
    RosbridgeSocket,
    TwinLinkLostError,
)

from robot_doctor.finding import Finding, Group, fine, note, wrong

QUESTIONS = 20
TIMEOUT_S = 2.0


def ask_twin(url: str, access: Access) -> Iterator[Finding]:
    """Yield whether the gateway answers, how fast, and how far its clock is from ours."""
    try:
        link = RosbridgeSocket(url, access, LinkSettings(TIMEOUT_S, TIMEOUT_S, TIMEOUT_S))
    except TwinLinkLostError as error:
        yield note(
            Group.LINKS,
            f"no twin at {shown(url)}: {error}",
            "start it (`./cell up`) to check its link too",
        )
        return
    try:
        trips, offsets = [], []
        for number in range(QUESTIONS):
            sent = time.time()
            question = {"op": "call_service", "id": str(number), "service": "/rosapi/get_time"}
            link.send(json.dumps(question).encode())
            answer = _next_packet(link)
            received = time.time()
            stamp = answer["values"]["time"]
            trips.append(received - sent)
            offsets.append(stamp["secs"] + stamp["nsecs"] * 1e-9 - 0.5 * (sent + received))
        # The quickest answer tells the clock best: it is known to half of its trip.
        best = min(range(QUESTIONS), key=trips.__getitem__)
        middle, offset = sorted(trips)[QUESTIONS // 2] * 1e3, offsets[best] * 1e3
        yield fine(
            Group.LINKS,
            f"twin at {shown(url)}: {middle:.2f} ms round trip, clock {offset:+.2f} ms from ours",
        )
    except (TwinLinkLostError, TimeoutError, ValueError, KeyError, TypeError) as error:
        yield wrong(
            Group.LINKS,
            f"the twin at {shown(url)} does not tell its time: {error!r}",
            "is it a rosbridge with rosapi?",
        )
    finally:
        link.close(politely=True)


def _next_packet(link: RosbridgeSocket) -> Any:
    """Return the next packet.

    Raises:
        TimeoutError: None came within ``TIMEOUT_S``, only signs of life.
        TwinLinkLostError: The line is lost.
        ValueError: It is no JSON.
    """
    until = time.monotonic() + TIMEOUT_S
    while time.monotonic() < until:
        if (packet := link.receive()) is not None:
            return json.loads(packet[0])
    raise TimeoutError(f"no answer within {TIMEOUT_S:g} s")
