"""A whole cell that runs an experiment, over a slow line to the twin if wanted."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.live_cell import LiveCell
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config import config_directory
from scara_config.writer import write_values

from bench.cells.late import Late

READY_S, EXPERIMENT_S, RECOVERY_S = 120.0, 240.0, 30.0
REPEATS, ATTEMPTS = 5, 2
Changes = Mapping[str, Mapping[tuple[str, ...], Any]]


@dataclass(frozen=True)
class Outcome:
    """What a run has left.

    Attributes:
        bag: Of the attempt that counts.
        entries: Figures of its experiments as in report.json.
        ended: Last words of each attempt before it, which left no report.
    """

    bag: Path
    entries: list[dict[str, Any]]
    ended: tuple[str, ...] = ()

    @property
    def note(self) -> str:
        """Say what the attempts without a report said; empty if there were none."""
        return "; ".join(self.ended)[:300]


@contextlib.contextmanager
def running_cell(
    folder: Path, changes: Changes, without: tuple[str, ...] = ()
) -> Iterator[LiveCell]:
    """Start a cell on ports of its own and wait until it is ready; end it at last.

    Args:
        folder: For logs and configuration.
        changes: Values of the configuration by file and key.
        without: Nodes to leave out.
    """
    config = copy_with_ports(config_directory(), folder / "changed")
    for name, values in changes.items():
        write_values(config / name, dict(values))
    words = [word for name in without for word in ("--without", name)]

    def start(cell: LiveCell) -> None:
        cell.wait_ready(cell.start("up", *words, env={"SCARA_CONFIG_DIR": str(config)}), READY_S)

    with started(folder, start) as cell:
        yield cell


@contextlib.contextmanager
def started(folder: Path, start: Callable[[LiveCell], object]) -> Iterator[LiveCell]:
    """Give a cell once ``start`` has succeeded; end it at last.

    A port that was free when it was chosen may be taken by anybody's connection when it is listened
    on: then once more.
    """
    for attempt in range(ATTEMPTS):
        cell = LiveCell(folder / f"attempt_{attempt}" if attempt else folder)
        try:
            start(cell)
        except AssertionError as error:
            cell.close()
            if attempt + 1 == ATTEMPTS or "in use" not in str(error):
                raise
        except BaseException:
            cell.close()
            raise
        else:
            break
    try:
        yield cell
    finally:
        cell.close()


def experiment(folder: Path, delay_ms: tuple[float, float], changes: Changes) -> Outcome:
    """Let the robot lead at full speed over a slow line.

    The line is slow by ``delay_ms`` in each direction. Return what came out.

    Raises:
        RuntimeError: No report came out; the text is the end of the log.
    """
    with running_cell(folder, changes, ("twin_controller",)) as cell:
        cell.put_relays("web")
        if delay_ms[1]:
            cell.web.disturb(Late(delay_ms[0] * 1e-3, delay_ms[1] * 1e-3))
        cell.start_node("twin_controller")
        return run_experiments(cell, folder / "run", "real_leads", repeat=REPEATS)


def run_experiments(cell: LiveCell, output: Path, name: str, repeat: int) -> Outcome:
    """Run an experiment some times at full speed on a running cell.

    Once more if something has stopped the cell: a busy machine, or what is measured.

    Raises:
        RuntimeError: No report came out of any attempt; the text is the end of the log.
    """
    ended: list[str] = []
    for attempt in range(ATTEMPTS):
        folder = output.with_name(f"{output.name}_{attempt}")
        said = _attempt(cell, folder, name, repeat)
        if (folder / "report.json").is_file():
            break
        ended.append(said)
        recover(cell)
    else:
        raise RuntimeError(said)
    found = json.loads((folder / "report.json").read_text(encoding="utf-8"))["experiments"]
    return Outcome(next(folder.glob("*.bag")), found, tuple(ended))


def recover(cell: LiveCell) -> None:
    """Lead the cell back to IDLE, as an operator would, or give up after a while."""
    with contextlib.suppress(AssertionError):
        cell.make_ready(RECOVERY_S)


def _attempt(cell: LiveCell, output: Path, name: str, repeat: int) -> str:
    """Run the command to its end and return its last words."""
    options = ("--repeat", str(repeat), "--speed", "100", "--output", str(output))
    command = ("rosrun", "twin_experiments", "run_experiment", name, *options)
    process = cell.stage.start(*command, env=cell.environment)
    code = process.wait(EXPERIMENT_S)
    return f"run_experiment ended with {code}: {process.tail(3)}"
