"""The figures of a comparison.

They compare real with twin in one recording, and recording with recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from twin_experiments.metrics.errors import Comparison, MetricsSettings, compare
from twin_experiments.metrics.lag import estimate_lag
from twin_experiments.metrics.series import (
    Aligned,
    Array,
    Mask,
    MetricsError,
    Motion,
    SampleGap,
    align,
    count_ends,
    equal_steps,
    find_gaps,
    interpolate,
    known_at,
)
from twin_experiments.metrics.tracks import (
    Mechanism,
    Track,
    along_path,
    distance_from_path,
    moving,
    onset,
)
from twin_experiments.report.record import pick

from twin_analysis.compare.config import ComparisonFile
from twin_analysis.compare.fidelity import Fidelity, measure_fidelity

FOREIGN_SHARE = (
    0.01  # our choice: of a foreign joint's range of motion, accepted between two snapshots
)
FINER = 16  # our choice: so much more finely the first recording's path is drawn
# Our choice: part of the path within which the nearest place is looked for; later it may cross
# itself
PATH_WINDOW = 0.05
SMALLEST = 1e-4  # [rad] or [m], our choice: accepted at least


@dataclass(frozen=True)
class JointDeviation:
    """Root mean square and largest deviation of one joint in its border unit."""

    name: str
    unit: str
    rms: float
    max: float


@dataclass(frozen=True)
class PairDeviation:
    """Real against twin in one recording.

    Args:
        track: What was compared.
        comparison: Errors of the tool; None for a robot without kinematics here.
        joints: Errors of the joints.
        lag_s: By how much the follower is behind; None if it cannot be told.
        fidelity: By trace alignment.
        mean_distance_mm: Distance of the tools in matched snapshots [mm]; None without kinematics
            or match.
        begun: The leader's first motion [s].
        over_time: Distance over time: instants after ``begun`` [s], distances in the unit of the
            places.
        along_path: Distance along the leader's path while both sides have samples: length so far,
            distances, both in the unit of the places.
        excluded_percent: Share of the experiment in which a side has no samples; no figure is of
            that time. Of a recording without marks: of the common time.
        gaps: These holes.
    """

    track: Track
    comparison: Comparison | None
    joints: tuple[JointDeviation, ...]
    lag_s: float | None
    fidelity: Fidelity
    mean_distance_mm: float | None
    begun: float
    over_time: tuple[Array, Array]
    along_path: tuple[Array, Array]
    excluded_percent: float
    gaps: tuple[SampleGap, ...]


@dataclass(frozen=True)
class RunDifference:
    """One side of a recording against the same side of the first one.

    Lengths in the unit of the places.

    Args:
        label: Of the recording.
        experiment: Which.
        side: ``real`` or ``twin``.
        time_rms: At the same time after the leader's first motion.
        time_max: The largest.
        path_rms: From the first recording's path, whatever the speed along it.
        path_max: The largest.
        length_percent: How much longer the path is.
        fidelity: By trace alignment.
    """

    label: str
    experiment: str
    side: str
    time_rms: float
    time_max: float
    path_rms: float
    path_max: float
    length_percent: float
    fidelity: Fidelity


class Comparer:
    """Compares tracks of one mechanism."""

    def __init__(
        self,
        mechanism: Mechanism,
        config: ComparisonFile,
        settings: MetricsSettings,
        percent: float,
        most_excluded_percent: float,
    ) -> None:
        """Take what all comparisons need.

        Args:
            mechanism: The joints.
            config: comparison.yaml.
            settings: Of the tool's errors.
            percent: Speed from which a joint moves, of its largest.
            most_excluded_percent: More of the time without samples is a reason.
        """
        self.most_excluded_percent = most_excluded_percent
        self._mechanism, self._config, self._settings, self._percent = (
            mechanism,
            config,
            settings,
            percent,
        )

    def pair(self, track: Track) -> PairDeviation:
        """Hold real against twin.

        Raises:
            MetricsError: The two cannot be brought onto one time axis.
        """
        sides, longest = (track.real, track.twin), self._settings.longest_gap_s
        aligned = align(*sides, self._settings.rate_hz, longest)
        # Nobody knows when an experiment without marks began and ended.
        if track.marked:
            aligned = count_ends(aligned, sides, track.start, track.end, longest)
        speeds = self._speeds([track])
        snapshots = self._snapshots(*sides)
        fidelity, matched_mm = self._fidelity(*snapshots, speeds), None
        if self._mechanism.tool is not None and len(fidelity.pairs):
            (real, twin), pairs = snapshots[0], fidelity.pairs
            matched_mm = float(self._distance(real[pairs[:, 0]], twin[pairs[:, 1]]).mean())
        begun = onset(track.side(track.leader), speeds)
        distance = self._distance(aligned.real.positions, aligned.twin.positions)
        _, instants, length = along_path(
            self._mechanism, track.side(track.leader), self._config.path_points, longest
        )
        # Where nothing moves, time counts from the first instant.
        zero = float(aligned.instants[0]) if begun is None else begun
        first, last = track.common
        # Behind the last sample of a side its last place would be drawn on.
        known = self._known(instants, *sides) & (instants >= first) & (instants <= last)
        # From SI to the units of the border.
        apart = (aligned.real.positions - aligned.twin.positions) / self._mechanism.scales
        leader, follower = aligned.real.velocities, aligned.twin.velocities
        if track.leader != "real":
            leader, follower = follower, leader
        return PairDeviation(
            track=track,
            comparison=self._tool_errors(track, speeds),
            joints=tuple(
                JointDeviation(name, unit, float(rms), float(largest))
                for name, unit, rms, largest in zip(
                    self._mechanism.names,
                    self._mechanism.units,
                    np.sqrt(np.mean(apart**2, axis=0)),
                    np.abs(apart).max(axis=0),
                )
            ),
            lag_s=self._behind(leader, follower, aligned, speeds),
            fidelity=fidelity,
            mean_distance_mm=matched_mm,
            begun=zero,
            over_time=(aligned.instants - zero, distance),
            along_path=(
                np.linspace(0.0, length, len(instants))[known],
                np.interp(instants[known], aligned.instants, distance),
            ),
            excluded_percent=100.0 * aligned.excluded_share,
            gaps=aligned.gaps,
        )

    def is_whole(self, track: Track) -> bool:
        """Return whether a track goes from the begin of its experiment to the end.

        A part of a path has other places at the same parts of its length.
        """
        if not track.marked:
            return track.finished
        begin, end = track.common
        missing = 1.0 - (end - begin) / (track.end - track.start)
        return track.finished and 100.0 * missing <= self.most_excluded_percent

    def runs(self, first: Track, other: Track) -> tuple[RunDifference, RunDifference]:
        """Hold a recording against the first one, side by side, from the leader's first motion on.

        When that was is known from the whole motion: by cross-correlation, close to where each
        leader begins to move.

        Raises:
            MetricsError: In one of them nothing moves, or they have no time in common.
        """
        speeds = self._speeds([first, other])
        begun = []
        for track in (first, other):
            at = onset(track.side(track.leader), speeds)
            if at is None:
                raise MetricsError(f"{track.label} {track.experiment}: nothing moves")
            begun.append(at)
        # The same side of both, whoever led the other one.
        leaders = (
            first.side(first.leader).shifted(-begun[0]),
            other.side(first.leader).shifted(-begun[1]),
        )
        aligned = align(*leaders, self._settings.rate_hz, self._settings.longest_gap_s)
        # None: it cannot be told, and the two onsets have to do.
        late = (
            self._behind(aligned.real.velocities, aligned.twin.velocities, aligned, speeds) or 0.0
        )
        real, twin = (
            self._run(
                first.side(side).shifted(-begun[0]),
                other.side(side).shifted(-begun[1] - late),
                other,
                speeds,
            )
            for side in ("real", "twin")
        )
        return real, twin

    def _run(self, first: Motion, other: Motion, track: Track, speeds: Array) -> RunDifference:
        """Compare one side of two recordings whose times count from the leader's first motion."""
        longest = self._settings.longest_gap_s
        aligned = align(first, other, self._settings.rate_hz, longest)
        in_time = self._distance(aligned.real.positions, aligned.twin.positions)
        count = self._config.path_points
        # A hole of either is cut out of both: parts of a path's length are then the same places.
        both = []
        for motion in (first, other):
            known = self._known(motion.stamps, first, other)
            kept = motion.stamps[known], motion.positions[known], motion.velocities[known]
            both.append(Motion(motion.side, *kept))
        reference, _, reference_length = along_path(
            self._mechanism, both[0], FINER * count, longest
        )
        places, instants, length = along_path(self._mechanism, both[1], count, longest)
        on_path = distance_from_path(places, reference, round(PATH_WINDOW * FINER * count))
        on_path = on_path[self._known(instants, first, other)]
        return RunDifference(
            label=track.label,
            experiment=track.experiment,
            side=first.side,
            time_rms=float(np.sqrt(np.mean(in_time**2))),
            time_max=float(in_time.max()),
            path_rms=float(np.sqrt(np.mean(on_path**2))),
            path_max=float(on_path.max()),
            length_percent=100.0 * (length / reference_length - 1.0)
            if reference_length > 0.0
            else 0.0,
            fidelity=self._fidelity(*self._snapshots(first, other), speeds),
        )

    def _speeds(self, tracks: Sequence[Track]) -> Array:
        motions = tuple(motion for track in tracks for motion in (track.real, track.twin))
        return self._mechanism.moving_speeds(motions, self._percent)

    def _distance(self, one: Array, other: Array) -> Array:
        return np.asarray(
            np.linalg.norm(self._mechanism.places(one) - self._mechanism.places(other), axis=1)
        )

    def _tool_errors(self, track: Track, speeds: Array) -> Comparison | None:
        """Return the errors of the tool; none without kinematics or motion."""
        mechanism = self._mechanism
        if mechanism.tool is None:
            return None
        columns = list(mechanism.arm)
        settings = replace(self._settings, moving_speeds=speeds[columns])
        # Where the operator leads both, the real robot counts as the leader.
        leader: Literal["real", "twin"] = "twin" if track.leader == "twin" else "real"
        try:
            return compare(
                pick(track.real, columns),
                pick(track.twin, columns),
                mechanism.tool,
                settings,
                leader,
            )
        # The joints can be compared all the same.
        except MetricsError:
            return None

    def _behind(
        self, leader: Array, follower: Array, aligned: Aligned, speeds: Array
    ) -> float | None:
        """Estimate a lag from joint velocities, each in parts of the speed from which it moves."""
        settings = self._settings
        return estimate_lag(
            leader / speeds,
            follower / speeds,
            aligned.segments,
            settings.rate_hz,
            settings.max_lag_s,
        )

    def _gaps(self, one: Motion, other: Motion) -> tuple[SampleGap, ...]:
        """Return the holes of both motions."""
        longest = self._settings.longest_gap_s
        return (*find_gaps(one, longest), *find_gaps(other, longest))

    def _known(self, instants: Array, one: Motion, other: Motion) -> Mask:
        """Return at which instants neither motion has a hole."""
        return known_at(instants, self._gaps(one, other))

    def _snapshots(self, one: Motion, other: Motion) -> tuple[list[Array], list[Array]]:
        """Return positions and velocities of both over their common time, holes left out."""
        start = float(max(one.stamps[0], other.stamps[0]))
        end = float(min(one.stamps[-1], other.stamps[-1]))
        instants = equal_steps(start, end, self._config.snapshots_hz, self._gaps(one, other))
        traces = [interpolate(motion, instants) for motion in (one, other)]
        return [positions for positions, _ in traces], [speeds for _, speeds in traces]

    def _fidelity(self, positions: list[Array], velocities: list[Array], speeds: Array) -> Fidelity:
        """Align the snapshots of two motions; see :meth:`_snapshots`."""
        joints = self._mechanism.joints
        if joints:
            accepted = self._config.accepted_of(list(joints))
        else:
            # Joints without a profile: a share of their range of motion.
            moved = np.ptp(np.concatenate(positions), axis=0)
            accepted = np.maximum(FOREIGN_SHARE * moved, SMALLEST)
        movings = (moving(velocities[0], speeds), moving(velocities[1], speeds))
        band = round(self._config.longest_shift_s * self._config.snapshots_hz)
        return measure_fidelity(
            positions[0], positions[1], accepted, movings, self._config.gap_penalty, band
        )
