"""The typed content of twin_controller.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Robot, Section, load, locate
from scara_config import quantities as allowed
from scara_control.keep_out.points import watched_points

NodeWord = Annotated[str, Meta(pattern=r"^[A-Za-z]\w*\Z")]
SensorName = Annotated[str, Meta(pattern=r"^/?[A-Za-z]\w*(/[A-Za-z]\w*)*\Z")]


class Real(Section, frozen=True):
    """Link to the real robot."""

    host: str
    port: allowed.Port
    poll_period_ms: allowed.PeriodMs
    sample_latency_ms: allowed.RegisterDelayMs
    samples: allowed.Samples
    timeout_ms: allowed.SilenceMs
    stale_ms: allowed.SilenceMs
    clock_drift_ppm: allowed.ClockDriftPpm
    command_retry_ms: allowed.RepeatMs
    command_attempts: allowed.Attempts
    clock_jump_ms: allowed.SilenceMs = 100.0
    clock_conflicts: allowed.Conflicts = 50
    alone_ms: allowed.SettleMs = 2000.0


class MeasuredJoint(Section, frozen=True):
    """How one joint of the real robot answered when it was measured."""

    delay_ms: allowed.MeasuredDelayMs
    smoothing_ms2: Annotated[float, Meta(ge=0.0, le=10_000.0)] = 0.0


class ResponseConfig(Section, frozen=True):
    """How the real robot's answer to its set points is measured, and what is assumed of it."""

    first_ms: allowed.DelayMs
    first_percent: allowed.SpeedPercent
    doubt_percent: allowed.FewPercent
    known_ms: allowed.SpreadMs
    longest_ms: allowed.DelayMs
    window_ms: allowed.MemoryMs
    behind_ms: allowed.SpreadMs
    change_percent: allowed.PartPercent
    measured: dict[str, MeasuredJoint] | None = None


class Twin(Section, frozen=True):
    """Link to the twin."""

    url: str
    stale_ms: allowed.SilenceMs
    state_period_ms: allowed.PeriodMs
    plan_period_ms: allowed.PeriodMs
    probe_period_ms: allowed.RepeatMs
    clock_drift_ppm: allowed.ClockDriftPpm
    probes: allowed.Samples
    stop_quiet_ms: allowed.QuietMs
    command_retry_ms: allowed.RepeatMs
    command_attempts: allowed.Attempts
    token_environment: Annotated[str, Meta(pattern=r"^[A-Za-z_][A-Za-z0-9_]*\Z")] | None = None
    ca_file: str | None = None
    clock_jump_ms: allowed.SilenceMs = 100.0
    clock_conflicts: allowed.Conflicts = 50


class DeskLinks(Section, frozen=True):
    """Link limits of a cell whose robot is the stand-in on the same machine."""

    real_timeout_ms: allowed.DeskSilenceMs
    real_stale_ms: allowed.DeskSilenceMs
    twin_stale_ms: allowed.DeskSilenceMs
    clock_jump_ms: allowed.DeskSilenceMs
    clock_conflicts: allowed.Conflicts


class OwnGap(Section, frozen=True):
    """When a late look of the controller itself is no silence of a side."""

    notice_ms: allowed.ReactionMs
    forgive_ms: allowed.ReactionMs
    window_ms: allowed.MemoryMs


class Change(Section, frozen=True):
    """What counts as moved and as standing still."""

    decimals: Annotated[int, Meta(ge=1, le=4)]
    hysteresis: allowed.StillTolerance
    confirm: allowed.FewSamples
    window: allowed.FewSamples
    confirm_wait_ms: allowed.ReactionMs
    agree_samples: allowed.Samples
    still_tolerance: allowed.StillTolerance
    still_time_ms: allowed.QuietMs
    echo_tolerance: allowed.LeadTolerance
    echo_memory_ms: allowed.MemoryMs


class Align(Section, frozen=True):
    """The twin's slow way to the real robot's pose."""

    speed_percent: allowed.SpeedPercent
    tolerance: allowed.FineTolerance
    timeout_ms: allowed.PatienceMs
    lead_tolerance: allowed.LeadTolerance
    catch_up: allowed.CoarseTolerance
    catch_up_ms: allowed.ReactionMs


class Settle(Section, frozen=True):
    """When a motion has ended."""

    tolerance: allowed.FineTolerance
    timeout_ms: allowed.SettleMs
    minimum_ms: allowed.QuietMs


class Gripper(Section, frozen=True):
    """How long a gripper may take to show what it was told."""

    retry_ms: allowed.RepeatMs
    attempts: allowed.Attempts
    agree_ms: allowed.SettleMs


class Limit(Section, frozen=True):
    """The additional controller between twin and real robot."""

    speed_percent: allowed.SpeedPercent
    told_percent: allowed.SpeedPercent
    twin_percent: allowed.SpeedPercent
    step_margin: Annotated[float, Meta(ge=1.0, le=3.0)]
    override_margin: Annotated[float, Meta(ge=1.0, le=2.0)]
    source_age_ms: allowed.SilenceMs
    position_tolerance: allowed.FineTolerance


class CellLimits(Section, frozen=True):
    """What holds in the whole cell, whoever leads."""

    cartesian_speed_mm_s: allowed.ToolSpeedMmS | None
    cartesian_margin: Annotated[float, Meta(ge=1.0, le=2.0)]
    cartesian_confirm_ms: allowed.ReactionMs
    slowing_margin_ms: allowed.ReactionMs
    braking_acceleration_percent: allowed.SpeedPercent
    keep_out_clearance_mm: allowed.ClearanceMm


class Separation(Section, frozen=True):
    """Terms of the protective distance."""

    enabled: bool
    sensors: tuple[SensorName, ...]
    human_speed_mm_s: allowed.WalkingMmS
    reaction_ms: allowed.ReactionMs
    deceleration_m_s2: allowed.DecelerationMS2
    intrusion_mm: allowed.IntrusionMm
    sensor_uncertainty_mm: allowed.UncertaintyMm
    robot_uncertainty_mm: allowed.UncertaintyMm
    margin_mm: allowed.UncertaintyMm
    standstill_mm_s: allowed.StandstillSpeed
    stale_ms: allowed.SilenceMs


class Reset(Section, frozen=True):
    """How long the robot may take to become ready."""

    wait_ms: allowed.QuietMs
    timeout_ms: allowed.SettleMs


class Stop(Section, frozen=True):
    """How long a side may take to show a stop, and how often it is told."""

    retry_ms: allowed.StopRepeatMs
    attempts: allowed.StopAttempts
    hold_ms: allowed.QuietMs
    answer_ms: allowed.ShownMs
    heard_ms: allowed.QuietMs
    restart_percent: allowed.StepPercent
    safety_retry_ms: allowed.RepeatMs
    twin_retry_ms: allowed.RepeatMs


class EStop(Section, frozen=True):
    """How long a side may take to show a latched emergency stop, and the robot to stand by it."""

    retry_ms: allowed.RepeatMs
    shown_ms: allowed.ShownMs


class SpeedOrders(Section, frozen=True):
    """How long a side may take to show a cap or an override, and what counts as shown."""

    retry_ms: allowed.RepeatMs
    step_percent: allowed.StepPercent
    step_ratio: Annotated[float, Meta(ge=0.01, le=0.2)]
    raise_step_percent: allowed.StepPercent


class Stream(Section, frozen=True):
    """How the robot's stream program is fed and started."""

    period_ms: allowed.PeriodMs | None
    ahead_period_ms: Annotated[int, msgspec.Meta(ge=2, le=100)]
    alone_percent: allowed.PartPercent
    retry_ms: allowed.RepeatMs
    attempts: allowed.Attempts


class Divergence(Section, frozen=True):
    """The alarm when the pair comes apart."""

    path_mm: allowed.DivergenceMm
    rest_mm: allowed.DivergenceMm
    delay_mm: allowed.DivergenceMm
    release_ratio: Annotated[float, Meta(ge=0.2, lt=1.0)]
    confirm: allowed.Samples
    window: allowed.Samples
    history_ms: allowed.MemoryMs
    pause: bool


class Home(Section, frozen=True):
    """How the twin goes home; where that is: robot.yaml."""

    speed_percent: allowed.SpeedPercent


class Shadow(Section, frozen=True):
    """What the service ``twin_controller/shadow`` remembers."""

    period_ms: allowed.RepeatMs
    memory_s: Annotated[float, Meta(ge=1.0, le=3600.0)]


class ControlTimes(Section, frozen=True):
    """When who holds control, or asks for it, loses it; who is no program of this machine.

    Attributes:
        keep_ms: Who gives no sign of life for so long loses it.
        answer_ms: Who does not answer a question for so long loses it.
        lend_ms: So long a motion of the holder's own programs may begin.
        remote: Nodes that pass on what clients of other machines or rights ask for.
    """

    keep_ms: allowed.PatienceMs
    answer_ms: allowed.PatienceMs
    # Recordings from before programs of this machine were the holder's have neither.
    lend_ms: allowed.PatienceMs = 2000.0
    remote: tuple[NodeWord, ...] = ()


class TwinControllerConfig(Section, frozen=True):
    """Everything in twin_controller.yaml."""

    real: Real
    response: ResponseConfig
    twin: Twin
    change: Change
    align: Align
    settle: Settle
    gripper: Gripper
    limit: Limit
    cell: CellLimits
    separation: Separation
    reset: Reset
    stop: Stop
    estop: EStop
    speed: SpeedOrders
    stream: Stream
    divergence: Divergence
    home: Home
    shadow: Shadow
    state_rate_hz: Annotated[float, Meta(ge=1.0, le=100.0)]
    decision_history: Annotated[int, Meta(ge=10, le=100_000)]
    links: Literal["strict", "desk"] = "strict"
    desk: DeskLinks | None = None
    own_gap: OwnGap = OwnGap(30.0, 100.0, 1000.0)
    # Recordings from before control was held have none.
    control: ControlTimes = ControlTimes(5000.0, 20_000.0)


def with_links(config: TwinControllerConfig, links: str = "") -> TwinControllerConfig:
    """Return the configuration with the link limits in force.

    Args:
        config: What stands in the file.
        links: ``strict`` or ``desk``; empty: what the file says.

    Raises:
        ConfigError: There is no such choice, or the file has no limits for a desk.
    """
    links = links or config.links
    if links == "strict":
        return msgspec.structs.replace(config, links="strict")
    if links != "desk" or config.desk is None:
        raise ConfigError(f"links = {links!r}: Expected strict, or desk with the section desk")
    desk = config.desk
    real = msgspec.structs.replace(
        config.real,
        timeout_ms=max(config.real.timeout_ms, desk.real_timeout_ms),
        stale_ms=max(config.real.stale_ms, desk.real_stale_ms),
        clock_jump_ms=max(config.real.clock_jump_ms, desk.clock_jump_ms),
        clock_conflicts=max(config.real.clock_conflicts, desk.clock_conflicts),
    )
    twin = msgspec.structs.replace(
        config.twin,
        stale_ms=max(config.twin.stale_ms, desk.twin_stale_ms),
        clock_jump_ms=max(config.twin.clock_jump_ms, desk.clock_jump_ms),
        clock_conflicts=max(config.twin.clock_conflicts, desk.clock_conflicts),
    )
    return msgspec.structs.replace(config, real=real, twin=twin, links="desk")


def load_twin_controller(
    robot: Robot, directory: Path | str | None = None, links: str = ""
) -> TwinControllerConfig:
    """Read twin_controller.yaml of ``directory`` (default: the package scara_config).

    Args:
        robot: robot.yaml.
        directory: Folder with the YAML files.
        links: Which link limits count, see :func:`with_links`.

    Raises:
        ConfigError: The file is missing or wrong, or the robot's body cannot be watched.
    """
    path = locate("twin_controller.yaml", directory)
    config = with_links(load(path, TwinControllerConfig), links)
    for name, each in (("change", config.change), ("divergence", config.divergence)):
        if each.confirm > each.window:
            at_most = f"Expected at most {name}.window = {each.window}"
            raise ConfigError(f"{path}: {name}.confirm = {each.confirm}: {at_most}")
    _check_speeds(path, config)
    if config.separation.enabled and not config.separation.sensors:
        raise ConfigError(f"{path}: separation.sensors = []: Expected at least one with enabled")
    watched_points(robot)  # A profile whose body is not watched does not start.
    _check_response(path, config.response, robot)
    return config


def _check_response(path: Path, response: ResponseConfig, robot: Robot) -> None:
    """Refuse delays longer than what is looked for, and joints that were left out or mistyped."""
    delays = {"first_ms": response.first_ms}
    if response.measured is not None:
        names = [joint.name for joint in robot.twin_joints]
        if sorted(response.measured) != sorted(names):
            raise ConfigError(
                f"{path}: response.measured has {', '.join(response.measured)}: "
                f"Expected {', '.join(names)}"
            )
        for name, joint in response.measured.items():
            delays[f"measured.{name}.delay_ms"] = joint.delay_ms
    for name, delay in delays.items():
        if delay > response.longest_ms:
            raise ConfigError(
                f"{path}: response.{name} = {delay:g}: "
                f"Expected at most response.longest_ms = {response.longest_ms:g}"
            )


def _check_speeds(path: Path, config: TwinControllerConfig) -> None:
    """Refuse set points faster than the robot may be, and a twin faster than its set points."""
    limit = config.limit
    for name, value, bound, most in (
        ("told_percent", limit.told_percent, "speed_percent", limit.speed_percent),
        ("twin_percent", limit.twin_percent, "told_percent", limit.told_percent),
    ):
        if value > most:
            raise ConfigError(
                f"{path}: limit.{name} = {value:g}: Expected at most limit.{bound} = {most:g}"
            )
