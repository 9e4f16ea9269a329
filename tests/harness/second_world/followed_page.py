"""What docs/what_if.md tells its reader to write and to type, and what it says comes of it."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass

from harness.workspace import ROOT

PAGE = ROOT / "docs" / "what_if.md"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PROMPT = "$ rosrun what_if judge "


@dataclass(frozen=True)
class Typed:
    """A command with what the page says that it prints.

    Attributes:
        words: Behind ``rosrun what_if judge``.
        printed: Line by line.
    """

    words: tuple[str, ...]
    printed: tuple[str, ...]


def programs() -> dict[str, str]:
    """Return the page's programs by the name of the file as which they are saved.

    The second is the first, lifted higher as the page says.
    """
    page = PAGE.read_text(encoding="utf-8")
    (carry,) = [text for _, text in BLOCK.findall(page) if text.startswith("/PROG ")]
    (high, low) = re.findall(r"`CARRY_HIGH\.LS` with `(.*?)` for `(.*?)`", page)[0]
    assert low in carry
    lifted = carry.replace(low, high).replace("/PROG CARRY", "/PROG CARRY_HIGH")
    return {"CARRY.LS": carry, "CARRY_HIGH.LS": lifted}


def commands() -> list[Typed]:
    """Return the page's commands that are shown with what they print."""
    found = []
    for _, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        for part in text.split(PROMPT)[1:]:
            first, *printed = part.rstrip().splitlines()
            found.append(Typed(tuple(shlex.split(first)), tuple(printed)))
    return found
