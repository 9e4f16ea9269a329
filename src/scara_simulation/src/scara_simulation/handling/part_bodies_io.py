"""The parts as rigid bodies, which sleep while nothing is near.

A sleeping part costs the engine nothing: it is taken out of the physics and keeps its place on the
link that it lies on, as dry friction holds it there. What would move it wakes it first: the tool
coming near, or a table that turns harder than friction can hold.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import pybullet
from scara_config.palletise import Palletise

from scara_simulation.handling.ledger import PartView

Vector = tuple[float, float, float]
Pose = tuple[Vector, tuple[float, float, float, float]]
RESTING_SPEED = 0.003
"""Slower than this against its support [m/s] a part is at rest. Our choice."""
RESTING_TURN = 0.2
"""The same for turning [rad/s]."""
_SHELF = 10.0
"""Sleeping bodies wait so far apart [m], where nothing touches them: PyBullet cannot restore a
world in which a body was taken out of the collisions and put back."""
_UPRIGHT: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class LoosePart:
    """One part: awake it is the engine's, asleep it lies at ``place`` on the link ``support``."""

    def __init__(self, name: str, body: int, support: str, place: Pose) -> None:
        self.name, self.body = name, body
        self.start = support, place
        self.support, self.place = support, place
        self.asleep = True
        self.centre = place[0]
        self.still_for = 0.0


class PartBodies:
    """All parts of the work in one world of the engine.

    Args:
        client: The engine's client.
        cell: The engine's body of the cell.
        links: Its links by name.
        work: palletise.yaml.
    """

    def __init__(self, client: int, cell: int, links: dict[str, int], work: Palletise) -> None:
        self._client, self._cell, self._links = client, cell, links
        self._names = {index: name for name, index in links.items()}
        self._kind = work.parts
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=work.parts.radius,
            height=work.parts.height,
            physicsClientId=client,
        )
        self.parts = [
            self._create(shape, start.name, start.stand, (start.x, start.y, start.z))
            for start in work.starts()
        ]
        # Contacts name bodies by the engine's numbers.
        self.by_body = {part.body: part for part in self.parts}

    def _create(self, shape: int, name: str, stand: str, underside: Vector) -> LoosePart:
        x, y, z = underside
        centre = (x, y, z + 0.5 * self._kind.height)
        body: int = pybullet.createMultiBody(
            self._kind.mass_kg,
            shape,
            -1,
            centre,
            useMaximalCoordinates=1,
            physicsClientId=self._client,
        )
        pybullet.changeDynamics(
            body,
            -1,
            lateralFriction=self._kind.friction,
            linearDamping=0.0,
            angularDamping=0.0,
            frictionAnchor=1,  # without it a part at rest creeps by 0.02 mm a second
            physicsClientId=self._client,
        )
        part = LoosePart(name, body, stand, self._relative(stand, (centre, _UPRIGHT)))
        self.put_to_sleep(part)
        return part

    def reset(self) -> None:
        """Put all parts back where they were created, asleep."""
        for part in self.parts:
            if not part.asleep:
                self.put_to_sleep(part)
            part.support, part.place = part.start

    def pose(self, part: LoosePart) -> Pose:
        """Return the pose of a part's middle in the world."""
        if part.asleep:
            pose: Pose = pybullet.multiplyTransforms(*self.link_pose(part.support), *part.place)
            return pose
        found: Pose = pybullet.getBasePositionAndOrientation(part.body, self._client)
        return found

    def link_pose(self, link: str) -> Pose:
        """Return the pose of a link's frame."""
        state = pybullet.getLinkState(
            self._cell,
            self._links[link],
            computeForwardKinematics=True,
            physicsClientId=self._client,
        )
        return state[4], state[5]

    def wake(self, part: LoosePart) -> None:
        """Give a part back to the engine, moving as its support does."""
        if not part.asleep:
            return
        pose = self.pose(part)
        # It goes along with what it lay on: from rest it would slip off a turning table.
        velocity, turn = self._support_motion(part.support, pose[0])
        part.asleep, part.still_for = False, 0.0
        self._switch(
            part,
            pose,
            pybullet.ACTIVATION_STATE_WAKE_UP | pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        )
        pybullet.resetBaseVelocity(part.body, velocity, turn, physicsClientId=self._client)

    def lay(self, part: LoosePart, link: str, place: Pose) -> None:
        """Put a part on a link, asleep; ``place`` is that of its middle in the link's frame."""
        part.support, part.place = link, place
        self.put_to_sleep(part)

    def put_to_sleep(self, part: LoosePart) -> None:
        """Take a part out of the physics; it stays where it is on its support."""
        part.asleep, part.still_for = True, 0.0
        shelf = (part.body * _SHELF, 0.0, -100.0 * _SHELF)
        self._switch(
            part,
            (shelf, _UPRIGHT),
            pybullet.ACTIVATION_STATE_SLEEP | pybullet.ACTIVATION_STATE_DISABLE_WAKEUP,
        )

    def settle(self, part: LoosePart) -> bool:
        """Find what an awake part lies on; return whether it does not move against it."""
        # The name of what pushes a part up hardest, a link or another part. Empty: nothing.
        link, most = "", 0.0
        # Of a contact: 2 the other body, 4 its link, 7 the normal towards this one, 9 the force
        # [N].
        for contact in pybullet.getContactPoints(bodyA=part.body, physicsClientId=self._client):
            if contact[7][2] * contact[9] > most:
                most, other = contact[7][2] * contact[9], self.by_body.get(contact[2])
                link = other.name if other else self._names.get(contact[4], "")
        part.support = link
        if not link or link not in self._links:
            return False
        pose = self.pose(part)
        part.place = self._relative(link, pose)
        velocity, turn = pybullet.getBaseVelocity(part.body, self._client)
        under, under_turn = self._support_motion(link, pose[0])
        slip: float = max(abs(a - b) for a, b in zip(velocity, under))
        twist: float = max(abs(a - b) for a, b in zip(turn, under_turn))
        return slip < RESTING_SPEED and twist < RESTING_TURN

    def view(self, part: LoosePart, *, held: bool, resting: bool) -> PartView:
        """Return a part as the ledger wants to see it."""
        position, orientation = self.pose(part)
        # The third column of the rotation: where the part's own z points.
        axis = pybullet.getMatrixFromQuaternion(orientation)[2::3]
        half = 0.5 * self._kind.height
        underside = (
            position[0] - half * axis[0],
            position[1] - half * axis[1],
            position[2] - half * axis[2],
        )
        return PartView(part.name, underside, axis[2], resting, held, part.support)

    def _switch(self, part: LoosePart, pose: Pose, state: int) -> None:
        """Put a body there at rest, and let the engine move it or not."""
        pybullet.resetBasePositionAndOrientation(part.body, *pose, physicsClientId=self._client)
        pybullet.changeDynamics(part.body, -1, activationState=state, physicsClientId=self._client)

    def _relative(self, link: str, pose: Pose) -> Pose:
        found: Pose = pybullet.multiplyTransforms(
            *pybullet.invertTransform(*self.link_pose(link)), *pose
        )
        return found

    def _support_motion(self, link: str, at: Vector) -> tuple[Vector, Vector]:
        """Return the velocity of a link at a point, and its turning."""
        state = pybullet.getLinkState(
            self._cell, self._links[link], computeLinkVelocity=True, physicsClientId=self._client
        )
        (vx, vy, vz), turn = state[6], state[7]
        # The engine tells a link's velocity at its centre of mass.
        rx, ry, rz = (a - b for a, b in zip(at, state[0]))
        wx, wy, wz = turn
        return (vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx), turn


class PartShown(msgspec.Struct, frozen=True):
    """A part for the world outside: pose of its middle."""

    name: str
    position: Vector
    orientation: tuple[float, float, float, float]
    held: bool
    support: str


def shown(bodies: PartBodies, held: str) -> Sequence[PartShown]:
    """Return all parts where they are now."""
    return [
        PartShown(part.name, *bodies.pose(part), part.name == held, part.support)
        for part in bodies.parts
    ]
