"""How late each joint does its set points: what ``response.measured`` wants to know."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scara_config import Joint
from twin_controller.config import TwinControllerConfig
from twin_controller.estimation.delay import Fit, fit_joint
from twin_controller.estimation.rhythm import Rhythm, heard
from twin_controller.robot_sample import RobotSample

from robot_doctor.finding import Finding, Group, fine, note


class DelayStretch:
    """What one joint was told on a stretch of its way, and what it did.

    Times of what it was told are ours [s], or the robot's where it takes set points ahead.
    """

    def __init__(self, joint: Joint, index: int, config: TwinControllerConfig) -> None:
        """Begin with nothing; ``index`` is the joint's place in a sample."""
        self._by_its_clock = False
        self.joint, self._index, self._config = joint, index, config
        self._told: list[tuple[float, float]] = []
        self._seen: list[tuple[float, float]] = []
        self._rhythm = Rhythm()
        # Least and most that the robot's clock can be ahead of ours [s].
        self._least: list[float] = []
        self._most: list[float] = []

    def tell(self, at: float, position: float) -> None:
        """Take in a set point as it was sent [rad or m]."""
        self._told.append((at, position / self.joint.scale))

    def tell_ahead(self, clock_ms: int, position: float) -> None:
        """Take in a set point that counts when the robot's clock shows ``clock_ms`` [rad or m]."""
        self._by_its_clock = True
        self.tell(1e-3 * clock_ms, position)

    def take(self, sample: RobotSample, sent: float, received: float) -> None:
        """Take in an answer."""
        clock = sample.clock_ms * 1e-3
        # The same reading once more would count twice.
        if self._seen and self._seen[-1][0] == clock:
            return
        self._rhythm = heard(self._rhythm, sample.clock_ms, 0.5 * (sent + received))
        latency = self._config.real.sample_latency_ms * 1e-3
        self._least.append(clock + latency - received)
        self._most.append(clock + latency - sent)
        self._seen.append((clock, sample.motion.q[self._index] / self.joint.scale))

    def fit(self) -> Fit | None:
        """Fit delay and smoothing; None if too little was seen."""
        if len(self._told) < 10 or len(self._seen) < 10:
            return None
        # A reading is of any age up to its period.
        ahead = 0.5 * (max(self._least) + min(self._most) + self._rhythm.period)
        # What it was told stands on the robot's own clock then, as what was seen.
        ahead = 0.0 if self._by_its_clock else ahead
        told, seen = np.array(self._told), np.array(self._seen)
        longest = self._config.response.longest_ms * 1e-3
        return fit_joint(told[:, 0], told[:, 1], seen[:, 0] - ahead, seen[:, 1], 0.0, longest)


def check_delays(
    fits: Sequence[tuple[Joint, Fit | None]], config: TwinControllerConfig
) -> Iterator[Finding]:
    """Say how late each joint was, and what to write into twin_controller.yaml.

    Args:
        fits: Each joint of the twin, in order.
        config: What the twin controller expects.
    """
    measured = []
    for joint, fit in fits:
        if fit is None or fit.doubt > config.response.known_ms * 1e-3:
            yield note(
                Group.LINKS,
                f"{joint.name}: how late it does its set points was not seen",
                "the twin controller measures it at the first motion",
            )
            continue
        text = f"{joint.name}: does its set points {1e3 * fit.delay:.1f} ms late"
        yield fine(Group.LINKS, f"{text}, known to {1e3 * fit.doubt:.1f} ms")
        # The fit of a quick robot may come out below 0, which the file does not take.
        smoothing = max(0.0, 1e6 * fit.smoothing)
        delay = f"delay_ms: {1e3 * fit.delay:.1f}, smoothing_ms2: {smoothing:.0f}"
        measured.append(f"{joint.name}: {{{delay}}}")
    if len(measured) == len(fits):
        yield note(
            Group.LINKS,
            f"response.measured: {{{', '.join(measured)}}}",
            "write this into twin_controller.yaml: the first move is as fast as the later ones",
        )
