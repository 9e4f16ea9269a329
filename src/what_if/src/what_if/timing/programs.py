"""Lay a program's steps in a row, each move as the robot's own planner has it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from fanuc_emulator.alarms import POSITION_LIMIT, RefusedError
from fanuc_emulator.drives.interpolator import JointMove, Trapezoid
from fanuc_emulator.drives.planner import Limits, Planner
from scara_config.programs.files import ProgramSteps
from scara_config.programs.steps import GripperStep, MoveStep, PathStep, WaitStep
from scara_control.errors import JointLimitError
from scara_control.limits import check_limits

from what_if.timing.law import NO_TIME, Law, move_leg, straight_course
from what_if.timing.leg import Course, Leg, Planned, curved
from what_if.verdict import Cause, Reason
from what_if.world import World


def plan_program(world: World, motion: ProgramSteps) -> Planned:
    """Return the legs of a program from where the joints are; what the twin lacks is at 0 there."""
    row = _ProgramRow(world)
    reasons: list[Reason] = []
    for number, step in enumerate(motion.steps):
        row.number = number
        row.words = f"line {step.line} of {step.program or motion.name}"
        match step:
            case MoveStep() | PathStep():
                if row.answered - row.now > NO_TIME:
                    early_ms = 1e3 * (row.answered - row.now)
                    text = f"begins {early_ms:.0f} ms before the suction answers: add WAIT RI[1]"
                    reasons.append(Reason(Cause.GRIP, row.now, row.words, None, text))
                try:
                    # Noted, and planned all the same: the lines behind it shall be judged too.
                    if isinstance(step, MoveStep):
                        check_limits(world.cell.robot.joints, step.target)
                except JointLimitError as error:
                    reasons.append(Reason(Cause.LIMIT, row.now, row.words, None, str(error)))
                try:
                    row.move(step)
                except RefusedError as refused:
                    cause = Cause.LIMIT if refused.code is POSITION_LIMIT else Cause.REACH
                    text = f"{refused.code.message}: {refused}"
                    reasons.append(Reason(cause, row.now, row.words, None, text))
                    # Here the robot stops with an alarm: what comes behind is never made.
                    break
            case WaitStep():
                row.stand(step.seconds)
            case GripperStep():
                row.grip(step)
    row.settle()
    return Planned(tuple(row.legs), tuple(reasons))


class _ProgramRow:
    """What was laid so far.

    Attributes:
        legs: One after the other.
        now: When the last one ends [s].
        answered: When the suction holds, or has let go, as it was switched last [s].
        number: Of the step that is laid.
        words: Which one that is.
    """

    def __init__(self, world: World) -> None:
        robot, self._settings = world.cell.robot, world.cell.config.program
        share = self._settings.acceleration_percent / 100.0
        limits = [Limits(joint.velocity, joint.acceleration * share) for joint in robot.joints]
        self._world, self._planner = world, Planner(robot, limits)
        self._columns = [k for k, joint in enumerate(robot.joints) if joint.twin]
        self._sample = world.cell.config.sample_ms * 1e-3
        # A cap is for a robot that follows. What slows its own program is the override.
        self._override = 0.01 * world.override_percent
        here = [0.0] * len(robot.joints)
        for column, q in zip(self._columns, world.q):
            here[column] = q
        self._here = tuple(here)
        # Moves that go on, each with its law and since when [s]: the newest began before the end of
        # the others, which rounds the corner.
        self._going: list[tuple[Trapezoid, Law, float]] = []
        self.legs: list[Leg] = []
        self.now, self.answered, self.number, self.words = 0.0, 0.0, 0, ""
        # How the suction was switched last; None: not yet.
        self._on: bool | None = None

    def move(self, step: MoveStep | PathStep) -> None:
        """Lay a move, up to where the next one may begin.

        Raises:
            RefusedError: The robot cannot make it.
        """
        begin, move = self._here, self._planner.plan(step, self._here)
        law, self._here = Law(move, self._override), move.end
        after = (self._settings.fine_ms if step.fine else self._settings.cnt_ms) * 1e-3
        spread = self._settings.fine_spread_ms * 1e-3 if step.fine else 0.0
        # Alone from rest to rest, it is straight and known in closed form.
        if not step.cnt and not self._going and isinstance(move, JointMove):
            course = self._of_twin(straight_course(begin, move, law, self._sample))
            self._lay(move_leg(course, self.now, self.words, after, spread))
            return
        self._going.append((move, law, 0.0))
        if step.cnt:
            # CNT100 lets the next move begin where this one begins to brake, CNT0 where it ends.
            self._go(law.duration - 0.01 * step.cnt * law.ramp)
        else:
            self._go(self._left(), after, spread)

    def stand(self, seconds: float) -> None:
        """Lay a wait; what still moves goes on meanwhile."""
        moves = min(self._left(), seconds)
        self._go(moves)
        self._lay(Leg(self.now, seconds - moves, self.words))

    def grip(self, step: GripperStep) -> None:
        """Lay a switch of the suction, or a wait for the answer to the last one.

        It takes no time where nobody waits for its answer, and what is left of it behind other
        waits.
        """
        self.settle()
        grip = None
        if step.on != self._on:
            self._on = grip = step.on
            takes_ms = 0.0  # without parts there is nothing to grip
            if self._world.cell.work is not None:
                gripper = self._world.cell.work.gripper
                takes_ms = gripper.vacuum_ms if step.on else gripper.release_ms
            self.answered = self.now + takes_ms * 1e-3
        seconds = max(self.answered - self.now, 0.0) if step.awaited else 0.0
        self._lay(Leg(self.now, seconds, self.words, grip=grip))

    def settle(self) -> None:
        """Let what still moves come to its end."""
        self._go(self._left())

    def _left(self) -> float:
        return max((law.duration - since for _, law, since in self._going), default=0.0)

    def _go(self, seconds: float, after: float = 0.0, spread: float = 0.0) -> None:
        """Let what moves go on for so long [s], and wait for the motors [s], known so well [s]."""
        if seconds > NO_TIME:
            times = np.linspace(0.0, seconds, max(3, math.ceil(seconds / self._sample) + 1))
            q = np.tile(np.array(self._here), (len(times), 1))
            for move, law, since in self._going:
                # Each move adds what it still lacks to the last one's end: they overlap so.
                q += move.places(law.at(times + since)[0]) - np.array(move.end)
            qdot = np.gradient(q, times, axis=0)
            qddot = np.gradient(qdot, times, axis=0)
            course = Course(times, q, qdot, qddot, np.arange(len(times), dtype=float))
            self._lay(curved(self._of_twin(course), self.now, self.words, after, spread))
        going = [(move, law, since + seconds) for move, law, since in self._going]
        self._going = [each for each in going if each[1].duration - each[2] > NO_TIME]

    def _of_twin(self, course: Course) -> Course:
        """Leave out the joints that the twin does not have."""
        chosen = self._columns
        rows = (course.q[:, chosen], course.qdot[:, chosen], course.qddot[:, chosen])
        return Course(course.times, *rows, course.u)

    def _lay(self, leg: Leg) -> None:
        self.legs.append(replace(leg, number=self.number))
        self.now += leg.duration
