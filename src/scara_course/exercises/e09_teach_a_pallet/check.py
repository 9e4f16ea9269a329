"""Exercise 9: a program of the learner's own carries parts to their places, on both sides."""

from __future__ import annotations

import math

from scara_config import Robot
from scara_course.marking import ExerciseMark
from scara_course.recorded import SHIPPED, CourseRecording
from twin_experiments.palletising import SIDES, outcome

from scara_msgs.msg import PartEvent

FEWEST = 3
"""Parts that must lie on their places: one stand's. Our choice."""


def mark(recorded: CourseRecording, robot: Robot) -> ExerciseMark:
    """Judge both sides' parts at the end, and who carried them."""
    del robot
    run, work = recorded.run, recorded.work
    if work is None or any(side not in run.handled for side in SIDES):
        return ExerciseMark(False, "the recording holds no parts: record a cell of ./cell up")
    placed_at = [at for at, kind, _, _ in run.handled["real"].events if kind == PartEvent.PLACED]
    if not placed_at:
        return ExerciseMark(False, "the robot placed no part while it was recorded")
    for at in placed_at:
        program = recorded.program_at(at)
        if program in SHIPPED:
            return ExerciseMark(False, f"{program} placed the parts: teach a program of your own")
    told = []
    for side in SIDES:
        found = outcome(side, run.handled[side], work, 0.0, run.duration)
        for what, texts in (("a collision", found.collisions), ("a drop", found.drops)):
            # Told before how far parts are off: a collision or a drop explains that.
            if texts:
                return ExerciseMark(False, f"{side}: {what}: {texts[0]} ({len(texts)} in all)")
        off = {
            name: error
            for name, error in found.errors_mm.items()
            if math.isfinite(error) and name not in found.placed
        }
        if off:
            name = max(off, key=lambda each: off[each])
            return ExerciseMark(
                False,
                f"{side}: {name} lies {off[name]:.2f} mm off its place "
                f"({work.task.tolerance_mm:g} mm is allowed)",
            )
        # What lay there before the recording is no work of this program.
        events = run.handled[side].events
        carried = {name for _, kind, name, _ in events if kind == PartEvent.PLACED}
        placed = [name for name in found.placed if name in carried]
        if len(placed) < FEWEST:
            return ExerciseMark(
                False,
                f"{side}: {len(placed)} parts lie on their places, {FEWEST} are needed that were "
                "placed while it was recorded",
            )
        worst = max(found.errors_mm[name] for name in placed)
        told.append(f"{side}: {len(placed)} parts, at most {worst:.2f} mm off")
    program = recorded.program_at(placed_at[-1])
    return ExerciseMark(True, f"{program or 'your lead'}: {'; '.join(told)}")
