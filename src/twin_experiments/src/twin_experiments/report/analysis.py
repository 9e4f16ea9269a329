"""From a recorded run to figures and a verdict for each experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scara_config import Robot
from scara_config.palletise import Palletise
from scara_control.kinematics.screws import ScrewModel

from twin_experiments.config import ExperimentsFile, Judged, Limits, Unmarked
from twin_experiments.metrics.angles import AngleErrors, angle_errors
from twin_experiments.metrics.errors import (
    Comparison,
    ErrorSummary,
    MetricsSettings,
    ToolFunction,
    compare,
    summarize,
)
from twin_experiments.metrics.needles import Needle, find_needles
from twin_experiments.metrics.pauses import Pause, pauses_within, undisturbed
from twin_experiments.metrics.series import Array, MetricsError, Motion, count_ends
from twin_experiments.metrics.tracks import first_to_move
from twin_experiments.metrics.true_positions import TrueArm, TruePositioning, true_positioning
from twin_experiments.metrics.unseen import UnseenDelay, unseen_delay
from twin_experiments.palletising import SIDES, Handled, SideOutcome, outcome, shortcomings
from twin_experiments.report.record import ENDS_EARLY, Age, RecordError, Run, Span, cut, pick


@dataclass(frozen=True)
class Excess:
    """An error beyond its limit, both in percent of reach."""

    what: str
    percent: float
    limit: float

    @property
    def text(self) -> str:
        """Say it as a reason to fail."""
        return f"{self.what} {self.percent:.3f} % of reach, limit {self.limit:g} %"


@dataclass(frozen=True)
class Result:
    """One experiment: what was found and whether it passes. ``reasons`` is empty if it does.

    Args:
        span: Name and time.
        leader: ``real`` or ``twin``.
        visits: Set positions that should be held, in order.
        held: Set positions that were held, in order, repetitions joined.
        comparison: All errors; None if the data could not be compared.
        motions: Both sides' joints during the experiment, all joints of the twin.
        ages: Of each topic the median, p95 and max of how old its content was on receipt [ms];
            negative: it was due in the future.
        reasons: Why it fails.
        parts: What became of the parts, for each side; empty if it handles none.
        speed_percent: The leader's fastest joint, in percent of that joint's largest speed; None if
            the data could not be compared.
        pauses: When the machine, or the recorder, stood still.
        path_undisturbed: Path error without the pauses and what follows them; None if it is not
            known.
        true_positioning: Error at rest against the robot's true geometry; None if it is not known.
        needles: Short peaks of the tools' distance.
        unseen: Delay that the figures cannot show; None where the truth was recorded, or where
            nobody knows.
        turned: How far the tools were turned against each other; None as ``comparison``.
    """

    span: Span
    leader: str
    visits: tuple[str, ...]
    held: tuple[str, ...]
    comparison: Comparison | None
    motions: tuple[Motion, Motion] | None
    ages: Mapping[str, Mapping[str, float]]
    reasons: tuple[str, ...]
    parts: tuple[SideOutcome, ...] = ()
    speed_percent: float | None = None
    pauses: tuple[Pause, ...] = ()
    path_undisturbed: ErrorSummary | None = None
    true_positioning: TruePositioning | None = None
    needles: tuple[Needle, ...] = ()
    unseen: UnseenDelay | None = None
    turned: AngleErrors | None = None

    @property
    def passed(self) -> bool:
        """True if nothing speaks against it."""
        return not self.reasons


def analyse(
    run: Run,
    config: ExperimentsFile,
    robot: Robot,
    settings: MetricsSettings,
    tool: ToolFunction,
    work: Palletise | None = None,
    arm: TrueArm | None = None,
) -> tuple[Result, ...]:
    """Analyse every experiment of a run.

    Args:
        run: What was recorded.
        config: Experiments and limits.
        robot: Joints and set positions.
        settings: Thresholds of the errors, for the joints that move the tool.
        tool: Forward kinematics of the joints that move the tool, in robot.yaml's order.
        work: palletise.yaml, if the robot has one.
        arm: The robot as it was made, if that is known.

    Raises:
        RecordError: An experiment of the run is not in ``config``.
    """
    unknown = sorted({span.name for span in run.spans if span.marked} - set(config.known))
    if unknown:
        raise RecordError(
            f"unknown experiment {', '.join(unknown)}: experiments.yaml has "
            f"{', '.join(config.known)}"
        )
    positions = {name: np.array(place) for name, place in robot.positions_m.items()}
    columns = [run.joint_names.index(joint.name) for joint in robot.arm_joints]
    largest = np.array([robot.joint(name).velocity for name in run.joint_names])
    chain = ScrewModel.from_robot(robot)

    def analysed(span: Span) -> Result:
        experiment: Judged
        if span.marked:
            experiment = config.known[span.name]
        else:  # nobody said who should lead: whoever did, or moved first
            sides = (pick(run.real, columns), pick(run.twin, columns))
            leader = run.leader or first_to_move(*sides, settings.moving_speeds)
            experiment = Unmarked(leader="twin" if leader == "twin" else "real")
        visited = {name: positions[name] for name in experiment.visits}
        result = _analyse_span(run, span, experiment, config, visited, settings, columns, tool)
        if result.motions is not None:
            # The motions are those of real and twin, in this order.
            led = result.motions[result.leader == "twin"]
            percent = float(100.0 * (np.abs(led.velocities) / largest).max())
            result = replace(result, speed_percent=percent)
        # Pauses first, for they explain needles.
        result = _with_needles(_with_pauses(result, run.pauses, robot.reach_mm), run)
        result = _with_unseen(result, run)
        if result.comparison is not None:
            result = replace(result, turned=angle_errors(result.comparison, chain))
        if arm is not None and result.comparison is not None:
            found = true_positioning(result.comparison, tool, arm, visited, settings)
            result = replace(result, true_positioning=found)
        carries = span.marked and span.name in config.palletising
        return _with_parts(result, run, work) if carries else result

    return tuple(analysed(span) for span in run.spans)


def _analyse_span(
    run: Run,
    span: Span,
    experiment: Judged,
    config: ExperimentsFile,
    positions: dict[str, Array],
    settings: MetricsSettings,
    columns: list[int],
    tool: ToolFunction,
) -> Result:
    """Analyse one experiment.

    Data that cannot be compared are a reason to fail, not an end of the report.
    """
    ages = {
        topic: found
        for topic, age in run.ages.items()
        if (found := summarize_age(age, span)) is not None
    }
    visits = tuple(experiment.visits)
    try:
        motions = (
            cut(run.real, span.start, span.end),
            cut(run.twin, span.start, span.end),
        )
        arm = [pick(motion, columns) for motion in motions]
        comparison = compare(arm[0], arm[1], tool, settings, experiment.leader, positions)
    except (MetricsError, RecordError) as error:
        return Result(span, experiment.leader, visits, (), None, None, ages, (str(error),))
    seen = comparison.trace
    aligned = count_ends(seen.aligned, motions, span.start, span.end, settings.longest_gap_s)
    comparison = replace(comparison, trace=replace(seen, aligned=aligned))
    # The set positions at which both stood still, in order, repetitions joined
    names = [rest.set_position for rest in comparison.rests if rest.set_position is not None]
    held = tuple(name for name, _ in groupby(names))
    reasons = judge(span, experiment, comparison, held, settings.reach_mm, config.limits)
    return Result(span, experiment.leader, visits, held, comparison, motions, ages, reasons)


def _with_pauses(result: Result, pauses: tuple[Pause, ...], reach_mm: float) -> Result:
    """Add the pauses of the machine, and the path error without the moments that they disturbed."""
    result = replace(result, pauses=pauses_within(pauses, result.span.start, result.span.end))
    if result.comparison is None:
        return result
    seen = result.comparison.trace
    counted = seen.moving & undisturbed(seen.aligned.instants, pauses)
    if not counted.any():
        return result
    return replace(result, path_undisturbed=summarize(seen.deviation_mm[counted], reach_mm))


def _with_unseen(result: Result, run: Run) -> Result:
    """Add the delay that a recording without ground truth cannot show."""
    if run.clock_half_widths is None or result.comparison is None or result.motions is None:
        return result
    times, half_widths = run.clock_half_widths
    during = (result.span.start <= times) & (times <= result.span.end)
    real, _ = result.motions
    found = unseen_delay(result.comparison.trace, real.stamps, half_widths[during])
    return replace(result, unseen=found)


def _with_needles(result: Result, run: Run) -> Result:
    """Add the short peaks of the tools' distance, and what was going on then."""
    if result.comparison is None:
        return result
    span = result.span
    within = {
        topic: (age.received >= span.start) & (age.received <= span.end)
        for topic, age in run.ages.items()
    }
    ages = {
        topic: (age.received[within[topic]], age.age[within[topic]])
        for topic, age in run.ages.items()
    }
    comparison = result.comparison
    needles = find_needles(comparison.trace, comparison.moves, result.pauses, ages)
    return replace(result, needles=needles)


def _with_parts(result: Result, run: Run, work: Palletise | None) -> Result:
    """Add what became of the parts, and what speaks against it."""
    if work is None:
        return replace(result, reasons=(*result.reasons, "there is no palletise.yaml"))
    span = result.span
    parts = tuple(
        outcome(side, run.handled.get(side, Handled()), work, span.start, span.end)
        for side in SIDES
    )
    return replace(
        result, parts=parts, reasons=(*result.reasons, *shortcomings(parts, work.task.tolerance_mm))
    )


def judge(
    span: Span,
    experiment: Judged,
    comparison: Comparison,
    held: tuple[str, ...],
    reach_mm: float,
    limits: Limits,
) -> tuple[str, ...]:
    """Return every reason why an experiment fails; none: it passes."""
    reasons = []
    if not span.finished:
        reasons.append(ENDS_EARLY)
    reasons += [excess.text for excess in exceeded(comparison, reach_mm, limits)]
    wanted = tuple(name for name, _ in groupby(experiment.visits))
    # Only the last ones: where both stood before the first visit does not count.
    if held[-len(wanted) :] != wanted:
        reasons.append(
            f"both stood still at {' '.join(held) or 'no set position'}, expected "
            f"{' '.join(wanted)}"
        )
    excluded = 100.0 * comparison.trace.aligned.excluded_share
    if excluded > limits.excluded_percent:
        reasons.append(
            f"{excluded:.1f} % of the time has no samples, limit {limits.excluded_percent:g} %"
        )
    return tuple(reasons)


def exceeded(comparison: Comparison, reach_mm: float, limits: Limits) -> tuple[Excess, ...]:
    """Return the errors that are beyond their limits."""
    positioning = comparison.positioning_max_mm
    found = [Excess("path error", comparison.path.max_percent, limits.path_error_percent)]
    if positioning is not None:
        percent = 100.0 * positioning / reach_mm
        found.append(Excess("positioning error", percent, limits.positioning_error_percent))
    return tuple(excess for excess in found if excess.percent > excess.limit)


def summarize_age(age: Age, span: Span) -> dict[str, float] | None:
    """Return median, p95 and max of the ages during an experiment [ms]; None: nothing came."""
    inside: Array = 1e3 * age.age[(age.received >= span.start) & (age.received <= span.end)]
    if not len(inside):
        return None
    return {
        "median": float(np.median(inside)),
        "p95": float(np.percentile(inside, 95.0)),
        "max": float(inside.max()),
    }
