"""Changing gains while the loops run.

It says what is let in, why the rest is refused, and how a change is taken back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Literal, cast

import msgspec
from scara_control.pid import PidGains

from scara_simulation.config import LoopGains
from scara_simulation.tuning.stability import (
    KINDS,
    TOLERANCE,
    Kind,
    Plant,
    stable_range,
    worst_radius,
)

Value = float | bool
FACTORS: tuple[Literal["p", "i", "d"], ...] = ("p", "i", "d")
KEYS = (*FACTORS, "i_clamp", "antiwindup")
PARAMETERS: dict[str, tuple[Kind, str]] = {
    f"{kind}_{key}": (kind, key) for kind in KINDS for key in KEYS
}
"""Name of each parameter of a joint: which loop, which gain."""
MOST_UNDO = 1000
"""So many changes can be taken back. Our choice."""


class TuningError(ValueError):
    """A change that is not made; the text names joint, key, value and what is allowed."""


class Change(msgspec.Struct, frozen=True):
    """One joint's gains before and after."""

    joint: str
    before: LoopGains
    after: LoopGains

    def values(self) -> Iterator[tuple[str, Value, Value]]:
        """Yield (parameter, before, after) for each that differs."""
        for name in PARAMETERS:
            before, after = value_of(self.before, name), value_of(self.after, name)
            if before != after:
                yield name, before, after

    def describe(self) -> str:
        """Return ``joint_1: position_p 8285 -> 9000, ...``."""
        return f"{self.joint}: " + ", ".join(
            f"{name} {_show(a)} -> {_show(b)}" for name, a, b in self.values()
        )


def value_of(gains: LoopGains, name: str) -> Value:
    """Return the value of one parameter."""
    kind, key = PARAMETERS[name]
    return cast(Value, getattr(getattr(gains, kind), key))


class Tuning:
    """The gains in force of all joints, and the changes that led to them."""

    def __init__(
        self,
        joints: Sequence[str],
        gains: Sequence[LoopGains],
        efforts: Sequence[float],
        plant: Plant,
    ) -> None:
        """Begin with the gains of the file.

        Args:
            joints: Names, in the order of the plant.
            gains: Of each joint.
            efforts: Largest effort of each joint [N m] or [N]: the most that a clamp may be.
            plant: What the gains must be stable for.

        Raises:
            TuningError: They are not stable.
        """
        self._joints, self._gains, self._efforts, self._plant = (
            list(joints),
            list(gains),
            list(efforts),
            plant,
        )
        self._changes: list[Change] = []
        for joint, loops in zip(self._joints, gains):
            self._check_stability(
                joint, loops, [f"{kind}_{key}" for kind in KINDS for key in FACTORS]
            )

    def gains(self, joint: str) -> LoopGains:
        """Return the gains in force."""
        return self._gains[self._joints.index(joint)]

    def ranges(self, joint: str) -> dict[str, tuple[float, float]]:
        """Return the allowed values of each number, the others as they are."""
        return {
            name: self._range(joint, name, self.gains(joint))
            for name, (_, key) in PARAMETERS.items()
            if key != "antiwindup"
        }

    def coupled(self, joint: str) -> list[str]:
        """Return the other joints whose ranges depend on the gains of ``joint``."""
        index = self._joints.index(joint)
        # With many joints each is judged alone.
        group = [] if self._plant.extremes else self._plant.group(index)
        return [self._joints[k] for k in group if k != index]

    def propose(self, joint: str, values: Mapping[str, object]) -> Change:
        """Return the change that sets the parameters ``values``; nothing is changed yet.

        Raises:
            TuningError: An unknown parameter, a value of the wrong kind, not finite, negative, a
                clamp above the joint's effort or without effect, or gains that are not stable at
                the physics step.
        """
        before = after = self.gains(joint)
        for name, value in values.items():
            after = self._with(joint, after, name, value)
        change = Change(joint, before, after)
        self._check_stability(joint, after, [name for name, *_ in change.values()])
        return change

    def accept(self, change: Change) -> None:
        """Let a change be in force, to be taken back by :meth:`undo`."""
        self._gains[self._joints.index(change.joint)] = change.after
        self._changes = [*self._changes[1 - MOST_UNDO :], change]

    def undo(self) -> Change:
        """Take the last change back and return what that changes.

        Raises:
            TuningError: There is none.
        """
        if not self._changes:
            raise TuningError("nothing to undo: no gain has been changed since the start")
        last = self._changes.pop()
        self._gains[self._joints.index(last.joint)] = last.before
        return Change(last.joint, last.after, last.before)

    def _with(self, joint: str, gains: LoopGains, name: str, value: object) -> LoopGains:
        """Return ``gains`` with one parameter set."""
        if name not in PARAMETERS:
            raise TuningError(
                f"{joint}: unknown parameter {name!r}: it has {', '.join(PARAMETERS)}"
            )
        kind, key = PARAMETERS[name]
        loop: PidGains = getattr(gains, kind)
        if key == "antiwindup":
            if not isinstance(value, bool):
                raise TuningError(f"{joint} {name} = {value!r}: must be true or false")
        else:
            # A number that a loop can have, or refuse it
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise TuningError(f"{joint} {name} = {value!r}: must be a number")
            most = (
                self._efforts[self._joints.index(joint)] if name.endswith("i_clamp") else math.inf
            )
            if not (math.isfinite(value) and 0.0 <= value <= most):
                low, high = self._range(joint, name, self.gains(joint))
                raise TuningError(f"{joint} {name} = {_show(value)} is outside [{low:g}, {high:g}]")
            if name.endswith("i_clamp") and loop.i_clamp_max is not None and value != loop.i_clamp:
                raise TuningError(
                    f"{joint} {name} = {_show(value)}: has no effect, i_clamp_min and "
                    "i_clamp_max are given in the file"
                )
            value = float(value)
        return msgspec.structs.replace(
            gains, **{kind: msgspec.structs.replace(loop, **{key: value})}
        )

    def _check_stability(self, joint: str, loops: LoopGains, changed: Sequence[str]) -> None:
        """Refuse gains with a pole outside the unit circle.

        Say which range the changed ones have.
        """
        index = self._joints.index(joint)
        gains = [*self._gains[:index], loops, *self._gains[index + 1 :]]
        for kind in KINDS:
            names = [
                name
                for name in changed
                if PARAMETERS[name][0] == kind and PARAMETERS[name][1] in FACTORS
            ]
            if not names:
                continue
            radius = worst_radius(self._plant, gains, index, kind)
            if radius > 1.0 + TOLERANCE:
                raise TuningError(self._explain(joint, loops, names, radius))

    def _explain(self, joint: str, loops: LoopGains, names: Sequence[str], radius: float) -> str:
        """Say that gains are not stable.

        Say what each of the named ones could be with the others as they are.
        """
        asked = {name: _show(value_of(loops, name)) for name in names}
        ranges = {name: self._range(joint, name, loops) for name in names}
        texts = [
            f"{name} = {asked[name]} is outside [{low:g}, {high:g}]"
            for name, (low, high) in ranges.items()
            if low <= high
        ]
        if not texts:
            texts = [
                f"{name} = {text}, of which no value is stable with the other gains"
                for name, text in asked.items()
            ]
        step = f"{self._plant.dt * 1e3:g} ms"
        return (
            f"{joint} "
            + ", ".join(texts)
            + f": not stable at a physics step of {step} (pole of magnitude {radius:.6g})"
        )

    def _range(self, joint: str, name: str, loops: LoopGains) -> tuple[float, float]:
        """Return smallest and largest allowed value of one number, rounded inwards.

        (inf, -inf) if there is none.
        """
        index, (kind, key) = self._joints.index(joint), PARAMETERS[name]
        if key == "i_clamp":
            return 0.0, self._efforts[index]
        gains = [*self._gains[:index], loops, *self._gains[index + 1 :]]
        found = stable_range(self._plant, gains, index, kind, cast(Literal["p", "i", "d"], key))
        return (
            (_rounded(found[0], math.ceil), _rounded(found[1], math.floor))
            if found
            else (math.inf, -math.inf)
        )


def _rounded(value: float, towards: Callable[[float], int]) -> float:
    """Return ``value`` with 4 digits, rounded by ``towards``."""
    if value == 0.0:
        return 0.0
    digits = 3 - math.floor(math.log10(value))
    return round(towards(value * 10.0**digits) / 10.0**digits, max(digits, 0))


def _show(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:.10g}"
