"""The cell as a user starts it, watched from outside.

How soon it is ready, what it costs, how old its set points are.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import open_bag
from harness.live_cell import LiveCell
from harness.processes import free_port

from bench.cells.cell_run import READY_S, run_experiments, started
from bench.room import Room

ROOT = Path(__file__).resolve().parents[2]
STARTS, REST_S = 3, 8.0
SETPOINTS = "twin/joint_setpoints"


@dataclass(frozen=True)
class Cost:
    """What a process took.

    Share of one core [percent], memory [MB] with shared pages counted once, and as `top` shows it;
    how often its threads waited and were woken [1/s].
    """

    cpu: float
    memory: float
    resident: float
    wakes: float


@dataclass
class Watched:
    """What was seen of a cell.

    Seconds until it was ready, costs by node, ages of set points [s], why there are none, what
    attempts said that left no report.
    """

    starts: list[float] = field(default_factory=list)
    rest: dict[str, Cost] = field(default_factory=dict)
    moving: dict[str, Cost] = field(default_factory=dict)
    ages: list[float] = field(default_factory=list)
    failure: str = ""
    note: str = ""


def watch(room: Room) -> Watched:
    """Start the cell some times; let the last one run the robot's program twice at full speed."""
    seen = Watched()
    for number in range(STARTS):
        room.say(f"./cell up, {number + 1} of {STARTS}")
        taken: list[float] = []
        with started(
            room.place(f"whole_cell_{number}"),
            lambda cell, taken=taken: taken.append(start_cell(cell)),
        ) as cell:  # type: ignore[misc]
            seen.starts.append(taken[-1])
            if number == STARTS - 1:
                room.say("at rest, then the robot's program twice")
                seen.rest = _costs_over(cell, lambda: time.sleep(REST_S))
                seen.moving = _costs_over(cell, partial(_lead, cell, seen))
    return seen


def start_cell(cell: LiveCell) -> float:
    """Start ``./cell up`` on ports of its own and return the seconds until the twin follows."""
    ports = {
        "master": cell.master_port,
        "modbus": cell.modbus_port,
        "gateway": cell.gateway_port,
        "panel": free_port(),
        "pendant": free_port(),
    }
    words = [word for name, port in ports.items() for word in (f"--{name}-port", str(port))]
    begun = time.monotonic()
    process = cell.stage.start(
        str(ROOT / "cell"),
        "up",
        "--no-browser",
        "--output",
        str(cell.output),
        "--runs",
        str(cell.folder),
        *words,
        name="cell_up",
    )
    cell.wait_ready(process, READY_S)
    return time.monotonic() - begun


def _lead(cell: LiveCell, seen: Watched) -> None:
    try:
        outcome = run_experiments(cell, cell.folder / "run", "real_leads", repeat=2)
    except RuntimeError as error:
        seen.failure = str(error)
    else:
        # At arrival at the twin's simulator.
        seen.ages += setpoint_ages(outcome.bag)
        seen.note = outcome.note


def setpoint_ages(file: Path) -> list[float]:
    """Return how old each set point of a recording was when the simulator got it [s]."""
    ages = []
    with open_bag(file) as bag:
        follow = {
            _stamp(m.header.stamp)
            for _, m in bag.messages("joint_pose_controller/follow")
            if m.points
        }
        for at, message in bag.messages(SETPOINTS):
            stamp = _stamp(message.header.stamp)
            if stamp in follow:
                ages.append(at - stamp[0] - stamp[1] * 1e-9)
    return ages


def _stamp(stamp: Any) -> tuple[int, int]:
    return stamp.sec, stamp.nanosec


def _costs_over(cell: LiveCell, action: Callable[[], object]) -> dict[str, Cost]:
    """Return what each process of the cell took while ``action`` ran.

    The experiment's own process is left out.
    """
    before, begun = _counts(cell), time.monotonic()
    action()
    after, seconds = _counts(cell), time.monotonic() - begun
    rate, costs = os.sysconf("SC_CLK_TCK"), {}
    for name, (pid, ticks, waits) in before.items():
        if name in after and after[name][0] == pid:
            cpu = 100.0 * (after[name][1] - ticks) / rate / seconds
            # Threads that have ended meanwhile took their counts with them.
            wakes = sum(max(0, n - waits.get(thread, 0)) for thread, n in after[name][2].items())
            costs[name] = Cost(cpu, *_memory(pid), wakes / seconds)
    return costs


def process_id(cell: LiveCell, name: str) -> int:
    """Return the process of a node.

    Raises:
        KeyError: No such node runs.
    """
    return _counts(cell)[name][0]


def _counts(cell: LiveCell) -> Mapping[str, tuple[int, int, dict[str, int]]]:
    """Return what all that the cell has started has taken so far.

    By name: process id, processor ticks, and how often each of its threads has waited.
    """
    found = {}
    for line in cell.stage.left_over():
        pid, _, command = line.partition(" ")
        name = _name(command.split())
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        found[name] = (int(pid), int(fields[11]) + int(fields[12]), _waits(int(pid)))
    return found


def _waits(pid: int) -> dict[str, int]:
    """Return how often each thread of a process has waited for something, by its id."""
    found = {}
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended just now
            lines = (thread / "status").read_text().splitlines()
            fields = dict(line.split(":", 1) for line in lines)
            found[thread.name] = int(fields["voluntary_ctxt_switches"])
    return found


def _name(words: list[str]) -> str:
    """Return the script of a command line, or its program."""
    scripts = [word for word in words[1:2] if "/" in word]
    return Path(scripts[0] if scripts else words[0]).name.replace("cell", "bring-up")


def _memory(pid: int) -> tuple[float, float]:
    """Return the proportional and the resident memory of a process [MB]."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    values = {line.split(":")[0]: int(line.split()[1]) for line in lines[1:] if line.endswith("kB")}
    return values["Pss"] / 1e3, values["Rss"] / 1e3
