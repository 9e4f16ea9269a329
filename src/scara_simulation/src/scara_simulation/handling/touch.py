"""What a touch means: what the arm and a held part may touch, and what is a collision."""

from __future__ import annotations

from enum import Enum, auto

import msgspec

UPRIGHT = 0.9
"""Cosine of the steepest contact normal that still counts as pressing from above. Our choice: 26
deg."""


class ContactKind(Enum):
    """Kinds of things that touch."""

    ARM = auto()
    NOZZLE = auto()
    HELD = auto()
    PART = auto()
    REST = auto()
    """Where parts may lie: a stand or the pallet."""
    CELL = auto()


class Touch(msgspec.Struct, frozen=True):
    """One contact.

    ``vertical`` is the size of the normal's vertical part, ``force`` acts along the normal [N].
    """

    kinds: tuple[ContactKind, ContactKind]
    names: tuple[str, str]
    vertical: float
    force: float


def is_told(touch: Touch, touch_n: float) -> bool:
    """Tell whether the arm, or what it holds, touches something else.

    Args:
        touch: The contact.
        touch_n: Weaker contacts are none [N].
    """
    kinds = set(touch.kinds)
    if touch.force < touch_n or not kinds & {ContactKind.ARM, ContactKind.NOZZLE, ContactKind.HELD}:
        return False
    return not (ContactKind.HELD in kinds and kinds & {ContactKind.ARM, ContactKind.NOZZLE})


def is_collision(touch: Touch, touch_n: float, press_n: float) -> bool:
    """Tell whether a touch should not be.

    The nozzle may stand on a part, and a held part on a stand or the pallet: from above and not too
    hard. Nothing else may be touched by the arm or by what it carries; what lies about may touch
    what it likes.

    Args:
        touch: The contact.
        touch_n: Weaker contacts are none [N].
        press_n: What may be touched must not be pressed harder [N].
    """
    if not is_told(touch, touch_n):
        return False
    kinds = set(touch.kinds)
    if kinds in ({ContactKind.NOZZLE, ContactKind.PART}, {ContactKind.HELD, ContactKind.REST}):
        return touch.vertical < UPRIGHT or touch.force > press_n
    return True
