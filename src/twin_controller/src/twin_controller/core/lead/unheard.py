"""What becomes of a row of the table where nothing is written to the real robot."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import Command
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.table import Row, look_up

TO_REAL = frozenset(
    (
        *(Command.STOP_REAL, Command.HOLD_REAL, Command.GIVE_HOLD_BACK, Command.RELEASE_REAL),
        *(Command.END_AT_REST, Command.END_STREAM, Command.ESTOP_REAL, Command.RESET_REAL),
        *(Command.START_STREAM, Command.CONTINUE_STREAM, Command.BEGIN_STREAM),
    )
)
"""What the real robot would hear."""
_STOP_REAL = frozenset((Command.STOP_REAL, Command.HOLD_REAL, Command.ESTOP_REAL))
AT_ITS_PENDANT = "the twin stops; nothing reaches the real robot: stop it at its own pendant"


def unheard(row: Row, mode: Mode) -> Row:
    """Return a row for a robot to which nothing is written: it claims no stop of that robot.

    That robot went on while its twin was stopped, so the twin comes to it before it follows.
    """
    if mode is Mode.STOPPED and row.to is Mode.REAL_LEADS:
        return look_up(mode, Trigger.ALIGN)
    told = TO_REAL & set(row.commands)
    if not told:
        return row
    why = row.why
    if told & _STOP_REAL:
        _, also, rest = row.why.partition(";")
        why = AT_ITS_PENDANT + also + rest
    elif Command.RESET_REAL in told:
        why = "nothing reaches the real robot: reset it at its own pendant; nothing moves"
    kept = tuple(command for command in row.commands if command not in TO_REAL)
    return msgspec.structs.replace(row, commands=kept, why=why)
