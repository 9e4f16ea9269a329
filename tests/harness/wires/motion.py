"""What a side really did, from its stamped joint states.

Positions and speeds at given times, standstill, ramps.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

from scara_config import load_robot

from harness.scenes.truth import Row
from harness.workspace import ROOT

ROBOT = load_robot(ROOT / "config")
KEPT = 20_000
"""So many messages are kept, 80 s of the robot's."""
STILL = 0.002
"""A joint slower than this part of its greatest speed stands."""
SEEN_STILL_S = 0.1
BRAKE = 1.3
"""The stand-in brakes with this multiple of robot.yaml's acceleration (emulator.yaml)."""
FILTERS_S = 0.030
"""And its filters follow this much later."""


class Motion:
    """A growing list of sensor_msgs/JointState of one side, read by time of truth (ROS time)."""

    def __init__(self, names: Sequence[str]) -> None:
        """Look at the joints ``names``."""
        self._joints = [ROBOT.joint(name) for name in names]
        self.messages: deque[Any] = deque(maxlen=KEPT)

    def shares(self, message: Any) -> list[float]:
        """Return each joint's speed as a part of its greatest."""
        at = dict(zip(message.name, message.velocity))
        return [abs(at[joint.name]) / joint.velocity for joint in self._joints]

    def position(self) -> list[float]:
        """Return the newest joint positions, SI."""
        at = dict(zip(self.messages[-1].name, self.messages[-1].position))
        return [float(at[joint.name]) for joint in self._joints]

    def between(self, begin: float, end: float = math.inf) -> list[Any]:
        """Return the messages that were true in [begin, end]."""
        found = []
        for message in reversed(list(self.messages)):
            stamp = message.header.stamp.to_sec()
            if stamp < begin:
                break
            if stamp <= end:
                found.append(message)
        return found[::-1]

    def truth(self, begin: float, end: float = math.inf) -> list[Row]:
        """Return time [s], positions and velocities of the joints within [begin, end], SI."""
        rows = []
        for message in self.between(begin, end):
            q, qdot = (dict(zip(message.name, v)) for v in (message.position, message.velocity))
            names = [joint.name for joint in self._joints]
            rows.append(
                (
                    message.header.stamp.to_sec(),
                    tuple(q[name] for name in names),
                    tuple(qdot[name] for name in names),
                )
            )
        return rows

    def under_way(self, share: float, duration: float) -> bool:
        """Return whether a joint was faster than this share of its limit for so long [s]."""
        recent = (
            self.between(self.messages[-1].header.stamp.to_sec() - duration)
            if self.messages
            else []
        )
        return len(recent) > 5 and all(max(self.shares(message)) > share for message in recent)

    def standstill(self, since: float) -> float:
        """Return how long after ``since`` the side stood for good [s].

        Infinity while it moves, and until it was seen to stand for ``SEEN_STILL_S``.
        """
        # Read once: a message that comes between two looks would make a moving side stand.
        seen = self.between(since)
        stamps = [m.header.stamp.to_sec() for m in seen if max(self.shares(m)) > STILL]
        last = max(stamps, default=since)
        if not seen or last >= seen[-1].header.stamp.to_sec() - SEEN_STILL_S:
            return math.inf
        return last - since

    def ramp(self, since: float) -> float:
        """Return how long [s] the robot's own ramp takes from its speed at ``since``."""
        before = self.between(since - 0.2, since)
        at = dict(zip(before[-1].name, before[-1].velocity))
        ramps: list[float] = [
            abs(at[joint.name]) / (BRAKE * joint.acceleration) for joint in self._joints
        ]
        return max(ramps) + FILTERS_S

    def travel(self, begin: float, end: float = math.inf) -> float:
        """Return the largest way of any joint within [begin, end], in degrees or millimetres."""
        rows = [dict(zip(m.name, m.position)) for m in self.between(begin, end)]
        if not rows:
            return math.inf
        ways: list[float] = [
            max(abs(row[j.name] - rows[0][j.name]) for row in rows) / j.scale for j in self._joints
        ]
        return max(ways)

    def peak(self, begin: float, end: float = math.inf) -> float:
        """Return the largest speed of any joint within [begin, end], as a part of its greatest."""
        return max(
            (max(self.shares(message)) for message in self.between(begin, end)), default=math.inf
        )
