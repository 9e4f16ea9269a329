"""Read-only routes beside the page, for everybody who may see it: the camera, the past, events."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from datetime import datetime

import msgspec
from scara_ros.page.page_library_io import offer
from starlette.responses import Response

from operator_panel.retelling.recordings_io import Recordings
from operator_panel.retelling.run_folders_io import RunFolderError
from operator_panel.view.past import Past

CAMERA, EVENTS, PAST = "/camera.jpg", "/events.csv", "/past.json"
FRESH = {"Cache-Control": "no-store"}


def offer_camera(picture: Callable[[str], Awaitable[tuple[str, bytes] | None]]) -> None:
    """Offer the camera's next picture.

    ``?after=STAMP`` waits for a picture with another stamp; the answer's head has the stamp.
    """

    async def answer(after: str = "") -> Response:
        found = await picture(after)
        if found is None:
            return _refusal(503, "no picture comes: is the camera running, and the twin?")
        stamp, jpeg = found
        return Response(jpeg, media_type="image/jpeg", headers={**FRESH, "X-Stamp": stamp})

    offer(CAMERA, answer)


def offer_past(past: Past, recordings: Recordings, window_s: float) -> None:
    """Offer what the page showed, or would have shown of a recording.

    ``?at=`` system time [s], with ``window_s`` of charts; ``&run=`` the name of a recording. In the
    answer ``zone_s`` is by how much this machine's time of day is ahead of UTC [s].
    """

    async def answer(at: str = "", run: str = "") -> Response:
        try:
            time = float(at)
        except ValueError:
            time = math.nan
        if not math.isfinite(time):
            return _refusal(400, f"at = {at!r} is no number of seconds since 1970")
        try:
            found = await recordings.look(run, time) if run else past.look(time, window_s)
        except RunFolderError as error:
            return _refusal(404, str(error))
        if found is None and run:
            return _refusal(202, "the recording is being opened")
        if found is None:
            return _refusal(404, "nothing is remembered yet")
        # A browser may have another zone; events and all else on the page have this machine's.
        zone = datetime.fromtimestamp(found.at).astimezone().utcoffset()
        told = msgspec.structs.asdict(found) | {"zone_s": zone.total_seconds() if zone else 0.0}
        return Response(msgspec.json.encode(told), media_type="application/json", headers=FRESH)

    offer(PAST, answer)


def offer_events(csv: Callable[[], str]) -> None:
    """Offer the kept events as a file for a spreadsheet."""

    async def answer() -> Response:
        name = {"Content-Disposition": 'attachment; filename="events.csv"'}
        return Response(csv(), media_type="text/csv; charset=utf-8", headers={**FRESH, **name})

    offer(EVENTS, answer)


def _refusal(status: int, why: str) -> Response:
    return Response(
        msgspec.json.encode({"error": why}),
        status_code=status,
        media_type="application/json",
        headers=FRESH,
    )
