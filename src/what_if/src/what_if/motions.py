"""What can be asked for: motions that are not begun yet, or were recorded."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from scara_config.programs.files import ProgramSteps
from scara_control.joint_motion import Setpoints

from what_if.errors import WhatIfError

NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
LIST = re.compile(rf"^\s*{NUMBER}(\s*,\s*{NUMBER})*\s*\Z")


@dataclass(frozen=True)
class ToolTarget:
    """Move the tool to a point, as MOVE and ``move_to`` do.

    Attributes:
        x: In the base frame [m].
        y: Likewise.
        z: Likewise.
        yaw: Wanted rotation of the tool about the vertical [rad]; None: as it comes.
        elbow: righty, lefty or empty.
        speed_percent: Program speed; 0: the default.
        path: joint or empty, or linear.
        speed_mm_s: Of the tool on a line, at most; 0: as the joints allow.
    """

    x: float
    y: float
    z: float
    yaw: float | None = None
    elbow: str = ""
    speed_percent: float = 0.0
    path: str = ""
    speed_mm_s: float = 0.0


@dataclass(frozen=True)
class JointTarget:
    """Move all of the twin's joints, as MOVE_JOINTS does.

    Attributes:
        q: Joint positions, shape (n,): [rad], prismatic [m].
        speed_percent: Program speed; 0: the default.
        path: joint or empty; linear or circular: the tool goes along a line or an arc.
        speed_mm_s: Of the tool then, at most; 0: as the joints allow.
        via: Joint positions at the places that it passes, one after the other.
        corner_mm: How far from them the tool may pass [mm]; 0: it stops at each.
    """

    q: tuple[float, ...]
    speed_percent: float = 0.0
    path: str = ""
    speed_mm_s: float = 0.0
    via: tuple[float, ...] = ()
    corner_mm: float = 0.0


@dataclass(frozen=True)
class Recorded:
    """The way that a bag holds.

    Attributes:
        way: Positions, at times from the start; a bag's velocities are not used.
        grips: When the suction was switched [s], and whether on.
    """

    way: Setpoints
    grips: tuple[tuple[float, bool], ...] = ()


Motion = ToolTarget | JointTarget | Setpoints | ProgramSteps | Recorded


def point_of(text: str, speed_percent: float = 0.0, elbow: str = "") -> ToolTarget | None:
    """Return the point that a text names: ``x,y,z`` in [m], with a yaw in [deg] as the fourth.

    None if the text is no list of numbers.

    Raises:
        WhatIfError: It is one, but not of three or four finite numbers.
    """
    if not LIST.match(text):
        return None
    numbers = [float(word) for word in text.split(",")]
    if len(numbers) not in (3, 4) or not all(map(math.isfinite, numbers)):
        raise WhatIfError(f"{text}: expected x,y,z [m] and perhaps a yaw [deg]")
    yaw = math.radians(numbers[3]) if len(numbers) == 4 else None
    x, y, z = numbers[:3]
    return ToolTarget(x, y, z, yaw, elbow, speed_percent)
