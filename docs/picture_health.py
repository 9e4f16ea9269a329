"""What a picture of the operator's page may show: a healthy cell, and nothing else.

A picture carries what its page said when it was taken, as PNG texts, so that a test can read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PIL import Image, PngImagePlugin

MODES = ("Ready", "Real robot leads", "Twin leads", "Operator leads")
SHARE = 0.5  # of the distance that raises an alarm: what is more is no small deviation
KEYS = ("mode", "alarms", "deviation", "limit", "links", "trouble")
SAID = """() => {
    const text = (key) => document.querySelector(`[data-live="${key}"]`).textContent;
    return {
        mode: text("mode"),
        alarms: document.querySelector("[data-alarms]").textContent,
        deviation: text("deviation"),
        limit: text("deviation.limit"),
        links: `${text("link.real.state")}, ${text("link.twin.state")}`,
        trouble: ["is-lost", "is-silent", "no-stop"]
            .filter((name) => document.body.classList.contains(name)).join(" "),
    };
}"""


class UnhealthyError(RuntimeError):
    """The cell in a picture is not healthy; the text says what is wrong."""


def check(said: Mapping[str, str]) -> None:
    """Check what a page said.

    Raises:
        UnhealthyError: An alarm, a trouble, a mode or a distance that no example should show.
    """
    missing = [key for key in KEYS if key not in said]
    if missing:
        raise UnhealthyError(f"the picture does not say its {', '.join(missing)}")
    if said["mode"] not in MODES:
        raise UnhealthyError(f"mode = {said['mode']}: allowed are {', '.join(MODES)}")
    if said["alarms"].strip() != "No alarm":
        raise UnhealthyError(f"alarms = {said['alarms']!r}: there should be none")
    if said["links"] != "connected, connected":
        raise UnhealthyError(f"links = {said['links']}: both should be connected")
    if said["trouble"]:
        raise UnhealthyError(f"the page says {said['trouble']}")
    apart, limit = _millimetres(said["deviation"]), _millimetres(said["limit"])
    if not apart <= SHARE * limit:
        raise UnhealthyError(f"the tools are {apart:g} mm apart, alarm from {limit:g} mm")


def take(page: Any, file: Path) -> None:
    """Take a picture of a page; what the page says must be healthy before and after it.

    Raises:
        UnhealthyError: It is not; no file is written.
    """
    check(page.evaluate(SAID))
    shot = file.with_suffix(".new.png")
    page.screenshot(path=shot)
    try:
        said = page.evaluate(SAID)
        check(said)
        texts = PngImagePlugin.PngInfo()
        for key, value in said.items():
            texts.add_text(key, value)
        with Image.open(shot) as image:
            image.save(file, pnginfo=texts, optimize=True)
    finally:
        shot.unlink()


def told(file: Path) -> dict[str, str]:
    """Return what the page in a picture said."""
    with Image.open(file) as image:
        return {key: value for key, value in image.info.items() if key in KEYS}


def _millimetres(text: str) -> float:
    """Return the number of "0.42 mm" or "alarm from 20 mm"; not a number where there is none."""
    words = [word for word in text.split() if word.replace(".", "", 1).isdigit()]
    return float(words[-1]) if words else float("nan")
