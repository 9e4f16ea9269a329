"""The set points with time that one joint has been sent: which of them counts at an instant."""

from __future__ import annotations

import math

from scara_control.joint_motion import AxisMotion
from scara_control.joint_track import JointTrack

from scara_simulation.compiled.cells import Piece


class TrackQueue:
    """Tracks in the order of their first points; each counts from its own first point on."""

    __slots__ = ("_entries",)

    def __init__(self) -> None:
        """Begin empty."""
        self._entries: list[tuple[JointTrack, int, float]] = []

    def add(self, track: JointTrack, column: int) -> None:
        """Let a column of ``track`` replace all that was to come after its first point.

        What is due before it stays.
        """
        earlier = [
            entry for entry in self._entries if entry[0].first_time + entry[2] < track.first_time
        ]
        self._entries = earlier + [(track, column, 0.0)]

    def clear(self) -> None:
        """Forget all."""
        self._entries = []

    def postpone(self, duration: float) -> None:
        """Let all be due ``duration`` [s] later."""
        self._entries = [
            (track, column, delay + duration) for track, column, delay in self._entries
        ]

    def sample(self, t: float) -> AxisMotion:
        """Return the motion at time ``t``; tracks that have been replaced by then are forgotten."""
        entries = self._entries
        while len(entries) > 1 and entries[1][0].first_time + entries[1][2] <= t:
            entries.pop(0)
        track, column, delay = entries[0]
        return track.sample_joint(column, t - delay)

    def piece(self, t: float) -> Piece | None:
        """Return the polynomial that :meth:`sample` has just used; None: it is none.

        Args:
            t: The time that was sampled [s].
        """
        (track, column, delay), later = self._entries[0], self._entries[1:2]
        found = track.polynomial(column, t - delay)
        if found is None:
            return None
        until = later[0][0].first_time + later[0][2] if later else math.inf
        return Piece(until, delay, *found)
