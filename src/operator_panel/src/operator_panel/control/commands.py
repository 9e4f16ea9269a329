"""Which commands make sense in which mode. This only greys out buttons: the twin controller judges every command itself."""

from __future__ import annotations

from collections.abc import Mapping

COMMANDS = ("STOP", "ESTOP", "PAUSE", "RESUME", "RESET", "HOME", "ALIGN", "ACKNOWLEDGE", "SPEED", "MOVE")
WITHOUT_CONTROL = ("STOP", "ESTOP")  # any operator may end a motion; only the one in control may begin one
MOVING = ("REAL_LEADS", "TWIN_LEADS", "OPERATOR_LEADS")
AT_REST = ("IDLE", "STOPPED")

_MODES: Mapping[str, tuple[str, ...]] = {
    "PAUSE": MOVING,
    "RESUME": ("PAUSED",),
    "RESET": ("ESTOP", "FAULT"),
    "HOME": AT_REST,
    "ALIGN": AT_REST,
    "MOVE": AT_REST,
    "JOG": (*AT_REST, "TWIN_LEADS"),
    "RUN": AT_REST,
}
_WHY: Mapping[str, str] = {
    "PAUSE": "nothing moves",
    "RESUME": "nothing is paused",
    "RESET": "nothing is latched",
    "HOME": "only while both stand ready",
    "ALIGN": "only while both stand ready",
    "MOVE": "only while both stand ready",
    "JOG": "only while both stand ready",
    "RUN": "only while both stand ready",
    "ACKNOWLEDGE": "there is nothing to acknowledge",
}


def refusal(command: str, mode: str, diverged: bool, silent: bool) -> str:
    """Return why a button is greyed out now, or an empty text.

    Args:
        command: One of ``COMMANDS``, or JOG, or RUN (a program of the real robot).
        mode: Mode of the twin controller.
        diverged: Whether the pair came apart.
        silent: Whether the twin controller says nothing.
    """
    if command in WITHOUT_CONTROL:
        return ""
    if silent:
        return "the twin controller is silent"
    if command == "ACKNOWLEDGE":
        return "" if diverged or mode == "PAUSED" else _WHY[command]
    return "" if mode in _MODES.get(command, (mode,)) else _WHY[command]
