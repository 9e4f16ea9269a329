"""What a node says about its own health: one status of ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus (REP-107)."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Diagnosis:
    """One status: how bad, of what, in words, and the values behind it."""

    level: int
    name: str
    message: str
    values: Mapping[str, object] = field(default_factory=dict)
