"""The suction as a constraint between tool and part."""

from __future__ import annotations

import math

import pybullet

from scara_simulation.handling.part_bodies_io import LoosePart, PartBodies

TORN = 0.002
"""A held part that has been pulled so far off its grip [m] is torn off. Our choice."""


class PartGrip:
    """Holds at most one part.

    Args:
        client: The engine's client.
        cell: The engine's body of the cell.
        tool: Its link that grips.
        bodies: The parts.
        force: What the suction holds [N].
        stiffness: Of the bellows [N/m].
        mass: Of a part [kg].
    """

    def __init__(
        self,
        client: int,
        cell: int,
        tool: int,
        bodies: PartBodies,
        force: float,
        stiffness: float,
        mass: float,
    ) -> None:
        self._client, self._cell, self._tool, self._bodies, self._force = (
            client,
            cell,
            tool,
            bodies,
            force,
        )
        self._constraint = -1
        self._place = (0.0, 0.0, 0.0)
        pybullet.changeDynamics(
            cell,
            tool,
            contactStiffness=stiffness,
            contactDamping=2.0 * math.sqrt(stiffness * mass),  # aperiodic with a part on it
            physicsClientId=client,
        )

    def hold(self, part: LoosePart) -> None:
        """Tie a part to the tool as it is now."""
        self._place, orientation = self._relative(part)
        self._constraint = pybullet.createConstraint(
            self._cell,
            self._tool,
            part.body,
            -1,
            pybullet.JOINT_FIXED,
            [0.0, 0.0, 0.0],
            self._place,
            [0.0, 0.0, 0.0],
            orientation,
            [0.0, 0.0, 0.0, 1.0],
            physicsClientId=self._client,
        )
        # What pulls harder moves the part off its grip, until it counts as torn.
        pybullet.changeConstraint(
            self._constraint, maxForce=self._force, physicsClientId=self._client
        )

    def let_go(self) -> None:
        """Untie the part, if there is one."""
        if self._constraint >= 0:
            pybullet.removeConstraint(self._constraint, physicsClientId=self._client)
            self._constraint = -1

    def is_torn(self, part: LoosePart) -> bool:
        """Tell whether the held part was pulled off its grip.

        Pushed up, it only compresses the bellows.
        """
        dx, dy, dz = (now - then for now, then in zip(self._relative(part)[0], self._place))
        return math.hypot(dx, dy, max(dz, 0.0)) > TORN  # the tool's z points down

    def _relative(
        self, part: LoosePart
    ) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
        """Return the pose of a part's middle in the tool's inertial frame.

        Constraints refer to that frame.
        """
        state = pybullet.getLinkState(
            self._cell, self._tool, computeForwardKinematics=True, physicsClientId=self._client
        )
        pose = pybullet.multiplyTransforms(
            *pybullet.invertTransform(state[0], state[1]), *self._bodies.pose(part)
        )
        return pose[0], pose[1]
