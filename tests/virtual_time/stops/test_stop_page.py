"""docs/operating/stops.md: settings that change nothing share a row, and no row is lost."""

from __future__ import annotations

from harness.stops.page import page
from harness.stops.rows import ALL, Instant, Row, instants


def found(**by_setting: float) -> dict[object, list[Row] | str]:
    """Return rows of a robot that stands after a time by its setting of *IMSTP."""

    def row(command: str, cstopi: bool, imstp: bool) -> Row:
        stood = by_setting["on" if imstp else "off"]
        mode = {"STOP": "STOPPED", "ESTOP": "ESTOP", "PAUSE": "STOPPED"}[command]
        return Row(
            command, cstopi, imstp, True, True, stood, 0.1, False, "paused", True, "", mode, ""
        )

    return {instant: [row(*tried) for tried in ALL] for instant in instants()}


def test_settings_that_change_nothing_share_a_row() -> None:
    """The mode is named where it is not the usual one."""
    text = page(found(on=0.2, off=0.2), "2026-01-02", "abc1234")
    assert text.count("| any | any | in a WAIT | 0.200 (0.100); paused |") == 3
    assert "Plant ideal and field:" in text
    assert "| 0.200 (0.100); paused; STOPPED |" in text


def test_a_setting_that_matters_has_its_rows() -> None:
    """Each setting is in one row, whatever is merged."""
    text = page(found(on=0.2, off=0.3), "2026-01-02", "abc1234")
    assert "| any | on | real leads | 0.200" in text and "| any | off | real leads | 0.300" in text


def test_an_instant_that_was_not_reached_is_told() -> None:
    """A table without rows would say that nothing was tried."""
    rows = found(on=0.2, off=0.2) | {Instant("none", "in a WAIT", "ideal"): "no link"}
    assert "Plant ideal: the pair never led. no link" in page(rows, "2026-01-02", "abc1234")
