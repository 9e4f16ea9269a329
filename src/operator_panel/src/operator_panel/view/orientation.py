"""How a tool is turned, as a robot's own display says it."""

from __future__ import annotations

import math

import numpy as np

from operator_panel.view import words

LEVEL_DEG = 0.005  # our choice: less is shown as 0.00


def turn_text(home: np.ndarray, now: np.ndarray) -> str:
    """Return the turn from ``home`` to ``now`` about fixed axes of the base: x, y, z are W, P, R.

    A tool that only turns about z, as a SCARA's, is told by R alone.

    Args:
        home: Rotation of the tool at home, shape ``(3, 3)``.
        now: Its rotation now.

    Source:
        The names W, P, R and their order: the maker's Cartesian display. From the home pose: our
        choice; a real SR-6iA shows R = J1 + J2 + J4 (tests/golden).
    """
    turned = now @ home.T
    w = math.degrees(math.atan2(turned[2, 1], turned[2, 2]))
    p = math.degrees(math.asin(max(-1.0, min(1.0, -turned[2, 0]))))
    r = words.number(math.degrees(math.atan2(turned[1, 0], turned[0, 0])), 1)
    if max(abs(w), abs(p)) < LEVEL_DEG:
        return f"R {r} deg"
    return f"W {words.number(w, 1)}  P {words.number(p, 1)}  R {r} deg"
