"""Whether a command of the farm is handed on to the cell; pure.

STOP and PAUSE are refused for two reasons only: they are too old, or they were taken already.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from farm.link.rights import ALWAYS, ASKABLE, Rights
from farm.wire import Command

LONGEST_EXPIRY_S = 2.0
"""Nothing that moves or stops a robot is kept for longer on its way."""
CLOCK_STEP_S = 0.05
"""Our choice: clocks of one machine, read by two processes, differ by less."""
CALLER = re.compile(r"^[A-Za-z0-9_.-]{1,63}$")
"""What may stand in a caller's id: it goes into audits, logs and bags."""


@dataclass(frozen=True)
class Guard:
    """What a command is judged by.

    Attributes:
        rights: Who may do what.
        remote: Whether the local switch lets the farm move this cell.
        revision: Of what is shown now: the state, or the number of configurations decided.
        seen: Ids that were taken, and when each expires [s since 1970].
    """

    rights: Rights
    remote: bool = False
    revision: int = 0
    seen: Mapping[str, float] = field(default_factory=dict)


def judge(command: Command, guard: Guard, now: float) -> tuple[str, Mapping[str, float]]:
    """Judge a command.

    Args:
        command: What somebody at a desk asks for.
        guard: What it is judged by.
        now: Time [s since 1970].

    Returns:
        Why it is refused, empty if it is handed on; and the ids that count as seen from now on. An
        id counts as seen as soon as it was judged in time, whatever the answer was: the same
        question is not asked twice. It is forgotten when it has expired, since it is refused for
        that then.
    """
    if why := _wrong(command) or _late(command, now):
        return why, guard.seen
    if command.id in guard.seen:
        return f"{command.command} was taken already: a command is never repeated", guard.seen
    kept = {id_: expires for id_, expires in guard.seen.items() if expires >= now}
    seen = {**kept, command.id: command.expires}
    return ("" if command.command in ALWAYS else _not_allowed(command, guard)), seen


def caller_id(command: Command) -> str:
    """Return the name in which a command is handed on, for audit, decisions and bag.

    Example:
        >>> caller_id(Command("1", "STOP", "ann", "desk_1", 0.0))
        '/farm/ann@desk_1'
    """
    return f"/farm/{command.person}@{command.desk}"


def _wrong(command: Command) -> str:
    """Return what is wrong with the words of a command."""
    for name, text in (("person", command.person), ("desk", command.desk), ("id", command.id)):
        if not CALLER.match(text):
            return (
                f"{name} = {text[:63]!r}: allowed are 1 to 63 letters, digits, dots, dashes "
                "and underlines"
            )
    if command.command not in ALWAYS + ASKABLE:
        return (
            f"{command.command[:63]}: the farm may not ask for this; "
            f"allowed are {', '.join(ALWAYS + ASKABLE)}"
        )
    return ""


def _late(command: Command, now: float) -> str:
    left = command.expires - now
    if not left >= 0.0:  # not a number is late too
        return f"{command.command} expired {-left:.1f} s ago: ask again"
    if left > LONGEST_EXPIRY_S + CLOCK_STEP_S:
        return f"{command.command} expires in {left:.1f} s: allowed are {LONGEST_EXPIRY_S:g} s"
    return ""


def _not_allowed(command: Command, guard: Guard) -> str:
    """Return why somebody may not move the cell now."""
    word = command.command
    if not guard.rights.allows(command.person, word):
        role = guard.rights.role(command.person)
        return f"{word}: {command.person} is {role} here and may only STOP and PAUSE"
    if not guard.remote:
        return f"{word}: the remote switch of this cell is off; somebody at the cell turns it on"
    if command.revision is None:
        return f"{word}: names no state that it is based on"
    if command.revision != guard.revision:
        return (
            f"{word}: the cell has changed since (state {guard.revision}, not "
            f"{command.revision}): look again"
        )
    return ""
