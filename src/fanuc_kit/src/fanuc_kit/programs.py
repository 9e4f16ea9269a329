"""The programs that a person types: the stream, and what watches the heartbeat beside it."""

from __future__ import annotations

from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program
from scara_config.programs.tp.printer import print_program
from scara_config.set_up.settings import STREAM_LINES, STREAM_NUMBER

MOST_LINES = 30
"""More is not typed without a mistake; our choice."""
PERIOD_MS, PATIENCE_MS = 8, 120
"""Of background logic [src]; of the watchdog, as the stand-in has it."""

STREAM = (
    "!Where it stands, until a set",
    "!point comes",
    "PR[1]=JPOS",
    *STREAM_LINES,
)
WATCH = (
    "!R[1] heartbeat, R[8] its echo",
    "!R[9] 0 off 1 armed 2 expired",
    "!F[2] is UI[2] *HOLD",
    "IF (R[1]<>R[8]),R[22]=(0)",
    "IF (R[1]=R[8]),R[22]=(R[22]+1)",
    "R[8]=(R[1])",
    "IF (R[1]=0),R[9]=(0)",
    "IF (R[1]>0 AND R[9]=0),R[9]=(1)",
    f"IF (R[9]=1 AND R[22]>{PATIENCE_MS // PERIOD_MS}),R[9]=(2)",
    "IF (R[9]=2),F[2]=(OFF)",
)


def programs() -> dict[str, str]:
    """Return the text of each program by its name."""
    return {
        name: print_program(Program(name, tuple(map(read_line, lines)), (), attributes))
        for name, lines, attributes in (
            (f"RSR{STREAM_NUMBER:04d}", STREAM, {}),
            ("BGTWIN", WATCH, {"DEFAULT_GROUP": "*,*,*,*,*"}),
        )
    }
