"""``/api/twin``: the twin controller's shadow, passed on to programs without ROS. Reads only."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Awaitable, Callable

import msgspec
from fastapi import FastAPI, HTTPException, Request, Response
from starlette.responses import StreamingResponse

from operator_panel.door import Answer
from operator_panel.view.twin_schema import EVENTS, JSON, ROOT, ROUTES, json_schema, openapi

STREAM_S, STREAMS = 0.1, 16  # our choice: so many at once; all get the same document
LONGEST_S, MOST_PAIRS = 3600.0, 240  # our choice: of one history
FRESH = {"Cache-Control": "no-store"}
SCHEMAS = {"/schema.json": json_schema, "/openapi.json": openapi}


class TwinApi:
    """Asks the twin controller's memory; the newest document is asked for once for all streams."""

    def __init__(
        self,
        shadow: Callable[[float], Awaitable[Answer]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Take who answers: a time [s], 0 now, negative so long ago, else ROS time."""
        self._shadow, self._clock, self._asking = shadow, clock, asyncio.Lock()
        self._asked, self._event, self._streams = -math.inf, b"", 0

    def offer(self, server: FastAPI) -> None:
        """Offer all routes."""
        for path in (*ROUTES, *SCHEMAS):
            server.add_api_route(
                ROOT + path, self._answer, methods=["GET", "HEAD"], include_in_schema=False
            )

    async def _answer(self, request: Request) -> Response:
        path = request.url.path.removeprefix(ROOT)
        if path in SCHEMAS:
            return _json(msgspec.json.encode(SCHEMAS[path]()))
        try:
            given = _numbers(path, dict(request.query_params))
            if path == "/stream":
                if self._streams >= STREAMS:
                    raise HTTPException(503, f"{STREAMS} streams are open: close one")
                head = {**FRESH, "X-Accel-Buffering": "no"}
                if request.method == "HEAD":
                    return Response(headers=head, media_type=EVENTS)
                return StreamingResponse(self._events(), headers=head, media_type=EVENTS)
            if path == "/history":
                return _json(b'{"pairs":[%s]}' % b",".join(await self._history(**given)))
            return _json(await self._at(**given))
        except HTTPException as refused:
            return _json(msgspec.json.encode({"error": refused.detail}), refused.status_code)

    async def _at(self, time: float) -> bytes:
        found = await self._shadow(time)
        if not found.success:
            raise HTTPException(404 if "document" in found.values else 503, found.message)
        return str(found.values["document"]).encode()

    async def _history(self, seconds: float, step: float) -> list[bytes]:
        if not 0.0 < step <= seconds <= LONGEST_S or seconds / step > MOST_PAIRS:
            raise HTTPException(
                400,
                f"seconds = {seconds:g}, step = {step:g}: allowed is 0 < step <= seconds and at "
                f"most {MOST_PAIRS} documents",
            )
        now = await self._at(0.0)
        stamp = msgspec.json.decode(now)["stamp"]
        pairs = []
        # 0.3 / 0.1 falls just short of 3: without the small share the oldest pair would be missing.
        for number in range(int(seconds / step + 1e-9), 0, -1):
            try:
                pairs.append(await self._at(stamp - number * step))
            except HTTPException as refused:
                if refused.status_code != 404:  # started meanwhile: less is remembered
                    raise
        return [*pairs, now]

    async def _events(self) -> AsyncIterator[bytes]:
        """Yield an event each period, on absolute deadlines, until the client goes."""
        self._streams += 1
        try:
            due = self._clock()
            while True:
                yield await self._newest()
                due = max(due + STREAM_S, self._clock())
                await asyncio.sleep(due - self._clock())
        finally:
            self._streams -= 1

    async def _newest(self) -> bytes:
        """Return the newest event; it is asked for when the last one is old."""
        async with self._asking:
            # Less than a period: a stream that wakes a little early must not send an event twice.
            if self._clock() - self._asked >= 0.9 * STREAM_S:
                self._asked = self._clock()
                try:
                    self._event = b"data: %s\n\n" % await self._at(0.0)
                except HTTPException as refused:
                    reason = msgspec.json.encode({"error": refused.detail})
                    self._event = b"event: refused\ndata: %s\n\n" % reason
            return self._event


def _numbers(path: str, query: dict[str, str]) -> dict[str, float]:
    """Return what was asked for, or refuse what is unknown or no number of seconds."""
    found = dict(ROUTES[path][-1])
    if unknown := sorted(set(query) - set(found)):
        raise HTTPException(
            400, f"unknown parameter {', '.join(unknown)}: there is {', '.join(found) or 'none'}"
        )
    for name, text in query.items():
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            hint = ": 0 is now, -5 five seconds ago, else ROS time" if name == "time" else ""
            raise HTTPException(400, f"{name} = {text!r} is no number of seconds{hint}")
    return found


def _json(content: bytes, status: int = 200) -> Response:
    return Response(content, status, FRESH, JSON)
