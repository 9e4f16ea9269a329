"""A vehicle docked beside the robot: where it stands, and what its dock's sensor says of it."""

from __future__ import annotations

import math

import msgspec
import numpy as np
from scara_config.palletise import MM, Dock, Palletise
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.values import POSE_NUMBERS, Pose

DOCKED = "DI[1]"
"""On while a vehicle is docked [our]."""


class Docked(msgspec.Struct, frozen=True):
    """A vehicle beside the robot.

    Attributes:
        dock: Where it truly stands; the robot does not know.
        register: The user frame that the dock's sensor sets.
        frame: What it sets there: origin at the first mark, x towards the second, level.
    """

    dock: Dock
    register: Indexed
    frame: Pose


def dock(work: Palletise, chance: np.random.Generator) -> Docked | None:
    """Return a vehicle that has just docked, and was seen; None if the cell has no vehicle.

    Args:
        work: palletise.yaml.
        chance: Draws how far it is off, and how far its marks are seen off.
    """
    vehicle = work.vehicle
    if vehicle is None:
        return None
    stands = vehicle.dock(chance.uniform(-1.0, 1.0, 3).tolist())
    (x, y), (along_x, along_y), _ = vehicle.seen(stands, chance.standard_normal(6).tolist())
    turn = math.degrees(math.atan2(along_y - y, along_x - x))
    values = (x / MM, y / MM, work.pallet.top_mm, 0.0, 0.0, turn)
    frame = Pose((*values, *(0.0,) * (POSE_NUMBERS - len(values))), "")
    return Docked(stands, Indexed("UFRAME", (float(vehicle.frame),)), frame)


def docked_text(docked: Docked) -> str:
    """Return what the dock's sensor says, in words."""
    x, y, _, _, _, turn = docked.frame.values[:6]
    number = int(float(docked.register.index[0]))  # type: ignore[arg-type]
    return f"docked: UFRAME[{number}] is X {x:.2f} mm, Y {y:.2f} mm, R {turn:.3f} deg"
