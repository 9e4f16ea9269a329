"""Sees what the arm and a held part touch, and reports each collision once."""

from __future__ import annotations

from collections.abc import Collection

import pybullet
from scara_config.palletise import Watch

from scara_msgs.msg import PartEvent
from scara_simulation.handling.ledger import Happening
from scara_simulation.handling.part_bodies_io import PartBodies
from scara_simulation.handling.touch import ContactKind, Touch, is_collision, is_told

AGAIN_S = 0.2
"""The same two things touch anew after being apart so long [s]. Our choice."""


class TouchWatch:
    """Looks at all contacts of the arm and of what it holds.

    Args:
        client: The engine's client.
        cell: The engine's body of the cell.
        links: Its links by name.
        arm: The arm's links.
        tool: Name of the link that may stand on parts.
        rests: Names of the links on which parts may lie.
        bodies: The parts.
        watch: What counts as a collision.
        dt: Time step [s].
    """

    def __init__(
        self,
        client: int,
        cell: int,
        links: dict[str, int],
        arm: Collection[int],
        tool: str,
        rests: Collection[str],
        bodies: PartBodies,
        watch: Watch,
        dt: float,
    ) -> None:
        self._client, self._cell, self._bodies, self._watch, self._dt = (
            client,
            cell,
            bodies,
            watch,
            dt,
        )
        # To PyBullet the base is link -1.
        self._links = {-1: (ContactKind.CELL, "base_link")}
        for name, index in links.items():
            kind = (
                ContactKind.NOZZLE
                if name == tool
                else ContactKind.ARM
                if index in arm
                else ContactKind.REST
                if name in rests
                else ContactKind.CELL
            )
            self._links[index] = (kind, name)
        self._touched: dict[tuple[str, str], int] = {}
        # When two things that count touched last, whether that was a collision or not.
        self._told: dict[tuple[str, str], int] = {}

    def reset(self) -> None:
        """Forget what was touched."""
        self._touched, self._told = {}, {}

    def text(self, step: int) -> str:
        """Say what the arm and what it holds touch now; empty: nothing."""
        near = AGAIN_S / self._dt
        pairs = sorted(pair for pair, last in self._told.items() if step - last < near)
        return ", ".join(f"{first} touches {second}" for first, second in pairs)

    def collisions(self, held: str, step: int) -> list[Happening]:
        """Return what has collided in this step and was apart before.

        ``held`` is the part at the nozzle, if any.
        """
        contacts = pybullet.getContactPoints(bodyA=self._cell, physicsClientId=self._client)
        if held:
            body = next(part.body for part in self._bodies.parts if part.name == held)
            contacts = [
                *contacts,
                *pybullet.getContactPoints(bodyA=body, physicsClientId=self._client),
            ]
        found = []
        for contact in contacts:
            if contact[9] < self._watch.touch_n:
                continue
            first, second = (
                self._who(contact[1], contact[3], held),
                self._who(contact[2], contact[4], held),
            )
            touch = Touch(
                (first[0], second[0]), (first[1], second[1]), abs(contact[7][2]), contact[9]
            )
            if is_told(touch, self._watch.touch_n):
                first_name, second_name = touch.names
                self._told[first_name, second_name] = step
            if is_collision(touch, self._watch.touch_n, self._watch.press_n):
                # Told anew only once the two have been apart for a while.
                pair = min(touch.names), max(touch.names)
                last, self._touched[pair] = self._touched.get(pair), step
                if last is None or (step - last) * self._dt >= AGAIN_S:
                    found.append(_collision(touch, contact[5]))
        return found

    def _who(self, body: int, link: int, held: str) -> tuple[ContactKind, str]:
        """Return what kind of thing touches, and its name."""
        part = self._bodies.by_body.get(body)
        if part is not None:
            return (ContactKind.HELD if part.name == held else ContactKind.PART), part.name
        return self._links[link]


def _collision(touch: Touch, where: tuple[float, float, float]) -> Happening:
    part = next(
        (
            name
            for name, kind in zip(touch.names, touch.kinds)
            if kind in (ContactKind.HELD, ContactKind.PART)
        ),
        "",
    )
    other = next((name for name in touch.names if name != part), "")
    text = f"{touch.names[0]} hit {touch.names[1]} with {touch.force:.1f} N"
    return Happening(PartEvent.COLLISION, part, other, text, where)
