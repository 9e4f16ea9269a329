"""tests/mutants/rooms.yaml: each room has modules, and tests that are to notice their faults."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from ruamel.yaml import YAML

FOLDER = ROOT / "tests" / "mutants"
ROOMS = YAML(typ="safe").load(FOLDER / "rooms.yaml")
EQUIVALENT = YAML(typ="safe").load(FOLDER / "equivalent.yaml")


@pytest.mark.parametrize("name", ROOMS)
def test_each_pattern_of_a_room_leads_to_a_file(name: str) -> None:
    """A folder that was renamed would have no mutants, and nobody would miss them."""
    patterns = [*ROOMS[name]["modules"], *ROOMS[name]["tests"]]
    assert not [pattern for pattern in patterns if not any(ROOT.glob(pattern))]


def test_each_line_of_an_equivalent_mutant_is_still_there() -> None:
    """An entry for a line that has changed excuses nothing, or the wrong thing."""
    modules = {path for room in ROOMS.values() for p in room["modules"] for path in ROOT.glob(p)}
    for entry in EQUIVALENT:
        texts = [
            path.read_text(encoding="utf-8")
            for path in modules
            if path.as_posix().endswith(entry["path"])
        ]
        lines = {line.strip() for text in texts for line in text.splitlines()}
        assert entry["before"] in lines, entry
