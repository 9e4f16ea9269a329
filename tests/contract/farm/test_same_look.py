"""The desk's page and the operator's page say the same and look the same."""

from __future__ import annotations

import re

import msgspec
import pytest
from farm.desk.roster import STATUSES, Roster
from farm.desk.wall import wall_of
from farm.keys import CellName
from farm.link.shown import told_by
from harness.workspace import ROOT
from scara_ros.page.page_words import MODES
from unit.operator_panel.view.test_frame import STATE, frame_of

from scara_msgs.msg import TwinControllerState

CONTROLLERS = [
    value for name, value in vars(TwinControllerState).items() if name.isupper() and name == value
]
STYLES = {
    name: (ROOT / "src" / name / "web" / file).read_text(encoding="utf-8")
    for name, file in (("operator_panel", "panel.css"), ("farm", "farm.css"))
}


def variables(style: str, rule: str) -> dict[str, str]:
    """Return the custom properties of a rule."""
    (body,) = re.findall(rf"^{re.escape(rule)} \{{(.*?)\}}", style, re.DOTALL | re.MULTILINE)
    return dict(re.findall(r"--([\w-]+): ([^;]+);", body))


def test_the_words_are_those_of_the_controllers_modes() -> None:
    """All of them, and no other."""
    assert set(MODES) == set(CONTROLLERS) and len(CONTROLLERS) == 11
    assert not set(STATUSES) & set(CONTROLLERS)


@pytest.mark.parametrize("mode", CONTROLLERS)
def test_a_mode_is_called_the_same_on_both_pages(mode: str) -> None:
    """With the same reason below it."""
    cell, why = CellName("hall", "pc", "cell"), f"MOVE: {mode}: both stand still"
    roster = Roster(2.0)
    roster.alive(cell, 1.0)
    roster.shown(cell, told_by(TwinControllerState(mode=mode, why=why)), 1.0)
    (card,) = wall_of(1.5, roster.rows(1.5), [], []).cards
    frame = frame_of(msgspec.structs.replace(STATE, mode=mode, why=why))
    assert (card.title, card.text) == (frame["text"]["mode"], frame["text"]["why"])
    if card.tone not in ("warn", "bad"):
        assert card.tone == frame["tone"]["mode"]


@pytest.mark.parametrize("rule", [":root", "body.body--dark"])
def test_colours_type_and_spaces_are_those_of_the_operators_page(rule: str) -> None:
    """One kit; the desk's page has the height of its bar besides."""
    ours, theirs = (variables(STYLES[name], rule) for name in ("farm", "operator_panel"))
    assert len(ours) > 15
    assert {k: v for k, v in ours.items() if theirs.get(k) != v and k != "bar"} == {}


def test_the_type_grows_with_the_screen_alike() -> None:
    """A rem is as large on both."""
    grown = [re.findall(r"font-size: clamp\([^;]*;", style) for style in STYLES.values()]
    assert grown[0] == grown[1] and len(grown[0]) == 1
