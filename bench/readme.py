"""The figures of README.md: taken from bench/results.json, so that no page contradicts another."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from bench.demo_tables import short_table

BLOCK = re.compile(r"(<!-- figures: [^>]* -->\n).*?(<!-- end of figures -->)", re.DOTALL)


def with_figures(text: str, content: Mapping[str, Any]) -> str:
    """Return the README with its block of figures written anew.

    Args:
        text: README.md, with one block between the two comments.
        content: As in results.json.

    Raises:
        ValueError: The block is missing, or there are several.
    """
    block = "\n".join(short_table(content.get("demos", []))) + "\n"
    replaced, count = BLOCK.subn(lambda found: found[1] + block + found[2], text)
    if count != 1:
        raise ValueError(f"README.md has {count} blocks of figures, expected 1")
    return replaced
