"""Read a plant: config/robots/ROBOT/plants/PLANT.yaml, checked against robot.yaml.

Nothing of it is told to the twin controller: with a real robot nobody knows these numbers.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Joint, Robot, load
from scara_config.profile import chosen_plant, plant_draw, plant_path
from scara_config.quantities import AboveZero, AccelerationPercent, LagMs, WholePercent

from fanuc_emulator.drives.axis import Axis, AxisParameters, Friction
from fanuc_emulator.uop import Outputs

Period = Annotated[int, Meta(ge=1, le=40)]
Phase = Annotated[int, Meta(ge=0, le=40)]
Range = tuple[LagMs, LagMs]
Row = tuple[float, float, float, float]
ALARM = "alarm"
"""Beside the outputs of :class:`Outputs`: the register of the active alarm."""
LONGEST_POWER_ON_MS = 2000  # B-83284EN/09, figure 3.8


class ClockFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The controller's own clock.

    ``error_ms``: positions and clock are read so far apart at most, either way.
    """

    boot_offset_ms: Annotated[int, Meta(ge=0, lt=2**31)]
    drift_ppm: Annotated[float, Meta(ge=-500.0, le=500.0)]
    error_ms: Annotated[int, Meta(ge=0, le=20)]


class AnswerFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """From a request to its answer: shortest and longest, evenly drawn."""

    idle_ms: Range
    running_ms: Range


class MeasuringFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the position registers show.

    ``period_ms``: between two readings, the first of which comes ``phase_ms`` late. ``decimals``:
    of a position [deg or mm]; null: whole encoder counts. Noise: Gaussian, rms.
    """

    period_ms: Period
    decimals: Annotated[int, Meta(ge=0, le=6)] | None
    noise_deg: Annotated[float, Meta(ge=0.0, le=1.0)]
    noise_mm: Annotated[float, Meta(ge=0.0, le=1.0)]
    phase_ms: Phase = 0


class StreamFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How ``J PR[1] R[2]% CNT100; JMP`` moves.

    With ``look_ahead`` each new PR[1] counts at once. Without it each motion is planned when the
    one before it ends, and begins ``lag_ms`` later; each motion that begins at rest adds
    ``lag_step_ms`` up to ``lag_largest_ms``, and ``rest_s`` of rest bring the first lag back.
    """

    look_ahead: bool
    lag_ms: LagMs
    lag_step_ms: LagMs
    lag_largest_ms: LagMs
    rest_s: Annotated[float, Meta(ge=0.0, le=3600.0)]


class FrictionFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Friction of one axis; percent of the acceleration in robot.yaml.

    ``static`` holds it at rest, ``coulomb`` brakes it at any speed, ``viscous`` adds as much at its
    largest speed, ``load`` as much for the payload. ``stribeck_percent``: of the largest speed,
    where static friction has fallen to a third of what it is above coulomb's.
    """

    static_percent: WholePercent
    coulomb_percent: WholePercent
    viscous_percent: WholePercent
    stribeck_percent: AboveZero
    load_percent: WholePercent


class AxisFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Servo model of one axis; percent of the acceleration in robot.yaml.

    ``payload_inertia_percent``: of the arm's own; the drive accelerates both. ``zero_offset``: the
    joint is so much further than its encoder says. ``held_friction``: what the drive's integral
    part overcomes, which shows in the torque alone. ``backlash_turns``: play, motor turns.
    """

    program_acceleration_percent: AccelerationPercent
    command_acceleration_percent: AccelerationPercent
    servo_acceleration_percent: AccelerationPercent
    estop_deceleration_percent: AccelerationPercent
    natural_frequency_hz: Annotated[float, Meta(gt=0.0, le=100.0)]
    damping: Annotated[float, Meta(gt=0.0, le=5.0)]
    velocity_feedforward: Annotated[float, Meta(ge=0.0, le=1.0)]
    encoder_counts_per_turn: Annotated[int, Meta(ge=1, le=2**26)]
    travel_per_turn_deg: AboveZero | None = None
    travel_per_turn_mm: AboveZero | None = None
    payload_inertia_percent: Annotated[float, Meta(ge=0.0, le=1000.0)] = 0.0
    friction: FrictionFile | None = None
    held_friction: FrictionFile | None = None
    backlash_turns: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    zero_offset_deg: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0
    zero_offset_mm: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0


class GeometryFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The arm as it was made: what differs from robot.yaml.

    Screw axes ``(omega, v)`` by joint and the tool's home pose, as there.
    """

    screw_axes: dict[str, tuple[float, float, float, float, float, float]]
    home_pose: tuple[Row, Row, Row, Row]


class Plant(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One plant's file.

    ``description`` stands beside each figure. Its first interpolation period is shorter by
    ``interpolation_phase_ms``. ``payload_kg`` is what the tool carries.
    ``vacuum_leak`` is the part of the best vacuum that a leak takes (plant/wear.py).
    ``power_on_ms``: from RESET until the drives are on.
    ``shown_after_ms`` names outputs, or ``alarm``, that are shown later than they are true.
    """

    description: Annotated[str, Meta(min_length=1, max_length=100)]
    clock: ClockFile
    # Filters come in steps of 10 ms, and BGTWIN runs each 8 ms: both are whole servo periods.
    servo_period_ms: Annotated[int, Meta(ge=1, le=2)]
    servo_substeps: Annotated[int, Meta(ge=1, le=16)]
    interpolation_period_ms: Period
    filter_ms: Annotated[
        list[Annotated[int, Meta(ge=10, le=500, multiple_of=10)]], Meta(min_length=1, max_length=4)
    ]
    start_delay_ms: Annotated[int, Meta(ge=0, le=1000)]
    answers: AnswerFile
    measuring: MeasuringFile
    stream: StreamFile
    shown_after_ms: dict[str, LagMs]
    fine_tolerance_deg: AboveZero
    fine_tolerance_mm: AboveZero
    payload_kg: Annotated[float, Meta(ge=0.0, le=1000.0)]
    geometry: GeometryFile | None
    axes: dict[str, AxisFile]
    interpolation_phase_ms: Phase = 0
    vacuum_leak: Annotated[float, Meta(ge=0.0, lt=1.0)] = 0.0
    power_on_ms: Annotated[int, Meta(ge=0, le=LONGEST_POWER_ON_MS)] = 0

    @property
    def dt(self) -> float:
        """Servo period: the stand-in's step [s]."""
        return self.servo_period_ms / 1000.0

    @property
    def filter_lengths(self) -> tuple[int, ...]:
        """Moving averages in servo periods."""
        return tuple(length // self.servo_period_ms for length in self.filter_ms)


def load_plant(robot: Robot, directory: Path | str | None = None, name: str | None = None) -> Plant:
    """Read a plant of ``directory`` (default: the package scara_config).

    Args:
        robot: robot.yaml.
        directory: Folder with all YAML files.
        name: Of the plant, with or without a draw; default: what ``SCARA_PLANT`` says, else
            ``ideal``.

    Raises:
        ConfigError: There is no such plant or it is wrong, an axis is missing or unknown, a period
            does not divide another.
    """
    path = plant_path(directory, name)
    plant = load(path, Plant)
    _, seed = plant_draw(name or chosen_plant())
    if seed is not None:
        plant = drawn(plant, seed)
    _check_periods(path, plant)
    _check_axes(path, plant, robot)
    names = [joint.name for joint in robot.joints]
    for joint_name in plant.geometry.screw_axes if plant.geometry else ():
        if joint_name not in names:
            raise ConfigError(
                f"{path}: geometry.screw_axes.{joint_name}: is no joint of robot.yaml "
                f"({', '.join(names)})"
            )
    shown = (*Outputs.__struct_fields__, ALARM)
    for output in plant.shown_after_ms:
        if output not in shown:
            raise ConfigError(
                f"{path}: shown_after_ms.{output}: unknown, allowed are {', '.join(shown)}"
            )
    return plant


def _check_periods(path: Path, plant: Plant) -> None:
    for key, period in (
        ("interpolation_period_ms", plant.interpolation_period_ms),
        ("measuring.period_ms", plant.measuring.period_ms),
    ):
        if period % plant.servo_period_ms:
            raise ConfigError(
                f"{path}: {key} = {period}: must be a multiple of servo_period_ms = "
                f"{plant.servo_period_ms}"
            )
    for key, (shortest, longest) in (
        ("answers.idle_ms", plant.answers.idle_ms),
        ("answers.running_ms", plant.answers.running_ms),
        ("stream.lag_ms", (plant.stream.lag_ms, plant.stream.lag_largest_ms)),
    ):
        if shortest > longest:
            raise ConfigError(
                f"{path}: {key} = {shortest:g}: must not be above the largest, {longest:g}"
            )


def _check_axes(path: Path, plant: Plant, robot: Robot) -> None:
    names = [joint.name for joint in robot.joints]
    for name in sorted(set(names) ^ set(plant.axes)):
        what = "is missing" if name in names else f"is no joint of robot.yaml ({', '.join(names)})"
        raise ConfigError(f"{path}: axes.{name}: {what}")
    for joint in robot.joints:
        axis, other = plant.axes[joint.name], "mm" if joint.unit == "deg" else "deg"
        wanted, wrong = f"travel_per_turn_{joint.unit}", f"travel_per_turn_{other}"
        if getattr(axis, wanted) is None or getattr(axis, wrong) is not None:
            raise ConfigError(f"{path}: axes.{joint.name}: needs {wanted} and not {wrong}")
        if getattr(axis, f"zero_offset_{other}"):
            raise ConfigError(
                f"{path}: axes.{joint.name}.zero_offset_{other}: {joint.name} is counted in "
                f"{joint.unit}"
            )


def axis_parameters(plant: Plant, joint: Joint) -> AxisParameters:
    """Return one axis' limits and dynamics in SI."""
    axis = plant.axes[joint.name]
    percent = joint.acceleration / 100.0
    # The drive's force is the same, and it moves the payload too.
    share = 1.0 / (1.0 + axis.payload_inertia_percent / 100.0)
    turn = getattr(axis, f"travel_per_turn_{joint.unit}") * joint.scale
    return AxisParameters(
        lower=joint.lower,
        upper=joint.upper,
        velocity=joint.velocity,
        program_acceleration=axis.program_acceleration_percent * percent,
        command_acceleration=axis.command_acceleration_percent * percent,
        servo_acceleration=axis.servo_acceleration_percent * percent * share,
        estop_deceleration=axis.estop_deceleration_percent * percent * share,
        # The loop's stiffness is a force as well: with more mass its frequency falls by the root.
        natural_frequency=2.0 * math.pi * axis.natural_frequency_hz * math.sqrt(share),
        damping=axis.damping,
        velocity_feedforward=axis.velocity_feedforward,
        resolution=turn / axis.encoder_counts_per_turn,
        tolerance=getattr(plant, f"fine_tolerance_{joint.unit}") * joint.scale,
        friction=_friction(axis.friction, joint, percent * share),
        held=_friction(axis.held_friction, joint, percent * share),
        backlash=axis.backlash_turns * turn,
    )


def axes_of(plant: Plant, joints: Sequence[Joint], positions: Sequence[float]) -> list[Axis]:
    """Return the axes of a robot that stands at ``positions`` [rad or m]."""
    return [
        Axis(
            axis_parameters(plant, joint),
            plant.filter_lengths,
            position,
            plant.dt,
            plant.servo_substeps,
        )
        for joint, position in zip(joints, positions)
    ]


def plant_text(name: str, plant: Plant) -> str:
    """Return a plant as one JSON object, its name among its keys."""
    return msgspec.json.encode({"name": name, **msgspec.structs.asdict(plant)}).decode()


def zero_offset(plant: Plant, joint: Joint) -> float:
    """Return by how much a joint is further than its encoder says [rad or m]."""
    return float(getattr(plant.axes[joint.name], f"zero_offset_{joint.unit}")) * joint.scale


def _friction(file: FrictionFile | None, joint: Joint, percent: float) -> Friction | None:
    if file is None:
        return None
    coulomb = (file.coulomb_percent + file.load_percent) * percent
    return Friction(
        static=max((file.static_percent + file.load_percent) * percent, coulomb),
        coulomb=coulomb,
        viscous=file.viscous_percent * percent / joint.velocity,
        stribeck=file.stribeck_percent / 100.0 * joint.velocity,
    )


SPREAD, READINGS_MS, INTERPOLATIONS_MS = 0.3, (4, 16), (4, 12)
"""Each number is drawn within this part of what is filed, each period between these [ms]: what
differs from one robot of a family to the next, and from one family to another. Our choice."""
FILTER_STEP_MS, LONGEST_DESCRIPTION = 10, 100
_SERVO = (
    *(f"{name}_acceleration_percent" for name in ("program", "command", "servo")),
    *("natural_frequency_hz", "damping", "velocity_feedforward", "payload_inertia_percent"),
)


def drawn(plant: Plant, seed: int) -> Plant:
    """Return another robot of the same kind: the same seed gives the same one.

    Mechanics, encoders and geometry stay: they belong to the type.

    Args:
        plant: What is filed.
        seed: Of the draw.
    """
    replace, parts = msgspec.structs.replace, _parts(seed)

    def near(value: float) -> float:
        return value * (1.0 + SPREAD * (2.0 * next(parts) - 1.0))

    def ordered(ends: Range) -> Range:
        low, high = sorted(map(near, ends))
        return low, high

    def rubbing(file: FrictionFile) -> FrictionFile:
        return FrictionFile(*[near(getattr(file, key)) for key in FrictionFile.__struct_fields__])

    def period(shortest: int, longest: int) -> tuple[int, int]:
        step = plant.servo_period_ms
        fewest, most = -(-shortest // step), longest // step
        length = fewest + int(next(parts) * (most - fewest + 1))
        return step * length, step * int(next(parts) * length)

    axes = {}
    for name, axis in plant.axes.items():
        new: dict[str, Any] = {key: near(getattr(axis, key)) for key in _SERVO}
        new["velocity_feedforward"] = min(new["velocity_feedforward"], 1.0)
        if axis.friction is not None:
            new["friction"] = rubbing(axis.friction)
        axes[name] = replace(axis, **new)
    stream, measuring = plant.stream, plant.measuring
    lag, largest = ordered((stream.lag_ms, stream.lag_largest_ms))
    reading, interpolation = period(*READINGS_MS), period(*INTERPOLATIONS_MS)
    filters = [max(1, round(near(each) / FILTER_STEP_MS)) for each in plant.filter_ms]
    made = replace(
        plant,
        description=f"{plant.description}; drawn by seed {seed}"[-LONGEST_DESCRIPTION:],
        axes=axes,
        stream=replace(
            stream,
            lag_ms=lag,
            lag_largest_ms=largest,
            lag_step_ms=near(stream.lag_step_ms),
            rest_s=near(stream.rest_s),
        ),
        answers=AnswerFile(ordered(plant.answers.idle_ms), ordered(plant.answers.running_ms)),
        measuring=replace(
            measuring,
            period_ms=reading[0],
            phase_ms=reading[1],
            noise_deg=near(measuring.noise_deg),
            noise_mm=near(measuring.noise_mm),
        ),
        interpolation_period_ms=interpolation[0],
        interpolation_phase_ms=interpolation[1],
        filter_ms=[FILTER_STEP_MS * each for each in filters],
        start_delay_ms=round(near(plant.start_delay_ms)),
    )
    # Last: what was drawn before this was known stays as it was.
    held = {
        name: replace(axis, held_friction=rubbing(axis.held_friction))
        for name, axis in axes.items()
        if axis.held_friction is not None
    }
    power_on = min(round(near(plant.power_on_ms)), LONGEST_POWER_ON_MS)
    return replace(made, axes={**axes, **held}, power_on_ms=power_on)


def _parts(seed: int) -> Iterator[float]:
    """Yield numbers of 0 .. 1 without end: the same on any machine and with any library."""
    for count in itertools.count():
        digest = hashlib.blake2b(f"{seed}/{count}".encode(), digest_size=7).digest()
        yield int.from_bytes(digest, "big") / 2.0**56
