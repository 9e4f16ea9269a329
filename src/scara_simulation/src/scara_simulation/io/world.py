"""The twin's physics: PyBullet without a window, torque control, a fixed time step.

The same inputs give bitwise the same states, in every process on the same machine.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pybullet
from scara_config import ConfigError
from typing_extensions import Self

State = tuple[list[float], list[float]]


class World:
    """The cell of a URDF under gravity. A context manager; close it to free the physics engine."""

    def __init__(
        self,
        urdf: Path,
        joints: Sequence[str],
        tool_frame: str,
        *,
        dt: float,
        gravity: float,
        dynamics: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        """Load the URDF at the zero pose.

        Args:
            urdf: File to load; its base is fixed.
            joints: Names of the movable joints, in the order of every vector below; all that the
                URDF has.
            tool_frame: Link at the end of the arm; what is not on its chain is what the arm may
                hit.
            dt: Time step [s].
            gravity: [m/s^2], downwards.
            dynamics: Damping and dry friction of joints by name, in place of the URDF's.

        Raises:
            ConfigError: The URDF cannot be loaded or its movable joints are not ``joints``.
        """
        self._urdf, self._dt, self._gravity = urdf, dt, gravity
        self._client: int = pybullet.connect(pybullet.DIRECT)
        try:
            self._load()
            self._find_joints(joints, dynamics or {})
            self._prepare_dynamics()
            self._prepare_collisions(tool_frame)
            self._furnish()
            self._fresh: int = pybullet.saveState(physicsClientId=self._client)
        except BaseException:
            self.close()
            raise
        self.tool_frame = tool_frame

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the physics engine."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def read(self) -> State:
        """Return positions and velocities.

        The velocity is that of the middle of the last step (semi-implicit Euler).
        """
        states = pybullet.getJointStates(self._body, self._joints, self._client)
        return [s[0] for s in states], [s[1] for s in states]

    def step(self, efforts: Sequence[float]) -> None:
        """Advance by one time step under ``efforts`` [N m] or [N], constant over the step."""
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.TORQUE_CONTROL,
            forces=efforts,
            physicsClientId=self._client,
        )
        pybullet.stepSimulation(self._client)

    def reset(self, positions: Sequence[float], velocities: Sequence[float] | None = None) -> None:
        """Put the joints there (at rest unless ``velocities``) and forget all contacts."""
        pybullet.restoreState(stateId=self._fresh, physicsClientId=self._client)
        for index, q, qdot in zip(
            self._joints, positions, velocities or [0.0] * len(self._joints), strict=True
        ):
            pybullet.resetJointState(self._body, index, q, qdot, physicsClientId=self._client)

    def inverse_dynamics(
        self, q: Sequence[float], qdot: Sequence[float], qddot: Sequence[float]
    ) -> Sequence[float]:
        """Return the efforts for that motion.

        Inertia, velocity coupling and gravity, without damping and friction.
        """
        if self._in_order:
            # By name: the fifth place is that of the flags.
            in_order: Sequence[float] = pybullet.calculateInverseDynamics(
                self._body, q, qdot, qddot, physicsClientId=self._client
            )
            return in_order
        efforts: Sequence[float] = pybullet.calculateInverseDynamics(
            self._body,
            [q[k] for k in self._tree],
            [qdot[k] for k in self._tree],
            [qddot[k] for k in self._tree],
            physicsClientId=self._client,
        )
        return [efforts[k] for k in self._order]

    def mass_matrix(self, q: Sequence[float]) -> list[list[float]]:
        """Return the joint-space inertia at ``q``, shape (n, n): [kg m^2], prismatic [kg]."""
        rows = pybullet.calculateMassMatrix(
            self._body, [q[k] for k in self._tree], physicsClientId=self._client
        )
        return [[rows[row][column] for column in self._order] for row in self._order]

    def link_position(self, link: str) -> tuple[float, float, float]:
        """Return the origin of a link's frame in the world [m]."""
        state = pybullet.getLinkState(
            self._body,
            self._links[link],
            computeForwardKinematics=True,
            physicsClientId=self._client,
        )
        x, y, z = state[4]
        return x, y, z

    def contacts(self) -> int:
        """Return how many contact points the arm has with what stands around it."""
        return len(pybullet.getContactPoints(bodyA=self._body, physicsClientId=self._client))

    def _load(self) -> None:
        client = self._client
        pybullet.setTimeStep(self._dt, physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -self._gravity, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, numSubSteps=1, physicsClientId=client
        )
        # Without the last flag a cylinder is a hull that is 1 mm too large all around.
        flags = (
            pybullet.URDF_USE_SELF_COLLISION
            | pybullet.URDF_USE_INERTIA_FROM_FILE
            | pybullet.URDF_USE_IMPLICIT_CYLINDER
        )
        try:
            self._body: int = pybullet.loadURDF(
                str(self._urdf), useFixedBase=True, flags=flags, physicsClientId=client
            )
        except pybullet.error as error:
            raise ConfigError(f"{self._urdf}: cannot be loaded by PyBullet: {error}") from error
        count = pybullet.getNumJoints(self._body, physicsClientId=client)
        self._infos: list[Any] = [
            pybullet.getJointInfo(self._body, k, physicsClientId=client) for k in range(count)
        ]
        self._links = {info[12].decode(): info[0] for info in self._infos}

    def _find_joints(
        self, joints: Sequence[str], dynamics: Mapping[str, tuple[float, float]]
    ) -> None:
        """Find the joints' indices, damping and friction.

        Find their order, too, in the engine's own tree.
        """
        movable = {
            info[1].decode(): info for info in self._infos if info[2] != pybullet.JOINT_FIXED
        }
        if sorted(movable) != sorted(joints):
            raise ConfigError(
                f"{self._urdf}: movable joints are {', '.join(movable)}; robot.yaml moves "
                f"{', '.join(joints)}"
            )
        self._joints = [movable[name][0] for name in joints]
        chosen = [dynamics.get(name, (movable[name][6], movable[name][7])) for name in joints]
        self.damping, self.friction = [entry[0] for entry in chosen], [entry[1] for entry in chosen]
        self._tree = sorted(range(len(joints)), key=lambda k: movable[joints[k]][0])
        self._order = [self._tree.index(k) for k in range(len(joints))]
        self._in_order = self._tree == list(range(len(joints)))

    def _prepare_dynamics(self) -> None:
        """Remove what PyBullet adds of its own.

        Turn its default motors into the URDF's dry friction.
        """
        massless = _links_without_inertia(self._urdf)
        for index in range(-1, len(self._infos)):
            pybullet.changeDynamics(
                self._body,
                index,
                linearDamping=0.0,
                angularDamping=0.0,
                physicsClientId=self._client,
            )
            if index >= 0 and self._infos[index][12].decode() in massless:
                # PyBullet makes such a link 1 kg. A call of its own: together with a damping the
                # mass is ignored.
                pybullet.changeDynamics(
                    self._body,
                    index,
                    mass=0.0,
                    localInertiaDiagonal=[0.0, 0.0, 0.0],
                    physicsClientId=self._client,
                )
        for index, damping in zip(self._joints, self.damping):
            pybullet.changeDynamics(
                self._body, index, jointDamping=damping, physicsClientId=self._client
            )
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[0.0] * len(self._joints),
            forces=self.friction,
            physicsClientId=self._client,
        )

    def _prepare_collisions(self, tool_frame: str) -> None:
        """Let only the arm's moving links and what stands around it collide."""
        if tool_frame not in self._links:
            raise ConfigError(f"{self._urdf}: has no link {tool_frame}")
        arm: set[int] = set()
        index = self._links[tool_frame]
        while index >= 0:
            arm.add(index)
            index = self._infos[index][16]
        for first in range(-1, len(self._infos)):
            for second in range(first + 1, len(self._infos)):
                collide = first >= 0 and (first in arm) != (second in arm)
                pybullet.setCollisionFilterPair(
                    self._body,
                    self._body,
                    first,
                    second,
                    int(collide),
                    physicsClientId=self._client,
                )
        self._arm = frozenset(arm)

    def _furnish(self) -> None:
        """Add what else is in the world; here nothing."""


def _links_without_inertia(urdf: Path) -> set[str]:
    """Return the links that a URDF gives no mass."""
    return {
        link.get("name", "")
        for link in ElementTree.parse(urdf).getroot().iter("link")
        if link.find("inertial") is None
    }
