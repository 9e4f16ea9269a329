"""Run the demo again and again: what its two experiments measure, and how far runs lie apart."""

from __future__ import annotations

import json
import math
import os
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import open_bag
from fanuc_kit.sheets import map_file
from harness.faults.rows import Row
from harness.plants.trials import ARTICLE_PERCENT
from harness.processes import free_port
from rich.console import Console
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.set_up.kit_map import kit_map
from twin_experiments.report.record import cut
from twin_experiments.report.run_reader_io import read_run

from bench import page
from bench.record import or_infinite

ROOT = Path(__file__).resolve().parents[1]
DEADLINE_S = 300.0
PATH_PERCENT, REST_PERCENT = 5.0, 2.0
"""The article's errors, percent of reach."""
KIT = "with the kit's own programs, PR[1] alone"
DRAWN = "drawn"
"""A plant of its own for each run: the field plant's numbers drawn by the run's seed."""
PLANTS = {"kit_ideal_50": "ideal", "kit_drawn_50": DRAWN}
"""Each series' plant."""
NAMES = tuple(PLANTS)
ENDED = "runs that ended without a report"


def run(
    repeats: int, first: int, wanted: Sequence[str], folder: Path, console: Console
) -> list[Row]:
    """Run the demo ``repeats`` times for each series, keep the figures and write the pages.

    The pages are written after each series: one that is ended keeps those before it.

    Args:
        repeats: How many runs of each; one that ends without a report is counted and said.
        first: The seed of the first run of DRAWN; each later run takes the next.
        wanted: Some of NAMES: the others stay as they were measured last; all if empty.
        folder: Where bags and reports go.
        console: For progress.

    Returns:
        The worst figure of each experiment against the article's, and how many runs came to none.

    Raises:
        ValueError: See :func:`label`.
    """
    load, rows = os.getloadavg()[0], []
    for name, plant in PLANTS.items():
        if wanted and name not in wanted:
            continue
        seeds = range(first, first + repeats)
        entry = _series(plant, seeds, folder / name, console)
        known = {each["series"]: each for each in page.so_far().get("demos", ())}
        known[name] = page.measured({"series": name, **entry}, load)
        page.write({**page.so_far(), "demos": [known[each] for each in NAMES if each in known]})
        case = f"demo, {plant}, {ARTICLE_PERCENT:g} %, {KIT}"
        rows.append(Row(case, ENDED, 0.0, float(entry["failed"])))
        rows += [
            Row(
                f"{case}: {leader}",
                what,
                limit,
                _worst(entry["runs"], leader, key),
            )
            for leader in ("real_leads", "twin_leads")
            for what, key, limit in (
                ("path error max [% of reach]", "path_percent", PATH_PERCENT),
                ("positioning error max [% of reach]", "positioning_percent", REST_PERCENT),
            )
        ]
    return rows


def _worst(runs: Sequence[dict[str, dict[str, Any]]], name: str, key: str) -> float:
    """Return the largest figure; without any run there is none that holds."""
    return max((or_infinite(run.get(name, {}).get(key)) for run in runs), default=math.inf)


def _series(plant: str, seeds: Sequence[int], folder: Path, console: Console) -> dict[str, Any]:
    """Run the demo once for each seed; only DRAWN looks at them."""
    failed = 0
    runs: list[dict[str, dict[str, Any]]] = []
    labels: list[dict[str, Any]] = []
    for number, seed in enumerate(seeds, 1):
        made = folder / f"demo_{number}"
        chosen = f"field:{seed}" if plant == DRAWN else plant
        report = _demo(made, chosen)
        figures = None if report is None else _figures(report, made)
        said = figures or "no report"
        console.print(f"{chosen} [{number}/{len(seeds)}] {said}", markup=False)
        failed += figures is None
        runs += [figures] if figures else []
        if report and plant == DRAWN:
            told = f"the field plant drawn anew for each run, seeds {seeds[0]} to {seeds[-1]}"
            report["made_with"]["plant"] = {"name": DRAWN, "description": told}
        labels += [report["made_with"]] if report else []
    known = label(labels) if labels else {"robot": load_robot().name, "plant": f"plant {plant}"}
    known["robot"] += f" {KIT}"
    return {**known, "asked_percent": ARTICLE_PERCENT, "failed": failed, "runs": runs}


def label(made_with: Sequence[dict[str, Any]]) -> dict[str, str]:
    """Return robot and plant of all runs, as their reports say; figures of two are not mixed.

    Args:
        made_with: The section of that name of each report.json.

    Raises:
        ValueError: There is no report, or two reports name another robot or plant.
    """
    found = {(each["robot"], _plant(each["plant"])) for each in made_with}
    if not found:
        raise ValueError("no demo ended with a report")
    if len(found) > 1:
        told = ", ".join(f"{robot} with {plant}" for robot, plant in sorted(found))
        raise ValueError(f"the demos are of one robot and one plant, but their reports say {told}")
    ((robot, plant),) = found
    return {"robot": robot, "plant": plant}


def _plant(plant: dict[str, Any] | None) -> str:
    return (
        "plant not recorded" if plant is None else f"plant {plant['name']}: {plant['description']}"
    )


def _demo(folder: Path, plant: str) -> dict[str, Any] | None:
    """Run one demo on ports of its own; return its report.json, None without a report."""
    config = folder / "config_in_use"
    copy_with_ports(ROOT / "config", config)
    typed = kit_map(load_modbus_map(config))
    (config / "modbus_map.yaml").write_text(map_file(typed), encoding="utf-8")
    ports = [f"--{kind}-port={free_port()}" for kind in ("master", "modbus", "gateway")]
    asked = ["--plant", plant, "--output", str(folder / "run")]
    command = ["rosrun", "scara_bringup", "cell", "demo", *asked, *ports]
    environment = {**os.environ, "SCARA_CONFIG_DIR": str(config)}
    # Who hangs has no report, and is counted as such.
    with suppress(subprocess.TimeoutExpired), (folder / "demo.log").open("w") as log:
        subprocess.run(
            command, env=environment, stdout=log, stderr=log, timeout=DEADLINE_S, check=False
        )
    report = folder / "run" / "report.json"
    if not report.is_file():
        return None
    read: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    return read


def _figures(report: dict[str, Any], folder: Path) -> dict[str, dict[str, Any]]:
    """Return the figures of one demo by experiment."""
    speeds = _speeds(folder / "run" / "run.bag")
    return {
        entry["name"]: {
            "path_percent": entry["path_error_max_percent"],
            "undisturbed_percent": entry["path_error_max_undisturbed_percent"],
            "positioning_percent": entry["positioning_error_max_percent"],
            "true_percent": entry["true_positioning_error_max_percent"],
            "speed_percent": speeds[entry["name"]],
        }
        for entry in report["experiments"]
    }


def _speeds(bag: Path) -> dict[str, float]:
    """Return how fast the real robot's fastest joint was, percent of its largest, by experiment."""
    joints = load_robot(ROOT / "config").twin_joints
    with open_bag(bag) as opened:
        recorded = read_run(opened, [joint.name for joint in joints])
    found: dict[str, Any] = {}
    for span in recorded.spans:
        peaks = abs(cut(recorded.real, span.start, span.end).velocities).max(axis=0)
        shares = [100.0 * peak / joint.velocity for peak, joint in zip(peaks, joints)]
        found[span.name] = round(float(max(shares)), 1)
    return found
