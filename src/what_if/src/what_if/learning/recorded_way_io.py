"""The way of the joints that a bag holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, BagError, open_bag
from scara_control.joint_motion import JointMotion, Setpoints

from what_if.errors import WhatIfError
from what_if.motions import Recorded
from what_if.world import Cell

TOPICS = ("real/joint_states", "twin/joint_states")
GRIPPERS = ("real/gripper", "twin/gripper")
"""The stand-in alone tells of the real one; a real robot's suction is switched with the twin's."""
STILL = 1e-4
"""A joint that moves by less [rad] or [m] stands, for where the way begins and ends; our choice."""


def read_way(cell: Cell, path: Path) -> Recorded:
    """Read the way of the real robot, or of the twin if the bag has no real one.

    What stands at both ends is left out.

    Raises:
        WhatIfError: The bag cannot be read, holds no joint states, or nothing moves in it; or the
            cell has parts, and nothing tells when the suction was switched, or one is in hand where
            the way begins.
    """
    names = [joint.name for joint in cell.robot.twin_joints]
    try:
        with open_bag(path) as bag:
            topic = next((name for name in TOPICS if bag.count(name)), "")
            if not topic:
                raise WhatIfError(f"{path}: holds no message of {' or '.join(TOPICS)}")
            times, rows = [], []
            for _, message in bag.messages(topic):
                missing = sorted(set(names) - set(message.name))
                if missing:
                    raise WhatIfError(f"{path}: {topic}: has no joint {', '.join(missing)}")
                at = {name: k for k, name in enumerate(message.name)}
                stamp = message.header.stamp
                times.append(stamp.sec + 1e-9 * stamp.nanosec)
                rows.append([message.position[at[name]] for name in names])
            gripper = next((name for name in GRIPPERS if bag.count(name)), "")
            if not gripper and cell.work is not None:
                wanted = " or ".join(GRIPPERS)
                raise WhatIfError(f"{path}: holds no message of {wanted}: was a part in hand?")
            grips = _grips(bag, gripper) if gripper else []
    except BagError as error:
        raise WhatIfError(str(error)) from error
    # A bag has the order in which messages came; what counts is when they were measured.
    order = np.argsort(times, kind="stable")
    stamps, q = np.array(times)[order], np.array(rows)[order]
    keep = np.append(True, np.diff(stamps) > 0.0)
    stamps, q = stamps[keep], q[keep]
    moving = np.flatnonzero(np.any(np.abs(np.diff(q, axis=0)) > STILL, axis=1))
    if not moving.size:
        raise WhatIfError(f"{path}: {topic}: nothing moves in it")
    # A step is numbered by its first row: the last one ends a row later, before the slice does.
    cut = slice(int(moving[0]), int(moving[-1]) + 2)
    begin = float(stamps[cut][0])
    held = [on for when, on in grips if when <= begin][-1:] == [True]
    if held and cell.work is not None:
        # Nothing tells which part it is, nor how it hangs at the tool.
        why = "a part is in hand where the way begins: begin with an empty hand"
        raise WhatIfError(f"{path}: {why}")
    inside = tuple((when - begin, on) for when, on in grips if begin < when < stamps[cut][-1])
    points = (JointMotion(tuple(row), (), ()) for row in q[cut].tolist())
    return Recorded(Setpoints.due(tuple(names), (stamps[cut] - begin).tolist(), points), inside)


def _grips(bag: Bag, gripper: str) -> list[tuple[float, bool]]:
    """Return when the suction took a part or let it go."""
    found: list[tuple[float, bool]] = []
    holding = False
    for _, message in bag.messages(gripper):
        if message.holding != holding:
            holding = message.holding
            stamp = message.header.stamp
            found.append((stamp.sec + 1e-9 * stamp.nanosec, holding))
    return found
