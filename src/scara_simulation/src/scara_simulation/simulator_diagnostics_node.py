"""The simulator's part of ``/diagnostics``."""

from __future__ import annotations

import rospy
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import Diagnostics

from scara_simulation.config import SimulationConfig
from scara_simulation.health import SaturationWatch, Status, judge

_LEVELS = {"ok": Level.OK, "warn": Level.WARN, "error": Level.ERROR}


class DiagnosticsPort:
    """Publishes how the simulation is doing.

    Compares with the last report to tell new troubles from old ones.
    """

    def __init__(self, factor: float, config: SimulationConfig) -> None:
        """Advertise; ``factor`` is the speed that shall be kept, 0: none."""
        self._factor = factor
        self._saturation = SaturationWatch(
            config.saturation_window_steps, config.saturation_limit_percent
        )
        self._last: Status | None = None
        self._diagnostics = Diagnostics("simulator")

    def report(self, status: Status) -> None:
        """Publish ``status``."""
        saturation = self._saturation.judge(status.steps, status.saturated_steps)
        level, text = judge(status, self._last, self._factor, saturation)
        self._last = status
        name = f"{rospy.get_name()}: physics"
        self._diagnostics.publish(Diagnosis(_LEVELS[level], name, text, dict(_values(status))))


def _values(status: Status) -> list[tuple[str, str]]:
    late = status.deadlines
    return [
        ("paused", str(status.paused)),
        ("steps", str(status.steps)),
        ("real time factor", f"{status.real_time_factor:.3f}"),
        ("wakes", str(late.wakes)),
        ("wakes missed", str(late.missed)),
        ("wake late p50 [ms]", f"{late.p50_ms:.3f}"),
        ("wake late p99 [ms]", f"{late.p99_ms:.3f}"),
        ("wake late max [ms]", f"{late.max_ms:.3f}"),
        ("stalls", str(status.stalls)),
        ("steps skipped", str(status.skipped_steps)),
        ("system clock steps", str(status.clock_steps)),
        ("joint steps with saturated effort", str(sum(status.saturated_steps.values()))),
        ("joint steps with limited set point", str(status.limited_steps)),
        ("commands refused", str(status.refused)),
        ("last refusal", status.last_refusal),
    ]
