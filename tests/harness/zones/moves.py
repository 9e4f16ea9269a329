"""A cell in which random moves pass random zones, and what became of each.

Most zones lie on the way or near it, some right before its begin. Samples of both sides are stamped
up to 2 ms too early or too late, and packets of the twin come up to 2 ms later than others.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from random import Random

import msgspec
import numpy as np
from scara_config import KeepOut, Robot
from scara_config.programs.steps import MoveStep
from twin_controller.core.events import AnyEvent, RealMeasured, TwinMeasured

from harness.programs import program_of
from harness.starter import way_out
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files
from harness.virtual_cell.timing import Delays
from harness.zones.truth import Body, straight

ROBOT = "fanuc_sr6ia"
JITTER_S = 2e-3
NUMBERS = range(2, 9)
"""RSR numbers of the programs."""
SHORTEST = 0.25
"""A way that is shorter [rad] is no trial."""
NEAREST_START_M, FARTHEST_START_M = 0.005, 0.06
STANDS_S = 0.4
"""So long the robot stands beside the zone before anything moves: its override is lowered."""
LIMIT_S = 90.0
"""A way that grazes a zone's clearance is crept along."""
THERE = 0.1
"""A side whose joints are no further from its target has come there [deg or mm]."""
LEADERS = ("program", "move_to", "operator")
FINE_ROWS = 30_000
"""Of a way that is judged: at most 0.1 mm from one to the next."""


@dataclass(frozen=True)
class Outcome:
    """What became of one move."""

    leader: str
    speed_percent: float
    # How near the whole way comes to the zone, and how near both sides came [m].
    way: float
    came: float
    # KEEP_OUT was decided, or the move was refused for the zone.
    stopped: bool
    # The controller lowered the robot's override on the way.
    slowed: bool
    # Any other end than the target: its words.
    other: str
    words: str

    @property
    def missed(self) -> bool:
        """Whether a part of a side's arm was in the zone."""
        return self.came < 0.0

    def false(self, promised: float) -> bool:
        """Whether the move was stopped although its way keeps the promised distance [m]."""
        return self.stopped and self.way >= promised


class ZoneCell(VirtualCell):
    """A cell with seven random programs and zones that change from move to move."""

    def __init__(self, seed: int, files: CellFiles | None = None) -> None:
        """Connect; a SCARA of ``files``, or the article's robot."""
        self.random = Random(seed)
        files = files or load_files(ROBOT)
        self.body = Body.of(files.robot)
        self.turns = len(files.robot.arm_joints) == 4
        self.targets = {number: self._pose(files) for number in NUMBERS}
        programs = {
            number: program_of(f"P{number}", [MoveStep(1, self._full(files, q), 100.0, True)])
            for number, q in self.targets.items()
        }
        super().__init__(replace(files, programs=programs), Delays(jitter=JITTER_S), seed=seed)
        self.setup.keep_out = ()
        self.connect()

    def put(self, event: AnyEvent) -> None:
        """Stamp the samples of both sides wrongly by the jitter."""
        if isinstance(event, RealMeasured):
            late = self.random.randint(round(-JITTER_S * 1e3), round(JITTER_S * 1e3))
            event = msgspec.structs.replace(event, clock_ms=event.clock_ms + late)
        elif isinstance(event, TwinMeasured):
            late_s = self.random.uniform(-JITTER_S, JITTER_S)
            moved = msgspec.structs.replace(event.motion, time=event.motion.time + late_s)
            event = msgspec.structs.replace(event, motion=moved)
        super().put(event)

    def trial(self) -> Outcome:
        """Make one random move beside one random zone."""
        leader = self.random.choice(LEADERS)
        speed = self.random.choice((10.0, 20.0, 40.0, 60.0, 80.0, 100.0))
        # The way of who leads: the sides agree to some hundredths of a degree.
        start = (self.real if leader == "program" else self.twin).truth[-1][1]
        number, target = self._far_target(start)
        way = self.body.watched(straight(start, target))
        zone = self._zone(way)
        self.setup.keep_out = (zone,)
        begun, decided = self.schedule.now, len(self.decisions)
        refused = self._begin(leader, number, target, speed)
        if not refused:
            self._end()
        self.setup.keep_out = ()
        made = self.decisions[decided:]
        stops = [decision.why for decision in made if decision.trigger == "KEEP_OUT"]
        came = min(
            self.body.clearance(
                self.body.watched(np.array([q for at, q, _ in side.truth if at >= begun])),
                *_box(zone),
            )
            for side in (self.real, self.twin)
        )
        stopped = bool(stops) or "keep-out zone" in refused
        other = "" if stopped else refused or self._unexpected(target)
        words = (stops or [refused])[0]
        # Between two rows of a coarse way the tool goes up to 2 mm: too much for the verdict.
        near = self.body.clearance(
            self.body.watched(straight(start, target, FINE_ROWS)), *_box(zone)
        )
        outcome = Outcome(leader, speed, near, came, stopped, self._slowed, other, words)
        self._recover()
        return outcome

    def _begin(self, leader: str, number: int, target: Sequence[float], speed: float) -> str:
        """Begin the move; return why it was refused."""
        self._slowed, self._answer = False, (True, "")
        self.real.robot.write_override(round(speed) if leader == "program" else 100)
        self.schedule.run(STANDS_S)
        if leader == "program":
            self.real.signal(f"panel_run{number}", None)
            self.schedule.run(0.1)
            return ""
        if leader == "operator":
            answer = self.operate("MOVE_JOINTS", target=tuple(target), speed_percent=speed)
            return "" if answer.success else answer.message
        point = tuple(self.body.watched(np.array([target]))[0, 0])
        elbow = "righty" if self.body.bend(target) > 0.0 else "lefty"
        yaw = self.body.yaw(target) if self.turns else None
        self._answer = False, "move_to was never answered"
        self.twin.move_to.begin(point, speed, elbow, self._answered, yaw)
        return ""

    def _answered(self, success: bool, words: str) -> None:
        self._answer = success, words

    def _end(self) -> None:
        """Wait until the move has ended, however it did."""
        self.schedule.run(0.3)
        end = self.schedule.now + LIMIT_S
        override = self.real.robot.override
        while self.schedule.now < end:
            self.schedule.run(0.05)
            self._slowed |= self.real.robot.override < override
            busy = self.real.running or self.mode.endswith("LEADS")
            if not busy and self.still_for() >= 0.3:
                return

    def _unexpected(self, target: Sequence[float]) -> str:
        """Return what else ended the move; empty if it came to its end."""
        if self.mode != "IDLE":
            return f"{self.mode}: {self.why}"
        success, words = self._answer
        if not success:
            return words
        return elsewhere(self.files.robot, target, self.real.truth[-1][1], self.twin.truth[-1][1])

    def _recover(self) -> None:
        """Be idle again, without a zone."""
        self.wait_whatever(lambda: self.still_for() > 0.3, 10.0, "standstill")

        def idle() -> bool:
            if command := way_out(self.mode):
                self.operate(command)
            return self.mode == "IDLE" and self.still_for() > 0.3

        self.wait_whatever(idle, 40.0, "IDLE")
        self.schedule.run(0.5)
        for side in (self.real, self.twin):
            del side.truth[:-50]
        self._seen = [len(self.real.truth), len(self.twin.truth)]

    def _far_target(self, start: Sequence[float]) -> tuple[int, tuple[float, ...]]:
        far = [
            (number, q)
            for number, q in self.targets.items()
            if max(abs(a - b) for a, b in zip(q[:2], start)) > SHORTEST
        ]
        return self.random.choice(far)

    def _zone(self, way: np.ndarray) -> KeepOut:
        """Return a box on the way, near it, or by one of its ends; the arm does not begin in it."""
        while True:
            kind = self.random.choice(("on", "near", "end", "end", "begin"))
            # The tool, or a piece of a link.
            point = self.random.choice((0, self.random.randrange(2, len(way))))
            rows = way[point]
            middle = rows[self.random.randrange(len(rows) // 4, len(rows))]
            away = (0.0, 0.03) if kind == "on" else (0.0, 0.25)
            if kind == "end":
                # Behind the end of the way, in its direction.
                ahead = rows[-1] - rows[-20]
                length = np.linalg.norm(ahead)
                if length < 1e-4:
                    continue
                middle, away = rows[-1] + ahead / length * self.random.uniform(0.02, 0.2), (0, 0.01)
            if kind == "begin":
                middle, away = rows[self.random.randrange(1, len(rows) // 4)], (0.0, 0.03)
            shift = [self.random.choice((-1, 1)) * self.random.uniform(*away) for _ in range(3)]
            half = [self.random.uniform(0.01, 0.12) for _ in range(3)]
            lower = tuple(1e3 * (m + s - h) for m, s, h in zip(middle, shift, half))
            upper = tuple(1e3 * (m + s + h) for m, s, h in zip(middle, shift, half))
            zone = KeepOut("box", lower, upper)
            near = self.body.clearance(way, *_box(zone))
            begin = self.body.clearance(way[:, :1], *_box(zone))
            if begin < NEAREST_START_M or (kind == "begin" and begin > FARTHEST_START_M):
                continue
            if kind in ("on", "begin") or (near > 0.0 and near < 0.06):
                return zone

    def _pose(self, files: CellFiles) -> tuple[float, ...]:
        joints = files.robot.twin_joints
        return tuple(
            self.random.uniform(0.8 * joint.lower, 0.8 * joint.upper)
            if joint.screw_axis is not None
            else 0.0
            for joint in joints
        )

    def _full(self, files: CellFiles, q: Sequence[float]) -> tuple[float, ...]:
        twin = iter(q)
        return tuple(next(twin) if joint.twin else 0.0 for joint in files.robot.joints)


def elsewhere(
    robot: Robot, target: Sequence[float], real: Sequence[float], twin: Sequence[float]
) -> str:
    """Return which joint of the arm ends elsewhere than at the target, empty if none does.

    A whole turn away is the same place.
    """
    for side, q in (("real", real), ("twin", twin)):
        for joint, end, wanted in zip(robot.twin_joints, q, target, strict=True):
            off = (end - wanted) / joint.scale
            if joint.si_unit == "rad":
                off = math.remainder(off, 360.0)
            if joint.screw_axis is not None and abs(off) > THERE:
                return f"{side}: {joint.name} ends {off:.2f} deg or mm from the target"
    return ""


def wrong_moves(cell: ZoneCell, moves: int, counts: Counter[str]) -> list[tuple[int, Outcome]]:
    """Make random moves, count what became of them, and return those that are wrong."""
    promised = cell.setup.config.cell.keep_out_clearance_mm * 1e-3
    wrong: list[tuple[int, Outcome]] = []
    for number in range(moves):
        made = cell.trial()
        false = made.false(promised)
        passed = made.way < 0.0 and not made.stopped
        counts.update({"moves": 1, made.leader: 1, "enter": made.way < 0.0})
        counts.update({"stopped": made.stopped, "slowed": made.slowed})
        counts.update({"false stops": false, "missed zones": made.missed or passed})
        if false or made.missed or passed or made.other:
            wrong.append((number, made))
    return wrong


def _box(zone: KeepOut) -> tuple[list[float], list[float]]:
    return [1e-3 * x for x in zone.lower_mm], [1e-3 * x for x in zone.upper_mm]
