"""The numbers of motion.yaml, checked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Joint, load, locate
from scara_config.percent import SpeedPercent

Rate = Annotated[float, Meta(ge=1.0, le=1000.0)]
Duration = Annotated[float, Meta(gt=0.0, le=60.0)]
Positive = Annotated[float, Meta(gt=0.0, le=1e4)]


class MoveConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Joint moves of joint_pose_controller."""

    default_speed_percent: SpeedPercent
    effort_percent: Annotated[float, Meta(ge=20.0, le=100.0)]
    announce: Annotated[float, Meta(ge=0.0, le=2.0)]
    horizon: Annotated[float, Meta(gt=0.0, le=1.0)]
    time_scale_ramp: Annotated[float, Meta(ge=0.1, le=100.0)]
    time_scale_jerk: Annotated[float, Meta(ge=1.0, le=10000.0)]
    position_tolerance_deg: Positive
    position_tolerance_mm: Positive
    settle_timeout: Duration
    start_tolerance_deg: Positive
    start_tolerance_mm: Positive
    standstill_deg_s: Positive
    standstill_mm_s: Positive


class FollowConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Streamed set points of joint_pose_controller."""

    timeout: Annotated[float, Meta(ge=0.02, le=2.0)]
    extrapolation: Annotated[float, Meta(ge=0.0, le=2.0)]
    ahead: Duration
    start_tolerance_deg: Positive
    start_tolerance_mm: Positive
    step_tolerance_deg: Positive
    step_tolerance_mm: Positive
    limit_tolerance_deg: Annotated[float, Meta(ge=0.0, le=5.0)]
    limit_tolerance_mm: Annotated[float, Meta(ge=0.0, le=5.0)]
    velocity_factor: Annotated[float, Meta(ge=1.0, le=10.0)]


class JogConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Joint velocities of joint_vel_controller."""

    timeout: Annotated[float, Meta(ge=0.02, le=2.0)]
    speed_percent: SpeedPercent
    braking_percent: SpeedPercent
    reaction: Annotated[float, Meta(ge=0.0, le=1.0)]
    final_zeros: Annotated[int, Meta(ge=1, le=100)]
    waits_for_robot: bool
    waiting_ramp_percent: SpeedPercent


class TrimConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The end of move_to: what the joint move has left is driven out by small velocities."""

    tolerance_mm: Positive
    timeout: Duration
    gain: Annotated[float, Meta(ge=0.1, le=50.0)]
    integral_gain: Annotated[float, Meta(ge=0.0, le=50.0)]
    breakaway_percent: Annotated[float, Meta(ge=0.0, le=5.0)]
    speed_mm_s: Positive
    range_mm: Positive
    settled: Duration
    service_timeout: Duration


class TrajectoryConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Trajectories given to trajectory_server; tolerances hold where a goal names none."""

    path_tolerance_deg: Positive
    path_tolerance_mm: Positive
    goal_tolerance_deg: Positive
    goal_tolerance_mm: Positive
    goal_time_tolerance: Duration
    longest: Annotated[float, Meta(gt=0.0, le=3600.0)]
    feedback_rate_hz: Rate
    stream_timeout: Duration
    mode_timeout: Duration


class MotionConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything of motion.yaml."""

    rate_hz: Rate
    state_rate_hz: Rate
    state_timeout: Duration
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
    if config.move.horizon < 2.0 * config.period:
        raise ConfigError(
            f"{path}: move.horizon = {config.move.horizon}: is below two periods, "
            f"{2.0 * config.period:g} s"
        )
    return config


def in_si(joint: Joint, deg: float, mm: float) -> float:
    """Return that of two values that fits the joint, in [rad] or [m] (or per second)."""
    return (deg if joint.unit == "deg" else mm) * joint.scale
