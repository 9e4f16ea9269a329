"""Does what happens differ more and more from what is predicted?"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import median

from what_if.config import LearningConfig
from what_if.learning.pairing import Outcome

WORDS = {"time": "moving time", "way": "way of the tool", "effort": "largest effort"}
ADVICE = {
    "time": "measure the robot's lag (doctor --move) and look at program: in what_if.yaml",
    "way": "look whether robot.yaml has the arm's true lengths",
    "effort": "look at the payload that the controller was told, and at the joints' friction",
}


class Drift:
    """The last ratios of measured to predicted, and whether their medians are within the limits.

    Not their means: one odd motion is no drift, however odd. The first one of a robot that nobody
    has measured yet is, since the twin controller holds the twin back until it knows its delay.
    """

    def __init__(self, config: LearningConfig) -> None:
        """Know nothing yet."""
        self._config = config
        self._limits = {
            "time": config.time_percent,
            "way": config.way_percent,
            "effort": config.effort_percent,
        }
        self._kept: dict[str, deque[float]] = {name: deque(maxlen=config.motions) for name in WORDS}

    def take(self, outcome: Outcome) -> None:
        """Take in a motion that has ended; what did not reach its target teaches nothing."""
        for name, ratio in outcome.ratios.items():
            self._kept[name].append(ratio)

    @property
    def medians(self) -> Mapping[str, float]:
        """Median ratio of each measure, of those that are known."""
        return {name: median(kept) for name, kept in self._kept.items() if kept}

    @property
    def alarms(self) -> tuple[str, ...]:
        """What is outside its limit, with what to do; only once enough motions have ended."""
        found = []
        for name, ratio in self.medians.items():
            off, count = 100.0 * (ratio - 1.0), len(self._kept[name])
            if count == self._config.motions and abs(off) > self._limits[name]:
                found.append(
                    f"{WORDS[name]} of the last {count} motions is {off:+.1f} % off its prediction "
                    f"(allowed {self._limits[name]:g} %): {ADVICE[name]}"
                )
        return tuple(found)
