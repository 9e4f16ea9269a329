"""The quantities that modbus_map.yaml places: what each may stand in, and who needs it.

A delivered controller gives what a twin needs to follow it. Speeds, an echo, a watchdog and a ring
want a program of the robot's own: where they are left out, something else stands in their place,
and nothing is ever taken for 0.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

FAST_CLOCK, FAST_CLOCK_MS = "$FAST_CLOCK", 2.0
"""A controller's own clock counts so many milliseconds at a time."""
WHOLE = ("int16", "int32")
_AXIS = ("float32", "int32")
_TEXT = ("string",)


class Entry(NamedTuple):
    """What a quantity of the map may stand in, and who needs it.

    Attributes:
        types: Of its register.
        need: ``follow``: a twin that follows needs it, and each R-30iB has it without a program of
            its own. ``lead``: who leads the robot needs it too. Empty: it may be left out.
        instead: What stands in its place where it is left out.
    """

    types: tuple[str, ...]
    need: Literal["follow", "lead", ""] = ""
    instead: str = "not shown"


# Addresses are free, more registers are welcome.
ENTRIES: dict[str, Entry] = {
    "position": Entry(_AXIS, "follow"),
    # Wider than int16, and in whole halves of a millisecond: its wraps are to be told from jumps.
    "clock_ms": Entry(("int32",), "follow"),
    **dict.fromkeys(("position_valid", "override_now"), Entry(WHOLE, "follow")),
    **dict.fromkeys(("program_line", "program_state"), Entry(WHOLE, "follow")),
    **dict.fromkeys(("alarm_id", "alarm_number"), Entry(WHOLE, "follow")),
    **dict.fromkeys(("program_name", "alarm_message"), Entry(_TEXT, "follow")),
    # Kept by a program of the robot's own, or written for one.
    "setpoint": Entry(_AXIS, "lead"),
    **dict.fromkeys(("heartbeat", "stream_speed", "override"), Entry(WHOLE, "lead")),
    "control_type": Entry(WHOLE, instead="by PRG[1], the program's name"),
    "velocity": Entry(_AXIS, instead="differences of positions, over the robot's clock"),
    "setpoint_valid": Entry(WHOLE, instead="not written"),
    **dict.fromkeys(("program_speed", "heartbeat_echo", "watchdog_state"), Entry(WHOLE)),
    **dict.fromkeys(("program_caller", "alarm_cause", "alarm_severity_text"), Entry(_TEXT)),
    **dict.fromkeys(("alarm_severity", "alarm_time"), Entry(WHOLE)),
    "payload_mass": Entry(("float32", *WHOLE)),
    **dict.fromkeys(("mode_b0", "mode_b1"), Entry(WHOLE, instead="the mode switch is not known")),
    "motor_torque": Entry(_AXIS, instead="nothing tells how hard a joint works, nor how it wears"),
}
MODE_BITS = {"AUTO": (1, 1), "T1": (0, 0), "T2": (0, 1)}
"""What ``mode_b0`` and ``mode_b1`` show of the mode switch, a key at the robot.

Source:
    SI[8], SI[9] and AUTO: docs/sources.md. Which of T1 and T2 is which: [asm].
"""
GRIPPER_NUMBERS = {"gripper": "suction_now", "vacuum": "vacuum_now"}
"""Registers of RO[1] and RI[1] by the output that each stands for: of a robot whose gripper its own
programs switch, and nobody else."""
WRITTEN = ("setpoint", "setpoint_valid", "heartbeat", "stream_speed", "override")
# Signals of a robot, as a Fanuc controller names them: UI and UO.
INPUTS = (
    ("imstp", "hold", "sfspd", "cstopi", "fault_reset", "start", "home", "enbl")
    + tuple(f"rsr{number}" for number in range(1, 9))
    + ("pnstrobe", "prod_start")
)
OUTPUTS = (
    "cmdenbl",
    "sysrdy",
    "progrun",
    "paused",
    "held",
    "fault",
    "atperch",
    "tpenbl",
    "batalm",
    "busy",
)
# What is said to a robot: coils that must be writable, commands that must have a code. The other
# inputs are its own affair.
COMMANDS = ("imstp", "hold", "cstopi", "fault_reset", "start", "rsr1")
# A robot may have a suction gripper: then all of these signals, else none.
GRIPPER_INPUTS, GRIPPER_OUTPUTS = ("gripper",), ("gripper", "vacuum")
LEVELS = ("imstp", "hold", *GRIPPER_INPUTS)
"""Of what is said to a robot, what stays until it is taken back; all else is a pulse."""
# The buttons of the person beside the robot: all or none. The twin controller never writes them.
_KEYS = ("panel_start", "panel_abort", "panel_reset", *(f"panel_run{n}" for n in range(1, 9)))
PANEL_INPUTS = ("panel_imstp", "panel_hold", *_KEYS)
PANEL_OUTPUTS = ("panel_estop", "panel_held")
