"""docs/state_table.md is the table that the controller obeys."""

from __future__ import annotations

import re

from harness.workspace import ROOT
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.table_page import rows, table_page

PAGE = ROOT / "docs" / "state_table.md"


def test_the_page_is_up_to_date() -> None:
    """The page is what the table gives.

    After a change: python -m twin_controller.core.lead.table_page > docs/state_table.md.
    """
    assert PAGE.read_text(encoding="utf-8") == table_page()


def test_every_pair_of_mode_and_trigger_is_on_the_page() -> None:
    """Read back from the page as a person would: a mode's own rows, then those of most modes."""
    sections = dict(
        re.findall(
            r"^## ([\w, ]+)\n(.*?)(?=^## |\Z)",
            PAGE.read_text(encoding="utf-8"),
            re.MULTILINE | re.DOTALL,
        )
    )
    modes = {name: text for names, text in sections.items() for name in names.split(", ")}
    assert set(modes) == {"Triggers", "Most modes", *(mode.name for mode in Mode)}
    usual = set(re.findall(r"`(\w+)`", sections["Most modes"]))
    for mode in Mode:
        own, _, nothing = modes[mode.name].partition("Decides nothing:")
        named, silent = (re.findall(r"`(\w+)`", text) for text in (own, nothing))
        decides = {trigger.name for trigger, _, row in rows(mode) if not row.silent}
        assert set(named) | usual - set(silent) == decides
        assert set(silent) <= usual - set(named)
        assert mode is Mode.PAUSED or len(named) == len(set(named))
