"""Draws step responses with the colours of the article.

The control signal is blue, the set point black, the error red.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from twin_experiments.report.charts import BLUE, GREY, RED
from twin_experiments.report.figures_io import STYLE

from twin_analysis.step.response import FloatArray, Step
from twin_analysis.step.trial import STEADY_ERROR, StepTrial

_FAR = 3.0
_SHORTEST_MS, _REST = 300.0, 2.0


def write_trial(
    trial: StepTrial, steps: Sequence[Step], document: Mapping[str, Any], folder: Path, label: str
) -> list[Path]:
    """Write ``step_<label>.json`` and a PNG for each direction; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / f"step_{label}.json"]
    written[0].write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    for step, row in zip(steps, document["steps"], strict=True):
        written.append(folder / f"step_{label}_{row['direction']}.png")
        with mpl.rc_context(STYLE):
            _draw(trial, step, row, str(document["title"])).savefig(written[-1], dpi=120)
    return written


def _draw(trial: StepTrial, step: Step, row: Mapping[str, Any], title: str) -> Figure:
    """Draw set point, value and error; the error near zero; the control signal."""
    figure = Figure(figsize=(8.4, 7.2))
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    times, scale = step.times * 1e3, trial.joint.scale
    before = step.set_points[0] / scale
    upper.plot(
        times,
        step.set_points / scale - before,
        color="black",
        linewidth=1.4,
        label="set point",
        drawstyle="steps-post",
    )
    upper.plot(times, step.values / scale - before, color=GREY, linewidth=2.2, label="measured")
    upper.plot(times, step.errors / scale, color=RED, linewidth=1.2, label="error")
    upper.set(
        ylabel=f"{trial.kind} from {before:.2f} [{trial.unit}]",
        title=f"{title}, {'upwards' if step.height > 0.0 else 'downwards'}",
    )
    upper.legend(loc="center right")
    # The figure ends when nothing but rest would follow, or with the record.
    resting = np.abs(step.errors) / scale < STEADY_ERROR[trial.kind]
    last = times[~resting][-1] if not resting.all() else 0.0
    upper.set_xlim(times[0], min(times[-1], max(_SHORTEST_MS, _REST * last)))
    # Draw the error as it comes to rest, with the band that it has to end in
    errors = step.errors / scale
    limit = STEADY_ERROR[trial.kind]
    middle.axhspan(-limit, limit, color="#eef2f7", linewidth=0, label=f"±{limit:g} {trial.unit}")
    middle.plot(times, errors, color=RED, linewidth=1.2)
    middle.set_ylim(-5.0 * limit, 5.0 * limit)
    middle.set_ylabel(f"error [{trial.unit}]")
    settled, rise = row["settling_time_s"], row["rise_time_s"]
    texts = [
        f"overshoot {row['overshoot_percent']:.2f} %",
        f"steady-state error {row['steady_state_error']:+.4f} {trial.unit}",
    ]
    texts.insert(0, "rise - " if rise is None else f"rise {rise * 1e3:.0f} ms")
    texts.insert(1, "not settled" if settled is None else f"settled {settled * 1e3:.0f} ms")
    middle.set_title(" · ".join(texts), fontsize=9, fontweight="normal")
    _draw_effort(lower, times, step.efforts, row, trial)
    figure.align_ylabels([upper, middle, lower])
    return figure


def _draw_effort(
    axis: Axes, times: FloatArray, efforts: FloatArray, row: Mapping[str, Any], trial: StepTrial
) -> None:
    """Draw the control signal; its limits as lines, or as a text when they are far away."""
    limit, peak = trial.joint.effort, float(np.abs(efforts).max())
    axis.plot(times, efforts, color=BLUE, linewidth=1.2)
    if limit <= _FAR * peak:
        for side in (-limit, limit):
            axis.axhline(side, color=BLUE, linestyle="--", linewidth=1.0)
        axis.set_ylim(-1.12 * limit, 1.12 * limit)
    unit = trial.effort_unit
    text = (
        f"limit ±{limit:g} {unit}, peak {row['peak_effort']:.1f} {unit} = "
        f"{row['peak_effort_percent']:.0f} %"
    )
    axis.set_title(text, fontsize=9, fontweight="normal")
    axis.set(ylabel=f"control signal [{unit}]", xlabel="time since the command [ms]")
