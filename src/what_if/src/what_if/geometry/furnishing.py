"""The bodies of a world: what the description tells, parts, obstacles, people, zones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from what_if.geometry.bodies import Body, Kind, box_between, upright
from what_if.geometry.distances import ERROR
from what_if.geometry.scene import Press, Scene
from what_if.handling import MM, part_bodies
from what_if.world import Part, World


def furnished(world: World, parts: Sequence[Part]) -> Scene:
    """Return the cell with everything that stands in it.

    Args:
        world: The world.
        parts: Where the parts are by now, instead of the world's.
    """
    cell = world.cell
    root, tool, config = cell.tree.links[0], cell.robot.tool_frame, cell.config
    bodies: list[Body] = list(cell.bodies)
    press = Press()
    if cell.work is not None:
        bodies += part_bodies(cell.work, tool, parts)
        # What is nearer than this counts as a hit, so what is allowed begins that far away.
        room = config.nearer_mm * MM + ERROR
        gripper = cell.work.gripper
        press = Press(
            gripper.offset_mm * MM + room, cell.work.give + room, config.lay_mm * MM + room
        )
    for thing in world.obstacles:
        bodies.append(
            upright(thing.name, Kind.OBSTACLE, root, thing.shape, thing.size, thing.middle)
        )
    floor, height = cell.floor, config.person_height_mm * MM
    if cell.work is None:
        # What stands below the base need not be their floor: on the base's they are as tall.
        height -= floor
    size = (config.person_radius_mm * MM, height)
    # Heights do not count: whatever part of a person was seen, the person stands on the floor.
    for number, (x, y, _) in enumerate(world.people, 1):
        middle = (x, y, floor + 0.5 * height)
        bodies.append(upright(f"person {number}", Kind.PERSON, root, "cylinder", size, middle))
    for zone in world.zones:
        low, high = (np.array(corner) * MM for corner in (zone.lower_mm, zone.upper_mm))
        bodies.append(box_between(zone.name, Kind.ZONE, root, low, high))
    return Scene(cell.tree, bodies, press)
