"""Film the operator's page and write it as a GIF that a README can carry.

Chromium hands out a frame whenever the page has drawn one. Of these, one is kept for each step of
the film's clock, so that the film runs at the cell's own pace however slowly the browser draws.
"""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

from PIL import Image

WIDTH = 960
FRAMES_PER_S = 4.0
LONGEST_S = 24.0
LIMIT_BYTES = 3_000_000
COLOURS = (160, 128, 96, 72)
OTHERS = 40
LAST_MS = 1500  # the last frame stays a while before the film begins again

Frame = tuple[float, bytes]


class FilmError(RuntimeError):
    """The film cannot be written; the text says why."""


class Film:
    """Films a page while somebody waits with :meth:`wait`; a context manager.

    Attributes:
        frames: What the page drew: time [s] and JPEG.
    """

    def __init__(self, page: Any) -> None:
        """Take the page."""
        self.frames: list[Frame] = []
        self._page = page
        self._shown: list[int] = []
        self._session = page.context.new_cdp_session(page)
        self._session.on("Page.screencastFrame", self._keep)

    def __enter__(self) -> Film:
        """Begin."""
        words = {"format": "jpeg", "quality": 92, "everyNthFrame": 2}
        self._session.send("Page.startScreencast", words)
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._session.send("Page.stopScreencast")
        self._session.detach()

    def wait(self, ms: float) -> None:
        """Let the page draw for a while, and ask for the next frame."""
        self._page.wait_for_timeout(ms)
        while self._shown:
            number = self._shown.pop(0)
            self._session.send("Page.screencastFrameAck", {"sessionId": number})

    def _keep(self, event: dict[str, Any]) -> None:
        # When it was drawn, not when it came: the browser may be behind.
        self.frames.append((event["metadata"]["timestamp"], base64.b64decode(event["data"])))
        self._shown.append(event["sessionId"])


def write_gif(frames: list[Frame], file: Path, limit: int = LIMIT_BYTES) -> None:
    """Write frames as a GIF below ``limit`` bytes, with as many colours as that allows.

    Raises:
        FilmError: There are too few frames, or even the fewest colours need more.
    """
    chosen = at_steps(frames)
    if len(chosen) < 2:
        raise FilmError(f"{len(frames)} frames were drawn: too few for a film")
    pictures = [_scaled(data) for data in chosen]
    for colours in COLOURS:
        # One palette for all: what does not move stays the same, dot by dot, and costs nothing.
        strip = Image.new("RGB", (WIDTH, pictures[0].height * 3))
        for number, picture in enumerate((pictures[0], pictures[len(pictures) // 2], pictures[-1])):
            strip.paste(picture, (0, number * picture.height))
        palette = _palette(strip, colours)
        shown = [
            picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures
        ]
        step_ms = int(1000 / FRAMES_PER_S)
        shown[0].save(
            file,
            save_all=True,
            append_images=shown[1:],
            duration=[step_ms] * (len(shown) - 1) + [LAST_MS],
            loop=0,
            optimize=False,
        )
        if file.stat().st_size < limit:
            return
    size = file.stat().st_size
    file.unlink()
    raise FilmError(f"{len(pictures)} frames need {size / 1e6:.1f} MB: film for a shorter time")


def _palette(picture: Image.Image, colours: int) -> Image.Image:
    """Return a palette: most for the greys that cover most, the rest for all other colours."""
    greys = picture.quantize(colours - OTHERS).getpalette() or []
    others = picture.quantize(OTHERS, method=Image.Quantize.MAXCOVERAGE).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*greys[: 3 * (colours - OTHERS)], *others[: 3 * OTHERS]])
    return palette


def at_steps(frames: list[Frame]) -> list[bytes]:
    """Return for each step of the film's clock the frame that was seen then."""
    if not frames:
        return []
    begun, ended = frames[0][0], min(frames[-1][0], frames[0][0] + LONGEST_S)
    chosen, number = [], 0
    for step in range(int((ended - begun) * FRAMES_PER_S) + 1):
        while number + 1 < len(frames) and frames[number + 1][0] <= begun + step / FRAMES_PER_S:
            number += 1
        chosen.append(frames[number][1])
    return chosen


def _scaled(data: bytes) -> Image.Image:
    """Return a frame in the film's width."""
    with Image.open(io.BytesIO(data)) as image:
        height = round(image.height * WIDTH / image.width)
        return image.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
