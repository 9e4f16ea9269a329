"""What came of a motion in the simulated world: contacts, suction and parts included."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.geometry.tree import Tree
from what_if.timing.leg import Leg
from what_if.verdict import Outcome


class Seen(msgspec.Struct, frozen=True):
    """Something that happened to a part, or a collision.

    Attributes:
        time_s: From the beginning of the motion.
        step: Which part of the motion, for example a line of the program.
        text: In words.
        harm: It must not happen.
    """

    time_s: float
    step: str
    text: str
    harm: bool


class Simulated(msgspec.Struct, frozen=True):
    """The answer of the simulated world.

    Attributes:
        outcome: OK or REFUSED.
        duration_s: Of the motion.
        seen: What happened, in time.
        saturated_steps: In so many steps a joint's effort was at its limit.
        strayed_mm: So far the tool was from where it was planned, at most.
        times_real: How much faster than real time it was computed, by processor time.
    """

    outcome: Outcome
    duration_s: float
    seen: tuple[Seen, ...]
    saturated_steps: int
    strayed_mm: float
    times_real: float

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        first = next((seen for seen in self.seen if seen.harm), None)
        if first is None:
            return f"OK: takes {self.duration_s:.2f} s in the simulated world"
        where = f", {first.step}" if first.step else ""
        return f"{self.outcome.value} at {first.time_s:.2f} s{where}: {first.text}"


def outcome_of(seen: Sequence[Seen]) -> Outcome:
    """Return REFUSED if there was harm."""
    return Outcome.REFUSED if any(each.harm for each in seen) else Outcome.OK


def planned_at(leg: Leg, here: Sequence[float], times: FloatArray) -> FloatArray:
    """Return where the joints are planned to be, shape (m, n).

    Args:
        leg: A piece of the motion.
        here: Where they stand if it has no course, shape (n,).
        times: From the beginning of the leg [s], shape (m,).
    """
    course = leg.course
    if course is None or len(course.times) < 2:
        return np.tile(np.asarray(here, dtype=float), (len(times), 1))
    columns = [np.interp(times, course.times, column) for column in course.q.T]
    return np.stack(columns, axis=1)


def strays_mm(tree: Tree, tool: str, planned: FloatArray, measured: FloatArray) -> FloatArray:
    """Return how far the tool was from its plan [mm], shape (m,).

    Args:
        tree: The links.
        tool: The tool's link.
        planned: Joint positions, shape (m, n).
        measured: Likewise.
    """
    if not len(measured):
        return np.zeros(0)
    index = tree.index[tool]
    gap = tree.poses(measured)[:, index, :3, 3] - tree.poses(planned)[:, index, :3, 3]
    found: FloatArray = 1e3 * np.linalg.norm(gap, axis=1)
    return found


def held_up(strays: FloatArray, times: FloatArray, allowed_mm: float, step: str) -> list[Seen]:
    """Return when something kept the tool from where it was planned, if it did.

    Args:
        strays: [mm], shape (m,).
        times: From the beginning of the motion [s], shape (m,).
        allowed_mm: So far it may be by itself.
        step: Which part of the motion.
    """
    beyond = np.flatnonzero(strays > allowed_mm)
    if not beyond.size:
        return []
    text = f"the tool is kept {float(strays.max()):.1f} mm from where it was planned"
    return [Seen(float(times[beyond[0]]), step, text, harm=True)]


def physics_lines(found: Simulated) -> list[str]:
    """Return the answer in words."""
    lines = [f"physics    {found.sentence}"]
    lines += [f"           {seen.time_s:.2f} s: {seen.text}" for seen in found.seen if seen.harm]
    lines.append(
        f"           tool at most {found.strayed_mm:.2f} mm from its plan, efforts limited in "
        f"{found.saturated_steps} steps, {found.times_real:.0f} times real time"
    )
    return lines
