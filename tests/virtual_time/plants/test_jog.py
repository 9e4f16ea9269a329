"""Jogs of a pair whose real robot is late: the twin waits for it, or it is behind and said so."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import msgspec
import numpy as np
import pytest
from harness.plants.known_robot import knowing
from harness.plants.variants import FIELD
from harness.running.thorough import thorough
from harness.scenes.copies import copied
from harness.scenes.troubled import TroubledCell
from harness.workspace import ROOT
from scara_control.config import load_motion
from scara_control.kinematics.screws import ScrewModel, tool_positions

ROBOT = "fanuc_sr6ia"
DELAY_MS = 110.0
"""So late the field robot is."""
VELOCITY = 0.5
"""A jog may have a tenth of joint_1's largest. At 0.7 rad/s a robot so late that is not waited for
goes on by 40 mm where the key is let go, at times for so long that the pair is paused [rad/s]."""


class Jogged(TroubledCell):
    """A cell whose twin is jogged."""

    @classmethod
    def standing(cls, waits: bool) -> Jogged:
        """Return a cell that stands, with a robot whose delay is known."""
        files = FIELD.files(ROBOT)
        jog = msgspec.structs.replace(files.motion.jog, waits_for_robot=waits)
        motion = msgspec.structs.replace(files.motion, jog=jog)
        controller = knowing(files.controller, files.robot, DELAY_MS)
        cell = cls(replace(files, motion=motion, controller=controller), seed=1)
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.5)
        # The first motion shows how late the robot is.
        for velocity in (VELOCITY, -VELOCITY):
            cell.jog(0.8, velocity)
            cell.release()
            cell.wait_still(0.3)
        return cell

    def jog(self, seconds: float, velocity: float = VELOCITY) -> None:
        """Hold a jog key."""
        for _ in range(round(seconds / 0.05)):
            self.twin.jog(["joint_1"], [velocity])
            self.schedule.run(0.05)

    def release(self) -> None:
        """Let the key go."""
        self.twin.jog(["joint_1"], [0.0])

    def apart(self, since: float) -> float:
        """Return the largest distance of both tools at the same instant since then [m]."""
        model = ScrewModel.from_robot(self.files.robot)
        times, tools = [], []
        for truth in (self.real.truth, self.twin.truth):
            # The table under the robot moves no tool.
            rows = [(at, q[: model.joint_count]) for at, q, _ in truth if at >= since]
            times.append([at for at, _ in rows])
            tools.append(tool_positions(model, np.array([q for _, q in rows])))
        twin = np.stack(
            [np.interp(times[0], times[1], tools[1][:, axis]) for axis in range(3)], axis=1
        )
        return float(np.linalg.norm(twin - tools[0], axis=1).max())


def stood_at(cell: Jogged, side: str, since: float) -> float:
    """Return when a side began to stand for good [s]."""
    truth = cell.real.truth if side == "real" else cell.twin.truth
    return max(at for at, _, qdot in truth if at >= since and max(map(abs, qdot)) > 0.02)


@pytest.fixture(scope="module")
def cells() -> Iterator[dict[bool, Jogged]]:
    """Give two cells that stand: the twin waits for its robot, or not; for copies of them."""
    with Jogged.standing(False) as one, Jogged.standing(True) as other:
        yield {False: one, True: other}


def jogged_apart(cell: Jogged) -> tuple[float, float]:
    """Jog for a second; return how far both tools were apart [m], and how far it went [rad]."""
    since, start = cell.schedule.now, cell.real.truth[-1][1][0]
    cell.jog(1.0)
    cell.release()
    cell.wait_still(0.3)
    assert cell.mode == "IDLE" and not cell.twin.refused
    return cell.apart(since), cell.real.truth[-1][1][0] - start


def test_a_jog_that_waits_keeps_the_pair_together(cells: dict[bool, Jogged]) -> None:
    """To a quarter of what the robot's delay makes of it else."""
    found = {}
    for waits, cell in cells.items():
        found[waits], moved = copied(partial(jogged_apart, cell), tuple[float, float])
        assert moved == pytest.approx(VELOCITY, rel=0.1)
    reach = 0.65
    assert found[False] > 0.5 * VELOCITY * reach * DELAY_MS * 1e-3
    assert found[True] < 0.25 * found[False], found


def stopped_after(cell: Jogged, command: str) -> tuple[float, float]:
    """Give a command in the middle of a jog; return when the robot and the twin stood [s]."""
    cell.jog(0.8)
    begun = cell.schedule.now
    assert cell.operate(command).success
    cell.jog(0.1)
    cell.schedule.run(1.0)
    real, twin = (stood_at(cell, side, begun - 0.1) - begun for side in ("real", "twin"))
    return real, twin


@pytest.mark.parametrize("command", ["STOP", *thorough("ESTOP", "PAUSE")])
def test_a_stop_does_not_wait(cells: dict[bool, Jogged], command: str) -> None:
    """What waits is forgotten: the twin stands as soon as without, and so does the robot."""
    took = {
        waits: copied(partial(stopped_after, cell, command), tuple[float, float])
        for waits, cell in cells.items()
    }
    for before, after in zip(took[False], took[True]):
        assert after <= before + 0.03, took


def released_after(cell: Jogged) -> float:
    """Let the key go in the middle of a jog; return when the robot stood [s]."""
    cell.jog(0.8)
    begun = cell.schedule.now
    cell.release()
    cell.schedule.run(1.0)
    return stood_at(cell, "real", begun - 0.1) - begun


def test_a_key_that_is_let_go_stops_a_waiting_pair_later_by_a_known_time(
    cells: dict[bool, Jogged],
) -> None:
    """By what the way on has to be known before: a stop is for who cannot wait for that."""
    took = {waits: copied(partial(released_after, cell), float) for waits, cell in cells.items()}
    known = 0.17 + load_motion(ROOT / "config").move.announce
    assert took[True] <= took[False] + known, took


def test_a_jog_that_waits_stops_at_the_joints_limit(cells: dict[bool, Jogged]) -> None:
    """What waits counts: it is braked before the limit, not at it."""
    cell = cells[True]
    joint = cell.files.robot.twin_joints[0]

    def highest() -> float:
        cell.jog((joint.upper - cell.twin.truth[-1][1][0]) / VELOCITY + 1.0)
        cell.wait_still(0.3)
        assert cell.mode == "IDLE"
        return max(q[0] for side in (cell.real, cell.twin) for _, q, _ in side.truth)

    found = copied(highest, float)
    assert joint.upper - math.radians(2.0) <= found <= joint.upper + math.radians(0.05)
