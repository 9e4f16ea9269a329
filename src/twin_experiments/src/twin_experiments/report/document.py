"""The report as data: report.json, and the rows of the tables on the page and on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin_experiments.config import Limits, PaperFigures
from twin_experiments.metrics.angles import AngleErrors
from twin_experiments.metrics.errors import Comparison, Rest
from twin_experiments.metrics.needles import Needle
from twin_experiments.metrics.pauses import longest_ms
from twin_experiments.palletising import as_document
from twin_experiments.report.analysis import Result
from twin_experiments.report.repeats import summarize_repeats

DIGITS = 6

NOT_COMPARED: dict[str, Any] = {
    "samples": 0,
    "duration_s": 0.0,
    "lag_s": None,
    "path_error_max_mm": None,
    "path_error_max_percent": None,
    "path_error_rms_percent": None,
    "positioning_error_max_mm": None,
    "positioning_error_max_percent": None,
}


def report_document(
    results: Sequence[Result], reach_mm: float, paper: PaperFigures
) -> dict[str, Any]:
    """Return the content of report.json."""
    document: dict[str, Any] = {
        "experiments": [_experiment(result, reach_mm) for result in results],
        "paper": {
            "path_error_percent": paper.path_error_percent,
            "positioning_error_percent": paper.positioning_error_percent,
        },
    }
    if repeats := summarize_repeats(document["experiments"]):
        document["repeats"] = rounded_tree(repeats)
    return document


def _experiment(result: Result, reach_mm: float) -> dict[str, Any]:
    """Return one experiment of report.json."""
    figures = NOT_COMPARED
    if result.comparison is not None:
        figures = _figures(result.comparison, reach_mm, result.span.start)
    entry = {
        "name": result.span.name,
        "leader": result.leader,
        **figures,
        "path_angle_max_deg": None if result.turned is None else result.turned.path_max_deg,
        "rest_angle_max_deg": None if result.turned is None else result.turned.rest_max_deg,
        **_true_positioning(result, reach_mm),
        "unseen_delay_ms": None if result.unseen is None else list(result.unseen.bounds_ms),
        "unseen_delay_mm": None if result.unseen is None else list(result.unseen.bounds_mm),
        **_pauses(result),
        "needles": [_needle(needle, result.span.start) for needle in result.needles],
        "verdict": "pass" if result.passed else "fail",
        "repeat": result.span.repeat,
        "reasons": list(result.reasons),
        "visits": list(result.visits),
        "held": list(result.held),
        "sample_age_ms": dict(result.ages),
    }
    if result.parts:
        entry["parts"] = as_document(result.parts)
    rounded: dict[str, Any] = rounded_tree(entry)
    return rounded


def _figures(comparison: Comparison, reach_mm: float, start: float) -> dict[str, Any]:
    """Return the figures of an experiment that could be compared; times count from its start."""
    aligned, after = comparison.trace.aligned, comparison.path_after_lag
    positioning = comparison.positioning_max_mm
    return {
        "samples": len(aligned.instants),
        "duration_s": aligned.span,
        "lag_s": comparison.lag_s,
        "path_error_max_mm": comparison.path.max_mm,
        "path_error_max_percent": comparison.path.max_percent,
        "path_error_rms_mm": comparison.path.rms_mm,
        "path_error_rms_percent": comparison.path.rms_percent,
        "path_error_max_after_lag_mm": None if after is None else after.max_mm,
        "path_error_max_after_lag_percent": None if after is None else after.max_percent,
        "path_error_max_travelled_percent": comparison.travelled_percent,
        "positioning_error_max_mm": positioning,
        "positioning_error_max_percent": None
        if positioning is None
        else 100.0 * positioning / reach_mm,
        "positions": [_rest(rest, start) for rest in comparison.rests],
        "excluded_percent": 100.0 * aligned.excluded_share,
        "gaps": [
            {"side": gap.side, "start_s": gap.start - start, "duration_s": gap.duration}
            for gap in aligned.gaps
        ],
    }


def _true_positioning(result: Result, reach_mm: float) -> dict[str, Any]:
    """Return the error at rest against the robot's true geometry."""
    found = result.true_positioning
    return {
        "true_positioning_error_max_mm": None if found is None else found.max_mm,
        "true_positioning_error_max_percent": None
        if found is None
        else 100.0 * found.max_mm / reach_mm,
        "calibrated_positioning_error_max_mm": None if found is None else found.calibrated_mm,
    }


def _pauses(result: Result) -> dict[str, Any]:
    """Return the pauses of the machine during an experiment, and the path error without them."""
    undisturbed = result.path_undisturbed
    return {
        "pauses": len(result.pauses),
        "longest_pause_ms": longest_ms(result.pauses),
        "path_error_max_undisturbed_percent": None
        if undisturbed is None
        else undisturbed.max_percent,
    }


def _needle(needle: Needle, start: float) -> dict[str, Any]:
    """Return one short peak of report.json; times count from the experiment's start."""
    return {
        "at_s": needle.at - start,
        "height_mm": needle.height_mm,
        "tool_speed_m_s": needle.speed,
        "timing_ms": needle.timing_ms,
        "cause": needle.cause.name.lower(),
    }


def _rest(rest: Rest, start: float) -> dict[str, Any]:
    """Return one rest of report.json."""
    return {
        "set_position": rest.set_position,
        "start_s": rest.start - start,
        "real_twin_mm": rest.deviation_mm,
        "real_set_mm": rest.real_error_mm,
        "twin_set_mm": rest.twin_error_mm,
    }


def rounded_tree(value: Any) -> Any:
    """Round all floats of a tree."""
    if isinstance(value, float):
        return round(value, DIGITS)
    if isinstance(value, dict):
        return {key: rounded_tree(item) for key, item in value.items()}
    return [rounded_tree(item) for item in value] if isinstance(value, list) else value


SHORT_HEADINGS = (
    "experiment",
    "leads",
    "speed",
    "apart while moving",
    "apart at rest",
    "turned apart",
    "follower behind",
    "verdict",
)
"""What somebody reads who reads one table only."""

LEADS = {"real": "real robot", "twin": "twin"}

HEADINGS = (
    "experiment",
    "leader",
    "path error max",
    "rms",
    "after lag",
    "of travelled",
    "lag",
    "positioning max",
    "speed",
    "verdict",
)


def summary_rows(results: Sequence[Result], reach_mm: float) -> list[tuple[str, ...]]:
    """Return one row of text for each experiment, cells as in ``HEADINGS``."""
    return [_row(result, reach_mm) for result in results]


def short_rows(
    results: Sequence[Result], reach_mm: float, limits: Limits, paper: PaperFigures
) -> list[tuple[str, ...]]:
    """Return the short table, cells as in ``SHORT_HEADINGS``; limits and the article come last."""
    asked, article = (
        (
            name,
            "",
            "",
            f"{figures.path_error_percent:g} %",
            f"{figures.positioning_error_percent:g} %",
            "",
            "",
            "",
        )
        for name, figures in (("allowed here", limits), ("in the article", paper))
    )
    return [*(_short_row(result, reach_mm) for result in results), asked, article]


def _short_row(result: Result, reach_mm: float) -> tuple[str, ...]:
    verdict, comparison = "pass" if result.passed else "FAIL", result.comparison
    speed = "-" if result.speed_percent is None else f"{result.speed_percent:.0f} %"
    head = (result.span.label, LEADS[result.leader], speed)
    if comparison is None:
        return (*head, "-", "-", "-", "-", verdict)
    at_rest, lag = comparison.positioning_max_mm, comparison.lag_s
    return (
        *head,
        _plain(comparison.path.max_mm, reach_mm),
        "-" if at_rest is None else _plain(at_rest, reach_mm),
        _turned(result.turned),
        # A lag that rounds to nothing has no sign.
        "-" if lag is None else f"{1e3 * lag:.0f} ms".replace("-0 ms", "0 ms"),
        verdict,
    )


def _plain(length_mm: float, reach_mm: float) -> str:
    """Return a length with the digits that matter: percent of reach, and mm."""
    return f"{100.0 * length_mm / reach_mm:.2f} % ({length_mm:.2f} mm)"


def _turned(turned: AngleErrors | None) -> str:
    """Return how far the tools were turned against each other, moving and at rest."""
    if turned is None:
        return "-"
    rest = "" if turned.rest_max_deg is None else f" ({turned.rest_max_deg:.2f} at rest)"
    return f"{turned.path_max_deg:.2f} deg{rest}"


def paper_rows(limits: Limits, paper: PaperFigures) -> list[tuple[str, ...]]:
    """Return the rows with this project's limits and the article's results."""
    return [
        _compared_row("limit", limits.path_error_percent, limits.positioning_error_percent),
        _compared_row("article", paper.path_error_percent, paper.positioning_error_percent),
    ]


def _compared_row(name: str, path_percent: float, positioning_percent: float) -> tuple[str, ...]:
    """Return a row that holds only the two figures the article gives."""
    cells = {
        "experiment": name,
        "path error max": f"{path_percent:g} %",
        "positioning max": f"{positioning_percent:g} %",
    }
    return tuple(cells.get(heading, "") for heading in HEADINGS)


def _row(result: Result, reach_mm: float) -> tuple[str, ...]:
    """Return the row of one experiment."""
    verdict = "pass" if result.passed else "FAIL"
    comparison = result.comparison
    if comparison is None:
        return (result.span.label, result.leader, *["-"] * (len(HEADINGS) - 3), verdict)
    lag, travelled = comparison.lag_s, comparison.travelled_percent
    late, positioning = comparison.path_after_lag, comparison.positioning_max_mm
    return (
        result.span.label,
        result.leader,
        _length(comparison.path.max_mm, reach_mm),
        _length(comparison.path.rms_mm, reach_mm),
        "-" if late is None else f"{late.max_mm:.2f} mm  {late.max_percent:.3f} %",
        "-" if travelled is None else f"{travelled:.2f} %",
        "-" if lag is None else f"{1e3 * lag:+.1f} ms",
        "-" if positioning is None else _length(positioning, reach_mm),
        "-" if result.speed_percent is None else f"{result.speed_percent:.0f} %",
        verdict,
    )


def _length(length_mm: float, reach_mm: float) -> str:
    """Return a length in mm and percent of reach."""
    return f"{length_mm:.2f} mm  {100.0 * length_mm / reach_mm:.3f} %"
