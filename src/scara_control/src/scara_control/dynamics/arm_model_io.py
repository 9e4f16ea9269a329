"""The arm in a physics engine: its inverse dynamics with what hangs at the tool."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path

import pybullet
from scara_config import ConfigError
from scara_config.payload import Payload
from typing_extensions import Self

from scara_control.dynamics.engine_io import joint_infos, new_engine
from scara_control.dynamics.payload_links import with_payloads, without_shapes
from scara_description.urdf import without_world


class ArmModel:
    """The robot of a URDF under gravity, without time. A context manager; close it after use.

    Attributes:
        damping: Of each joint, shape ``(n,)``: [N m s/rad], prismatic [N s/m].
        friction: Dry friction of each joint, shape ``(n,)``: [N m], prismatic [N].
    """

    # Shapes take 40 ms to load, and only what may touch something needs them.
    _has_shapes = False

    def __init__(
        self,
        urdf: Path,
        joints: Sequence[str],
        tool_frame: str,
        *,
        gravity: float,
        payloads: Sequence[Payload] = (),
        dynamics: Mapping[str, tuple[float, float]] | None = None,
        beside: ArmModel | None = None,
    ) -> None:
        """Load the URDF at the zero pose.

        Args:
            urdf: File to load; its base is fixed.
            joints: Names of the movable joints, in the order of every vector below; all that the
                URDF has.
            tool_frame: Link at the end of the arm, which carries the payloads.
            gravity: [m/s^2], downwards.
            payloads: What hangs at the tool.
            dynamics: Damping and dry friction of joints by name, in place of the URDF's.
            beside: Another model, whose engine is used too, since one takes 28 MB. It has to be
                closed after this one.

        Raises:
            ConfigError: The URDF cannot be loaded or its movable joints are not ``joints``.
        """
        self._urdf, self._gravity, self.tool_frame = urdf, gravity, tool_frame
        self._names, self._dynamics = tuple(joints), dict(dynamics or {})
        # First without an engine: close() is also called for a model whose engine did not start.
        self._client, self._beside = -1, beside
        self._client = new_engine() if beside is None else beside._client
        try:
            self._build(payloads)
        # Also at Ctrl-C: the engine is freed now, and not when the traceback that holds us is gone.
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Models of payloads are dropped and never closed: a plan may use one that its listener forgets.
    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """Free the physics engine."""
        if self._client >= 0 and self._beside is None:
            pybullet.disconnect(physicsClientId=self._client)
        self._client = -1

    def carry(self, payloads: Sequence[Payload]) -> None:
        """Hang these at the tool, in place of what hangs there.

        Whoever shares the engine has to do so right after the one whose engine it is.
        """
        # A body that is only removed leaves its inverse dynamics behind, for the next one.
        if self._beside is None:
            pybullet.resetSimulation(physicsClientId=self._client)
        self._build(payloads)

    def inverse_dynamics(
        self, q: Sequence[float], qdot: Sequence[float], qddot: Sequence[float]
    ) -> Sequence[float]:
        """Return the efforts for that motion.

        They hold inertia, velocity coupling and gravity, but no damping and no friction.
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

    def _build(self, payloads: Sequence[Payload]) -> None:
        """Put the robot into the engine."""
        pybullet.setGravity(0.0, 0.0, -self._gravity, physicsClientId=self._client)
        self._load(payloads)
        self._find_joints()
        self._remove_masses()

    def _furnished(self, text: str) -> str:
        """Return the description with what else stands in this world."""
        return text

    def _load(self, payloads: Sequence[Payload]) -> None:
        client = self._client
        # Without the last flag a cylinder is a hull that is 1 mm too large all around.
        flags = (
            pybullet.URDF_USE_SELF_COLLISION
            | pybullet.URDF_USE_INERTIA_FROM_FILE
            | pybullet.URDF_USE_IMPLICIT_CYLINDER
        )
        try:
            text = self._furnished(without_world(self._urdf.read_text(encoding="utf-8")))
        except OSError as error:
            raise ConfigError(f"{self._urdf}: cannot be read: {error.strerror}") from error
        text = with_payloads(text, self.tool_frame, payloads)
        if not self._has_shapes:
            text = without_shapes(text)
        try:
            # PyBullet reads a URDF from a file only, and this text stands in none.
            with tempfile.NamedTemporaryFile("w", suffix=".urdf", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                self._body: int = pybullet.loadURDF(
                    file.name, useFixedBase=True, flags=flags, physicsClientId=client
                )
        except pybullet.error as error:
            raise ConfigError(f"{self._urdf}: cannot be loaded by PyBullet: {error}") from error
        links = ElementTree.fromstring(text).iter("link")
        self._massless = {link.get("name") for link in links if link.find("inertial") is None}
        self._infos = joint_infos(self._body, client)
        self._links = {info[12].decode(): info[0] for info in self._infos}
        if self.tool_frame not in self._links:
            raise ConfigError(f"{self._urdf}: has no link {self.tool_frame}")

    def _find_joints(self) -> None:
        """Find the joints' indices, damping and friction.

        Find their order, too, in the engine's own tree.
        """
        names, dynamics = self._names, self._dynamics
        movable = {
            info[1].decode(): info for info in self._infos if info[2] != pybullet.JOINT_FIXED
        }
        if sorted(movable) != sorted(names):
            raise ConfigError(
                f"{self._urdf}: movable joints are {', '.join(movable)}; robot.yaml moves "
                f"{', '.join(names)}"
            )
        self._joints = [movable[name][0] for name in names]
        chosen = [dynamics.get(name, (movable[name][6], movable[name][7])) for name in names]
        self.damping, self.friction = [entry[0] for entry in chosen], [entry[1] for entry in chosen]
        self._tree = sorted(range(len(names)), key=lambda k: movable[names[k]][0])
        self._order = [self._tree.index(k) for k in range(len(names))]
        self._in_order = self._tree == list(range(len(names)))

    def _remove_masses(self) -> None:
        """Take away the 1 kg that PyBullet gives to a link without mass."""
        for info in self._infos:
            if info[12].decode() in self._massless:
                # A call of its own: together with a damping the mass is ignored.
                pybullet.changeDynamics(
                    self._body,
                    info[0],
                    mass=0.0,
                    localInertiaDiagonal=[0.0, 0.0, 0.0],
                    physicsClientId=self._client,
                )
