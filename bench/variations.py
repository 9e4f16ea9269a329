"""How the errors of the article's experiments depend on speed, model, poll rate and delay.

One cell for each variation.
"""

from __future__ import annotations

import json
import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

from harness.faults.rows import Row
from harness.processes import free_port
from rich.console import Console
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config.writer import write_values

from bench.demos import ENDED
from bench.record import or_infinite

ROOT = Path(__file__).resolve().parents[1]
DEADLINE_S = 300.0
ARTICLE_PATH, ARTICLE_REST = 5.0, 2.0

Changes = dict[str, dict[tuple[str, ...], Any]]

# Without feed-forward the integral alone carries joint_3; with 20 ms per answer a cycle of three
# takes 60 ms.
VARIATIONS: dict[str, tuple[float, Changes]] = {
    "100 % speed": (100.0, {}),
    "30 % speed": (30.0, {}),
    "plain PID, no feed-forward": (
        100.0,
        {
            "simulation.yaml": {("feed_forward",): False},
            "pid_gains.yaml": {("joint_3", "position", "i_clamp"): 20.0},
        },
    ),
    "masses of the model 20 % wrong": (100.0, {"simulation.yaml": {("model_mass_factor",): 0.8}}),
    "50 Hz poll": (100.0, {"twin_controller.yaml": {("real", "poll_period_ms"): 19.7}}),
    "20 ms added delay": (
        100.0,
        {
            "plants/ideal.yaml": {
                ("answers", "idle_ms"): [20, 20],
                ("answers", "running_ms"): [20, 20],
            },
            "twin_controller.yaml": {("real", "stale_ms"): 300},
        },
    ),
}


def run(folder: Path, console: Console) -> list[Row]:
    """Run every variation and return its errors.

    Args:
        folder: Where bags and reports go.
        console: For progress.

    Returns:
        For each variation and experiment the path and the positioning error [percent of reach],
        against the article's.
    """
    rows: list[Row] = []
    for number, (name, (speed, changes)) in enumerate(VARIATIONS.items(), 1):
        console.print(f"[{number}/{len(VARIATIONS)}] {name}", markup=False)
        report = _report(folder / f"variation_{number}", speed, changes)
        if report is None:
            console.print("  no report: see its log", style="red")
            rows.append(Row(name, ENDED, 0.0, 1.0))
            continue
        for experiment in report["experiments"]:
            label = f"{name}: {experiment['name']}"
            rows.append(
                Row(
                    label,
                    "path error max [% of reach]",
                    ARTICLE_PATH,
                    or_infinite(experiment["path_error_max_percent"]),
                )
            )
            rows.append(
                Row(
                    label,
                    "positioning error max [% of reach]",
                    ARTICLE_REST,
                    or_infinite(experiment["positioning_error_max_percent"]),
                )
            )
    return rows


def _report(folder: Path, speed: float, changes: Changes) -> dict[str, Any] | None:
    """Run one demo with a changed configuration and return its report, None if it has none."""
    config = folder / "changed_config"
    copy_with_ports(ROOT / "config", config)
    for name, values in changes.items():
        write_values(config / name, values)
    ports = [f"--{kind}-port={free_port()}" for kind in ("master", "modbus", "gateway")]
    command = [
        "rosrun",
        "scara_bringup",
        "cell",
        "demo",
        "--speed",
        f"{speed:g}",
        "--output",
        str(folder / "run"),
        *ports,
    ]
    # Who hangs has no report: the others are measured all the same.
    with suppress(subprocess.TimeoutExpired), (folder / "demo.log").open("w") as log:
        subprocess.run(
            command,
            env={**os.environ, "SCARA_CONFIG_DIR": str(config)},
            stdout=log,
            stderr=log,
            timeout=DEADLINE_S,
            check=False,
        )
    file = folder / "run" / "report.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else None
