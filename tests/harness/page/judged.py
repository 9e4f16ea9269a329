"""What the second world says in the scenes of the operator's page, the longest words included."""

from __future__ import annotations

from typing import Any

from operator_panel.door import Answer
from operator_panel.view.snapshot import Made
from scara_config import Robot

from scara_msgs.msg import MotionOutcome

STEPS = 60
LENGTH_S = 1.2
FAR = 0.5
"""Where each joint ends [rad] or [m], unless its range ends before."""
MADE = Made(end=MotionOutcome.REPLACED, time_predicted=12.34, time_measured=1.2)
HIT = (
    "REFUSED at 0.62 s, line 12 of a_program_with_a_long_name: part_3 in hand would hit "
    "stand_1 of the table with a long name"
)


def judged_home(robot: Robot) -> Answer:
    """Return a motion that is free; all joints go evenly from 0 to FAR or their limit."""
    return Answer(True, "OK: takes 1.20 s", _values(robot, "OK", "", 0.062))


def judged_hit(robot: Robot) -> Answer:
    """Return a motion that is refused half-way."""
    found = _values(robot, "REFUSED", "collision", 0.0)
    return Answer(True, HIT, {**found, "time": 0.62, "place": (0.351, 0.212, 0.04)})


def _values(robot: Robot, verdict: str, cause: str, least: float) -> dict[str, Any]:
    names = [joint.name for joint in robot.twin_joints]
    ends = [min(FAR, joint.upper) for joint in robot.twin_joints]
    shares = [k / (STEPS - 1) for k in range(STEPS)]
    return {
        "verdict": verdict,
        "cause": cause,
        "time": 0.0,
        "step": "",
        "place": (0.0, 0.0, 0.0),
        "duration": LENGTH_S,
        "clearance": least,
        "clearance_between": ["link_2", "keyboard_stand_of_the_neighbour"],
        "joint": names,
        "sample_times": [LENGTH_S * share for share in shares],
        "sample_positions": [share * end for share in shares for end in ends],
        "sample_clearance": [least + 0.4 * abs(share - 0.5) for share in shares],
        "sample_speed": [4.0 * share * (1.0 - share) for share in shares],
    }
