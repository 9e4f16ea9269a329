"""Compare bags and write table, figures and page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from twin_experiments.config import metrics_settings
from twin_experiments.metrics.series import MetricsError
from twin_experiments.metrics.tracks import Mechanism, Track
from twin_experiments.report.figures_io import draw_chart, write_figures
from twin_experiments.report.label.sentence import missing_sentence
from twin_experiments.report.page_io import anchor, figure, render, table
from twin_experiments.report.record import ENDS_EARLY

from twin_analysis.compare.charts import compared_charts
from twin_analysis.compare.config import ComparisonFile, load_comparison
from twin_analysis.compare.differences import Comparer, PairDeviation, RunDifference
from twin_analysis.compare.document import (
    PAIR_HEADINGS,
    RUN_HEADINGS,
    ExperimentComparison,
    comparison_document,
    comparison_sentences,
    pair_rows,
    run_rows,
)
from twin_analysis.compare.fidelity import FidelityError
from twin_analysis.compare.figures_io import draw_paths
from twin_analysis.compare.track_reader_io import (
    Opened,
    Topics,
    find_mechanism,
    lengths_of,
    read_bag,
    tracks_of,
)

CAPTIONS = {
    "paths": "Paths of the tool",
    "joints": "Joints from the leader's first motion on",
    "distance": "How far real and twin are apart, over time",
    "along_path": "How far real and twin are apart, along the leader's path",
}
LEGEND = (
    "max, rms: distance of both tools at the same instant while either side moves, nothing "
    "compensated; lag > 0: the follower is behind; matched: share of the snapshots of both "
    "sides that have a counterpart in the other, in order, with every joint within what "
    "comparison.yaml accepts (trace alignment after Munoz et al., IEEE TSE 2024); of moving: "
    "the same of those in motion; matched apart: mean distance of the tools in matched "
    "snapshots; gaps: runs of snapshots without a match. Against another recording: same "
    "time counts from the leader's first motion, off the path is the distance from its path, "
    "whatever the speed."
)


@dataclass(frozen=True)
class WrittenComparison:
    """A comparison and where it was written."""

    mechanism: Mechanism
    experiments: tuple[ExperimentComparison, ...]
    labels: dict[str, str]
    remarks: tuple[str, ...]
    folder: Path


def write_comparison(
    bags: Sequence[Path], folder: Path, topics: Topics, config_directory: Path | None
) -> WrittenComparison:
    """Compare bags and write comparison.json, comparison.html and figures into ``folder``.

    Raises:
        BagError: A bag cannot be read, or lacks a topic.
        RecordError: What is in it cannot be used.
        ConfigError: A configuration file is wrong.
    """
    config = load_comparison(config_directory)
    labels = _labels(bags)
    opened = [read_bag(path, label, topics, config_directory) for label, path in labels.items()]
    mechanism = find_mechanism(opened)
    # Compare real with twin in each recording, and each recording with the first one
    comparer, percent = comparer_of(opened[0], mechanism, config)
    of_bags = [tracks_of(bag, mechanism, percent) for bag in opened]
    tracks = [track for found, _ in of_bags for track in found]
    lost = [each for _, gone in of_bags for each in gone]
    names = dict.fromkeys([*(track.experiment for track in tracks), *(name for name, _ in lost)])
    had = {track.experiment for track in of_bags[0][0]} | {name for name, _ in of_bags[0][1]}
    lost += [
        (name, f"{opened[0].label} has no {name}: nothing is held against it")
        for name in names
        if name not in had
    ]
    compared = tuple(
        compare_tracks(
            name,
            [track for track in tracks if track.experiment == name],
            comparer,
            [text for about, text in lost if about == name],
        )
        for name in names
    )
    named = {label: str(path) for label, path in labels.items()}
    written = WrittenComparison(mechanism, compared, named, remarks_of(opened), folder)
    write_files(written)
    return written


def write_files(written: WrittenComparison) -> None:
    """Write comparison.json, comparison.html and the figures."""
    written.folder.mkdir(parents=True, exist_ok=True)
    document = comparison_document(written.mechanism, written.labels, written.experiments)
    (written.folder / "comparison.json").write_text(
        json.dumps(document, indent=2) + "\n", encoding="utf-8"
    )
    (written.folder / "comparison.html").write_text(_page(written), encoding="utf-8")


def comparer_of(
    first: Opened, mechanism: Mechanism, config: ComparisonFile
) -> tuple[Comparer, float]:
    """Return what compares, and the speed from which a joint moves [percent].

    The thresholds are those of the first recording.
    """
    metrics = first.experiments.metrics
    settings = metrics_settings(metrics, first.robot)
    percent, limits = metrics.moving_speed_percent, first.experiments.limits
    return Comparer(mechanism, config, settings, percent, limits.excluded_percent), percent


def compare_tracks(
    name: str, tracks: list[Track], comparer: Comparer, lost: Sequence[str] = ()
) -> ExperimentComparison:
    """Compare one experiment of all recordings that have it.

    The others are held against the first one. ``lost`` says why a recording is not among them.
    """
    pairs: list[PairDeviation] = []
    runs: list[RunDifference] = []
    reasons = list(lost)
    for number, track in enumerate(tracks):
        if not track.finished:
            reasons.append(f"{track.label}: {ENDS_EARLY}")
        try:
            pair = comparer.pair(track)
            pairs.append(pair)
            excluded, most = pair.excluded_percent, comparer.most_excluded_percent
            if excluded > most:
                reasons.append(
                    f"{track.label}: {excluded:.1f} % of the time has no samples, limit "
                    f"{most:g} %: no figure says what happened then"
                )
            parts = [each.label for each in (tracks[0], track) if not comparer.is_whole(each)]
            if number and parts:
                reasons.append(
                    f"{track.label}: not held against {tracks[0].label}: of {' and '.join(parts)} "
                    "only a part is recorded"
                )
            elif number:
                runs += comparer.runs(tracks[0], track)
        # A recording that cannot be compared must not take the others with it.
        except (MetricsError, FidelityError) as error:
            reasons.append(f"{track.label}: {error}")
    first = tracks[0].label if tracks else ""
    return ExperimentComparison(name, first, tuple(pairs), tuple(runs), tuple(reasons))


def _labels(bags: Sequence[Path]) -> dict[str, Path]:
    """Name each bag as briefly as possible.

    It is called by its folder if all are called run.bag, else by its name; never two alike.
    """
    paths = [path.resolve() for path in bags]
    stems = [path.parent.name if path.stem == "run" else path.stem for path in paths]
    found: dict[str, Path] = {}
    for stem, path in zip(stems, paths):
        number = 1
        label = stem
        while label in found:
            number += 1
            label = f"{stem} ({number})"
        found[label] = path
    return found


def remarks_of(opened: Sequence[Opened]) -> tuple[str, ...]:
    """Return what a reader must know of the recordings."""
    remarks = []
    for bag in opened:
        if bag.repaired:
            remarks.append(f"{bag.label}: the recording was not finished, a repaired copy was read")
        if bag.missing:
            remarks.append(f"{bag.label}: {missing_sentence(bag.missing)}")
        if bag.has_profile and lengths_of(bag.robot) != lengths_of(opened[0].robot):
            remarks.append(
                f"{bag.label}: recorded with other lengths of the arm than those of "
                f"{opened[0].label}, which count here"
            )
        remarks += [f"{bag.label}: {note}" for note in (*bag.real.notes, *bag.twin.notes)]
        remarks.append(f"{bag.label}: real is {bag.real.topic}, twin is {bag.twin.topic}")
    return tuple(remarks)


def _page(written: WrittenComparison) -> str:
    """Return the HTML page, after drawing the figures."""
    mechanism = written.mechanism
    place = (
        "the tool" if mechanism.tool is not None else "the joints, whose kinematics are not known"
    )
    return render(
        {
            "title": "Recordings held against each other",
            "subtitle": f"{len(written.labels)} recordings; joints {', '.join(mechanism.names)}; "
            f"distances are of {place}",
            "sentences": [
                ("", text)
                for experiment in written.experiments
                for text in comparison_sentences(experiment, mechanism.place_unit)
            ],
            "headings": ("experiment", *PAIR_HEADINGS),
            "rows": [
                (experiment.name, *row)
                for experiment in written.experiments
                for row in pair_rows(experiment)
            ],
            "legend": LEGEND,
            "experiments": [_experiment(experiment, written) for experiment in written.experiments],
            "tables": [
                ("Recordings", table(("name", "file"), list(written.labels.items()))),
                ("Remarks", table(("",), [(remark,) for remark in written.remarks])),
            ],
            "configuration_origin": "Profile and thresholds: "
            "of the first recording if it holds them, else of this machine.",
        }
    )


def _experiment(experiment: ExperimentComparison, written: WrittenComparison) -> dict[str, Any]:
    """Return one experiment as the page takes it, after drawing its figures."""
    charts = compared_charts(experiment, written.mechanism)
    figures: dict[str, Callable[[], Figure]] = {
        kind: partial(draw_chart, chart) for kind, chart in charts.items()
    }
    if experiment.pairs and written.mechanism.tool is not None:
        figures["paths"] = partial(draw_paths, experiment.pairs, written.mechanism)
    drawn = write_figures(figures, written.folder, experiment.name)
    joints = [
        (
            pair.track.label,
            joint.name,
            f"{joint.rms:.3f} {joint.unit}",
            f"{joint.max:.3f} {joint.unit}",
        )
        for pair in experiment.pairs
        for joint in pair.joints
    ]
    return {
        "name": experiment.name,
        "id": f"experiment_{anchor(experiment.name)}",
        "verdict": "",
        "reasons": experiment.reasons,
        "notes": [],
        "figures": [
            figure(caption, drawn[kind], charts.get(kind))
            for kind, caption in CAPTIONS.items()
            if kind in drawn
        ],
        "tables": [
            (
                f"Against {experiment.first}",
                table(RUN_HEADINGS, run_rows(experiment, written.mechanism.place_unit)),
            ),
            ("Joints, real against twin", table(("recording", "joint", "rms", "max"), joints)),
        ],
    }
