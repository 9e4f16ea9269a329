"""How well two sides move as one: path error, lag, positioning error.

The controller, the report and the tests use it. Deviations are distances between the tool
positions of both sides at the same instant of one clock; lengths leave here in millimetres and in
percent of reach. Nothing is compensated unless the name says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from twin_experiments.metrics.lag import estimate_lag, tool_velocity
from twin_experiments.metrics.series import (
    Aligned,
    Array,
    Mask,
    MetricsError,
    Motion,
    align,
    true_runs,
)

ToolFunction: TypeAlias = Callable[[Array], Array]
"""Joint positions, shape ``(m, n)``, to tool positions in the base frame [m], shape ``(m, 3)``."""

MM = 1e3
MERGE_PAUSE_S = 0.1  # our choice: a shorter standstill does not end a move
STIRS, STIRS_S = 0.1, 0.5
"""A move that begins slowly is traced back to where the twin had this part of the moving speed, for
so long at most [s]: the robot's readings are too noisy for that. Our choice."""


@dataclass(frozen=True)
class MetricsSettings:
    """What counts as moving, as a hole, as a rest.

    Args:
        reach_mm: 100 percent of an error.
        moving_speeds: Speed from which a joint moves, shape ``(n,)``: [rad/s], prismatic [m/s].
        rate_hz: Instants per second at which the sides are compared.
        longest_gap_s: Samples further apart leave a hole.
        rest_s: A position counts after both sides stood still this long.
        rest_margin_s: The end of a rest that already belongs to the next move.
        set_position_radius_mm: A rest nearer than this to a set position is held against it.
        max_lag_s: Largest lag searched for.
        shortest_move_mm: Shorter moves get no error in percent of travelled path.
    """

    reach_mm: float
    moving_speeds: Array
    rate_hz: float = 1000.0
    longest_gap_s: float = 0.05
    rest_s: float = 0.5
    rest_margin_s: float = 0.02
    set_position_radius_mm: float = 20.0
    max_lag_s: float = 0.25
    shortest_move_mm: float = 10.0


@dataclass(frozen=True)
class ErrorSummary:
    """Largest and root-mean-square deviation in [mm] and in percent of reach."""

    max_mm: float
    rms_mm: float
    max_percent: float
    rms_percent: float


@dataclass(frozen=True)
class Move:
    """One move: its time [s], the way of the leader's tool and how far the sides were apart."""

    start: float
    end: float
    length_mm: float
    error_max_mm: float
    travelled_percent: float | None


@dataclass(frozen=True)
class Rest:
    """Both sides stand still.

    Errors are the largest inside ``start`` to ``end`` [s], the measured part of the rest.
    ``set_position`` names the set position that is held, if one is near; then each side's distance
    from it is given.
    """

    start: float
    end: float
    deviation_mm: float
    set_position: str | None
    real_error_mm: float | None
    twin_error_mm: float | None

    @property
    def worst_mm(self) -> float:
        """Largest of the three distances [mm]."""
        return max(self.deviation_mm, self.real_error_mm or 0.0, self.twin_error_mm or 0.0)


@dataclass(frozen=True)
class Trace:
    """What gives the errors: instants [s], tool positions [m], their distance [mm], who moves."""

    aligned: Aligned
    real_tool: Array
    twin_tool: Array
    deviation_mm: Array
    moving: Mask
    stirring: Mask


@dataclass(frozen=True)
class Comparison:
    """All errors of one experiment. ``lag_s`` > 0: the follower is behind; None: lag unknown."""

    trace: Trace
    path: ErrorSummary
    lag_s: float | None
    path_after_lag: ErrorSummary | None
    trace_after_lag: Trace | None
    moves: tuple[Move, ...]
    rests: tuple[Rest, ...]

    @property
    def travelled_percent(self) -> float | None:
        """Largest error of a move in percent of that move's length."""
        return max(
            (move.travelled_percent for move in self.moves if move.travelled_percent is not None),
            default=None,
        )

    @property
    def positioning_max_mm(self) -> float | None:
        """Largest error of all rests [mm], between both sides and against the set position."""
        return max((rest.worst_mm for rest in self.rests), default=None)


def deviation_mm(real_tool: Array, twin_tool: Array) -> Array:
    """Return |p_real - p_twin| [mm] for tool positions [m] of shape ``(..., 3)``."""
    return np.asarray(np.linalg.norm(real_tool - twin_tool, axis=-1) * MM, dtype=np.float64)


def summarize(deviations_mm: Array, reach_mm: float) -> ErrorSummary:
    """Return the largest and the root-mean-square of deviations [mm].

    Raises:
        MetricsError: There is none.
    """
    if not len(deviations_mm):
        raise MetricsError("no path error: neither side moved")
    largest, rms = float(deviations_mm.max()), float(np.sqrt(np.mean(deviations_mm**2)))
    return ErrorSummary(largest, rms, 100.0 * largest / reach_mm, 100.0 * rms / reach_mm)


def trace(real: Motion, twin: Motion, tool: ToolFunction, settings: MetricsSettings) -> Trace:
    """Find at common instants where the tools of both sides are and whether either side moves.

    Raises:
        MetricsError: See :func:`twin_experiments.metrics.series.align`; or the thresholds do not
            fit the joints.
    """
    aligned = align(real, twin, settings.rate_hz, settings.longest_gap_s)
    joints = aligned.real.positions.shape[1]
    if settings.moving_speeds.shape != (joints,):
        raise MetricsError(
            f"moving_speeds has shape {settings.moving_speeds.shape}, "
            f"the motions have {joints} joints"
        )
    speeds = np.maximum(np.abs(aligned.real.velocities), np.abs(aligned.twin.velocities))
    real_tool, twin_tool = tool(aligned.real.positions), tool(aligned.twin.positions)
    moving = np.asarray((speeds >= settings.moving_speeds).any(axis=1))
    stirring = np.asarray(
        (np.abs(aligned.twin.velocities) >= STIRS * settings.moving_speeds).any(axis=1)
    )
    deviation = deviation_mm(real_tool, twin_tool)
    return Trace(aligned, real_tool, twin_tool, deviation, moving, stirring)


def find_moves(seen: Trace, leader_tool: Array, settings: MetricsSettings) -> tuple[Move, ...]:
    """Split the trace into moves; give each one's error in percent of the leader's path.

    A hole ends a move, and so do the ends of the data. Who moved at such an edge went further than
    is known, and gets no percent.
    """
    moves = []
    pause, segments = round(MERGE_PAUSE_S * settings.rate_hz), seen.aligned.segments
    begins, ends = {first for first, _ in segments}, {last for _, last in segments}
    runs = [run for one in segments for run in _merged(true_runs(seen.moving, (one,)), pause)]
    for first, last in runs:
        # The leader's way: the follower's has its errors in it.
        length = float(np.linalg.norm(np.diff(leader_tool[first:last], axis=0), axis=1).sum() * MM)
        error = float(seen.deviation_mm[first:last].max())
        whole = first not in begins and last not in ends
        known = whole and length >= settings.shortest_move_mm
        percent = 100.0 * error / length if known else None
        instants = seen.aligned.instants
        moves.append(
            Move(float(instants[first]), float(instants[last - 1]), length, error, percent)
        )
    return tuple(moves)


def _merged(runs: list[tuple[int, int]], pause: int) -> list[tuple[int, int]]:
    """Join runs that are no more than ``pause`` apart."""
    joined: list[tuple[int, int]] = []
    for first, last in runs:
        if joined and first - joined[-1][1] <= pause:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined


def find_rests(
    seen: Trace, set_positions: Mapping[str, Array], settings: MetricsSettings
) -> tuple[Rest, ...]:
    """Find where both sides stood still long enough, and measure their errors there.

    An error is the distance from each other or from the set position.

    Args:
        seen: Trace of both sides.
        set_positions: Name to tool position [m], shape ``(3,)``.
        settings: How long, and how near.
    """
    settle, margin = (
        round(settings.rest_s * settings.rate_hz),
        round(settings.rest_margin_s * settings.rate_hz),
    )
    rests = []
    for first, last in true_runs(~seen.moving, seen.aligned.segments):
        # The slow beginning of the move that follows, if one does, is no rest any more.
        if last < len(seen.moving) and seen.moving[last]:
            least = max(first, last - round(STIRS_S * settings.rate_hz))
            while last > least and seen.stirring[last - 1]:
                last -= 1
        if last - first > settle + margin:
            rests.append(
                _measure_rest(seen, slice(first + settle, last - margin), set_positions, settings)
            )
    return tuple(rests)


def _measure_rest(
    seen: Trace, part: slice, set_positions: Mapping[str, Array], settings: MetricsSettings
) -> Rest:
    """Measure one rest over the instants of ``part``."""
    real_tool, twin_tool, instants = (
        seen.real_tool[part],
        seen.twin_tool[part],
        seen.aligned.instants[part],
    )
    start, end, deviation = (
        float(instants[0]),
        float(instants[-1]),
        float(seen.deviation_mm[part].max()),
    )
    # Either side may have missed the position: the nearer one tells which was meant.
    near = {
        name: min(
            np.linalg.norm(side.mean(axis=0) - position) * MM for side in (real_tool, twin_tool)
        )
        for name, position in set_positions.items()
    }
    name = min(near, key=lambda key: near[key], default=None)
    if name is None or near[name] > settings.set_position_radius_mm:
        return Rest(start, end, deviation, None, None, None)
    errors = [
        float(deviation_mm(side, set_positions[name]).max()) for side in (real_tool, twin_tool)
    ]
    return Rest(start, end, deviation, name, errors[0], errors[1])


def compare(
    real: Motion,
    twin: Motion,
    tool: ToolFunction,
    settings: MetricsSettings,
    leader: Literal["real", "twin"],
    set_positions: Mapping[str, Array] | None = None,
) -> Comparison:
    """Compute all errors of one experiment.

    Args:
        real: Motion of the real side, in the clock common to both.
        twin: Motion of the twin, same joints in the same order.
        tool: Forward kinematics.
        settings: Thresholds.
        leader: Who moved first; the other one is the follower.
        set_positions: Name to tool position [m], shape ``(3,)``.

    Raises:
        MetricsError: The data cannot be compared, or neither side moved.
    """
    seen = trace(real, twin, tool, settings)
    path = summarize(seen.deviation_mm[seen.moving], settings.reach_mm)
    tools = (
        (seen.real_tool, seen.twin_tool) if leader == "real" else (seen.twin_tool, seen.real_tool)
    )
    speeds = [tool_velocity(side, seen.aligned.segments, settings.rate_hz) for side in tools]
    lag = estimate_lag(
        speeds[0], speeds[1], seen.aligned.segments, settings.rate_hz, settings.max_lag_s
    )
    shifted, after = None, None
    if lag is not None:
        # Each side is moved by half of it: who is called the leader changes the sign alone.
        half = 0.5 * lag if leader == "real" else -0.5 * lag
        shifted = trace(real.shifted(half), twin.shifted(-half), tool, settings)
        after = summarize(shifted.deviation_mm[shifted.moving], settings.reach_mm)
    moves = find_moves(seen, tools[0], settings)
    return Comparison(
        seen, path, lag, after, shifted, moves, find_rests(seen, set_positions or {}, settings)
    )
