"""What what_if.yaml says of the gate; its other keys are the judge's own."""

from __future__ import annotations

from pathlib import Path

import msgspec
from scara_config import load, locate
from scara_config.quantities import GateMs
from scara_config.text_enum import StrEnum


class Act(StrEnum):
    """What is done with a motion that is judged REFUSED."""

    REFUSE = "refuse"
    WARN = "warn"
    OFF = "off"
    """No judge is asked at all."""


class Unjudged(StrEnum):
    """What is done with a motion that nobody judged in time."""

    MOVE = "move"
    REFUSE = "refuse"


class GateSettings(msgspec.Struct, frozen=True):
    """The gate.

    Attributes:
        gate: What is done with a motion that is judged REFUSED.
        gate_timeout_ms: A motion waits for its judgement so long at most.
        gate_program_timeout_ms: Likewise a program.
        gate_without_judge: What is done with a motion that was not judged.
        hold_own_programs: Whether a program that the robot starts by itself is held if it is judged
            REFUSED; it is judged and told in any case.
    """

    gate: Act
    gate_timeout_ms: GateMs
    gate_program_timeout_ms: GateMs
    gate_without_judge: Unjudged
    hold_own_programs: bool

    @property
    def patience(self) -> float:
        """How long a motion waits [s]."""
        return self.gate_timeout_ms * 1e-3

    @property
    def program_patience(self) -> float:
        """How long a program waits [s]."""
        return self.gate_program_timeout_ms * 1e-3


def load_gate(directory: Path | str | None = None) -> GateSettings:
    """Read the gate's keys of what_if.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("what_if.yaml", directory), GateSettings)
