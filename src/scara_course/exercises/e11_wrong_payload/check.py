"""Exercise 11: one motion three times: the payload told right, told wrong, and right again."""

from __future__ import annotations

import numpy as np
from cell_recorder.journal.cycles import LEADS
from scara_config import Robot
from scara_course.marking import ExerciseMark
from scara_course.recorded import CourseRecording, held_at

from scara_msgs.msg import TwinControllerState as Mode

HEAVY_KG = 3.0
"""A lighter payload shows too little: our choice."""
SHORTEST_S = 2.0
"""A motion that lasts less shows nothing either."""
PLAINLY = 3.0
"""The wrong payload must move the twin so many times further off: the field stand-in's noise alone
changes the figure by less than half."""
JOINT, EMPTY = "joint_3", (0.0, 0.0)


def mark(recorded: CourseRecording, robot: Robot) -> ExerciseMark:
    """Look at each motion of the pair: what was told and mounted, how far joint_3 was apart."""
    if not recorded.payloads:
        return ExerciseMark(False, "the recording holds no payload: record a cell of ./cell up")
    phases: list[tuple[str, float]] = []
    changes = recorded.changes()
    for number, lead in enumerate(changes):
        if lead.after not in LEADS:
            continue
        end = changes[number + 1].at if number + 1 < len(changes) else recorded.run.duration
        if end - lead.at < SHORTEST_S or not all(recorded.moves(lead.at, end).values()):
            continue
        told, mounted = held_at(recorded.payloads, lead.at, EMPTY)
        if (told, mounted) != held_at(recorded.payloads, end, EMPTY):
            return ExerciseMark(False, f"the payload was changed in the motion at {lead.at:.1f} s")
        kind = "wrong" if told != mounted else "right"
        if mounted < HEAVY_KG:
            kind = "light"
        aligned = recorded.seen(robot, lead.at, end).aligned
        column = recorded.run.joint_names.index(JOINT)
        off = (aligned.real.positions - aligned.twin.positions)[:, column]
        apart = 1e3 * float(np.sqrt(np.mean(off**2)))
        # Several motions of one kind in a row are one phase, and its worst motion counts.
        if kind != "light" and phases and phases[-1][0] == kind:
            phases[-1] = (kind, max(phases[-1][1], apart))
        elif kind != "light":
            phases.append((kind, apart))
    kinds = [kind for kind, _ in phases]
    seen = ", ".join(kinds) or "none with a heavy payload"
    if "right" not in kinds:
        return ExerciseMark(False, f"no motion with {HEAVY_KG:g} kg or more told right ({seen})")
    if "wrong" not in kinds:
        return ExerciseMark(False, f"no motion with the payload told wrong ({seen})")
    # Phases take turns, so the three begin with the first right one.
    three = phases[kinds.index("right") :][:3]
    if len(three) < 2:
        return ExerciseMark(False, f"first right, then wrong: yours were {seen}")
    if len(three) < 3:
        return ExerciseMark(False, f"no motion after the payload was put right ({seen})")
    before, wrong, again = (apart for _, apart in three)
    told_text = f"{JOINT} was {before:.2f}, {wrong:.2f} and {again:.2f} mm apart (r.m.s.)"
    if wrong < PLAINLY * max(before, again):
        return ExerciseMark(False, f"the wrong payload did not show: {told_text}")
    if changes[-1].after != Mode.IDLE:
        return ExerciseMark(False, f"the recording ends in {changes[-1].after}, not ready")
    return ExerciseMark(True, told_text)
