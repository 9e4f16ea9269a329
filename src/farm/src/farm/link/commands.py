"""Whether a command of the farm is handed on to the cell; pure.

STOP and PAUSE are taken whatever the clocks show, and again when they come again: a stop never
hurts. All others are refused when they are old, from a clock that differs, or were taken already.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from farm.link.rights import ALWAYS, ASKABLE, Rights
from farm.wire import CLOCKS_AGREE_S, Command, clock_words

LONGEST_EXPIRY_S = 2.0
"""Nothing that may move a robot is good for longer."""
MOST_SEEN = 10_000
"""Our choice: so many ids are kept even when they have expired. A cell's clock may be set back, and
what had expired could come again then."""
CALLER = re.compile(r"^[A-Za-z0-9_.-]{1,63}\Z")
"""What may stand in a caller's id: it goes into audits, logs and bags."""


@dataclass(frozen=True)
class CommandRules:
    """What a command is judged by.

    Attributes:
        rights: Who may do what.
        remote: Whether the local switch lets the farm move this cell.
        revision: Of what is shown now: the state, or the number of configurations decided.
        seen: Ids that were taken, the oldest first, and when each expires [s since 1970].
    """

    rights: Rights
    remote: bool
    revision: int
    seen: Mapping[str, float]


def judge(command: Command, guard: CommandRules, now: float) -> tuple[str, Mapping[str, float]]:
    """Judge a command.

    Args:
        command: What somebody at a desk asks for.
        guard: What it is judged by.
        now: Time [s since 1970].

    Returns:
        Why it is refused, empty if it is handed on; and the ids that count as seen from now on. An
        id counts as seen as soon as it was judged in time, whatever the answer was: the same
        question is not asked twice. STOP and PAUSE leave none.
    """
    if why := _wrong(command):
        return why, guard.seen
    # No clock, no memory, no right: a stop that comes late or twice still stops.
    if command.command in ALWAYS:
        return "", guard.seen
    if why := _late(command, now):
        return why, guard.seen
    # A message may be delivered twice; a motion may not be made twice.
    if command.id in guard.seen:
        return f"{command.command} was taken already: a command is never repeated", guard.seen
    return _not_allowed(command, guard), {**_kept(guard.seen, now), command.id: command.expires}


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


def _kept(seen: Mapping[str, float], now: float) -> Mapping[str, float]:
    """Return the ids to keep: those that have not expired, and the newest of the others."""
    over = len(seen) - MOST_SEEN
    if over < 0:
        return seen
    return {
        id_: expires
        for place, (id_, expires) in enumerate(seen.items())
        if place > over or expires >= now
    }


def _late(command: Command, now: float) -> str:
    """Return why a command is too old, or is from a clock by which nobody can tell."""
    left = command.expires - now
    if 0.0 <= left <= LONGEST_EXPIRY_S + CLOCKS_AGREE_S:
        return ""
    if left > 0.0:
        what = f"expires in {left:.1f} s: allowed are {LONGEST_EXPIRY_S:g} s"
    else:  # not a number is late too
        what = f"expired {-left:.1f} s ago"
    ahead = command.asked - now if command.asked is not None else 0.0
    if abs(ahead) < CLOCKS_AGREE_S:
        return f"{command.command} {what}: ask again"
    clocks = f"by its time of asking, {command.desk}'s clock is {clock_words(ahead)} this cell's"
    # A clock that is ahead is the reason; one that seems behind may be a long way instead.
    long_way = "" if ahead > 0.0 else ", or it was on its way for as long"
    return f"{command.command} {what}: {clocks}{long_way}. Set the clocks (NTP) and ask again"


def _not_allowed(command: Command, guard: CommandRules) -> str:
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
