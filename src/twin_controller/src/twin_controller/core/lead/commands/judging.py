"""Judge where a move of the operator leads, before it is accepted and while it is only asked about.

One function for both: what the page shows as reachable is accepted, and what it refuses is refused.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scara_control.errors import ScaraControlError
from scara_control.keep_out.zones import judge_way
from scara_control.kinematics.tool_path import check_way, solve_legs, wanted_elbow
from scara_control.limits import inside

from twin_controller.core.events import Joints, Operator
from twin_controller.core.follow.limit import check_setpoint
from twin_controller.core.follow.real import bounds_of
from twin_controller.core.lead.modes import MOVES
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import TwinSide


class JudgedMove(NamedTuple):
    """Where a move leads, and why it may not be made."""

    # Joint positions at its end, SI; empty if they are not known.
    target: Joints = ()
    # The elbow branch of a point; empty where a branch has no name.
    elbow: str = ""
    # In words; empty if nothing is against it.
    refusal: str = ""


def judge_move(setup: Setup, twin: TwinSide, event: Operator) -> JudgedMove:
    """Judge a move from where the twin stands: its target, the kinematics, the way's zones.

    Whether a move may begin at all now is judged by :func:`refusals`, for it does not depend on the
    target.

    Args:
        setup: Profile and numbers.
        twin: The twin; one that was never seen cannot be judged.
        event: MOVE, MOVE_JOINTS or HOME.
    """
    if event.command not in MOVES:
        return JudgedMove(refusal=f"command = {event.command!r}: allowed are {', '.join(MOVES)}")
    invalid = invalid_target(setup, event)
    # A message's fields are 0 unless somebody fills them, and (0, 0, 0) is in the robot's own base.
    if not invalid and event.command == "MOVE" and not any(event.target):
        invalid = "x, y and z are 0, which is in the robot's base: MOVE needs the point to move to"
    if invalid:
        return JudgedMove(refusal=invalid)
    if not twin.history:
        return JudgedMove(refusal="where the twin stands is not known: wait for its link")
    start = twin.last.q
    try:
        target, elbow = _destination(setup, start, event)
        between = _between(setup, start, target, event)
    except ScaraControlError as error:
        return JudgedMove(refusal=str(error))
    # A rounded corner lies inside the one that is judged.
    margin = setup.config.cell.keep_out_clearance_mm + event.corner_mm
    zones, points = setup.keep_out, setup.points
    way = judge_way(points, zones, start, target, setup.velocity, margin, between)
    return JudgedMove(target, elbow, way.violation)


def _between(setup: Setup, start: Joints, target: Joints, event: Operator) -> tuple[Joints, ...]:
    """Return joint positions on the way, straight from one to the next, corners not rounded.

    Raises:
        ScaraControlError: The event asks for a way that is none, or that the tool cannot go.
    """
    way = check_way(setup.joints, event.path, event.via, event.speed_mm_s, event.corner_mm)
    if way is None:
        return ()
    found: list[Joints] = []
    begin = start if way.path == "joint" else inside(setup.joints, start)
    for end, along in solve_legs(setup.tool, setup.joints, begin, target, way):
        found += along.corners[1:] if along is not None else (end,)
    return tuple(found[:-1])


def invalid_target(setup: Setup, event: Operator) -> str:
    """Return why the command's target or speed is invalid, or an empty text."""
    if event.command not in MOVES:
        return ""
    percent = event.speed_percent
    if not (percent == 0.0 or 1.0 <= percent <= 100.0):
        return f"speed_percent = {percent:g} is neither 0 (default) nor in [1, 100]"
    if event.command == "MOVE":
        valid = len(event.target) == 3 and all(map(math.isfinite, event.target))
        if valid:
            return ""
        return f"target = {list(event.target)} is not three finite coordinates"
    if event.command == "MOVE_JOINTS":
        return check_setpoint(event.target, bounds_of(setup))
    return ""


def _destination(setup: Setup, start: Joints, event: Operator) -> tuple[Joints, str]:
    """Return where a move leads the twin's joints, by the same kinematics that the twin uses.

    Raises:
        ScaraControlError: The point is out of reach, or there is no such elbow.
    """
    if event.command == "HOME":
        return setup.home, ""
    if event.command == "MOVE_JOINTS":
        return event.target, ""
    columns = [setup.names.index(joint.name) for joint in setup.tool.joints]
    x, y, z = event.target
    seed = [start[column] for column in columns]
    elbow = wanted_elbow(setup.tool, event.elbow, event.path, seed)
    answer = setup.tool.inverse(x, y, z, elbow, seed, event.yaw)
    q = list(start)
    for column, position in zip(columns, answer.chosen.q):
        q[column] = position
    branch = answer.chosen.elbow
    if branch is None:
        return tuple(q), ""
    return tuple(q), branch.value
