"""The twin's physics: PyBullet without a window, torque control, a fixed time step.

The same inputs give bitwise the same states, in every process on the same machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pybullet
from scara_config.payload import Payload
from scara_control.dynamics.arm_model_io import ArmModel

State = tuple[list[float], list[float]]


class World(ArmModel):
    """The cell of a URDF under gravity. A context manager; close it to free the physics engine."""

    _has_shapes = True

    def __init__(
        self,
        urdf: Path,
        joints: Sequence[str],
        tool_frame: str,
        *,
        dt: float,
        gravity: float,
        dynamics: Mapping[str, tuple[float, float]] | None = None,
        mounted: Payload | None = None,
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
            mounted: What truly hangs at the tool, whatever the controller is told; None: nothing.

        Raises:
            ConfigError: The URDF cannot be loaded or its movable joints are not ``joints``.
        """
        self._dt = dt
        super().__init__(
            urdf,
            joints,
            tool_frame,
            gravity=gravity,
            payloads=[mounted] if mounted else [],
            dynamics=dynamics,
        )

    def mount(self, payload: Payload) -> None:
        """Hang another payload at the tool; the joints stay where they are, at rest.

        All else in the world begins anew.
        """
        positions = self.read()[0]
        self.carry([payload])
        self.reset(positions)

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
        # Contacts and what the engine keeps from step to step would make the same inputs end
        # otherwise.
        pybullet.restoreState(stateId=self._fresh, physicsClientId=self._client)
        for index, q, qdot in zip(
            self._joints, positions, velocities or [0.0] * len(self._joints), strict=True
        ):
            pybullet.resetJointState(self._body, index, q, qdot, physicsClientId=self._client)

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

    def _build(self, payloads: Sequence[Payload]) -> None:
        pybullet.setTimeStep(self._dt, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, numSubSteps=1, physicsClientId=self._client
        )
        super()._build(payloads)
        self._prepare_dynamics()
        self._prepare_collisions()
        self._furnish()
        self._fresh: int = pybullet.saveState(physicsClientId=self._client)

    def _prepare_dynamics(self) -> None:
        """Remove what PyBullet adds of its own.

        Turn its default motors into the URDF's dry friction.
        """
        for index in range(-1, len(self._infos)):
            pybullet.changeDynamics(
                self._body,
                index,
                linearDamping=0.0,
                angularDamping=0.0,
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

    def _prepare_collisions(self) -> None:
        """Let only the arm's moving links and what stands around it collide."""
        arm: set[int] = set()
        index = self._links[self.tool_frame]
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
