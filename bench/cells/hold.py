"""How far an ideal twin would be off that stands at the newest position it has been sent.

From the same recording.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, open_bag
from numpy.typing import NDArray
from scara_config import Robot
from scara_control.kinematics.screws import ScrewModel, tool_positions

FOLLOW, TRUTH, MARKER = "joint_pose_controller/follow", "real/ground_truth", "experiment/marker"
RATE_HZ = 1000.0
Array = NDArray[np.float64]


def held_errors_mm(file: Path, robot: Robot) -> list[float]:
    """Return the largest distance between tool and held tool [mm], for each experiment.

    Args:
        file: Recording in which the robot leads. Each packet to the twin holds the position that
            the controller has read; it counts from the instant at which it arrived at the twin,
            until the next one does.
        robot: robot.yaml.
    """
    names = [joint.name for joint in robot.arm_joints]
    tool = partial(tool_positions, ScrewModel.from_robot(robot))
    with open_bag(file) as bag:
        origin = bag.start
        spans = _spans(bag)
        truth = _table(
            bag,
            TRUTH,
            lambda at, m: (_seconds(m.header.stamp), m.position[_columns(m.name, names)]),
        )
        sent = _table(
            bag,
            FOLLOW,
            lambda at, m: (
                (at, m.points[0].positions[_columns(m.joint_names, names)]) if m.points else None
            ),
        )
    errors = []
    for first, last in spans:
        inside = sent[0][(sent[0] >= first) & (sent[0] <= last)]
        if len(inside) < 2:
            raise ValueError(
                f"{file}: the twin was sent nothing between {first - origin:.1f} and "
                f"{last - origin:.1f} s"
            )
        instants = np.arange(inside[0], inside[-1], 1.0 / RATE_HZ)
        real = np.column_stack([np.interp(instants, truth[0], column) for column in truth[1].T])
        held = sent[1][np.searchsorted(sent[0], instants, side="right") - 1]
        errors.append(float(np.linalg.norm(tool(real) - tool(held), axis=1).max()) * 1e3)
    return errors


def _spans(bag: Bag) -> list[tuple[float, float]]:
    """Return begin and end of each experiment, in the bag's time."""
    said = [(at, message.data.split()[0]) for at, message in bag.messages(MARKER)]
    begins, ends = ([at for at, word in said if word == wanted] for wanted in ("start", "end"))
    return list(zip(begins, ends))


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)


def _columns(there: list[str], wanted: list[str]) -> list[int]:
    return [there.index(name) for name in wanted]


def _table(bag: Bag, topic: str, row: Any) -> tuple[Array, Array]:
    """Return times and positions of a topic."""
    rows = [found for at, message in bag.messages(topic) if (found := row(at, message)) is not None]
    return np.array([at for at, _ in rows]), np.array([values for _, values in rows])
