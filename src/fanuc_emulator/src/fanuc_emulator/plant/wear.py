"""How a robot wears: what a plant is after its parts have rubbed, loosened, or leaked.

Who looks for wear shares none of these laws.

Source:
    Friction grows by load, temperature and wear as in Bittencourt & Gunnarsson, Static friction in
    a robot joint (2012); every number is assumed [asm].
"""

from __future__ import annotations

import math
from typing import Any, Literal

import msgspec

from fanuc_emulator.plant.config import AxisFile, FrictionFile, Plant

Kind = Literal["friction", "backlash", "stiffness", "payload", "vacuum"]
WARM_C = 30.0
"""Of the gears when the plant's friction is as filed."""
_SWITCH = 0.6
"""RI[1] tells of a vacuum from this part of the pump's best on."""


class Wear(msgspec.Struct, frozen=True):
    """One part that has worn.

    Attributes:
        kind: What has happened.
        amount: How far. Friction: growth of the Coulomb part, 1 is twice. Backlash: play, in turns
            of the motor. Stiffness: lost part. Payload: mass added [kg]. Vacuum: part of the best
            vacuum that a leak takes.
        joint: Of ``friction``, ``backlash`` and ``stiffness``.
    """

    kind: Kind
    amount: float
    joint: str = ""


def worn(plant: Plant, wear: Wear) -> Plant:
    """Return the plant after one part has worn.

    Raises:
        KeyError: The plant has no such joint.
        ValueError: A payload is added to a tool that carries nothing.
    """
    match wear.kind:
        case "friction":
            return _with(plant, wear.joint, _rubbing, wear.amount)
        case "backlash":
            return _with(plant, wear.joint, _loose, wear.amount)
        case "stiffness":
            return _with(plant, wear.joint, _soft, wear.amount)
        case "payload":
            return _loaded(plant, wear.amount)
    return msgspec.structs.replace(plant, vacuum_leak=wear.amount)


def at_temperature(plant: Plant, celsius: float) -> Plant:
    """Return the plant with gears of this temperature: grease is thick while it is cold."""
    colder = WARM_C - celsius
    coulomb, viscous = 1.0 + 0.006 * colder, math.exp(0.022 * colder)
    axes = {name: _rubbed(axis, coulomb, viscous, 1.0) for name, axis in plant.axes.items()}
    return msgspec.structs.replace(plant, axes=axes)


def vacuum_s(plant: Plant, healthy_s: float) -> float:
    r"""Return how long the vacuum takes to build [s]; infinite where the leak is too large.

    .. math:: p(t) = (1 - l) (1 - e^{-t / \tau})

    Args:
        plant: Its ``vacuum_leak`` is l.
        healthy_s: Without a leak [s].
    """
    left = 1.0 - plant.vacuum_leak
    if left <= _SWITCH:
        return math.inf
    return healthy_s * math.log(1.0 - _SWITCH / left) / math.log(1.0 - _SWITCH)


def _with(plant: Plant, joint: str, law: Any, amount: float) -> Plant:
    axes = {**plant.axes, joint: law(plant.axes[joint], amount)}
    return msgspec.structs.replace(plant, axes=axes)


def _rubbing(axis: AxisFile, amount: float) -> AxisFile:
    """Coulomb's part grows most; the boundary layer reaches to higher speeds."""
    return _rubbed(axis, 1.0 + amount, 1.0 + 0.4 * amount, 1.0 + 0.3 * amount)


def _rubbed(axis: AxisFile, coulomb: float, viscous: float, stribeck: float) -> AxisFile:
    def by(file: FrictionFile | None) -> FrictionFile | None:
        return file and FrictionFile(
            static_percent=file.static_percent * coulomb,
            coulomb_percent=file.coulomb_percent * coulomb,
            viscous_percent=file.viscous_percent * viscous,
            stribeck_percent=file.stribeck_percent * stribeck,
            load_percent=file.load_percent * coulomb,
        )

    friction, held = by(axis.friction), by(axis.held_friction)
    return msgspec.structs.replace(axis, friction=friction, held_friction=held)


def _loose(axis: AxisFile, amount: float) -> AxisFile:
    return msgspec.structs.replace(axis, backlash_turns=amount)


def _soft(axis: AxisFile, amount: float) -> AxisFile:
    """The loop loses stiffness and keeps its damping force."""
    left = math.sqrt(1.0 - amount)
    return msgspec.structs.replace(
        axis,
        natural_frequency_hz=axis.natural_frequency_hz * left,
        damping=axis.damping / left,
    )


def _loaded(plant: Plant, added_kg: float) -> Plant:
    """What hangs at the tool is heavier than the plant says, by inertia and by what it rubs."""
    # By how much an axis feels a kilogram stands nowhere but in what it feels of the payload.
    if not plant.payload_kg:
        raise ValueError(f"payload_kg = 0: {added_kg:g} kg more need a plant with a payload")
    share = (plant.payload_kg + added_kg) / plant.payload_kg

    def rubs(file: FrictionFile | None) -> FrictionFile | None:
        return file and msgspec.structs.replace(file, load_percent=file.load_percent * share)

    axes = {
        name: msgspec.structs.replace(
            axis,
            payload_inertia_percent=axis.payload_inertia_percent * share,
            friction=rubs(axis.friction),
            held_friction=rubs(axis.held_friction),
        )
        for name, axis in plant.axes.items()
    }
    return msgspec.structs.replace(plant, axes=axes, payload_kg=plant.payload_kg + added_kg)
