"""``/api/twin``: the pair for programs without ROS, now, earlier, and as a stream. Reads only."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import msgspec
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from operator_panel.door import Answer
from operator_panel.view.pair import Pair, PairHistory, Refusal, json_schema, named, openapi

ROOT = "/api/twin"
METHODS = ("GET", "HEAD")
FRESH = {"Cache-Control": "no-store"}
STREAM_S = 0.1
STREAMS = 16  # our choice: so many at once; all get the same document
MOST_PAIRS = 240  # our choice: of one history
LONGEST_S = 3600.0
_ENCODE = msgspec.json.Encoder().encode
Shadow = Callable[[float], Awaitable[Answer]]


class RefusedError(Exception):
    """There is no answer; ``status`` is that of HTTP."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status = status


class TwinApi:
    """Asks the twin controller's memory; the newest document is asked for once for all streams."""

    def __init__(self, shadow: Shadow, clock: Callable[[], float] = time.monotonic) -> None:
        """Take who answers: a time [s], 0 now, negative so long ago, else ROS time."""
        self._shadow, self._clock = shadow, clock
        self._asking = asyncio.Lock()
        self._asked, self._event = -math.inf, b""
        self._streams = 0

    def offer(self, server: FastAPI) -> None:
        """Offer all routes."""
        for path, answer in (
            ("", self._pair),
            ("/history", self._history),
            ("/stream", self._stream),
            ("/schema.json", self._schema),
            ("/openapi.json", self._openapi),
        ):
            server.add_api_route(
                ROOT + path, _told(answer), methods=list(METHODS), include_in_schema=False
            )

    async def _at(self, time_s: float) -> Pair:
        found = await self._shadow(time_s)
        if not found.success:
            raise RefusedError(404 if "document" in found.values else 503, found.message)
        return named(found.values["document"])

    async def _pair(self, request: Request) -> Response:
        return _json(await self._at(_numbers(request, time=0.0)["time"]))

    async def _history(self, request: Request) -> Response:
        given = _numbers(request, seconds=10.0, step=0.5)
        seconds, step = given["seconds"], given["step"]
        if not 0.0 < step <= seconds <= LONGEST_S or seconds / step > MOST_PAIRS:
            raise RefusedError(
                400,
                f"seconds = {seconds:g}, step = {step:g}: allowed is 0 < step <= seconds and at "
                f"most {MOST_PAIRS} documents",
            )
        now = await self._at(0.0)
        count = int(seconds / step + 1e-9)
        pairs = []
        for number in range(count, 0, -1):
            try:
                pairs.append(await self._at(now.stamp - number * step))
            except RefusedError as error:
                if error.status != 404:  # the controller was started meanwhile: less is remembered
                    raise
        return _json(PairHistory([*pairs, now]))

    async def _stream(self, request: Request) -> Response:
        _numbers(request)
        if self._streams >= STREAMS:
            raise RefusedError(503, f"{STREAMS} streams are open: close one")
        head = {**FRESH, "X-Accel-Buffering": "no"}
        body = self._events() if request.method == "GET" else _nothing()
        return StreamingResponse(body, media_type="text/event-stream", headers=head)

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
            if self._clock() - self._asked >= 0.9 * STREAM_S:
                self._asked = self._clock()
                try:
                    self._event = b"data: " + _ENCODE(await self._at(0.0)) + b"\n\n"
                except RefusedError as error:
                    told = _ENCODE(Refusal(str(error)))
                    self._event = b"event: refused\ndata: " + told + b"\n\n"
            return self._event

    async def _schema(self, request: Request) -> Response:
        return _json(json_schema(), "application/schema+json")

    async def _openapi(self, request: Request) -> Response:
        return _json(openapi())


def _told(answer: Callable[[Request], Awaitable[Response]]) -> Callable[..., Awaitable[Response]]:
    """Turn refusals into answers."""

    async def told(request: Request) -> Response:
        try:
            return await answer(request)
        except RefusedError as error:
            return _json(Refusal(str(error)), status=error.status)

    return told


def _numbers(request: Request, **defaults: float) -> dict[str, float]:
    """Read the query.

    Raises:
        RefusedError: A parameter is unknown, or no number of seconds.
    """
    unknown = sorted(set(request.query_params) - set(defaults))
    if unknown:
        there = f"there is {', '.join(defaults)}" if defaults else "there is none"
        raise RefusedError(400, f"unknown parameter {', '.join(unknown)}: {there}")
    found = dict(defaults)
    for name, text in request.query_params.items():
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            hint = ": 0 is now, -5 five seconds ago, else ROS time" if name == "time" else ""
            raise RefusedError(400, f"{name} = {text!r} is no number of seconds{hint}")
    return found


async def _nothing() -> AsyncIterator[bytes]:
    return
    yield b""


def _json(content: Any, kind: str = "application/json", status: int = 200) -> Response:
    return Response(_ENCODE(content), status_code=status, media_type=kind, headers=FRESH)
