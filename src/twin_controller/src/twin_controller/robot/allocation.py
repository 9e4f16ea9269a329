"""What a robot shows whose outputs are not all allocated: its program and alarm tell the rest."""

from __future__ import annotations

from twin_controller.robot_sample import AlarmStatus, ProgramState, ProgramStatus

_WARNS = ("", "NONE", "WARN")
"""Severities that stop nothing."""
_DRIVES_OFF = ("SERVO", "SYSTEM")
"""Severities that switch the drives off."""


def told_outputs(program: ProgramStatus, alarm: AlarmStatus) -> frozenset[str]:
    """Return the outputs that are on, as the blocks of program and alarm tell them.

    SYSRDY is on unless an alarm has switched the drives off: no register tells it.

    Args:
        program: The running or last program.
        alarm: The active alarm.

    Source:
        Our choice, by the severities of the maker's manual: docs/sources.md.
    """
    severity = alarm.severity if alarm.facility else ""
    told = {
        "sysrdy": severity not in _DRIVES_OFF,
        "progrun": program.state is ProgramState.RUNNING,
        "paused": program.state is ProgramState.PAUSED,
        "fault": severity not in _WARNS,
    }
    return frozenset(name for name, on in told.items() if on)
