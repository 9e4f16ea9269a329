"""Random moves of a whole cell in virtual time, by whoever may lead, and what went wrong in them.

Each move begins from IDLE after a random pause, or while the motion before it is trimmed.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from scara_config.programs.steps import MoveStep, WaitStep
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool import tool_kinematics
from scara_control.motion.requests import Outcome
from scara_control.trajectory.goal import Code, Goal, GoalError

from harness.programs import program_of
from harness.scenes.truth import Row
from harness.virtual_cell.cell import CellError, VirtualCell
from harness.virtual_cell.files import CellFiles, load_files

ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "articulated_six")
PLANTS = ("ideal", "field:{seed}")
SPREAD_RAD, LIFT_M = 0.5, 0.08
"""Targets lie so far around the middle, and so far above home."""
ARM_SPREAD_RAD = 0.2
"""The same of the joints that lean an arm, which shall touch nothing."""
BENT_RAD = 0.7
"""Of an arm that is stretched at home."""
REST_DEG_MM = 0.06
"""So far apart the joints may rest: ``settle.tolerance`` and what a reading rounds."""
MOVED_DEG_MM = 0.02
"""A pair at rest that strays so far has moved: ``change.hysteresis``."""
JUMP_DEG_MM = 0.02
"""A set point that leaps so far from one millisecond to the next, beside its speed, has jumped."""
SPEEDS_PERCENT = (20.0, 60.0)
DEADLINE_S = 20.0
ENDS_S = 0.05
"""What tells the twin that its following ends takes so long at most."""
STREAM_ENDS_S = 1.5
"""A robot that still runs its stream program behind IDLE is stopped within this."""
TAKES_OVER_S = 0.3
"""So long after a command its first set points are looked at."""
PAUSES_S = (0.06, 0.4)
"""The trajectory server hears of a mode within 50 ms."""
TRIMMED_S = (0.0, 0.1)
"""A command that comes during a trim comes so long after its beginning."""
KINDS = ("operator", "operator_point", "move_to", "move_to", "joints", "goal", "program")
TRIMMED = ("operator_point", "move_to")
"""What ends with a trim."""
INTO_TRIM = ("move_to", "joints", "goal", "jog", "stop")
"""Commands of the twin's side, and STOP, that come during a trim."""


@dataclass
class Found:
    """What was done, and what went wrong in words."""

    moves: int = 0
    into_trims: int = 0
    wrong: list[str] = field(default_factory=list)
    largest_jump: float = 0.0
    largest_rest: float = 0.0


@dataclass
class Asked:
    """One command and its answer."""

    what: str
    answer: tuple[bool, str] | None = None
    # A later command ends it.
    replaced: bool = False

    def ended(self, success: bool, text: str) -> None:
        """Take the answer."""
        self.answer = (success, text)


def random_moves(robot: str, seed: int, count: int) -> Found:
    """Make ``count`` moves on a new cell and return what was found.

    Args:
        robot: Its profile.
        seed: Of all that is drawn; its stand-in moves by turns as the file says and by the seed.
        count: So many moves.
    """
    source = random.Random(seed)
    files = load_files(robot, plant=PLANTS[seed % 2].format(seed=seed))
    with VirtualCell(_with_programs(files, source), seed=seed) as cell:
        return _Wanderer(cell, source).wander(count)


class _Wanderer:
    def __init__(self, cell: VirtualCell, source: random.Random) -> None:
        self.cell, self.source, self.found = cell, source, Found()
        self.joints = cell.files.robot.twin_joints
        self.scale = [1.0 / joint.scale for joint in self.joints]
        self.tool = tool_kinematics(cell.files.robot)
        self.columns = [self.joints.index(joint) for joint in self.tool.joints]
        self.asked: list[Asked] = []
        self.said = ""
        self.idle_since: float | None = None
        self.reported = False
        self.taken_over = -1.0
        self.jogs = 0
        self.rested: dict[str, tuple[float, ...]] = {}
        self.before: tuple[list[float], list[float]] | None = None

    def wander(self, count: int) -> Found:
        cell = self.cell
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.5)
        cell.decisions.clear()
        cell.schedule.every(0.005, self._watch_idle, first=0.0003)
        while self.found.moves < count:
            kind = self.source.choice(KINDS)
            self._command(kind)
            if kind in TRIMMED and self.source.random() < 0.8:
                self._into_trim()
            self._rest()
            cell.schedule.run(self.source.uniform(*PAUSES_S))
        return self.found

    def wrong(self, text: str) -> None:
        self.found.wrong.append(
            f"move {self.found.moves} ({self.said}) at {self.cell.schedule.now:.3f} s, "
            f"{self.cell.mode}: {text}"
        )

    def _pose(self) -> list[float]:
        return random_pose(self.cell.files, self.source)

    def _reachable(self, pose: Sequence[float]) -> bool:
        """Say whether the tool gets there as it is turned now."""
        q, here = ([row[k] for k in self.columns] for row in (pose, self.cell.twin.truth[-1][1]))
        try:
            self.tool.inverse(*self.tool.position(q), None, here)
        except ScaraControlError:
            return False
        return True

    def _command(self, kind: str) -> None:
        cell, speed = self.cell, self.source.uniform(*SPEEDS_PERCENT)
        pose = self._pose()
        if kind in TRIMMED:
            while not self._reachable(pose):
                pose = self._pose()
        self.found.moves += 1
        self.said += f" {kind}"
        self.idle_since = None
        asked = Asked(kind)
        point = self.tool.position([pose[k] for k in self.columns])
        before = len(cell.decisions)
        names = tuple(joint.name for joint in self.joints)
        if kind not in ("operator", "operator_point", "program"):
            for earlier in self.asked:
                earlier.replaced = earlier.replaced or earlier.answer is None
        if kind in ("move_to", "joints"):
            self.asked.append(asked)
        if kind in ("operator", "operator_point"):
            command, target = ("MOVE", point) if kind in TRIMMED else ("MOVE_JOINTS", tuple(pose))
            answer = cell.operate(command, target=target, speed_percent=speed)
            if not answer.success:
                self.wrong(f"refused: {answer.message}")
        elif kind == "move_to":
            cell.twin.move_to.begin(point, speed, "", asked.ended)
        elif kind == "joints":

            def ended(outcome: Outcome) -> None:
                asked.ended(outcome.success, outcome.message)

            cell.twin._begin_move(pose, speed, ended, list(names))
        elif kind == "goal":
            here = cell.twin.truth[-1][1]
            way = max(abs(a - b) / j.velocity for a, b, j in zip(pose, here, self.joints))
            took = 0.6 + 2.0 * way * 100.0 / speed
            try:
                cell.twin.accept(Goal(names, (JointMotion(tuple(pose), (), (), took),)))
            except GoalError as error:
                # As while any move runs: its caller waits for the answer.
                if "OPERATOR_LEADS" not in str(error) and "is moving: wait" not in str(error):
                    self.wrong(f"goal refused: {error}")
                return
        elif kind == "program":
            # Until then the robot would refuse it, and the page does not offer it.
            cell.wait_until(lambda: not cell.refusals()["RUN"], STREAM_ENDS_S, "RUN")
            # A twin that begins to follow catches up with what was seen late, and does not glide.
            self.taken_over = -1.0
            number = self.source.choice(sorted(cell.files.programs))
            cell.real.pendant(100.0, number)
        elif kind == "jog":
            self._jog()
        else:
            self._stop()
            return
        leads = ("REAL_LEADS",) if kind == "program" else ("TWIN_LEADS", "OPERATOR_LEADS")

        def began() -> bool:
            return any(made.mode_after in leads for made in cell.decisions[before:]) or (
                cell.mode in leads
            )

        try:
            cell.wait_until(began, 3.0, f"{kind} to begin")
        except CellError as error:
            said = [f"{made.trigger} ({made.why})" for made in cell.decisions]
            self.wrong(f"{error}; {cell.twin.ended}; {said}")

    def _jog(self) -> None:
        joint = self.source.choice(self.joints)
        velocity = 0.03 * joint.velocity * self.source.choice((-1.0, 1.0))
        self.jogs = 8

        def jog() -> None:
            self.cell.twin.jog([joint.name], [velocity])
            self.jogs -= 1
            self.cell.schedule.after(0.05, jog if self.jogs > 1 else rested)

        def rested() -> None:
            self.jogs = 0

        jog()

    def _stop(self) -> None:
        cell = self.cell
        cell.operate("STOP")
        cell.schedule.run(0.3)
        stopped = cell.schedule.now
        cell.schedule.run(0.7)
        for side in (cell.real, cell.twin):
            if self._span(side.truth, stopped) > MOVED_DEG_MM:
                self.wrong(f"moves {self._span(side.truth, stopped):.3f} after STOP")
        if not cell.operate("ALIGN").success:
            self.wrong("ALIGN is refused")
        try:
            cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE after ALIGN", ("FAULT",))
        except CellError as error:
            self.wrong(str(error))

    def _into_trim(self) -> None:
        """Command during the trim of the motion before, if it is trimmed."""
        cell = self.cell
        came = self._comes(lambda: bool(cell.twin.trims) or self._over(), "a trim")
        if not came or not cell.twin.trims:
            return
        cell.schedule.run(self.source.uniform(*TRIMMED_S))
        if not cell.twin.trims:
            return
        self.found.into_trims += 1
        kind = self.source.choice(INTO_TRIM)
        self.said += " | in its trim"
        self.taken_over = cell.schedule.now
        self._watch_setpoint()
        self._command(kind)

    def _comes(self, condition: Callable[[], bool], what: str) -> bool:
        try:
            self.cell.wait_until(condition, DEADLINE_S, what)
        except CellError as error:
            self.wrong(str(error))
            return False
        return True

    def _over(self) -> bool:
        answered = all(asked.answer for asked in self.asked) and not self.jogs
        return self.cell.mode == "IDLE" and answered

    def _rest(self) -> None:
        """Wait for the end, and judge it; begin anew after a failure."""
        cell = self.cell
        if not self._comes(self._over, "IDLE and all answers"):
            self._recover()
        for asked in self.asked:
            success, text = asked.answer or (False, "no answer")
            if not success and not asked.replaced:
                self.wrong(f"{asked.what} failed: {text}")
        for made in cell.decisions:
            asked_for = "replaced by" in made.why or "STOP by the operator" in made.why
            if made.trigger == "MOVE_FAILED" and not asked_for:
                self.wrong(made.why)
        for ended in cell.twin.ended:
            if ended.code is not Code.SUCCESSFUL and " | in its trim goal" in self.said:
                self.wrong(f"goal: {ended.text}")
        cell.decisions.clear()
        cell.twin.ended.clear()
        self.asked.clear()
        apart = self._away(cell.real.truth[-1][1], cell.twin.truth[-1][1])
        self.found.largest_rest = max(self.found.largest_rest, apart)
        if apart > REST_DEG_MM:
            self.wrong(f"{apart:.3f} deg or mm apart at rest")
        self.said = ""

    def _recover(self) -> None:
        cell = self.cell
        cell.schedule.run(1.0)
        cell.operate("ACKNOWLEDGE")
        cell.operate("STOP")
        cell.schedule.run(1.0)
        cell.operate("RESET")
        cell.schedule.run(1.0)
        latched = ("ESTOP", "FAULT")
        cell.wait_whatever(lambda: cell.mode not in latched, 5.0, "the end of RESET")
        cell.operate("ALIGN")
        cell.wait_whatever(lambda: cell.mode == "IDLE", 40.0, "IDLE again")

    def _watch_idle(self) -> None:
        """In IDLE, until the next command, nothing is commanded and nothing moves."""
        cell = self.cell
        if cell.mode != "IDLE":
            self.idle_since, self.reported = None, False
            return
        if self.idle_since is None:
            # A command that has just been given has not begun yet.
            led = bool(cell.decisions) and cell.decisions[-1].mode_after == "IDLE"
            if not self.said or led:
                self.idle_since = cell.schedule.now
                self.rested.clear()
            return
        if self.reported:
            return
        after = cell.schedule.now - self.idle_since
        if cell.twin.moves and after > ENDS_S:
            self.reported = True
            self.wrong(f"the twin is commanded {after:.3f} s after IDLE: {cell.twin.moves}")
        for name, side in (("real", cell.real), ("twin", cell.twin)):
            if after > ENDS_S and name not in self.rested:
                self.rested[name] = side.truth[-1][1]
            span = self._away(side.truth[-1][1], self.rested.get(name, side.truth[-1][1]))
            if span > MOVED_DEG_MM:
                self.reported = True
                self.wrong(f"the {name} has moved {span:.3f} {after:.3f} s after IDLE")

    def _span(self, truth: Sequence[Row], since: float) -> float:
        rows = []
        for at, q, _ in reversed(truth):
            if at < since:
                break
            rows.append(q)
        spans = [max(column) - min(column) for column in zip(*rows)]
        return float(max(scale * span for scale, span in zip(self.scale, spans)))

    def _away(self, a: Sequence[float], b: Sequence[float]) -> float:
        """Return the largest difference of two poses [deg or mm]."""
        return max(scale * abs(p - q) for scale, p, q in zip(self.scale, a, b))

    def _watch_setpoint(self) -> None:
        """From one step to the next the set point goes on with its speed."""
        cell = self.cell
        loops = cell.twin.simulation.control.loops
        wanted = [loop._wanted for loop in loops]
        here = [row[0] for row in wanted]
        dt = cell.files.simulation.dt
        if self.before is not None:
            last, speed = self.before
            for k, joint in enumerate(self.joints):
                moved = abs(here[k] - last[k]) - max(abs(speed[k]), abs(wanted[k][1])) * dt
                leap = moved * self.scale[k]
                self.found.largest_jump = max(self.found.largest_jump, leap)
                if leap > JUMP_DEG_MM:
                    self.wrong(f"the set point of {joint.name} jumps by {leap:.3f}")
        self.before = here, [row[1] for row in wanted]
        if cell.schedule.now < self.taken_over + TAKES_OVER_S:
            cell.schedule.after(dt, self._watch_setpoint)
        else:
            self.before = None


def random_pose(files: CellFiles, source: random.Random) -> list[float]:
    """Draw a pose of the twin's joints around a bent arm, above home [rad or m]."""
    joints, pose = files.robot.twin_joints, list(files.robot.home_positions)
    # As the long moves of the plants: an arm that leans forward is upright, clear of the table.
    pose[1] = BENT_RAD if pose[1] == 0.0 else 0.0
    drawn = []
    for joint, q in zip(joints, pose):
        if joint.unit == "mm":
            q += source.uniform(0.0, LIFT_M)
        else:
            leans = files.robot.twin_joints[0] is not joint and len(pose) > 4
            spread = ARM_SPREAD_RAD if leans else SPREAD_RAD
            q += source.uniform(-spread, spread)
        drawn.append(min(max(q, joint.lower), joint.upper))
    return drawn


def _with_programs(files: CellFiles, source: random.Random) -> CellFiles:
    """Return the cell with random programs of two moves in place of its own."""
    programs = {}
    for number, program in files.programs.items():
        steps: list[MoveStep | WaitStep] = []
        for line in (1, 2):
            twin = iter(random_pose(files, source))
            full = tuple(next(twin) if joint.twin else 0.0 for joint in files.robot.joints)
            steps.append(MoveStep(line, full, source.uniform(*SPEEDS_PERCENT), True))
            steps.append(WaitStep(line, source.uniform(0.0, 0.3)))
        programs[number] = program_of(program.name, steps)
    return replace(files, programs=programs)
