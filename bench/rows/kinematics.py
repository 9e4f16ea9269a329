"""Rows ik_single, ik_batch, ik_accuracy.

The closed forms of scara_control.kinematics, as the services call them.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle

import numpy as np
from scara_control.kinematics.scara import Elbow, Scara, solve, tool_position
from scara_control.kinematics.screws import ScrewModel

from bench.peers.process import Peer
from bench.record import Beside, Goal, Record, interleaved, median, of_rounds, p99
from bench.room import Room
from bench.timing import timed_blocks
from bench.world.scara_batch import solve_batch, tool_positions_batch

POSES, ROUNDS, BLOCKS, CALLS = 1000, 9, 20, 500
MIDDLE = (0.0, 1.3, -0.105)
"""First guess for a target of which nothing is known.

The middle of the joints' ranges, elbow on the wanted side.
"""
NEAR_RAD = 0.05
"""How far the first guess is away from the solution when a motion is followed."""


def _targets(room: Room, count: int, seed: int) -> np.ndarray:
    """Return joint positions all over the righty half of the workspace, shape ``(count, 3)``."""
    low, high = np.array([(joint.lower, joint.upper) for joint in room.robot.arm_joints]).T
    low[1] = 0.0
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def _solving(scara: Scara, points: list[list[float]]) -> Callable[[], int]:
    """Return a block of calls of our function, each with another target."""
    turn = cycle(points)

    def block() -> int:
        for _ in range(CALLS):
            x, y, z = next(turn)
            solve(scara, x, y, z, Elbow.RIGHTY)
        return CALLS

    return block


def ik_single(room: Room) -> Record:
    """One target at a time: ours needs no first guess and is exact; the others iterate from one."""
    scara, arm = Scara.from_robot(room.robot), ScrewModel.from_robot(room.robot)
    q = _targets(room, POSES, 1)
    near = q + np.random.default_rng(2).uniform(-NEAR_RAD, NEAR_RAD, q.shape) * (1.0, 1.0, 0.1)
    lengths, middle = [scara.l1, scara.l2, scara.h], [list(MIDDLE)] * POSES
    block = _solving(scara, tool_positions_batch(scara, q).tolist())
    screws, home = arm.screw_axes.tolist(), arm.home_pose.tolist()
    _ = room.peers
    with (
        Peer("kinematics:Kdl", lengths=lengths, targets=q.tolist(), seeds=middle) as far_kdl,
        Peer(
            "kinematics:Kdl", lengths=lengths, targets=q.tolist(), seeds=near.tolist()
        ) as near_kdl,
        Peer(
            "kinematics:ModernRobotics", screws=screws, home=home, targets=q.tolist(), seeds=middle
        ) as book,
        Peer("kinematics:Toolbox", lengths=lengths, targets=q.tolist(), seeds=middle) as toolbox,
    ):
        found = sum(error < 1e-4 for error in far_kdl.ask("errors"))
        ours, kdl, kdl_near, newton, lm = interleaved(
            ROUNDS,
            lambda: timed_blocks(BLOCKS, block),
            lambda: far_kdl.ask("round", blocks=BLOCKS),
            lambda: near_kdl.ask("round", blocks=BLOCKS),
            lambda: book.ask("round", blocks=BLOCKS),
            lambda: toolbox.ask("round", blocks=BLOCKS),
        )
        version, book_version = far_kdl.version, book.version
    value, tail, spread = of_rounds(ours, median, 1e6)
    other, other_tail, other_spread = of_rounds(kdl, median, 1e6)
    by_the_book = median(ours) / median(newton)
    return Record(
        "ik_single",
        value,
        other,
        "us",
        (Goal("ratio", 0.05),),
        measured="scara.solve with a branch, all checks of limits included; 1000 targets all "
        "over the workspace",
        against=f"{version} ChainIkSolverPos_LMA (C++) through PyKDL, eps 1e-5, first guess in the "
        "middle of the ranges",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=ROUNDS,
        beside=(
            Beside(
                f"ours / {book_version} IKinSpace",
                by_the_book,
                "",
                "<= 0.001",
                by_the_book <= 0.001,
            ),
            Beside(
                "ours / KDL, first guess 0.05 rad beside the solution",
                median(ours) / median(kdl_near),
                "",
            ),
            Beside(
                "ours / Robotics Toolbox ik_LM (C++), position only", median(ours) / median(lm), ""
            ),
        ),
        note=f"from that guess KDL finds {found} of {POSES} targets within 0.1 mm; ours all, see "
        "ik_accuracy",
    )


def ik_batch(room: Room) -> Record:
    """Many targets at once, in points per second."""
    scara = Scara.from_robot(room.robot)
    sizes = (10_000, 100_000, 1_000_000)
    points = [tool_positions_batch(scara, _targets(room, size, 3)) for size in sizes]

    def round_of(index: int) -> Callable[[], list[float]]:
        def one() -> int:
            solve_batch(scara, points[index])
            return sizes[index]

        return lambda: [1e-6 / seconds for seconds in timed_blocks(2_000_000 // sizes[index], one)]

    small, middle, large = interleaved(ROUNDS, round_of(0), round_of(1), round_of(2))
    value, _, spread = of_rounds(middle, median, 1.0)
    slowest = -p99([[-rate for rate in samples] for samples in middle])
    return Record(
        "ik_batch",
        value,
        None,
        "million points/s",
        (Goal("ours", 50.0, at_least=True),),
        measured="scara_batch.solve_batch, 100 000 targets a call, one thread, limits checked",
        against="none",
        ours_p99=slowest,
        spread_percent=spread,
        rounds=ROUNDS,
        beside=(
            Beside("10 000 targets a call", median(small), "million points/s"),
            Beside(
                "1 000 000 targets a call: the answer is fresh memory",
                median(large),
                "million points/s",
            ),
        ),
        note="p99 here: one call in a hundred was slower",
    )


def ik_accuracy(room: Room) -> Record:
    """Round trip there and back over a million poses, a tenth of them at the edge of the reach."""
    scara, count = Scara.from_robot(room.robot), 1_000_000
    q = _targets(room, count, 4)
    rng = np.random.default_rng(5)
    q[: count // 10, 1] = 10.0 ** rng.uniform(-14.0, -1.0, count // 10)
    q[: count // 100, 1] = 0.0
    points = tool_positions_batch(scara, q)
    worst = 0.0
    for elbow in Elbow:
        solutions = solve_batch(scara, points, elbow)
        sure = slice(None) if elbow is Elbow.RIGHTY else solutions.reachable
        worst = max(
            worst,
            float(np.abs(tool_positions_batch(scara, solutions.q[sure]) - points[sure]).max()),
        )
    singly = max(
        abs(a - b)
        for point in points[:: count // 20_000].tolist()
        for a, b in zip(tool_position(scara, *solve(scara, *point, Elbow.RIGHTY).q), point)
    )
    return Record(
        "ik_accuracy",
        max(worst, singly),
        None,
        "m",
        (Goal("ours", 1e-12),),
        measured="there and back: 1e6 poses in a batch on both branches, 2e4 of them one by "
        "one; 1e5 near the edge",
        against="none",
        statistic="max",
    )
