"""Enumerations of texts, as ``enum.StrEnum`` of Python 3.11: the project runs with 3.10 too."""

from __future__ import annotations

from enum import Enum


class StrEnum(str, Enum):
    """Members are texts: equal to them, and shown as them.

    Example:
        >>> class Colour(StrEnum):
        ...     RED = "red"
        >>> f"{Colour.RED}", Colour.RED == "red", Colour("red") is Colour.RED
        ('red', True, True)
    """

    # As the text hashes: an Enum's own hash is Python, and tables are looked up by modes.
    __hash__ = str.__hash__

    def __str__(self) -> str:
        """Return the text."""
        return str(self.value)
