"""The pictures of the operator's page in docs show a healthy cell."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from harness.workspace import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import diagrams
import picture_health

PICTURES = sorted((ROOT / "docs" / "images").glob("operator_*.png"))
HEALTHY = {
    "mode": "Real robot leads",
    "alarms": "No alarm",
    "deviation": "0.42 mm",
    "limit": "alarm from 20 mm",
    "links": "connected, connected",
    "trouble": "",
}


@pytest.mark.parametrize("picture", PICTURES, ids=lambda file: file.stem)
def test_picture_of_the_page_shows_a_healthy_cell(picture: Path) -> None:
    """A reader takes what a picture shows for how it should be."""
    picture_health.check(picture_health.told(picture))


def test_there_are_pictures_of_each_size() -> None:
    """An empty folder would pass."""
    assert {file.stem for file in PICTURES} >= {
        f"operator_{name}" for name in ("light", "dark", "tablet", "phone")
    }


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("mode", "Aligning", "mode = Aligning"),
        ("alarms", "link real: no answer", "there should be none"),
        ("links", "connected, no answer", "both should be connected"),
        ("trouble", "is-silent", "is-silent"),
        ("deviation", "136.20 mm", "136.2 mm apart"),
        ("deviation", "\N{EN DASH} mm", "nan mm apart"),
    ],
)
def test_unhealthy_cell_is_refused_with_what_is_wrong(key: str, value: str, text: str) -> None:
    """Each alone."""
    picture_health.check(HEALTHY)
    with pytest.raises(picture_health.UnhealthyError, match=text):
        picture_health.check({**HEALTHY, key: value})


def test_picture_that_says_nothing_is_refused() -> None:
    """One that was not taken by the script."""
    with pytest.raises(picture_health.UnhealthyError, match="does not say its mode"):
        picture_health.check({})


class Page:
    """A page that says what it is told to, and can be pictured."""

    def __init__(self, *said: dict[str, str]) -> None:
        """Say one after the other."""
        self._said = list(said)

    def evaluate(self, _: str) -> dict[str, str]:
        """Return what it says now."""
        return self._said.pop(0)

    def screenshot(self, path: Path) -> None:
        """Write a small picture."""
        from PIL import Image

        Image.new("RGB", (4, 4)).save(path)


def test_no_file_is_written_of_a_cell_that_falls_ill_meanwhile(tmp_path: Path) -> None:
    """And a healthy one carries what it said."""
    file = tmp_path / "operator_light.png"
    ill = {**HEALTHY, "mode": "Fault"}
    for said in ((ill,), (HEALTHY, ill)):
        with pytest.raises(picture_health.UnhealthyError):
            picture_health.take(Page(*said), file)
        assert list(tmp_path.iterdir()) == []
    picture_health.take(Page(HEALTHY, HEALTHY), file)
    assert picture_health.told(file) == HEALTHY and list(tmp_path.iterdir()) == [file]


def test_the_pictures_of_the_architecture_are_those_that_their_script_draws() -> None:
    """Whoever changes one changes the script, and both."""
    drawn = {name: (diagrams.FOLDER / name).read_text("utf-8") for name in diagrams.pictures()}
    assert drawn == diagrams.pictures()
    assert {file.name for file in diagrams.FOLDER.iterdir()} == set(drawn)


def test_no_page_needs_another_place_to_show_a_picture() -> None:
    """What a script from elsewhere draws stays source where there is no network."""
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    assert [page.name for page in pages if "```mermaid" in page.read_text("utf-8")] == []
