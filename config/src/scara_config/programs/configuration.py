"""How an arm is bent at a Cartesian position: ``CONFIG : 'N U T, 0, 0, 0'``, ``'L, 0, 0, 0'``.

The same place of the tool can be reached with the elbow on either side and with the wrist turned
over; letters say on which side each stands, numbers how often a joint has gone round.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from itertools import pairwise

import msgspec

from scara_config.elbow import elbow_of
from scara_config.loader import ConfigError
from scara_config.robot import Joint, Robot

GROUPS = ("NF", "RL", "UD", "TB")
"""Wrist not flipped or flipped, elbow to the right or to the left, elbow up or down, wrist in front
of the first axis or behind it; in the order in which they stand."""
TURN_AXES = {6: (4, 5, 6), 4: (4,)}
"""Axis numbers that the three numbers belong to, by the number of the arm's joints."""
FIELDS = 3
"""Numbers behind the letters."""
PARALLEL = 1.0 - 1e-6
"""Cosine between two axes of a wrist from which they count as one."""
_EDGE_DEG = 0.0005
"""180 deg counts as the next turn, and what is so near to it does too [src]."""
_TEXT = re.compile(r"([A-Z](?:\s*[A-Z])*)((?:\s*,\s*-?\d+)*)")


class Configuration(msgspec.Struct, frozen=True):
    """How an arm is bent.

    Attributes:
        letters: One of each group that the arm has.
        turns: Of the joints of ``TURN_AXES``, then 0; empty: they are not told.
    """

    letters: str
    turns: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """As it stands in a program; empty: no letters tell how this arm is bent."""
        return ", ".join([" ".join(self.letters), *map(str, self.turns)]) if self.letters else ""


@lru_cache(maxsize=256)
def read_configuration(text: str) -> Configuration | None:
    """Read what stands between the quotes; None: nothing does, the arm stays bent as it is.

    Raises:
        ConfigError: It is no configuration.
    """
    if not text.strip():
        return None
    found = _TEXT.fullmatch(text.strip())
    letters = "".join(found[1].split()) if found else ""
    groups = [k for letter in letters for k, group in enumerate(GROUPS) if letter in group]
    turns = tuple(map(int, re.findall(r"-?\d+", found[2]))) if found else ()
    # Each letter once, and in the order of the groups.
    known = len(groups) == len(letters) > 0 and groups == sorted(set(groups))
    if not known or len(turns) not in (0, FIELDS):
        raise ConfigError("is no configuration, as 'N U T, 0, 0, 0' and 'R, 0, 0, 0' are")
    return Configuration(letters, turns)


def letter_groups(robot: Robot) -> tuple[str, ...]:
    """Return the letters that tell how an arm is bent: a SCARA's elbow, six joints with a wrist."""
    if elbow_of(robot) is not None:
        return ("RL",)
    turning = [joint.screw_axis for joint in robot.arm_joints if joint.si_unit == "rad"]
    if not len(turning) == len(robot.arm_joints) == 6:
        return ()
    wrist = pairwise((axis or ())[:3] for axis in turning[3:])
    across = all(abs(sum(a * b for a, b in zip(*axes))) < PARALLEL for axes in wrist)
    return ("NF", "UD", "TB") if across else ()


def turn_joints(robot: Robot) -> tuple[Joint, ...]:
    """Return the joints whose turns are told."""
    arm = [joint for joint in robot.joints if joint.screw_axis is not None]
    numbers = TURN_AXES.get(len(arm), ())
    return tuple(joint for joint in arm if joint.axis_number in numbers)


def turn_of(q: float) -> int:
    """Return which turn a joint is in [rad]: 0 within half a turn to either side."""
    turns = math.floor((abs(math.degrees(q)) + 180.0 + _EDGE_DEG) / 360.0)
    return turns if q >= 0.0 else -turns


def configuration_fault(text: str, robot: Robot) -> str:
    """Say why an arm cannot be bent so, or nothing."""
    try:
        told = read_configuration(text)
    except ConfigError as error:
        return str(error)
    if told is None:
        return ""
    groups = letter_groups(robot)
    fits = len(told.letters) == len(groups)
    if not fits or not all(letter in group for letter, group in zip(told.letters, groups)):
        named = ", ".join(" or ".join(group) for group in groups) or "no configuration"
        return f"this arm has {named}"
    joints = turn_joints(robot)
    # Three numbers stand behind the letters, also where the arm has fewer joints that tell turns.
    for field, turn in enumerate(told.turns):
        if field >= len(joints):
            if turn:
                return f"turn {turn}: number {field + 1} belongs to no joint of this arm"
            continue
        joint = joints[field]
        low, high = turn_of(joint.lower), turn_of(joint.upper)
        if not low <= turn <= high:
            return f"turn {turn}: {joint.name} goes from turn {low} to {high}"
    return ""
