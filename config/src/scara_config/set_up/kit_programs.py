"""The programs that a person types on the robot: the kit prints them, the stand-in executes them.

RSR0101 follows what a client writes. BGTWIN watches that client's heartbeat, as background logic:
from its first to its last line in each period, without motion.
"""

from __future__ import annotations

from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program
from scara_config.programs.tp.printer import print_program
from scara_config.set_up.settings import STREAM_NUMBER

WATCH = "BGTWIN"
STREAM = f"RSR{STREAM_NUMBER:04d}"
PERIOD_MS = 8
"""Of background logic [src]."""
PATIENCE_MS = 120
"""The heartbeat may stand still for so long [our]: 12 missed writes at 100 Hz."""
_NO_GROUP = {"DEFAULT_GROUP": "*,*,*,*,*"}
# Remarks have at most 32 characters, so longer ones go on in the next.
# Its loop is as published clients of R553 have it [src]: MisoRobotics/fanuc-hmi-jointstreaming.
_STREAM = (
    "!Where it stands, until a set",
    "!point comes",
    "PR[1]=JPOS",
    "LBL[1]",
    "J PR[1] R[2]% CNT100",
    "JMP LBL[1]",
)


def stream_program(name: str = STREAM) -> Program:
    """Return the program that follows PR[1] at R[2] percent."""
    return Program(name, tuple(map(read_line, _STREAM)))


def watch_program(patience_ms: int = PATIENCE_MS) -> Program:
    """Return the background logic that ends a running program when the heartbeat stands still.

    HOLD is taken away, then the paused program is ended. Both stay so until RESET. While no program
    runs there is nothing to stop, and the watchdog rests until the heartbeat changes again: BUSY
    tells, which each allocation of the outputs has.

    Args:
        patience_ms: From one change of R[1] to the next, at most.
    """
    lines = (
        "!R[1] heartbeat, R[8] its echo",
        "!R[9] 0 off 1 armed 2 expired",
        "IF (R[1]<>R[8]),R[22]=(0)",
        "IF (R[9]=1 AND R[1]=R[8]),R[22]=(R[22]+1)",
        "IF (R[9]=0 AND R[1]<>R[8]),R[9]=(1)",
        "IF (R[9]=1 AND R[1]=0),R[9]=(0)",
        "R[8]=(R[1])",
        "!Silent: only BUSY is stopped",
        f"IF (R[9]=1 AND R[22]>={patience_ms // PERIOD_MS} AND UO[10]),R[9]=(2)",
        f"IF (R[9]=1 AND R[22]>={patience_ms // PERIOD_MS}),R[9]=(0)",
        "!*HOLD off, CSTOPI while PAUSED",
        "IF (R[9]=2),F[2]=(OFF)",
        "IF (R[9]=2 AND UO[4]),F[4]=(ON)",
        "!RESET, of UOP or of the panel",
        "IF (R[9]=2 AND (UI[5] OR SI[1])),R[9]=(3)",
        "IF (R[9]=3),F[4]=(OFF)",
        "IF (R[9]=3),F[2]=(ON)",
        "IF (R[9]=3),R[9]=(0)",
    )
    return Program(WATCH, tuple(map(read_line, lines)), (), _NO_GROUP)


def texts() -> dict[str, str]:
    """Return what a person types: the text of each program by its name."""
    return {each.name: print_program(each) for each in (stream_program(), watch_program())}
