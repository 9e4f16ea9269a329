"""The set points with time that one joint has been sent: which of them counts at an instant."""

from __future__ import annotations

import math

from scara_control.joint_motion import AxisMotion
from scara_control.joint_track import JointTrack

Piece = tuple[float, float, float, float, float, tuple[float, ...]]
"""A polynomial of one joint's set points, and when it holds.

Time from which another track counts; how much later than planned the track is due; from when on
and until when it holds, in the track's time, and how long at most after that begin [s]; six
coefficients of a quintic in the time since, or position, velocity and acceleration of an
extrapolation.
"""


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

    def lasts(self, t: float) -> bool:
        """Return whether points are due after the time ``t`` [s]."""
        return any(track.last_time + delay > t for track, _, delay in self._entries)

    def sample(self, t: float) -> AxisMotion:
        """Return the motion at time ``t``; tracks that have been replaced by then are forgotten."""
        track, column, delay = self._due(t)
        return track.sample_joint(column, t - delay)

    def piece(self, t: float) -> Piece | None:
        """Return the polynomial that :meth:`sample` computes at ``t``; None: it is none.

        Args:
            t: Time [s].
        """
        track, column, delay = self._due(t)
        found = track.polynomial(column, t - delay)
        if found is None:
            return None
        entries = self._entries
        until = entries[1][0].first_time + entries[1][2] if len(entries) > 1 else math.inf
        return until, delay, *found

    def _due(self, t: float) -> tuple[JointTrack, int, float]:
        """Return the entry that counts at ``t``, and forget those before it."""
        entries = self._entries
        while len(entries) > 1 and entries[1][0].first_time + entries[1][2] <= t:
            entries.pop(0)
        return entries[0]
