"""Places of the tool as a person types them, one on a line, and the grid that some of them span."""

from __future__ import annotations

import re
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_config import Robot

from operator_panel.control.fields import FieldError, parse_number
from operator_panel.teach.draft import TeachError

MOST_PLACES = 400
"""Our choice: a pallet of 20 x 20; a draft holds two positions for each."""
WIDEST_MM = 5000.0
_GAP = re.compile(r"[\s;]+")


class Place(msgspec.Struct, frozen=True):
    """Where the tool goes.

    Attributes:
        xyz_mm: In the robot's base.
        axes: Joints that do not move the tool [deg or mm], in the order of robot.yaml; empty: as
            they stand.
    """

    xyz_mm: tuple[float, float, float]
    axes: tuple[float, ...] = ()

    @property
    def text(self) -> str:
        """As a person types it."""
        return " ".join(f"{round(value, 4) + 0.0:.10g}" for value in (*self.xyz_mm, *self.axes))


def read_places(text: str, robot: Robot) -> tuple[Place, ...]:
    """Return the places of a text: ``x y z`` on each line, and perhaps the outer axes.

    Raises:
        TeachError: A line is no place; the text names it.
    """
    outer = outer_axes(robot)
    names = ["x", "y", "z", *outer]
    found = []
    for number, line in enumerate(text.strip().splitlines(), start=1):
        words = [word for word in _GAP.split(line.strip()) if word]
        if len(words) not in (3, len(names)):
            most = f", or {' '.join(names)}" if outer else ""
            raise TeachError(f"place {number}: {line.strip()!r}: x y z in mm{most}")
        try:
            values = [
                parse_number(word, name, "mm", -WIDEST_MM, WIDEST_MM)
                for word, name in zip(words, names)
            ]
        except FieldError as error:
            raise TeachError(f"place {number}: {error}") from error
        found.append(Place((values[0], values[1], values[2]), tuple(values[3:])))
    if len(found) > MOST_PLACES:
        raise TeachError(f"{len(found)} places: allowed are {MOST_PLACES}")
    return tuple(found)


def outer_axes(robot: Robot) -> tuple[str, ...]:
    """Return the names of the joints that do not move the tool, in the order of robot.yaml."""
    return tuple(joint.name for joint in robot.joints if joint.screw_axis is None)


def grid_of(
    places: Sequence[Place], rows: int, columns: int, row_mm: float, column_mm: float
) -> tuple[Place, ...]:
    """Return the places of a grid, row by row.

    Args:
        places: Its first corner; or three: the first corner, the end of the first row, and where
            the last row begins. Three say how the grid is turned and how far its places are apart.
        rows: At least 1.
        columns: Places in a row, at least 1.
        row_mm: From row to row along y, where one corner is given.
        column_mm: From place to place in a row along x, likewise.

    Raises:
        TeachError: It is no grid.
    """
    if rows < 1 or columns < 1 or rows * columns > MOST_PLACES:
        raise TeachError(f"{rows} x {columns} places: allowed are 1 to {MOST_PLACES}")
    if len(places) not in (1, 3):
        raise TeachError(
            f"{len(places)} places: a grid has its first corner, or three: the first, "
            "the end of its row, and where the last row begins"
        )
    corner, *others = places
    steps = [np.array([column_mm, 0.0, 0.0]), np.array([0.0, row_mm, 0.0])]
    for k, (other, count) in enumerate(zip(others, (columns, rows))):
        way = np.subtract(other.xyz_mm, corner.xyz_mm)
        steps[k] = way / max(count - 1, 1)
    for step, count, what in zip(steps, (columns, rows), ("columns", "rows")):
        if count > 1 and not step.any():
            raise TeachError(f"{count} {what} are 0 mm apart")
    made = []
    for row in range(rows):
        for column in range(columns):
            at = np.array(corner.xyz_mm) + column * steps[0] + row * steps[1]
            made.append(Place((float(at[0]), float(at[1]), float(at[2])), corner.axes))
    return tuple(made)
