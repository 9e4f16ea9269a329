"""Paths that are kept, kept to, and given up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import msgspec
import pytest
from harness.pair import HOME, SETUP
from scara_control.joint_motion import JointMotion
from twin_controller.core.events import Joints, RealMeasured
from twin_controller.core.follow.remembered import Remembered, note_sample, way_on
from twin_controller.core.sides.side import RealSide, Sides

AHEAD_S, MOST_PATHS, REST = 0.1, 32, 0.005
replace = msgspec.structs.replace
PERIOD_S = 0.008
SWING = 0.6
"""All joints go so far [rad or m], the one that slides a tenth of it."""
DURATION_S = 0.8
STILL = (0.0,) * len(HOME)


def moved(t: float, swing: float = SWING, duration: float = DURATION_S) -> JointMotion:
    """Return a motion from rest to rest as minimum jerk has it, at ``t`` [s] from its begin."""
    u = min(max(t / duration, 0.0), 1.0)
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    ds = 30.0 * u * u * (1.0 - u) ** 2 / duration
    parts = [swing if scale < 1e-1 and scale > 5e-3 else 0.1 * swing for scale in SETUP.scale]
    q = tuple(home + part * s for home, part in zip(HOME, parts))
    return JointMotion.measured(q, tuple(part * ds for part in parts), t)


def back(t: float, swing: float = SWING) -> JointMotion:
    """Return the same motion the other way."""
    there = moved(DURATION_S - t, swing)
    return replace(there, qdot=tuple(-v for v in there.qdot))


Way = Callable[[float], JointMotion]


class Robot:
    """A robot that leads: it drives ways, one after the other, and is remembered."""

    def __init__(self) -> None:
        """Begin with nothing remembered."""
        self.remembered, self.t = Remembered(), 0.0
        self.sides = Sides(RealSide(connected=True))

    def show(self, q: Joints, qdot: Joints, program: str, speed: float) -> JointMotion:
        """Let one sample be seen."""
        sample = JointMotion.measured(q, qdot, self.t)
        flags = RealMeasured(
            self.t,
            self.t,
            self.t,
            0,
            sample,
            own_program=True,
            program=program,
            speed_percent=speed,
        )
        history = (*self.sides.real.history, sample)[-48:]
        self.sides = Sides(replace(self.sides.real, history=history, flags=flags))
        self.remembered = note_sample(SETUP, self.remembered, self.sides)
        return sample

    def pass_by(self, there: JointMotion) -> None:
        """Let one sample be seen before anybody leads."""
        before = self.remembered
        self.show(there.q, there.qdot, "ARTICLE", 50.0)
        self.remembered = before

    def drive(
        self,
        way: Way = moved,
        program: str = "ARTICLE",
        speed: float = 50.0,
        late: float = 0.0,
        blind: tuple[float, float] = (9.0, 9.0),
    ) -> list[tuple[float, bool, float]]:
        """Drive a way; return for each sample: since when, whether it is foretold, how wrongly.

        Args:
            way: From rest to rest.
            program: Its name.
            speed: Its speed [percent].
            late: It begins so much after a sample [s].
            blind: From when to when no sample is seen [s].
        """
        seen: list[tuple[float, bool, float]] = []
        for k in range(int((DURATION_S + 0.3) / PERIOD_S)):
            self.t += PERIOD_S
            since = k * PERIOD_S - 0.1 - late
            if blind[0] <= since < blind[1]:
                continue
            there = way(since)
            sample = self.show(there.q, there.qdot, program, speed)
            _, points = way_on(SETUP, self.remembered, sample)
            wrong = 0.0
            for point in points:
                true = way(since + point.time).q
                wrong = max(wrong, *(abs(a - b) for a, b in zip(point.q, true)))
            seen.append((since, bool(points), wrong))
        return seen


def foretold(seen: Sequence[tuple[float, bool, float]], begin: float, end: float) -> list[bool]:
    """Return for each sample of that time whether the way on was foretold."""
    return [told for since, told, _ in seen if begin <= since < end]


def test_a_first_round_is_not_foretold_and_the_second_is() -> None:
    """Within a twentieth of a degree, from a little after the beginning, wherever samples fall."""
    robot = Robot()
    assert not any(told for _, told, _ in robot.drive())
    for late in (0.0, 0.003, 0.007):
        seen = robot.drive(late=late)
        assert all(foretold(seen, 0.15, DURATION_S - AHEAD_S)), late
        assert max(wrong for since, _, wrong in seen if since > 0.15) < 1e-3, late
    assert len(robot.remembered.paths) == 1


def test_a_path_begins_with_its_rest_at_no_time() -> None:
    """It has each sample once, and ends as long after it as the robot moved."""
    robot = Robot()
    robot.drive()
    (path,) = robot.remembered.paths
    assert path.points[0].time == 0.0 and path.points[0].q == pytest.approx(HOME, abs=1e-4)
    steps = [after.time - before.time for before, after in pairwise(path.points)]
    assert steps == pytest.approx([PERIOD_S] * len(steps))
    assert DURATION_S - 0.1 < path.points[-1].time <= DURATION_S + 2.0 * PERIOD_S
    assert path.duration == path.points[-1].time
    assert path.at(path.duration + 1.0).q == path.end == path.points[-1].q
    assert path.at(-1.0).q == path.begin == path.points[0].q
    assert path.points[0].qddot == path.points[-1].qddot == STILL


@pytest.mark.parametrize("late", [1, 2, 3, 8])
def test_a_motion_that_is_noticed_late_has_its_samples_from_the_rest_on(late: int) -> None:
    """Who leads is known only when the robot has moved a bit: each sample is there once."""
    robot = Robot()
    for k in range(30 + late):
        robot.t += PERIOD_S
        robot.pass_by(moved(k * PERIOD_S - 30 * PERIOD_S + 0.1))
    history = robot.sides.real.history
    rests = [
        all(abs(v) <= REST * most for v, most in zip(each.qdot, SETUP.velocity)) for each in history
    ]
    last = max(k for k, rested in enumerate(rests) if rested)
    found = note_sample(SETUP, robot.remembered, robot.sides).motion
    assert found is not None and found.samples == history[last:]


def test_nothing_is_foretold_of_a_robot_at_rest() -> None:
    """Nobody knows how long it waits; and no way is foretold beyond its next rest."""
    robot = Robot()
    robot.drive()
    seen = robot.drive()
    assert not any(foretold(seen, -1.0, 0.0)) and not any(foretold(seen, DURATION_S, 9.0))


@pytest.mark.parametrize(
    ("program", "speed"), [("OTHER", 50.0), ("ARTICLE", 30.0)], ids=["program", "speed"]
)
def test_another_program_or_speed_is_a_first_round(program: str, speed: float) -> None:
    """Though it drives the same."""
    robot = Robot()
    robot.drive()
    assert not any(told for _, told, _ in robot.drive(program=program, speed=speed))


def test_a_changed_program_is_given_up_where_it_changes() -> None:
    """And not foretold again before its next rest, though it may come near the old way."""
    robot = Robot()
    robot.drive()

    def changed(t: float) -> JointMotion:
        turned = t - 0.4
        sample = moved(t)
        if turned <= 0.0:
            return sample
        # From 0.4 s on it slows down: half a degree less after 60 ms.
        behind = 5.0 * turned * turned
        q = tuple(a - behind * v for a, v in zip(sample.q, sample.qdot))
        qdot = tuple(v - 2.0 * 5.0 * turned * v for v in sample.qdot)
        return JointMotion.measured(q, qdot, sample.time)

    seen = robot.drive(lambda t: changed(t) if t < 0.5 else replace(changed(0.5), qdot=STILL))
    assert all(foretold(seen, 0.15, 0.4))
    assert not any(foretold(seen, 0.46, 0.5))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_beside_its_place_is_no_round_of_that_path(side: float) -> None:
    """On either side of it, though the others go on as before; it stood, so it is not just late."""
    robot = Robot()

    def beside(off: float, t: float) -> JointMotion:
        there = moved(t)
        q = (HOME[0] + (off if t >= 0.3 else 0.0), *there.q[1:])
        return replace(there, q=q, qdot=(0.0, *there.qdot[1:]))

    robot.drive(partial(beside, 0.0))
    seen = robot.drive(partial(beside, 0.1 * side))
    assert all(foretold(seen, 0.15, 0.3)) and not any(foretold(seen, 0.31, 0.5))


def test_a_slower_round_is_not_foretold() -> None:
    """A robot whose override was turned down on the way: places match, velocities do not."""
    robot = Robot()
    robot.drive()
    seen = robot.drive(lambda t: moved(t, duration=1.2 * DURATION_S))
    assert not any(foretold(seen, 0.15, 9.0))


def test_a_path_with_a_hole_is_not_kept_but_kept_to() -> None:
    """A pause of the controller hides what was there; the path from before is not lost by it."""
    robot = Robot()
    robot.drive(blind=(0.3, 0.36))
    assert not robot.remembered.paths
    robot.drive()
    seen = robot.drive(blind=(0.3, 0.36))
    assert all(foretold(seen, 0.36, DURATION_S - AHEAD_S)) and len(robot.remembered.paths) == 1


def test_a_way_there_and_back_keeps_two_paths() -> None:
    """And one that begins at the same place and ends elsewhere is a third."""
    robot = Robot()
    for _ in range(3):
        robot.drive()
        robot.drive(back)
    assert len(robot.remembered.paths) == 2
    robot.drive(partial(moved, swing=0.5 * SWING))
    assert len(robot.remembered.paths) == 3


def test_memory_is_bounded() -> None:
    """The paths that were not driven for longest go first."""
    robot = Robot()
    for k in range(MOST_PATHS // 2 + 2):
        swing = SWING * (0.3 + 0.01 * k)
        robot.drive(partial(moved, swing=swing))
        robot.drive(partial(back, swing=swing))
    assert len(robot.remembered.paths) == MOST_PATHS
    assert robot.sides.real.last.q == pytest.approx(robot.remembered.paths[-1].end, abs=1e-3)


def test_a_jog_is_not_remembered() -> None:
    """It is no program."""
    robot = Robot()
    real = robot.sides.real
    for k in range(150):
        sample = replace(moved(k * PERIOD_S - 0.1), time=k * PERIOD_S)
        flags = RealMeasured(sample.time, sample.time, sample.time, 0, sample)
        real = replace(real, history=(*real.history, sample)[-48:], flags=flags)
        robot.remembered = note_sample(SETUP, robot.remembered, Sides(real))
    assert not robot.remembered.paths


@pytest.mark.parametrize(
    ("first", "blind", "known"),
    [(0.0, (9.0, 9.0), True), (0.0, (0.15, 0.2), False), (0.2, (9.0, 9.0), False)],
    ids=["whole", "hole", "no rest"],
)
def test_a_motion_that_is_noticed_late_is_known_only_as_a_whole(
    first: float, blind: tuple[float, float], known: bool
) -> None:
    """From its rest on and without a hole: of another one nobody knows where it began."""
    robot = Robot()
    for _ in range(45):
        robot.t += PERIOD_S
        if robot.t >= first and not blind[0] <= robot.t < blind[1]:
            robot.pass_by(moved(robot.t - 0.1))
    motion = note_sample(SETUP, robot.remembered, robot.sides).motion
    assert motion is not None and (motion.key is not None) is known
