"""Run the demo again and again: what its two experiments measure, and how far runs lie apart."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from harness.faults.rows import Row
from harness.processes import free_port
from rich.console import Console
from scara_bringup.io.configuration import copy_with_ports
from scara_config import load_robot
from twin_experiments.io.bag_reader import open_bag
from twin_experiments.io.run_reader import read_run
from twin_experiments.record import cut

from bench import page

ROOT = Path(__file__).resolve().parents[1]
DEADLINE_S = 300.0
PATH_PERCENT, REST_PERCENT = 5.0, 2.0
"""The article's errors, percent of reach."""
PLANT = "ideal stand-in, 18 ms of lag"


def run(repeats: int, folder: Path, console: Console) -> list[Row]:
    """Run the demo ``repeats`` times, keep the figures in results.json and write the pages.

    Args:
        repeats: How many runs; one that ends without a report is counted and said.
        folder: Where bags and reports go.
        console: For progress.

    Returns:
        The worst figure of each experiment against the article's.
    """
    load, runs, failed = os.getloadavg()[0], [], 0
    for number in range(1, repeats + 1):
        figures = _demo(folder / f"demo_{number}")
        console.print(f"[{number}/{repeats}] {figures or 'no report'}", markup=False)
        failed += figures is None
        runs += [figures] if figures else []
    robot = load_robot(ROOT / "config").name
    entry = {"robot": robot, "plant": PLANT, "failed": failed, "runs": runs}
    content = page.so_far()
    page.write({**content, "demos": page.measured(entry, load)})
    return [
        Row(f"demo: {name}", what, limit, max(run[name][key] for run in runs))
        for name in ("real_leads", "twin_leads")
        for what, key, limit in (
            ("path error max [% of reach]", "path_percent", PATH_PERCENT),
            ("positioning error max [% of reach]", "positioning_percent", REST_PERCENT),
        )
    ]


def _demo(folder: Path) -> dict[str, dict[str, float]] | None:
    """Run one demo on ports of its own; return its figures by experiment, None without a report."""
    config = folder / "config_in_use"
    copy_with_ports(ROOT / "config", config, None, None)
    ports = [f"--{kind}-port={free_port()}" for kind in ("master", "modbus", "gateway")]
    command = ["rosrun", "scara_bringup", "cell", "demo", "--output", str(folder / "run"), *ports]
    environment = {**os.environ, "SCARA_CONFIG_DIR": str(config)}
    with (folder / "demo.log").open("w") as log:
        subprocess.run(
            command, env=environment, stdout=log, stderr=log, timeout=DEADLINE_S, check=False
        )
    report = folder / "run" / "report.json"
    if not report.is_file():
        return None
    speeds = _speeds(folder / "run" / "run.bag")
    return {
        entry["name"]: {
            "path_percent": entry["path_error_max_percent"],
            "positioning_percent": entry["positioning_error_max_percent"],
            "speed_percent": speeds[entry["name"]],
        }
        for entry in json.loads(report.read_text(encoding="utf-8"))["experiments"]
    }


def _speeds(bag: Path) -> dict[str, float]:
    """Return how fast the real robot's fastest joint was, percent of its largest, by experiment."""
    joints = load_robot(ROOT / "config").twin_joints
    with open_bag(bag) as opened:
        recorded = read_run(opened, [joint.name for joint in joints])
    found: dict[str, Any] = {}
    for span in recorded.spans:
        peaks = abs(cut(recorded.real.motion, span.start, span.end).velocities).max(axis=0)
        shares = [100.0 * peak / joint.velocity for peak, joint in zip(peaks, joints)]
        found[span.name] = round(float(max(shares)), 1)
    return found
