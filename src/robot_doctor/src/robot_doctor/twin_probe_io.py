"""Ask the twin's gateway for its time, over the web socket."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import websocket
from twin_controller.twin.rosbridge_access_io import Access, is_secure, shown, tls_context

from robot_doctor.finding import Finding, Group, fine, note, wrong

QUESTIONS = 20
TIMEOUT_S = 2.0


def ask_twin(url: str, access: Access) -> Iterator[Finding]:
    """Yield whether the gateway answers, how fast, and how far its clock is from ours."""
    try:
        tls = {"context": tls_context(access.ca_file)} if is_secure(url) else None
        link = websocket.create_connection(
            url,
            timeout=TIMEOUT_S,
            header=access.headers,
            sslopt=tls,
            suppress_origin=True,
            http_no_proxy=["*"],
            # Behind a redirect another server would get the token.
            redirect_limit=0,
        )
    except (OSError, websocket.WebSocketException) as error:
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
            link.send(
                json.dumps({"op": "call_service", "id": str(number), "service": "/rosapi/get_time"})
            )
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
    except (OSError, ValueError, KeyError, TypeError, websocket.WebSocketException) as error:
        yield wrong(
            Group.LINKS,
            f"the twin at {shown(url)} does not tell its time: {error!r}",
            "is it a rosbridge with rosapi?",
        )
    finally:
        link.close()


def _next_packet(link: websocket.WebSocket) -> Any:
    """Return the next packet.

    Each ping would let the line's own ``recv`` wait anew.

    Raises:
        TimeoutError: None came within ``TIMEOUT_S``.
        ValueError: It is no JSON, or the other side has closed the line.
    """
    until = time.monotonic() + TIMEOUT_S
    while time.monotonic() < until:
        kind, frame = link.recv_data_frame(control_frame=True)
        if kind not in (websocket.ABNF.OPCODE_PING, websocket.ABNF.OPCODE_PONG):
            return json.loads(b"" if kind == websocket.ABNF.OPCODE_CLOSE else frame.data)
    raise TimeoutError(f"no answer within {TIMEOUT_S:g} s")
