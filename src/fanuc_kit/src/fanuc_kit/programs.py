"""The text of the programs that a person types."""

from __future__ import annotations

from scara_config.programs.tp.printer import print_program
from scara_config.set_up.kit_programs import kit_programs

MOST_LINES = 30
"""More is not typed without a mistake; our choice."""


def programs() -> dict[str, str]:
    """Return the text of each program by its name."""
    return {program.name: print_program(program) for program in kit_programs()}
