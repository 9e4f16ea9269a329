"""What the twin's controller knows of the arm: its dynamics with the payload that it was told."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from scara_config import Robot
from scara_config.payload import Payload
from scara_control.dynamics.arm_model_io import ArmModel
from scara_control.dynamics.effort import load_of, unplanned_shares
from typing_extensions import Self

from scara_simulation.config import SimulationConfig


class ToldDynamics:
    """Inverse dynamics for the feed-forward, whatever truly hangs at the simulated tool.

    A gripped part counts by itself while it is held. A context manager; close it after use.
    """

    def __init__(
        self,
        robot: Robot,
        config: SimulationConfig,
        payload: Payload,
        part: Payload | None = None,
        holding: Callable[[], bool] = lambda: False,
    ) -> None:
        """Begin with a payload.

        Args:
            robot: robot.yaml.
            config: simulation.yaml; its masses may be wrong on purpose.
            payload: What the controller is told.
            part: What counts beside it while a part is held.
            holding: Whether a part is held now; asked in each step.

        Raises:
            ConfigError: The URDF cannot be loaded.
        """
        self._robot, self._factor = robot, config.model_mass_factor
        self._part, self._holding = part, holding
        self._empty = _is_empty(payload, part)
        # Both are ready beforehand, since a grip must not cost time in the loop.
        self._models: list[ArmModel] = []
        for carried in self._loads(payload):
            model = ArmModel(
                robot.description,
                [joint.name for joint in robot.twin_joints],
                robot.tool_frame,
                gravity=config.gravity_m_s2,
                payloads=carried,
                dynamics=config.dynamics,
                beside=self._models[0] if self._models else None,
            )
            self._models.append(model)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # The second one lives in the engine of the first.
        for model in reversed(self._models):
            model.close()

    def tell(self, payload: Payload) -> None:
        """Reckon with another payload from now on."""
        self._empty = _is_empty(payload, self._part)
        for model, carried in zip(self._models, self._loads(payload)):
            model.carry(carried)

    def unplanned_shares(self, effort_percent: float) -> tuple[float, ...]:
        """Return the share of its acceleration that each joint may have in unplanned motion.

        With a part, which may be gripped at any time. For an empty tool robot.yaml's limits are
        made.
        """
        if self._empty:
            return (1.0,) * len(self._robot.twin_joints)
        joints = self._robot.twin_joints
        return unplanned_shares(load_of(self._models[-1], joints, effort_percent), joints)

    def __call__(
        self, q: Sequence[float], qdot: Sequence[float], qddot: Sequence[float]
    ) -> Sequence[float]:
        """Return the efforts of inertia, velocity coupling and gravity."""
        model = self._models[-1] if self._holding() else self._models[0]
        efforts = model.inverse_dynamics(q, qdot, qddot)
        return efforts if self._factor == 1.0 else [self._factor * effort for effort in efforts]

    def _loads(self, payload: Payload) -> list[list[Payload]]:
        return [[payload], [payload, self._part]] if self._part else [[payload]]


def _is_empty(payload: Payload, part: Payload | None) -> bool:
    return payload.mass_kg == 0.0 and part is None
