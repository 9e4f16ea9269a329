"""Modes, leaders, numbers and links in words, as an operator reads them."""

from __future__ import annotations

import math

from operator_panel.view.snapshot import CellState, Link
from scara_msgs.msg import TwinControllerState as Mode

MINUS = "\N{MINUS SIGN}"
UNKNOWN = "\N{EN DASH}"
OTHER_DAY_S = 600.0  # our choice: clocks that shall show the same time are not so far apart

# mode: (title, tone). The tone is a CSS class; blue is the real robot, orange the twin.
MODES: dict[str, tuple[str, str]] = {
    Mode.OFFLINE: ("Offline", "bad"),
    Mode.ALIGNING: ("Aligning", "busy"),
    Mode.IDLE: ("Ready", "calm"),
    Mode.REAL_LEADS: ("Real robot leads", "real"),
    Mode.TWIN_LEADS: ("Twin leads", "twin"),
    Mode.OPERATOR_LEADS: ("Operator leads", "operator"),
    Mode.PAUSED: ("Paused", "warn"),
    Mode.STOPPED: ("Stopped", "warn"),
    Mode.ESTOP: ("Emergency stop", "bad"),
    Mode.FAULT: ("Fault", "bad"),
}
LEADERS = {
    "real": "real robot, the twin follows",
    "twin": "twin, the real robot follows",
    "operator": "operator, both are commanded",
    "": "nobody",
}


def mode_title(mode: str) -> str:
    """Return the mode as a heading; an unknown one as it is."""
    return MODES.get(mode, (mode, "warn"))[0]


def mode_tone(mode: str) -> str:
    """Return the CSS class of the mode."""
    return MODES.get(mode, (mode, "warn"))[1]


def leader_text(leader: str) -> str:
    """Return who leads and what the other does."""
    return LEADERS.get(leader, leader)


def number(value: float, decimals: int = 2, signed: bool = False) -> str:
    """Return a number with a true minus sign; what is not finite is shown as a dash.

    Args:
        value: The number.
        decimals: Digits after the point.
        signed: Show a plus sign too; a rounded zero has none.
    """
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{decimals}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")
    elif signed and value > 0.0:
        text = f"+{text}"
    return text.replace("-", MINUS)


def percent(value: float) -> str:
    """Return a whole percentage."""
    return f"{number(value, 0)} %"


def seconds(value: float) -> str:
    """Return a time in the unit that reads best, from microseconds to days."""
    if not math.isfinite(value):
        return UNKNOWN
    size = abs(value)
    for limit, scale, unit, decimals in (
        (1e-3, 1e6, "\u00b5s", 0),
        (1.0, 1e3, "ms", 1),
        (600.0, 1.0, "s", 2),
    ):
        if size < limit:
            return f"{number(value * scale, decimals)} {unit}"
    days, rest = divmod(size, 86400.0)
    hours, rest = divmod(rest, 3600.0)
    text = f"{hours:.0f} h {rest / 60.0:.0f} min" if not days else f"{days:.0f} d {hours:.0f} h"
    return f"{MINUS}{text}" if value < 0.0 else text


def clock(offset: float, uncertainty: float) -> str:
    """Return how far a clock is from ours and how well that is known.

    A clock that counts from another day is just its own.
    """
    if not math.isfinite(offset):
        return UNKNOWN
    shown = seconds(offset) if abs(offset) < OTHER_DAY_S else "own"
    return f"{shown} \N{PLUS-MINUS SIGN} {seconds(uncertainty)}"


def link_state(link: Link) -> str:
    """Return whether a link is up, else why not."""
    if link.connected and not link.reason:
        return "connected"
    return link.reason or "not connected"


def motion_text(state: CellState) -> str:
    """Return which side moves."""
    real, twin = not state.real_standing_still, not state.twin_standing_still
    if real and twin:
        return "both move"
    if real or twin:
        return f"the {'real robot' if real else 'twin'} moves"
    return "both stand still"


def speed_reason(state: CellState) -> str:
    """Return why the applied speed is not the requested one, or an empty text."""
    if not state.speed_limited:
        return ""
    return state.speed_reason or "limited"


def no_stop_text(why: str) -> str:
    """Return what the page says while no STOP gets through, or an empty text.

    Example:
        >>> no_stop_text("roscore does not answer")
        'STOP does not get through from here: use the stop at the robot. Roscore does not answer.'
    """
    if not why:
        return ""
    reason = why[:1].upper() + why[1:]
    return f"STOP does not get through from here: use the stop at the robot. {reason}."
