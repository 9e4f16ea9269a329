"""What parts can lie on, as flat surfaces seen from above.

It also tells what is in the way of a tool that comes down.
"""

from __future__ import annotations

import math

import msgspec
from scara_config.palletise import MM, Dock, Palletise

VEHICLE = "vehicle"


class Surface(msgspec.Struct, frozen=True):
    """A horizontal face at ``height`` [m].

    It is a disc of ``radius`` about ``middle``, or a rectangle of ``half`` lengths, turned by
    ``turn`` [rad].
    """

    name: str
    height: float
    middle: tuple[float, float]
    radius: float = 0.0
    half: tuple[float, float] = (0.0, 0.0)
    turns: bool = False
    turn: float = 0.0

    def carries(self, x: float, y: float, reach: float = 0.0) -> bool:
        """Tell whether (x, y) lies over the face, or not farther beside it than ``reach`` [m]."""
        dx, dy = x - self.middle[0], y - self.middle[1]
        if self.turn:
            dx, dy = Dock(*self.middle, self.turn).of(x, y)
        if self.radius:
            return math.hypot(dx, dy) <= self.radius + reach
        return abs(dx) <= self.half[0] + reach and abs(dy) <= self.half[1] + reach


class WorkSurfaces:
    """The table with its stands, the pallet and the floor; only the table turns.

    Args:
        work: palletise.yaml.
    """

    def __init__(self, work: Palletise) -> None:
        self._axis = (work.table.axis_mm[0] * MM, work.table.axis_mm[1] * MM)
        half = (0.5 * work.pallet.size_mm[0] * MM, 0.5 * work.pallet.size_mm[1] * MM)
        middle = (work.pallet.middle_mm[0] * MM, work.pallet.middle_mm[1] * MM)
        self._fixed = [
            Surface("pallet", work.pallet.top_mm * MM, middle, half=half),
            Surface(
                work.table.link,
                work.table.top_mm * MM,
                self._axis,
                radius=work.table.radius_mm * MM,
            ),
            Surface("floor", work.floor_mm * MM, self._axis, half=(math.inf, math.inf)),
        ]
        self._stands = [
            Surface(
                name,
                work.table.stand_top_mm * MM,
                (x * MM, y * MM),
                radius=work.table.stand_radius_mm * MM,
                turns=True,
            )
            for name, (x, y) in work.table.stands_mm.items()
        ]
        # NaN equals no angle, so the first look computes the faces.
        self._surfaces: tuple[float, list[Surface]] = (math.nan, [])
        self._pallet = self._fixed[0]
        self.top = max(surface.height for surface in (*self._fixed, *self._stands))

    def dock(self, dock: Dock | None) -> None:
        """Let a vehicle with a pallet stand there; None: it has left."""
        self._fixed = [face for face in self._fixed if face.name != VEHICLE]
        if dock is not None:
            middle, turn = (dock.x, dock.y), dock.turn
            came = msgspec.structs.replace(self._pallet, name=VEHICLE, middle=middle, turn=turn)
            # In front: the floor has to stay the last one, for it is what lies under everything.
            self._fixed.insert(0, came)
        self._surfaces = (math.nan, [])

    def turned(self, x: float, y: float, angle: float) -> tuple[float, float]:
        """Return where a point goes when the table turns by ``angle`` [rad]."""
        dx, dy = x - self._axis[0], y - self._axis[1]
        c, s = math.cos(angle), math.sin(angle)
        return self._axis[0] + c * dx - s * dy, self._axis[1] + s * dx + c * dy

    def surfaces(self, table: float) -> list[Surface]:
        """Return all faces with the table at ``table`` [rad]."""
        if self._surfaces[0] != table:
            stands = [
                msgspec.structs.replace(stand, middle=self.turned(*stand.middle, table))
                for stand in self._stands
            ]
            self._surfaces = (table, [*stands, *self._fixed])
        return self._surfaces[1]

    def below(self, x: float, y: float, height: float, table: float) -> Surface:
        """Return the highest face under a point, at most ``height`` [m] high.

        The floor is always there.
        """
        under = [
            surface
            for surface in self.surfaces(table)
            if surface.height <= height and surface.carries(x, y)
        ]
        return max(under, key=lambda surface: surface.height, default=self._fixed[-1])
