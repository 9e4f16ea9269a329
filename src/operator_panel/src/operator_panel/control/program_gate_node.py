"""A program is judged before the page starts it on the robot's pendant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import run
from scara_ros.gate.judge_gate_node import JudgeGate
from scara_ros.gate.permit import Permit
from scara_ros.gate.settings import GateSettings, load_gate

from operator_panel.control.calling_node import as_answer
from operator_panel.door import Answer
from scara_msgs.msg import Audit
from scara_msgs.srv import JudgeMotion

FIELDS = (
    *("verdict", "cause", "time", "step", "duration", "clearance", "clearance_between", "joint"),
    *("sample_times", "sample_positions", "sample_clearance", "sample_speed"),
)
"""What the page needs of scara_msgs/JudgeMotion's answer."""
PASSED = Permit(True, "")


class ProgramGate:
    """Asks the judge for a program.

    Args:
        folder: Of what_if.yaml.

    Raises:
        ConfigError: what_if.yaml is wrong.
    """

    def __init__(self, folder: Path) -> None:
        self._settings = load_gate(folder)
        self._gate: JudgeGate | None = None

    @property
    def settings(self) -> GateSettings:
        """What what_if.yaml says of the gate."""
        return self._settings

    def connect(self) -> None:
        """Advertise, once this process is a node."""
        settings = self._settings
        self._gate = JudgeGate(settings, JudgeMotion, Audit, settings.program_patience)

    async def judge(self, key: str, *words: str) -> Permit:
        """Return whether a key of the pendant may be pressed; all but ``run`` may."""
        gate = self._gate
        if key != "run" or not words or gate is None:
            return PASSED
        program = words[0]
        found: Permit | None = await run.io_bound(
            lambda: gate.ask(f"program {program}", motion="PROGRAM", program=program)
        )
        # NiceGUI gives nothing at all for a call that the end of its server has cut off.
        return found or Permit(False, "the page's server ends")


def tried(response: Any) -> Answer:
    """Turn what the second world answers into values that are plain."""
    found = as_answer(response, *FIELDS)
    if not found.success:
        return found
    place = response.place
    return Answer(True, found.message, {**found.values, "place": (place.x, place.y, place.z)})


def with_note(answer: Answer, found: Permit) -> Answer:
    """Return the pendant's answer with what the gate adds to it."""
    if not found.note or not answer.success:
        return answer
    return Answer(True, f"{answer.message}; {found.note}", answer.values)
