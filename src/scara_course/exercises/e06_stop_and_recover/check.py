"""Exercise 6: a stop, an emergency stop, and the way back from both, in one recording."""

from __future__ import annotations

from typing import NamedTuple

from cell_recorder.journal.cycles import LEADS
from scara_config import Robot
from scara_course.marking import ExerciseMark
from scara_course.recorded import CourseRecording, after

from scara_msgs.msg import TwinControllerState as Mode

STANDS_S = 1.5
"""Our choice: as long as the twin controller waits until both are seen to stand."""
BEFORE_S, REST_S = 0.3, 0.3
"""So long before a stop somebody must have moved; so long at its end both must have stood [s]."""


class TaskStep(NamedTuple):
    """A step of the task: what happens, the modes it leads to, and what to say if it does not."""

    event: str
    modes: tuple[str, ...]
    missing: str


STAGES = (
    TaskStep("", LEADS, "nobody moved: press ARTICLE on the pendant while it records"),
    TaskStep("STOP", (Mode.STOPPED,), "no STOP while the pair moved"),
    TaskStep("ALIGN", (Mode.ALIGNING,), "no Align after STOP"),
    TaskStep("ALIGNED", (Mode.IDLE,), "the pair was not ready after the Align that follows STOP"),
    TaskStep("", LEADS, "nobody moved again between STOP and E-STOP"),
    TaskStep("ESTOP", (Mode.ESTOP,), "no E-STOP while the pair moved"),
    TaskStep(
        "RESET_DONE", (Mode.STOPPED,), "no Reset after E-STOP, or the robot did not become ready"
    ),
    TaskStep("ALIGN", (Mode.ALIGNING,), "no Align after Reset"),
    TaskStep("ALIGNED", (Mode.IDLE,), "the pair was not ready after the Align that follows Reset"),
    TaskStep("", LEADS, "nobody moved after the emergency stop was over"),
    TaskStep("AT_REST", (Mode.IDLE,), "the last motion did not come to rest within the recording"),
)
FROM = {"STOP": LEADS, "ESTOP": LEADS}
"""Modes from which a stop counts: one at rest stops nothing."""
WAY_BACK = ("ALIGN", "ALIGNED", "RESET_DONE")


def mark(recorded: CourseRecording, robot: Robot) -> ExerciseMark:
    """Look for the stages one after the other, then at what both sides did meanwhile."""
    del robot
    changes = recorded.changes()
    place, found = 0, []
    for number, stage in enumerate(STAGES, 1):
        at = after(changes, place, stage.event, stage.modes)
        while at is not None and changes[at].before not in FROM.get(
            stage.event, (changes[at].before,)
        ):
            at = after(changes, at + 1, stage.event, stage.modes)
        # The way back comes before the next motion, not some time later.
        next_lead = after(changes, place, "", LEADS)
        late = stage.event in WAY_BACK and at is not None and at > (next_lead or len(changes))
        if at is None or late:
            text = f"{stage.missing} (step {number} of {len(STAGES)} was not found)"
            return ExerciseMark(False, text)
        found.append(changes[at])
        place = at + 1
    stop, align, estop, reset = found[1], found[2], found[5], found[6]
    told = []
    for name, begun, over in (("STOP", stop, align), ("E-STOP", estop, reset)):
        moving = recorded.moves(begun.at - BEFORE_S, begun.at)
        if not any(moving.values()):
            return ExerciseMark(False, f"nothing moved when {name} came, at {begun.at:.1f} s")
        if over.at - begun.at < REST_S:
            return ExerciseMark(
                False, f"only {over.at - begun.at:.1f} s after {name}: wait until both stand"
            )
        # Who aligns before STANDS_S is over must have stood all the same, for REST_S at least.
        still = min(begun.at + STANDS_S, over.at - REST_S)
        for side, moved in recorded.moves(still, over.at).items():
            if moved:
                return ExerciseMark(
                    False, f"{name} at {begun.at:.1f} s: {side} still moved after {STANDS_S:g} s"
                )
        told.append(f"{name} at {begun.at:.1f} s")
    lead, end = found[-2], found[-1]
    for side, moved in recorded.moves(lead.at, end.at).items():
        if not moved:
            return ExerciseMark(False, f"{side} did not move in the last motion")
    last = changes[-1]
    if last.after != Mode.IDLE:
        return ExerciseMark(False, f"the recording ends in {last.after}, not ready")
    return ExerciseMark(True, f"{told[0]}, {told[1]}, both went on together at {lead.at:.1f} s")
