"""What can be seen through in the picture: ghosts, keep-out zones, lines of reach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Panes = dict[str, tuple[str, float]]
"""For each object that can be seen through its id: colour and opacity.

The browser needs them: it makes all else solid, and an object can be there before its material is.
"""


@dataclass(frozen=True)
class Glass:
    """A material that can be seen through.

    Attributes:
        colour: As ``#rrggbb``.
        opacity: 0 is nothing, 1 is solid.
    """

    colour: str
    opacity: float

    def cover(
        self, made: Any, panes: Panes, side: Literal["front", "back", "both"] = "front"
    ) -> None:
        """Give an object of the scene this material, and note it in ``panes``."""
        made.material(self.colour, self.opacity, side=side)
        panes[made.id] = (self.colour, self.opacity)
