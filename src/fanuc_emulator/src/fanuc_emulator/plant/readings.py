"""What a client can read of where the axes are: seldom, roughly, and not quite when it says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scara_config import Joint

from fanuc_emulator.plant.config import Plant, zero_offset

Values = tuple[float, ...]


class RegisterReading(NamedTuple):
    """Positions, speeds [SI], clock [ms] and motor torques [percent] as the registers show them."""

    positions: Values
    velocities: Values
    clock_ms: int
    torques: Values


class Readings:
    """Copies positions and clock into the registers, stepped once per servo period.

    Args:
        plant: Period, noise, decimals, how far the clock is apart.
        joints: Those of robot.yaml.
        random: Draws noise and clock errors; None if the plant has neither.

    Raises:
        ValueError: The plant has noise or clock errors, and there is nothing to draw them.
    """

    def __init__(
        self, plant: Plant, joints: Sequence[Joint], random: np.random.Generator | None
    ) -> None:
        measuring = plant.measuring
        self._every = measuring.period_ms // plant.servo_period_ms
        self._phase = measuring.phase_ms // plant.servo_period_ms
        self._clock_error = plant.clock.error_ms
        self._noise = [getattr(measuring, f"noise_{j.unit}") * j.scale for j in joints]
        self._noisy = any(self._noise)
        self._decimals = measuring.decimals
        self._scales = [joint.scale for joint in joints]
        self._zero = [zero_offset(plant, joint) for joint in joints]
        if random is None and (self._noisy or self._clock_error):
            raise ValueError("the plant has noise or clock errors: a generator has to draw them")
        self._random = random
        self._held: RegisterReading | None = None

    def true_positions(self, positions: Values) -> Values:
        """Return where the joints are: what the encoders say, and how far their zero is off."""
        if not any(self._zero):
            return positions
        return tuple([q + zero for q, zero in zip(positions, self._zero)])

    def read(
        self, tick: int, positions: Values, velocities: Values, clock_ms: int, torques: Values = ()
    ) -> RegisterReading:
        """Return what is shown in this servo period.

        Args:
            tick: Counts servo periods.
            positions: In whole encoder counts [rad or m], shape ``(n,)``.
            velocities: As the drives give them [rad/s or m/s].
            clock_ms: The controller's own clock [ms].
            torques: Of the motors [percent].
        """
        if self._held is not None and (tick - self._phase) % self._every:
            return self._held
        if self._noisy and self._random is not None:
            drawn = zip(self._noise, self._random.standard_normal(len(self._noise)).tolist())
            positions = tuple([q + (noise * one) for q, (noise, one) in zip(positions, drawn)])
        if self._decimals is not None:
            digits = self._decimals
            positions = tuple(
                [round(q / scale, digits) * scale for q, scale in zip(positions, self._scales)]
            )
        if self._clock_error and self._random is not None:
            clock_ms += int(self._random.integers(-self._clock_error, self._clock_error + 1))
        self._held = RegisterReading(positions, velocities, clock_ms, torques)
        return self._held
