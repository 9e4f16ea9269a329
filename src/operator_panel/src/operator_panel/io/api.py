"""Read-only routes beside the page, for everybody who may see it: the pair, the camera, events."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

import msgspec
from nicegui import app
from starlette.requests import Request
from starlette.responses import Response

from operator_panel.door import Answer, Picture

TWIN, CAMERA, EVENTS = "/api/twin", "/camera.jpg", "/events.csv"
FRESH = {"Cache-Control": "no-store"}


def offer_twin(shadow: Callable[[float], Awaitable[Answer]]) -> None:
    """Offer the route; ``shadow`` gets a time [s]: 0 now, negative so long ago, else ROS time."""

    async def answer(request: Request) -> Response:
        given = request.query_params.get("time", "0")
        unknown = sorted(set(request.query_params) - {"time"})
        if unknown:
            return _refusal(400, f"unknown parameter {', '.join(unknown)}: there is time")
        time = _number(given)
        if time is None:
            return _refusal(
                400,
                f"time = {given!r} is no number of seconds: "
                "0 is now, -5 five seconds ago, else ROS time",
            )
        found = await shadow(time)
        if found.success:
            return Response(found.values["document"], media_type="application/json", headers=FRESH)
        return _refusal(404 if "document" in found.values else 503, found.message)

    app.add_api_route(TWIN, answer, methods=["GET"], include_in_schema=False)


def offer_camera(picture: Callable[[str], Awaitable[Picture | None]]) -> None:
    """Offer the camera's next picture.

    ``?after=STAMP`` waits for a picture with another stamp; the answer's head has the stamp.
    """

    async def answer(after: str = "") -> Response:
        found = await picture(after)
        if found is None:
            return _refusal(503, "no picture comes: is the camera running, and the twin?")
        return Response(
            found.jpeg, media_type="image/jpeg", headers={**FRESH, "X-Stamp": found.stamp}
        )

    app.add_api_route(CAMERA, answer, methods=["GET"], include_in_schema=False)


def offer_events(csv: Callable[[], str]) -> None:
    """Offer the kept events as a file for a spreadsheet."""

    async def answer() -> Response:
        name = {"Content-Disposition": 'attachment; filename="events.csv"'}
        return Response(csv(), media_type="text/csv; charset=utf-8", headers={**FRESH, **name})

    app.add_api_route(EVENTS, answer, methods=["GET"], include_in_schema=False)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _refusal(status: int, why: str) -> Response:
    return Response(
        msgspec.json.encode({"error": why}),
        status_code=status,
        media_type="application/json",
        headers=FRESH,
    )
