"""The real robot's own state in words: who may move it, drives, stop, motion."""

from __future__ import annotations

from scara_ros.message_struct import struct_of

import industrial_msgs.msg

YES, NO = 1, 0
MODES = {1: "by hand, at its pendant", 2: "automatic"}
SWITCH = {
    "AUTO": "AUTO: automatic, can be started from here",
    "T1": "T1: by hand, at most 250 mm/s, started at its pendant",
    "T2": "T2: by hand, full speed, started at its pendant",
}
"""Where its mode switch stands says more than that somebody may move it by hand."""
UNKNOWN = "not known"


class RobotStatus(struct_of(industrial_msgs.msg.RobotStatus)):  # type: ignore[misc]
    """The fields of industrial_msgs/RobotStatus: mode 1 manual, 2 automatic; else 1 yes, 0 no, -1."""


def status_texts(status: RobotStatus | None, switch: str = "") -> dict[str, str]:
    """Return what stands on the page, by place.

    Args:
        status: What the robot says; None: nothing.
        switch: At what its mode switch stands; empty: it does not tell.
    """
    if status is None:
        return dict.fromkeys(
            ("status.mode", "status.drives", "status.stop", "status.motion", "status.error"),
            UNKNOWN,
        )
    motion = "moves"
    if status.in_motion != YES:
        motion = _answer(status.motion_possible, "stands, can move", "stands, cannot move")
    error = _answer(status.in_error, "yes", "none")
    if status.in_error == YES and status.error_code:
        error = f"yes, number {status.error_code}"
    return {
        "status.mode": SWITCH.get(switch, MODES.get(status.mode, UNKNOWN)),
        "status.drives": _answer(status.drives_powered, "on", "off"),
        "status.stop": _answer(status.e_stopped, "pressed", "not pressed"),
        "status.motion": motion,
        "status.error": error,
    }


def _answer(value: int, yes: str, no: str) -> str:
    return {YES: yes, NO: no}.get(value, UNKNOWN)
