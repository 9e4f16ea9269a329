"""What simulation.yaml and pid_gains.yaml may hold, checked against the robot."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Joint, Robot, load, locate
from scara_config.quantities import (
    PhysicsRateHz,
    QuietMs,
    ReactionMs,
    SettleMs,
    SpreadMs,
    StillTolerance,
    TolerancePercent,
)
from scara_control.pid import PidGains


class JointDynamics(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Friction of one joint in place of the URDF's.

    Damping is in [N m s/rad] and friction in [N m]; of a prismatic joint in [N s/m] and [N].
    """

    damping: Annotated[float, Meta(ge=0.0, le=10_000.0)]
    friction: Annotated[float, Meta(ge=0.0, le=10_000.0)]


class SimulationConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The world, its pace and what it accepts; keys as in simulation.yaml."""

    physics_rate_hz: Annotated[int, Meta(ge=200, le=10_000)]
    gravity_m_s2: Annotated[float, Meta(ge=0.0, le=100.0)]
    feed_forward: bool
    tracking_bandwidth_rad_s: Annotated[float, Meta(ge=0.0, le=400.0)]
    wake_period_ms: Annotated[float, Meta(ge=0.1, le=20.0)]
    max_catch_up_ms: QuietMs
    clock_step_limit_ms: SpreadMs
    joint_states_rate_hz: PhysicsRateHz
    controller_state_rate_hz: PhysicsRateHz
    diagnostics_rate_hz: Annotated[int, Meta(ge=1, le=100)]
    extrapolation_limit_ms: ReactionMs
    setpoint_lead_limit_ms: SettleMs
    velocity_timeout_ms: QuietMs
    stop_ramp_ms: QuietMs
    position_tolerance_deg: StillTolerance
    position_tolerance_mm: StillTolerance
    velocity_tolerance_percent: TolerancePercent
    acceleration_tolerance_percent: TolerancePercent
    standstill_percent: Annotated[float, Meta(ge=0.01, le=5.0)]
    stick_band_deg: Annotated[float, Meta(ge=0.0, le=1.0)]
    stick_band_mm: Annotated[float, Meta(ge=0.0, le=1.0)]
    saturation_window_ms: Annotated[float, Meta(ge=100.0, le=60_000.0)]
    saturation_limit_percent: Annotated[float, Meta(ge=0.0, le=100.0)]
    joint_dynamics: dict[str, JointDynamics] = {}
    model_mass_factor: Annotated[float, Meta(ge=0.1, le=10.0)] = 1.0

    @property
    def dynamics(self) -> dict[str, tuple[float, float]]:
        """Damping and friction by joint, for the world."""
        return {
            name: (entry.damping, entry.friction) for name, entry in self.joint_dynamics.items()
        }

    @property
    def saturation_window_steps(self) -> int:
        """Length of the window in which saturated steps are counted [steps]."""
        return round(self.saturation_window_ms * 1e-3 * self.physics_rate_hz)

    @property
    def step_ns(self) -> int:
        """Length of one physics step [ns]."""
        return 1_000_000_000 // self.physics_rate_hz

    @property
    def dt(self) -> float:
        """Length of one physics step [s]."""
        return 1.0 / self.physics_rate_hz

    def position_tolerance(self, joint: Joint) -> float:
        """How far outside its limits a set point is pulled back [rad] or [m]."""
        return {"deg": self.position_tolerance_deg, "mm": self.position_tolerance_mm}[
            joint.unit
        ] * joint.scale

    def stick_band(self, joint: Joint) -> float:
        """Position error at rest that gets the whole dry friction pushed [rad] or [m]."""
        return {"deg": self.stick_band_deg, "mm": self.stick_band_mm}[joint.unit] * joint.scale


class LoopGains(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The two loops of one joint."""

    position: PidGains
    velocity: PidGains


def load_simulation(robot: Robot, directory: Path | str | None = None) -> SimulationConfig:
    """Read simulation.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a rate does not divide the physics rate, or
            ``joint_dynamics`` names a joint that the twin does not move.
    """
    path = locate("simulation.yaml", directory)
    config = load(path, SimulationConfig)
    # Stamps count whole nanoseconds, so a step has to be some.
    if 1_000_000_000 % config.physics_rate_hz:
        raise ConfigError(
            f"{path}: physics_rate_hz = {config.physics_rate_hz}: must divide 1000000000"
        )
    for key, whole in (
        ("joint_states_rate_hz", "physics_rate_hz"),
        ("controller_state_rate_hz", "joint_states_rate_hz"),
    ):
        rate, multiple = getattr(config, key), getattr(config, whole)
        if multiple % rate:
            raise ConfigError(f"{path}: {key} = {rate}: must divide {whole} = {multiple}")
    _refuse_strangers(path, "joint_dynamics.", config.joint_dynamics, robot)
    return config


def gains_path(directory: Path | str | None = None) -> Path:
    """Return where pid_gains.yaml of ``directory`` (default: the package scara_config) is."""
    return locate("pid_gains.yaml", directory)


def load_gains(robot: Robot, directory: Path | str | None = None) -> list[LoopGains]:
    """Read the twin's gains from pid_gains.yaml of ``directory``, in robot.yaml's order.

    Raises:
        ConfigError: The file is missing or wrong, or does not name exactly the twin's joints.
    """
    path = gains_path(directory)
    gains = load(path, dict[str, LoopGains])
    _refuse_strangers(path, "", gains, robot)
    for joint in robot.twin_joints:
        if joint.name not in gains:
            raise ConfigError(f"{path}: {joint.name}: is missing")
    return [gains[joint.name] for joint in robot.twin_joints]


def _refuse_strangers(path: Path, prefix: str, names: Iterable[str], robot: Robot) -> None:
    """Raise ConfigError if one of ``names`` is no joint of the twin."""
    joints = [joint.name for joint in robot.twin_joints]
    for name in names:
        if name not in joints:
            raise ConfigError(
                f"{path}: {prefix}{name}: no joint of the twin; it has {', '.join(joints)}"
            )
