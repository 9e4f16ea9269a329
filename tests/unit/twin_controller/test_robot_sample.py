"""Where outputs are not allocated, the blocks of program and alarm tell what they would."""

from __future__ import annotations

import pytest
from twin_controller.robot_sample import AlarmStatus, ProgramState, ProgramStatus, told_outputs

NO_ALARM = AlarmStatus(0, 0, "", "", "")


@pytest.mark.parametrize(
    ("state", "told"),
    [
        (ProgramState.RUNNING, {"sysrdy", "progrun"}),
        (ProgramState.PAUSED, {"sysrdy", "paused"}),
        (ProgramState.ABORTED, {"sysrdy"}),
    ],
)
def test_the_program_block_tells_whether_a_program_runs(
    state: ProgramState, told: set[str]
) -> None:
    """PRG[1] has 0 aborted, 1 paused, 2 running."""
    assert told_outputs(ProgramStatus("ARTICLE", 4, state), NO_ALARM) == told


@pytest.mark.parametrize(
    ("severity", "told"),
    [
        ("", {"sysrdy", "fault"}),
        ("WARN", {"sysrdy"}),
        ("PAUSE", {"sysrdy", "fault"}),
        ("STOP", {"sysrdy", "fault"}),
        ("SERVO", {"fault"}),
        ("ABORT", {"sysrdy", "fault"}),
        ("SYSTEM", {"fault"}),
    ],
)
def test_the_alarm_block_tells_fault_and_drives(severity: str, told: set[str]) -> None:
    """A SERVO alarm has switched the drives off; one of no known severity stops the robot."""
    alarm = AlarmStatus(11, 7, severity, "text", "")
    assert told_outputs(ProgramStatus("", 0, ProgramState.ABORTED), alarm) == told
