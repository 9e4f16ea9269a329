"""A whole cell that runs an experiment, with a slow line between twin controller and twin if wanted."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.live_cell import LiveCell
from harness.processes import Process
from harness.proxy import websocket_units
from harness.wires.relay import Relay
from scara_bringup.io.configuration import copy_with_ports
from scara_config import config_directory
from scara_config.writer import write_values

from bench.cells.late import Late

READY_S, EXPERIMENT_S, REPEATS = 120.0, 240.0, 3
Changes = Mapping[str, Mapping[tuple[str, ...], Any]]


@dataclass(frozen=True)
class Outcome:
    """What a run has left: its bag, and the figures of its experiments as in report.json."""

    bag: Path
    entries: list[dict[str, Any]]


@contextlib.contextmanager
def running_cell(folder: Path, changes: Changes, without: tuple[str, ...] = ()) -> Iterator[tuple[LiveCell, Process]]:
    """Start a cell on ports of its own and wait until it is ready; end it at last.

    Args:
        folder: For logs and configuration.
        changes: Values of the configuration by file and key.
        without: Nodes to leave out.
    """
    config = copy_with_ports(config_directory(), folder / "changed", None, None)
    for name, values in changes.items():
        write_values(config / name, dict(values))
    cell = LiveCell(folder)
    try:
        words = [word for name in without for word in ("--without", name)]
        bringup = cell.start("up", *words, env={"SCARA_CONFIG_DIR": str(config)})
        cell.wait_ready(bringup, READY_S)
        yield cell, bringup
    finally:
        cell.close()


def experiment(folder: Path, delay_ms: tuple[float, float], changes: Changes) -> Outcome:
    """Let the robot lead at full speed over a line that is slow in each direction by ``delay_ms``, and return what came out.

    Raises:
        RuntimeError: No report came out; the text is the end of the log.
    """
    with running_cell(folder, changes, ("twin_controller",)) as (cell, _):
        relay = Relay(cell.gateway_port, websocket_units)
        try:
            if delay_ms[1]:
                relay.disturb(Late(delay_ms[0] * 1e-3, delay_ms[1] * 1e-3))
            env = {"SCARA_CONFIG_DIR": str(cell.output / "config")}
            url = f"_gateway_url:=ws://127.0.0.1:{relay.port}"
            cell.stage.start("rosrun", "twin_controller", "twin_controller", url, env=env)
            return run_experiments(cell, folder / "run", "real_leads", repeat=REPEATS)
        finally:
            relay.close()


def run_experiments(cell: LiveCell, output: Path, name: str, repeat: int) -> Outcome:
    """Run an experiment some times at full speed on a running cell.

    Raises:
        RuntimeError: No report came out; the text is the end of the log.
    """
    env = {"SCARA_CONFIG_DIR": str(cell.output / "config")}
    options = ("--repeat", str(repeat), "--speed", "100", "--output", str(output))
    process = cell.stage.start("rosrun", "twin_experiments", "run_experiment", name, *options, env=env)
    code = process.wait(EXPERIMENT_S)
    report = output / "report.json"
    if not report.is_file():
        raise RuntimeError(f"run_experiment ended with {code}: {process.tail(5)}")
    found = json.loads(report.read_text(encoding="utf-8"))["experiments"]
    return Outcome(next(output.glob("*.bag")), found)
