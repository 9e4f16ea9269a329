"""How long a program takes in the second world, and what speaks against it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from fanuc_emulator.tp.rehearsal import rehearse
from scara_config import ConfigError
from scara_config.programs.files import ProgramSteps, Taught, taught_of
from scara_config.programs.tp.listing import Program
from scara_config.programs.tp.printer import print_program

from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.judging import SAMPLED, judge_planned
from what_if.timing.leg import Planned
from what_if.timing.planning import plan
from what_if.verdict import Outcome, Verdict
from what_if.world import World

AIR_MM = 10.0
"""Bodies that were further apart stay so far from each other, in each line; our choice."""
FOUND_SHARE, FOUND_MM = 0.05, 0.5
"""Clearances are found to this share and this length: what_if.geometry.sweep."""
SMOOTHED_S = 0.03
"""A robot's own filters spread a change of acceleration over so long: those of the stand-in."""
GRID_S = 0.005
JERK_SHARE = 0.1
"""Jerk is known to this share: rounded corners are sampled."""
ROUNDED = 1e-6
"""Shares that differ by less are the same; our choice."""


class Bench:
    """Programs that are to do what an old one does.

    Args:
        world: In which they begin.
        program: The old one.
        library: What it can call.

    Attributes:
        program: As given.
        taught: The old one, checked.
        steps: What it does.
        verdict: On it.

    Raises:
        ConfigError: What it does cannot be told beforehand.
        WhatIfError: It is refused itself.
    """

    def __init__(self, world: World, program: Program, library: Mapping[str, Taught]) -> None:
        self._world, self._library = world, library
        self.program = program
        self.taught = taught_of(program, world.cell.robot, program.name)
        self.steps = tuple(rehearse(self.taught, world.cell.robot, library))
        planned = plan(world, ProgramSteps(program.name, self.steps))
        self.verdict, self._near = judge_planned(world, planned)
        if self.verdict.outcome is Outcome.REFUSED:
            raise WhatIfError(f"{program.name} is refused itself: {self.verdict.sentence}")
        self._jerk = self._jerk_of(planned)
        # By the text of a program what was found of it: a descent asks for the same ones again.
        self._seconds: dict[str, float] = {}
        self._against: dict[str, str] = {}

    def motion(self, program: Program) -> ProgramSteps:
        """Return what a program does.

        Raises:
            ConfigError: It cannot be told beforehand.
        """
        robot = self._world.cell.robot
        steps = rehearse(taught_of(program, robot, program.name), robot, self._library)
        return ProgramSteps(program.name, tuple(steps))

    def seconds(self, program: Program) -> float:
        """Return how long a program takes [s]; infinite: it cannot be made."""
        text = print_program(program)
        if text not in self._seconds:
            planned = self._planned(program)
            made = planned is not None and planned.legs and not planned.reasons
            last = planned.legs[-1] if planned is not None and made else None
            self._seconds[text] = last.begin + last.duration if last else math.inf
        return self._seconds[text]

    def against(self, program: Program) -> str:
        """Return what speaks against a program beside the old one; empty: nothing does."""
        text = print_program(program)
        if text not in self._against:
            planned = self._planned(program)
            unknown = "what it does cannot be told beforehand"
            self._against[text] = unknown if planned is None else self._spoken(planned)
        return self._against[text]

    def _spoken(self, planned: Planned) -> str:
        # What is quickly known comes first.
        hard = self._jerky(self._jerk_of(planned))
        if hard:
            return hard
        verdict, near = judge_planned(self._world, planned)
        if verdict.outcome not in (Outcome.OK, self.verdict.outcome):
            return verdict.sentence
        if sorted(verdict.placed) != sorted(self.verdict.placed):
            return "the parts do not come to the same places"
        return self._nearer(near) or self._harder(verdict)

    def jerk_percent(self, program: Program) -> float:
        """Return the largest jerk of a joint in percent of robot.yaml, behind the filters."""
        planned = self._planned(program)
        return 100.0 * float(self._jerk_of(planned).max()) if planned else math.inf

    def _planned(self, program: Program) -> Planned | None:
        try:
            return plan(self._world, self.motion(program))
        except ConfigError:
            return None

    def _nearer(self, near: Mapping[str, float]) -> str:
        """Say in which step bodies come nearer than they did and may."""
        for step, distance in near.items():
            least = min(self._near.get(step, math.inf), 1e-3 * AIR_MM)
            if distance < least * (1.0 - FOUND_SHARE) - 1e-3 * FOUND_MM:
                return f"{step} comes nearer than {1e3 * least:.1f} mm to something"
        return ""

    def _harder(self, verdict: Verdict) -> str:
        """Say which joint is driven harder than it was and may be."""
        for use, was in zip(verdict.joints, self.verdict.joints):
            for what, now, then, slack in (
                ("speed", use.speed_percent, was.speed_percent, SAMPLED),
                ("acceleration", use.acceleration_percent, was.acceleration_percent, ROUNDED),
                ("effort", use.effort_percent, was.effort_percent, ROUNDED),
            ):
                if now > max(100.0, then) * (1.0 + slack):
                    return f"{use.joint} would have {now:.0f} % of its {what}"
        return ""

    def _jerky(self, jerk: FloatArray) -> str:
        """Say which joint's acceleration changes more suddenly than it did and may."""
        joints = self._world.cell.robot.twin_joints
        for joint, now, then in zip(joints, jerk.tolist(), self._jerk.tolist()):
            if now > max(1.0, then) * (1.0 + JERK_SHARE):
                return f"{joint.name} would have {100.0 * now:.0f} % of its jerk"
        return ""

    def _jerk_of(self, planned: Planned) -> FloatArray:
        r"""Return each joint's largest jerk as a share of robot.yaml's, shape (n,).

        A plan's accelerations jump; the filters of a robot spread that over :data:`SMOOTHED_S`. So
        the largest jerk is how far the acceleration goes within that time, divided by it.
        """
        joints = self._world.cell.robot.twin_joints
        courses = [(leg.begin, leg.course) for leg in planned.legs if leg.course is not None]
        if not courses:
            return np.zeros(len(joints))
        # At rest between two legs, and behind the last.
        times = [np.zeros(1)]
        values = [np.zeros((1, len(joints)))]
        for begin, course in courses:
            times += [begin + course.times, begin + course.times[-1:]]
            values += [course.qddot, np.zeros((1, len(joints)))]
        at, rows = np.concatenate(times), np.concatenate(values)
        grid = np.arange(0.0, at[-1] + 2.0 * SMOOTHED_S, GRID_S)
        # The later of two values at one time: a jump is told by the value behind it.
        held = rows[np.searchsorted(at, grid, side="right") - 1]
        width = round(SMOOTHED_S / GRID_S) + 1
        windows = np.lib.stride_tricks.sliding_window_view(held, width, axis=0)
        jumps: FloatArray = (windows.max(axis=-1) - windows.min(axis=-1)).max(axis=0)
        shares: FloatArray = jumps / SMOOTHED_S / np.array([joint.jerk for joint in joints])
        return shares
