"""Exercise 10: a program of the learner's own visits the article's points sooner than ARTICLE."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from cell_recorder.journal.cycles import LEADS
from numpy.typing import NDArray
from scara_config import Robot
from scara_course.marking import ExerciseMark
from scara_course.recorded import SHIPPED, CourseRecording, held_at
from twin_experiments.metrics.errors import Trace

Array = NDArray[np.float64]
FIRST = "ARTICLE"
VISITS = ("P1", "P2", "P3", "P1", "P2", "P3", "P1")
TOLD_S = 0.5
"""Our choice: so long after the first motion the robot has told its program."""
NEAR_MM, APART_PERCENT, SHORTER_PERCENT = 3.0, 2.0, 15.0
"""Our choice: so near the tool comes to each point; so far apart both tools may be, as the report's
verdict has it, of reach; so much less time counts."""


class TimedRun(NamedTuple):
    """One run of a program: its name, where both tools were, and the override [percent]."""

    program: str
    seen: Trace
    override: float

    @property
    def time(self) -> float:
        """From first to last motion [s]."""
        at = self.seen.aligned.instants[self.seen.moving]
        return float(at[-1] - at[0])


def mark(recorded: CourseRecording, robot: Robot) -> ExerciseMark:
    """Compare the first run of ARTICLE with the last run of another program."""
    cycles = []
    for lead, over in pairwise(recorded.changes()):
        # The program is told by the robot a moment after it moved.
        program = recorded.program_at(min(lead.at + TOLD_S, over.at))
        if lead.after in LEADS and program:
            # From before the decision: it comes a moment after the motion that led to it.
            seen = recorded.seen(robot, lead.at - TOLD_S, over.at)
            if seen.moving.any():
                override = held_at(recorded.overrides, over.at, 0.0)
                cycles.append(TimedRun(program, seen, override))
    before = next((each for each in cycles if each.program == FIRST), None)
    after = next((each for each in reversed(cycles) if each.program not in SHIPPED), None)
    if before is None:
        return ExerciseMark(False, f"the recording holds no run of {FIRST} from its start")
    if after is None:
        return ExerciseMark(False, "the recording holds no run of a program of yours")
    points = {name: 1e3 * np.array(place) for name, place in robot.positions_m.items()}
    for each in (before, after):
        missing = first_missing(1e3 * each.seen.real_tool, [points[name] for name in VISITS])
        if missing is not None:
            return ExerciseMark(
                False,
                f"{each.program}: point {missing + 1} of {len(VISITS)}, {VISITS[missing]}, was "
                f"never nearer than {NEAR_MM:g} mm in its turn",
            )
    # A robot has whole percents: half of one is rounding.
    if abs(after.override - before.override) > 0.5:
        return ExerciseMark(
            False,
            f"the override was {before.override:.0f} %, then {after.override:.0f} %: it must be "
            "the same",
        )
    apart = float(after.seen.deviation_mm.max())
    percent = 100.0 * apart / robot.reach_mm
    if percent > APART_PERCENT:
        return ExerciseMark(
            False,
            f"{after.program}: the tools were {apart:.1f} mm apart, {percent:.1f} % of reach "
            f"({APART_PERCENT:g} % is allowed)",
        )
    shorter = 100.0 * (1.0 - after.time / before.time)
    text = (
        f"{FIRST} took {before.time:.2f} s, {after.program} {after.time:.2f} s, "
        f"{abs(shorter):.0f} % {'less' if shorter >= 0.0 else 'more'}"
    )
    if shorter < SHORTER_PERCENT:
        return ExerciseMark(False, f"{text}: {SHORTER_PERCENT:g} % less are needed")
    return ExerciseMark(True, f"{text}; the tools at most {apart:.1f} mm apart")


def first_missing(tool: Array, points: Sequence[Array]) -> int | None:
    """Return the place of the first point that was not visited in its turn; None: all were."""
    since = 0
    for number, point in enumerate(points):
        near = np.flatnonzero(np.linalg.norm(tool[since:] - point, axis=1) <= NEAR_MM)
        if not len(near):
            return number
        since += int(near[0])
    return None
