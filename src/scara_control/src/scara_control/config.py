"""The numbers of motion.yaml, checked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Joint, load, locate
from scara_config.quantities import (
    BeyondLimit,
    CoarseTolerance,
    Duration,
    FineTolerance,
    RateHz,
    SignSeconds,
    SpeedPercent,
    StandstillSpeed,
    StateSeconds,
)


class MoveConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Joint moves of joint_pose_controller."""

    default_speed_percent: SpeedPercent
    effort_percent: Annotated[float, Meta(ge=20.0, le=100.0)]
    announce: Annotated[float, Meta(ge=0.02, le=1.0)]
    horizon: Annotated[float, Meta(ge=0.01, le=1.0)]
    time_scale_ramp: Annotated[float, Meta(ge=0.1, le=100.0)]
    time_scale_jerk: Annotated[float, Meta(ge=1.0, le=10000.0)]
    position_tolerance_deg: FineTolerance
    position_tolerance_mm: FineTolerance
    settle_timeout: Duration
    start_tolerance_deg: CoarseTolerance
    start_tolerance_mm: CoarseTolerance
    standstill_deg_s: StandstillSpeed
    standstill_mm_s: StandstillSpeed


class FollowConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Streamed set points of joint_pose_controller."""

    timeout: SignSeconds
    extrapolation: Annotated[float, Meta(ge=0.01, le=0.5)]
    ahead: StateSeconds
    start_tolerance_deg: CoarseTolerance
    start_tolerance_mm: CoarseTolerance
    step_tolerance_deg: CoarseTolerance
    step_tolerance_mm: CoarseTolerance
    limit_tolerance_deg: BeyondLimit
    limit_tolerance_mm: BeyondLimit
    velocity_factor: Annotated[float, Meta(ge=1.0, le=5.0)]


class JogConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Joint velocities of joint_vel_controller."""

    timeout: SignSeconds
    speed_percent: SpeedPercent
    braking_percent: SpeedPercent
    reaction: Annotated[float, Meta(ge=0.01, le=0.5)]
    final_zeros: Annotated[int, Meta(ge=1, le=100)]
    waits_for_robot: bool
    waiting_ramp_percent: SpeedPercent


class TrimConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The end of move_to: what the joint move has left is driven out by small velocities."""

    tolerance_mm: FineTolerance
    tolerance_deg: FineTolerance
    timeout: Duration
    gain: Annotated[float, Meta(ge=0.1, le=50.0)]
    integral_gain: Annotated[float, Meta(ge=0.1, le=50.0)]
    breakaway_percent: Annotated[float, Meta(ge=0.01, le=5.0)]
    speed_mm_s: Annotated[float, Meta(ge=1.0, le=250.0)]
    range_mm: CoarseTolerance
    settled: Duration
    service_timeout: Duration


class TrajectoryConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Trajectories given to trajectory_server; tolerances hold where a goal names none."""

    path_tolerance_deg: CoarseTolerance
    path_tolerance_mm: CoarseTolerance
    goal_tolerance_deg: FineTolerance
    goal_tolerance_mm: FineTolerance
    goal_time_tolerance: Duration
    longest: Annotated[float, Meta(ge=10.0, le=3600.0)]
    feedback_rate_hz: RateHz
    stream_timeout: StateSeconds
    mode_timeout: StateSeconds


class MotionConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything of motion.yaml."""

    rate_hz: RateHz
    state_rate_hz: RateHz
    state_timeout: StateSeconds
    command_memory: Duration
    move: MoveConfig
    follow: FollowConfig
    jog: JogConfig
    trim: TrimConfig
    trajectory: TrajectoryConfig

    @property
    def period(self) -> float:
        """Time between two set points [s]."""
        return 1.0 / self.rate_hz


def load_motion(directory: Path | str | None = None) -> MotionConfig:
    """Read motion.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, or the horizon does not cover one period.
    """
    path = locate("motion.yaml", directory)
    config = load(path, MotionConfig)
    # A packet has to last until the next one, also if that is a period late.
    if config.move.horizon < 2.0 * config.period:
        raise ConfigError(
            f"{path}: move.horizon = {config.move.horizon}: is below two periods, "
            f"{2.0 * config.period:g} s"
        )
    return config


def in_si(joint: Joint, deg: float, mm: float) -> float:
    """Return that of two values that fits the joint, in [rad] or [m] (or per second)."""
    return (deg if joint.unit == "deg" else mm) * joint.scale
