"""What somebody typed, as a motion: a program's name, a point, a bag."""

from __future__ import annotations

import math
import re

from what_if.errors import WhatIfError
from what_if.motions import ToolTarget

NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
LIST = re.compile(rf"^\s*{NUMBER}(\s*,\s*{NUMBER})*\s*\Z")


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
