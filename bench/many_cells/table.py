"""The table of the farm, from results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bench.second_world.table import lines_of


def farm_table(parts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the section of bench/tables.txt: Markdown lines.

    Args:
        parts: ``farm`` of results.json.
    """
    return lines_of("The farm", "--farm", parts)
