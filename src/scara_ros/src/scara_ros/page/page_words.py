"""The twin controller's modes and reasons in words: the same on every page of ours."""

from __future__ import annotations

import re

CODE = re.compile(r"[A-Z_]{3,}: ")  # how the controller begins an answer: "MOVE: "

# mode: (title, tone). The tone is a CSS class; blue is the real robot, orange the twin. The modes
# are those of scara_msgs/TwinControllerState, which a desk without ROS cannot import; a test holds
# both together.
MODES: dict[str, tuple[str, str]] = {
    "OFFLINE": ("Offline", "bad"),
    "ALIGNING": ("Aligning", "busy"),
    "IDLE": ("Ready", "calm"),
    "REAL_LEADS": ("Real robot leads", "real"),
    "TWIN_LEADS": ("Twin leads", "twin"),
    "OPERATOR_LEADS": ("Operator leads", "operator"),
    "PAUSED": ("Paused", "warn"),
    "STOPPED": ("Stopped", "warn"),
    "STANDSTILL": ("Monitored standstill", "warn"),
    "ESTOP": ("Emergency stop", "bad"),
    "FAULT": ("Fault", "bad"),
}


def mode_title(mode: str) -> str:
    """Return the mode as a heading; an unknown one as it is.

    Example:
        >>> mode_title("ESTOP"), mode_title("DANCING")
        ('Emergency stop', 'DANCING')
    """
    return MODES.get(mode, (mode, "warn"))[0]


def mode_tone(mode: str) -> str:
    """Return the CSS class of the mode."""
    return MODES.get(mode, (mode, "warn"))[1]


def mode_change(before: str, after: str) -> str:
    """Return a change of the mode; only the mode if it stayed.

    Example:
        >>> mode_change("IDLE", "PAUSED"), mode_change("IDLE", "IDLE")
        ('Ready → Paused', 'Ready')
    """
    title = mode_title(after)
    return title if before == after else f"{mode_title(before)} \N{RIGHTWARDS ARROW} {title}"


def people(text: str) -> str:
    """Return a text of the controller with its modes and commands as a person says them.

    Example:
        >>> people("MOVE: OPERATOR_LEADS: both are commanded")
        'Both are commanded'
        >>> people("MOVE refused: something else leads: STOP first")
        'MOVE refused: something else leads: STOP first'
    """
    while found := CODE.match(text):
        text = text[found.end() :]
    for mode, (title, _) in MODES.items():
        if "_" in mode:
            text = text.replace(mode, title.lower())
    return text[:1].upper() + text[1:]
