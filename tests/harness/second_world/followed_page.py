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
    """Return the page's programs by the name of the file as which they are saved."""
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    texts = [text for kind, text in blocks if kind == "yaml" and text.startswith("name: ")]
    return {f"{text.split()[1].lower()}.yaml": text for text in texts}


def commands() -> list[Typed]:
    """Return the page's commands that are shown with what they print."""
    found = []
    for _, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        for part in text.split(PROMPT)[1:]:
            first, *printed = part.rstrip().splitlines()
            found.append(Typed(tuple(shlex.split(first)), tuple(printed)))
    return found
