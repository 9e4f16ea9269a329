"""Frames in the text of a program: a position names UF and UT, what they are stays in the robot.

So an exported program tells in remarks by which frames its positions were meant. A robot skips
them; whoever reads the program compares.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from scara_config.frames import LETTERS, WORDS, FrameTable, Kind, Numbered, Numbers
from scara_config.programs.tp.listing import Program, Remark

LONGEST = 32
"""Characters of a remark. Source: the maker's operator's manual B-83284EN/09, chapter 4."""
_KINDS: dict[str, Kind] = {word: kind for kind, word in WORDS.items()}
_TOLD = re.compile(r"\s*(UFRAME|UTOOL)\[(\d+)\]((?:\s+[XYZWPR]\s+-?\d+(?:\.\d+)?)+)\s*")


def frame_remarks(table: FrameTable, used: Iterable[tuple[Kind, int]]) -> Iterator[Remark]:
    """Yield remarks that tell frames, to a thousandth; a frame that is all 0 is none to tell."""
    for kind, number in used:
        taught = table.numbered(kind).get(number)
        rounded = [round(value, 3) for value in taught.numbers] if taught else []
        words = [f"{name} {value:.10g}" for name, value in zip(LETTERS, rounded) if value]
        begin = row = f"{WORDS[kind]}[{number}]"
        for word in words:
            if len(f"{row} {word}") > LONGEST:
                yield Remark("!", row)
                row = begin
            row += f" {word}"
        if words:
            yield Remark("!", row)


def told_frames(program: Program) -> Numbered:
    """Return the frames that a program's remarks tell."""
    found: dict[tuple[Kind, int], Numbers] = {}
    for line in program.lines:
        told = _TOLD.fullmatch(line.text) if isinstance(line, Remark) else None
        if told is None:
            continue
        key = _KINDS[told[1]], int(told[2])
        words = told[3].split()
        # A frame may take several remarks, each with some of its numbers.
        values = dict(zip(LETTERS, found.get(key, (0.0,) * len(LETTERS))))
        values |= {name: float(value) for name, value in zip(words[::2], words[1::2])}
        found[key] = tuple(values[name] for name in LETTERS)
    return found
