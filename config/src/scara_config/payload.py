"""What may hang at the tool: the table of payloads.yaml, by number as a controller's PAYLOAD[n]."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from scara_config.loader import ConfigError, load
from scara_config.profile import locate
from scara_config.quantities import LeverM

Mass = Annotated[float, Meta(ge=0.0, le=1000.0)]
Moment = Annotated[float, Meta(ge=0.0, le=1000.0)]
Number = Annotated[int, Meta(ge=1, le=10)]
_ROUNDING = 1e-9
"""[kg m^2]: so much rounding may put one moment of inertia above the sum of the others."""


class PayloadError(ValueError):
    """A payload that the robot cannot carry or no body can have; the text names key and range."""


class Payload(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rigid body at the tool.

    Attributes:
        number: n of PAYLOAD[n].
        name: For people.
        mass_kg: [kg]
        centre_m: Centre of mass in the frame ``tool_frame`` of robot.yaml, x y z [m].
        inertia_kg_m2: Moments about the centre, along that frame's axes, xx yy zz [kg m^2].
    """

    number: Number
    name: Annotated[str, Meta(min_length=1, max_length=40)]
    mass_kg: Mass
    centre_m: tuple[LeverM, LeverM, LeverM] = (0.0, 0.0, 0.0)
    inertia_kg_m2: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)


class Payloads(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file payloads.yaml.

    Attributes:
        rated_kg: The most that the robot may carry [kg].
        set_number: PAYLOAD[n] that the controller is told at the start.
        mounted_number: What hangs at the simulated tool at the start.
        payloads: The table.
    """

    rated_kg: Annotated[float, Meta(gt=0.0, le=1000.0)]
    set_number: Number
    mounted_number: Number
    payloads: Annotated[list[Payload], Meta(min_length=1, max_length=10)]

    def find(self, number: int) -> Payload:
        """Return PAYLOAD[number].

        Raises:
            PayloadError: There is none; the text lists those that exist.
        """
        for payload in self.payloads:
            if payload.number == number:
                return payload
        known = ", ".join(f"{p.number} ({p.name})" for p in self.payloads)
        raise PayloadError(f"number = {number}: is no payload of the table, which has {known}")

    def replaced(self, payload: Payload) -> Payloads:
        """Return the table with another entry in place of the one of its number.

        Raises:
            PayloadError: There is no such number, or the robot cannot carry it.
        """
        self.find(payload.number)
        for problem in problems(payload, self.rated_kg):
            raise PayloadError(problem)
        table = [payload if p.number == payload.number else p for p in self.payloads]
        return msgspec.structs.replace(self, payloads=table)


def problems(payload: Payload, rated_kg: float) -> Iterator[str]:
    """Yield what is wrong with a payload for a robot that carries ``rated_kg``, as text."""
    if not 0.0 <= payload.mass_kg <= rated_kg:
        yield (
            f"mass_kg = {payload.mass_kg:g}: is outside [0, {rated_kg:g}] kg, what the robot is "
            "rated for (rated_kg)"
        )
    for key, values, limit in (
        ("centre_m", payload.centre_m, 1.0),
        ("inertia_kg_m2", payload.inertia_kg_m2, 1000.0),
    ):
        low = -limit if key == "centre_m" else 0.0
        if not all(low <= value <= limit for value in values):
            yield f"{key} = {list(values)}: each must be in [{low:g}, {limit:g}]"
    moments = payload.inertia_kg_m2
    if payload.mass_kg == 0.0 and any(moments):
        yield f"inertia_kg_m2 = {list(moments)}: must be 0 without a mass"
    if 2.0 * max(moments) > sum(moments) + _ROUNDING:
        yield (
            f"inertia_kg_m2 = {list(moments)}: no body has a moment of inertia above the sum of "
            "the other two"
        )


def load_payloads(directory: Path | str | None = None) -> Payloads:
    """Read payloads.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a number occurs twice or is chosen and not there,
            a payload is heavier than rated or no body can have its inertia.
    """
    path = locate("payloads.yaml", directory)
    table = load(path, Payloads)
    numbers = [payload.number for payload in table.payloads]
    for number in numbers:
        if numbers.count(number) > 1:
            raise ConfigError(f"{path}: payloads: number = {number}: occurs more than once")
    for key in ("set_number", "mounted_number"):
        if getattr(table, key) not in numbers:
            raise ConfigError(
                f"{path}: {key} = {getattr(table, key)}: Expected one of "
                f"{', '.join(map(str, numbers))}"
            )
    for payload in table.payloads:
        for problem in problems(payload, table.rated_kg):
            raise ConfigError(f"{path}: payloads: {payload.name}.{problem}")
    return table
