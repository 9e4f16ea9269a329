"""What a robot says of its program, as scara_msgs/RobotData carries it."""

from __future__ import annotations

import re

STREAM = "stream"
"""As ``control_type`` says what moves the robot: set points of the twin controller."""
SAID = re.compile(r"(?P<name>\S+) line (?P<line>\d+) (?P<state>\w+)")
"""As ``program`` says it."""


def current_line(said: str) -> tuple[str, int]:
    """Return program and line that run or are paused now; an empty name if none does.

    Example:
        >>> current_line("ARTICLE line 5 paused"), current_line("ARTICLE line 9 aborted")
        (('ARTICLE', 5), ('', 0))
    """
    found = SAID.fullmatch(said)
    if found is None or found["state"] not in ("running", "paused", "held"):
        return "", 0
    return found["name"], int(found["line"])
