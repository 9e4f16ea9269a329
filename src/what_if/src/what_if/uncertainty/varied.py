"""A world in which what is not exactly known is otherwise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import msgspec
from scara_config.payload import Payload
from scara_control.dynamics.effort import DynamicModel

from scara_description.urdf import Model as Description
from what_if.geometry.bodies import FloatArray
from what_if.uncertainty.spreads import Spread
from what_if.world import Cell, Lag, Part, World

MM = 1e-3
LEAST_SHARE = 0.05
"""No mass, friction or acceleration becomes smaller than this share of what it was; our choice."""


@dataclass(frozen=True)
class Heavier:
    """An arm whose masses and frictions are all otherwise by the same share.

    Efforts of inertia, velocity coupling and gravity are in proportion to the masses.

    Attributes:
        arm: As it was told.
        mass: Share of all masses.
        resisting: Share of damping and dry friction.
    """

    arm: DynamicModel
    mass: float
    resisting: float

    @property
    def damping(self) -> Sequence[float]:
        """Damping of each joint, shape (n,)."""
        return [self.resisting * value for value in self.arm.damping]

    @property
    def friction(self) -> Sequence[float]:
        """Dry friction of each joint, shape (n,)."""
        return [self.resisting * value for value in self.arm.friction]

    def inverse_dynamics(
        self, q: Sequence[float], qdot: Sequence[float], qddot: Sequence[float]
    ) -> Sequence[float]:
        """Return the efforts of inertia, velocity coupling and gravity."""
        return [self.mass * effort for effort in self.arm.inverse_dynamics(q, qdot, qddot)]

    def mass_matrix(self, q: Sequence[float]) -> list[list[float]]:
        """Return the joint-space inertia, shape (n, n)."""
        return [[self.mass * value for value in row] for row in self.arm.mass_matrix(q)]


def varied(world: World, spreads: Sequence[Spread], row: Sequence[float]) -> World:
    """Return a world with other numbers; only bodies that truly touch hit each other in it.

    Its payload is as it was: who has its dynamics puts in what :func:`payload_of` says.

    Args:
        world: As it is believed to be.
        spreads: What is otherwise.
        row: By how much, as :func:`what_if.uncertainty.spreads.drawn` returns it.
    """
    by = _Row(spreads, row)
    cell, work = world.cell, world.cell.work
    description = cell.description
    if work is not None:
        stand = next(iter(work.table.stands_mm))
        # The first joint from the root on carries all of the table, or of the pallet.
        table, pallet = description.chain(stand)[0].name, description.chain("pallet")[0].name
        turn = math.radians(by.one("table_turn_deg"))
        description = _moved(description, table, by.two("table_mm"), turn)
        description = _moved(description, pallet, by.two("pallet_mm"), 0.0)
    law = cell.config.program
    law = msgspec.structs.replace(
        law,
        acceleration_percent=law.acceleration_percent * by.share("acceleration_percent"),
        fine_ms=max(0.0, law.fine_ms + by.one("fine_ms")),
        fine_spread_ms=0.0,
    )
    config = msgspec.structs.replace(cell.config, nearer_mm=0.0, program=law)
    people = []
    for x, y, z in world.people:
        aside_x, aside_y = by.two("person_mm")
        people.append((x + MM * aside_x, y + MM * aside_y, z))
    mass, resisting = (by.share(name) for name in ("mass_percent", "friction_percent"))
    return replace(
        world,
        cell=replace(cell, description=description, config=config),
        # The lag is drawn here, like the rest at FINE: nothing of them is left to spread.
        lag=Lag(max(0.0, world.lag.mean + MM * by.one("lag_ms")), 0.0, world.lag.measured),
        models={held: Heavier(arm, mass, resisting) for held, arm in world.models.items()},
        parts=tuple(_aside(cell, part, by.two("part_mm")) for part in world.parts),
        people=tuple(people),
    )


def payload_of(world: World, spreads: Sequence[Spread], row: Sequence[float]) -> Payload | None:
    """Return the payload of such a world: all of its mass more or less; None if it has none."""
    if world.payload is None or not world.payload.mass_kg:
        return world.payload
    share = _Row(spreads, row).share("payload_percent")
    xx, yy, zz = world.payload.inertia_kg_m2
    return msgspec.structs.replace(
        world.payload,
        mass_kg=share * world.payload.mass_kg,
        inertia_kg_m2=(share * xx, share * yy, share * zz),
    )


class _Row:
    """Gives out the numbers of a row by their spreads; what is exactly known is 0."""

    def __init__(self, spreads: Sequence[Spread], row: Sequence[float]) -> None:
        self._left: dict[str, Iterator[float]] = {}
        begin = 0
        for spread in spreads:
            self._left[spread.key] = iter(row[begin : begin + spread.count])
            begin += spread.count

    def one(self, key: str) -> float:
        """Return the next number of a spread."""
        return float(next(self._left.get(key, iter(())), 0.0))

    def two(self, key: str) -> tuple[float, float]:
        """Return the next two."""
        return self.one(key), self.one(key)

    def share(self, key: str) -> float:
        """Return a number in percent as a share of what it was."""
        return max(LEAST_SHARE, 1.0 + self.one(key) / 100.0)


def _moved(
    description: Description, joint: str, aside: tuple[float, float], turn: float
) -> Description:
    """Return a description in which a link of the root stands elsewhere [mm], turned [rad]."""
    joints = []
    for frame in description.joints:
        if frame.name == joint:
            (x, y, z), (roll, pitch, yaw) = frame.xyz, frame.rpy
            xyz = (x + MM * aside[0], y + MM * aside[1], z)
            frame = replace(frame, xyz=xyz, rpy=(roll, pitch, yaw + turn))
        joints.append(frame)
    return replace(description, joints=tuple(joints))


def _aside(cell: Cell, part: Part, aside: tuple[float, float]) -> Part:
    """Return a part that lies elsewhere on what carries it [mm]; one in hand does not."""
    if part.link == cell.robot.tool_frame:
        return part
    pose: FloatArray = part.pose.copy()
    pose[:2, 3] += MM * aside[0], MM * aside[1]
    return replace(part, pose=pose)
