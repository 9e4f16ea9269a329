"""Read-only routes beside the page, for everybody who may see it: the camera, events."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import msgspec
from nicegui import app
from starlette.responses import Response

from operator_panel.door import Picture

CAMERA, EVENTS = "/camera.jpg", "/events.csv"
FRESH = {"Cache-Control": "no-store"}


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


def _refusal(status: int, why: str) -> Response:
    return Response(
        msgspec.json.encode({"error": why}),
        status_code=status,
        media_type="application/json",
        headers=FRESH,
    )
