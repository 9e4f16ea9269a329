"""The refusals of scara_control; their texts carry joint, value and allowed range."""

from __future__ import annotations


class ScaraControlError(ValueError):
    """Something asked of the arm cannot be done; the text says what and what is allowed."""


class ScrewModelError(ScaraControlError):
    """Screw axes or home pose are no rigid mechanism."""


class JointVectorError(ScaraControlError):
    """A joint vector has the wrong length, or a value that is not finite."""


class JointLimitError(ScaraControlError):
    """A joint position or velocity lies outside its limits."""


class UnreachableError(ScaraControlError):
    """No joint positions bring the tool to the wanted point."""
