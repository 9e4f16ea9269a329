"""The rows as a page of the documents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from harness.stops.rows import COMMANDS, PLANTS, SCENES, UOPS, Instant, Row

HEAD = """# How a stop ends
How long the robot takes to stand, by how it was set up. Written by `./cell bench --stops` on
{date}, commit {commit}, with our stand-in in virtual time. **No real robot was stopped for it.**

- CSTOPI: "CSTOPI for ABORT" is TRUE, or FALSE as delivered. `*IMSTP`: it has an input or not.
- Scenes: ARTICLE at 100 % in the middle of a move; a `move_to` of the twin at 50 %; ARTICLE in a
  WAIT, 0.25 s before its next move; ARTICLE where the next move begins.
- Each cell: seconds until the robot stands, in brackets those of its ramp after HOLD where they
  differ; the state of its program; the mode 1.2 s later, where it is not the command's own.
- "No success": the answer says that the robot is not seen to stand.
- Where HOLD is allocated each row stands within 0.1 s after that ramp:
  `tests/virtual_time/stops/test_stop_table.py`.
"""
USUAL = {"STOP": "STOPPED", "ESTOP": "ESTOP", "PAUSE": "PAUSED"}
"""The mode after each command, which no cell repeats."""

NOTES = {
    "full": "HOLD, which works on each of these robots, is what stops it.",
    "simple": (
        "HOLD stops this robot too. No RSR starts its stream program, so it is never led. UO 2 to "
        "5 are read from the blocks of program and alarm. CSTOPI and RESET are one signal."
    ),
    "none": (
        "No input has an effect: **nothing of the pair stops this robot**, only its own buttons "
        'do. Each stop ends in ESTOP, and says so. Set "UOP auto assignment" to Full.'
    ),
}
"""What each section says before its tables."""


def page(found: Mapping[object, list[Row] | str], date: str, commit: str) -> str:
    """Return the page as Markdown.

    Args:
        found: Rows by instant, or why the cell did not come to it.
        date: When they were measured.
        commit: Of what.
    """
    lines = [HEAD.format(date=date, commit=commit)]
    for uop in UOPS:
        lines += [f"## UOP {uop}", NOTES[uop], ""]
        tables: dict[str, list[str]] = {}
        for plant in PLANTS:
            tables.setdefault("\n".join(_table(found, uop, plant)), []).append(plant)
        lines += [f"Plant {' and '.join(plants)}:{told}" for told, plants in tables.items()]
    return "\n".join(lines)


def _table(found: Mapping[object, list[Row] | str], uop: str, plant: str) -> list[str]:
    """Return one plant's table, or why the pair does not come to it."""
    reasons = {
        str(why) for scene in SCENES if isinstance(why := found[Instant(uop, scene, plant)], str)
    }
    if reasons:
        return [f" the pair never led. {' '.join(sorted(reasons))}", ""]
    lines = ["", "", f"| CSTOPI | *IMSTP | scene | {' | '.join(COMMANDS)} |"]
    lines.append("|---|---|---|" + "---|" * len(COMMANDS))
    for scene in SCENES:
        same: dict[str, list[tuple[bool, bool]]] = {}
        for cstopi, imstp in product((True, False), (True, False)):
            cells = [
                _cell(row)
                for command in COMMANDS
                for row in found[Instant(uop, scene, plant)]
                if isinstance(row, Row)
                and (row.command, row.cstopi_for_abort, row.imstp_assigned)
                == (command, cstopi, imstp)
            ]
            same.setdefault(" | ".join(cells), []).append((cstopi, imstp))
        lines += [
            f"| {cstopi} | {imstp} | {scene} | {told} |"
            for told, settings in same.items()
            for cstopi, imstp in _named(settings)
        ]
    return [*lines, ""]


def _named(settings: Sequence[tuple[bool, bool]]) -> list[tuple[str, str]]:
    """Return the words for settings of CSTOPI and *IMSTP, one line where they are a whole table."""
    words = {(True,): "on", (False,): "off", (True, False): "any"}
    firsts, seconds = (tuple(dict.fromkeys(values)) for values in zip(*settings, strict=True))
    if len(settings) == len(firsts) * len(seconds):
        return [(words[firsts], words[seconds])]
    return [(words[(one,)], words[(other,)]) for one, other in settings]


def _cell(row: Row) -> str:
    mode = "" if row.mode == USUAL[row.command] else f"; {row.mode}"
    if not row.moved:
        return f"never led{mode}"
    end = f"{row.program}{mode}" + ("" if row.success else "; no success")
    if row.stood_s is None:
        return f"does not stand; {end}"
    again = ", moves again" if row.began else ""
    stood, ramp = f"{row.stood_s:.3f}", f"{row.ramp_s:.3f}"
    return f"{stood}{again}{'' if ramp == stood else f' ({ramp})'}; {end}"
