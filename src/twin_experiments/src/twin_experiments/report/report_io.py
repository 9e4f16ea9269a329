"""Write the report of a bag: report.json, report.html and the figures, from the bag alone."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import open_bag
from matplotlib.figure import Figure
from scara_config import load_robot
from scara_control.kinematics.screws import ScrewModel, tool_positions

from twin_experiments.config import load_experiments, metrics_settings
from twin_experiments.palletising import SUMMARY, error_rows
from twin_experiments.palletising import summary_rows as summary_of_parts
from twin_experiments.parts_reader_io import read_work
from twin_experiments.report import predictions
from twin_experiments.report.analysis import Result, analyse
from twin_experiments.report.charts import report_charts
from twin_experiments.report.configuration import AnalysisSettings, choose
from twin_experiments.report.document import (
    HEADINGS,
    SHORT_HEADINGS,
    paper_rows,
    report_document,
    rounded_tree,
    short_rows,
    summary_rows,
)
from twin_experiments.report.figures_io import draw_chart, write_figures
from twin_experiments.report.label.made_with import MadeWith
from twin_experiments.report.label.notes import notes
from twin_experiments.report.label.sentence import missing_sentence, sentence, verdict_sentence
from twin_experiments.report.label.true_arm import true_arm
from twin_experiments.report.page_io import anchor, figure, render, table
from twin_experiments.report.paths_figure_io import draw_paths, draw_worst
from twin_experiments.report.record import Run
from twin_experiments.report.repeats import HEADINGS as REPEAT_HEADINGS
from twin_experiments.report.repeats import repeat_rows
from twin_experiments.report.run_reader_io import read_configuration, read_run
from twin_experiments.workspace_io import this_workspace

LIBRARIES = (
    "numpy",
    "scipy",
    "rosbags",
    "matplotlib",
    "pybullet",
    "pymodbus",
    "websocket-client",
    "websockets",
    "ruckig",
)
LEGEND = (
    "Path error: distance of both tools at the same instant while either side moves, in mm and "
    "percent of reach, nothing compensated; after lag: the same with the follower's lag "
    "removed; of travelled: largest error of a move in percent of that move's length; lag > 0: "
    "the follower is behind; positioning: after both stood still {rest_s:g} s, the largest of "
    "real - twin, real - set position, twin - set position. The article does not say what its "
    "percent are of. "
)
LEGEND_TRUTH = "Both sides are the simulators' own truth, not what the twin controller read."
LEGEND_MEASURED = (
    "The real side is what the twin controller read from the robot: nobody recorded the truth."
)
CAPTIONS = {
    "errors": "How far the tools are apart, over time; allowed are {allowed}",
    "worst": "Where they were furthest apart, magnified",
    "paths": "Paths of the real tool, coloured by the twin's distance (the article's Figure 15)",
    "deviations": "How far each joint is apart, real - twin",
    "joints": "Joints over time (the article's Figure 16)",
}
SHORT_LEGEND = (
    "Apart while moving: the largest distance of both tools at one instant. Apart at rest: the "
    "largest after {rest_s:g} s, between both tools or from the set position."
)


@dataclass(frozen=True)
class Report:
    """A written report."""

    results: tuple[Result, ...]
    configuration: AnalysisSettings
    folder: Path
    made_with: MadeWith
    foretold: tuple[str, ...] = ()
    missing: str = ""

    @property
    def passed(self) -> bool:
        """True if every experiment passes."""
        return all(result.passed for result in self.results)


def analyse_bag(
    bag: Path, config_directory: Path | None = None
) -> tuple[Run, AnalysisSettings, tuple[Result, ...]]:
    """Read and analyse a bag.

    Args:
        bag: Recording of a run.
        config_directory: Configuration for what the bag does not hold; default: the package
            scara_config.

    Raises:
        BagError: The bag cannot be read, or a topic is missing.
        RecordError: What is in the bag cannot be used.
        ConfigError: A configuration file is wrong.
    """
    with open_bag(bag) as opened:
        here = load_robot(config_directory)
        chosen = choose(read_configuration(opened), here, load_experiments(here, config_directory))
        robot, config = chosen.robot, chosen.experiments
        run = read_run(opened, [joint.name for joint in robot.twin_joints])
    work = read_work(run.configuration, config_directory)
    tool = partial(tool_positions, ScrewModel.from_robot(robot))
    settings, arm = metrics_settings(config.metrics, robot), true_arm(run.plant, robot)
    return run, chosen, analyse(run, config, robot, settings, tool, work, arm)


def write_report(bag: Path, folder: Path, config_directory: Path | None = None) -> Report:
    """Analyse a bag and write its report into ``folder``, which is created if need be.

    Raises:
        BagError, RecordError, ConfigError: See :func:`analyse_bag`.
    """
    run, chosen, results = analyse_bag(bag, config_directory)
    folder.mkdir(parents=True, exist_ok=True)
    foretold = tuple(predictions.summary(run.predictions))
    missing = missing_sentence(run.missing)
    report = Report(results, chosen, folder, _made_with(run, chosen, results), foretold, missing)
    document = report_document(results, chosen.robot.reach_mm, chosen.experiments.paper)
    if run.predictions:
        document["predictions"] = rounded_tree(predictions.as_document(run.predictions))
    document["made_with"] = report.made_with.document()
    if missing:
        document["missing"] = missing
    (folder / "report.html").write_text(_page(run, report, document), encoding="utf-8")
    (folder / "report.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return report


def _made_with(run: Run, chosen: AnalysisSettings, results: Sequence[Result]) -> MadeWith:
    """Return the label of a run's figures."""
    begun = datetime.fromtimestamp(run.origin, timezone.utc)
    return MadeWith(
        robot=chosen.robot.name,
        plant=run.plant,
        speed_percent={result.span.label: result.speed_percent for result in results},
        configuration=run.configuration_digest,
        recorded=(begun, begun + timedelta(seconds=run.duration)),
        workspace=this_workspace(),
    )


def _page(run: Run, report: Report, document: dict[str, Any]) -> str:
    """Return the HTML page, after drawing the figures."""
    robot, config = report.configuration.robot, report.configuration.experiments
    reach_mm, limits, paper = robot.reach_mm, config.limits, config.paper
    recorded = datetime.fromtimestamp(run.origin, timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
    repaired = "; the recording was not finished, a repaired copy was read" if run.repaired else ""
    return render(
        {
            "title": "How well real robot and twin move as one",
            "subtitle": f"{robot.name}, reach {reach_mm:g} mm, recorded {recorded}, "
            f"{run.duration:.1f} s{repaired}",
            "verdict": (_word(report), verdict_sentence(report.results, reach_mm, limits)),
            "short": table(SHORT_HEADINGS, short_rows(report.results, reach_mm, limits, paper)),
            "short_legend": SHORT_LEGEND.format(rest_s=config.metrics.rest_s),
            "missing": report.missing,
            "sentences": [
                (_word(result), sentence(result, reach_mm, limits)) for result in report.results
            ],
            "label": report.made_with.rows(),
            "headings": HEADINGS,
            "rows": [*summary_rows(report.results, reach_mm), *paper_rows(limits, paper)],
            "legend": LEGEND.format(rest_s=config.metrics.rest_s)
            + (LEGEND_TRUTH if run.real_is_truth else LEGEND_MEASURED),
            "experiments": [
                {
                    "name": result.span.label,
                    "id": f"experiment_{anchor(result.span.label)}",
                    "verdict": _word(result),
                    "reasons": result.reasons,
                    "notes": notes(result, reach_mm),
                    "figures": _figures(result, report),
                    "tables": _tables(result, entry),
                }
                for result, entry in zip(report.results, document["experiments"])
            ],
            "tables": _run_tables(run, report, document),
            "configuration_origin": "Analysed with the configuration "
            f"{report.configuration.origin}.",
            "configuration": [
                # Files are kept as they were written; what an older bag holds parsed is a tree.
                (name, tree if isinstance(tree, str) else json.dumps(tree, indent=2))
                for name, tree in sorted(run.configuration.items())
            ],
        }
    )


def _word(judged: Report | Result) -> str:
    return "pass" if judged.passed else "FAIL"


def _run_tables(run: Run, report: Report, document: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return the tables of the whole run: name and content."""
    repeats = repeat_rows(document.get("repeats", []))
    foretold = predictions.motion_rows(run.predictions)
    versions = [
        ("Python", platform.python_version()),
        ("system", f"{platform.system()} {platform.machine()}"),
        *((name, version(name)) for name in LIBRARIES),
    ]
    topics = [(name, str(count)) for name, count in run.topics.items()]
    decisions, warnings = (
        [(f"{event.at:.2f}", event.source, event.text) for event in events]
        for events in (run.decisions, run.warnings)
    )
    found = [
        ("Decisions of the twin controller", table(("s", "mode", "why"), decisions)),
        ("Warnings", table(("s", "node", "what"), warnings)),
        ("Recorded topics", table(("topic", "messages"), topics)),
        ("Versions of the reporting machine", table(("what", "version"), versions)),
    ]
    # Most runs have none of these two; the others say "none" where they are empty.
    if foretold:
        words = table(predictions.HEADINGS, foretold, report.foretold)
        found.insert(0, (predictions.TITLE, words))
    if repeats:
        found.insert(0, ("Repeats", table(REPEAT_HEADINGS, repeats)))
    return found


def _tables(result: Result, entry: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return the tables of one experiment; the page leaves out those without a row."""
    start = result.span.start
    sides = [f"{found.side} mm" for found in result.parts]
    pauses = [
        (f"{pause.start - start:.2f}", f"{1e3 * pause.duration:.0f}") for pause in result.pauses
    ]
    ages = [
        (topic, *(f"{value:.2f}" for value in age.values()))
        for topic, age in entry["sample_age_ms"].items()
    ]
    gaps = [tuple(map(_cell, gap.values())) for gap in entry.get("gaps", [])]
    needles = ("s", "mm", "tool m/s", "as time ms", "what was going on")
    moves = ("start s", "duration s", "path mm", "error max mm", "of travelled")
    rests = ("s", "set position", "real - twin mm", "real - set mm", "twin - set mm")
    found: list[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = [
        ("Needles", needles, _needles(result)),
        ("Parts", SUMMARY, summary_of_parts(result.parts)),
        ("Placement error", ("part", *sides), error_rows(result.parts)),
        ("Moves", moves, _moves(result)),
        ("At rest", rests, _rests(result)),
        ("Age of samples on receipt", ("topic", "median ms", "95 % ms", "max ms"), ages),
        ("Pauses of the machine", ("start s", "duration ms"), pauses),
        ("Holes", ("side", "start s", "duration s"), gaps),
    ]
    return [(name, table(headings, rows)) for name, headings, rows in found]


def _figures(result: Result, report: Report) -> list[Mapping[str, Any]]:
    """Draw the figures of an experiment, and return them as the page takes them."""
    if result.comparison is None:
        return []
    robot = report.configuration.robot
    percent = report.configuration.experiments.limits.path_error_percent
    positions = {name: np.array(robot.positions_m[name]) for name in result.visits}
    charts = report_charts(result, robot, percent)
    drawings: dict[str, Callable[[], Figure]] = {
        **{kind: partial(draw_chart, chart) for kind, chart in charts.items()},
        "worst": partial(draw_worst, result.comparison),
        "paths": partial(draw_paths, result.comparison, positions),
    }
    drawn = write_figures(drawings, report.folder, result.span.label)
    allowed = f"{percent * robot.reach_mm / 100.0:.1f} mm, {percent:g} % of reach"
    return [
        figure(caption.format(allowed=allowed), drawn[kind], charts.get(kind))
        for kind, caption in CAPTIONS.items()
        if kind in drawn
    ]


def _moves(result: Result) -> list[tuple[str, ...]]:
    """Return one row for each move."""
    moves = result.comparison.moves if result.comparison is not None else ()
    start = result.span.start
    return [
        (
            f"{move.start - start:.2f}",
            f"{move.end - move.start:.2f}",
            f"{move.length_mm:.1f}",
            f"{move.error_max_mm:.2f}",
            "-" if move.travelled_percent is None else f"{move.travelled_percent:.2f} %",
        )
        for move in moves
    ]


def _rests(result: Result) -> list[tuple[str, ...]]:
    """Return one row for each rest."""
    rests = result.comparison.rests if result.comparison is not None else ()
    return [
        (
            f"{rest.start - result.span.start:.2f}",
            rest.set_position or "-",
            *map(_cell, (rest.deviation_mm, rest.real_error_mm, rest.twin_error_mm)),
        )
        for rest in rests
    ]


def _needles(result: Result) -> list[tuple[str, ...]]:
    """Return one row for each needle."""
    return [
        (
            f"{needle.at - result.span.start:.2f}",
            f"{needle.height_mm:.2f}",
            f"{needle.speed:.2f}",
            "-" if needle.timing_ms is None else f"{needle.timing_ms:.1f}",
            str(needle.cause),
        )
        for needle in result.needles
    ]


def _cell(value: Any) -> str:
    """Return a number or a name as text."""
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else str(value)
