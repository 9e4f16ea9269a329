"""The simulated world beside a running cell: how fast it is, and whether the cell notices.

Blocks without and with it take turns, so that what else the machine does falls on both.
"""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import statistics
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import websocket
from rich.console import Console

from bench.cells.cell_run import running_cell
from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
PROGRAMS = ("ARTICLE", "PALLETISE")
NICENESS = 10
"""As that of rosrun what_if judge --physics."""
BLOCK_S, FIRST_S = 20.0, 2.0
"""A block lasts so long, and its first seconds do not count: the one before still ends in them."""
MOST_BLOCKS = 12
RECEIVE_S, READY_S = 10.0, 60.0
STATUS, P99 = "simulator: physics", "wake late p99 [ms]"


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Make programs in the simulated world beside a cell; ``count`` bounds the number of blocks.

    A thousand gives twelve blocks of each kind: eight minutes.
    """
    blocks = max(2, min(MOST_BLOCKS, count // 80))
    late: dict[bool, list[float]] = {False: [], True: []}
    speeds: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    with running_cell(folder / "beside", {}) as cell, _simulating() as line:
        for number in range(2 * blocks):
            busy = bool(number % 2)
            if busy:
                line.send(True)
            late[busy] += _lateness(cell.gateway_port)
            if busy:
                line.send(False)
                for name, speed in _answer(line):
                    speeds[name].append(speed)
            console.print(f"block {number + 1} of {2 * blocks}: {_told(late, speeds)}")
    return [*map(_speed, PROGRAMS, speeds.values()), _added(late, blocks)]


def _speed(name: str, found: list[float]) -> Figure:
    note = f"times real time by the clock, median of {len(found)} runs in one process"
    value = statistics.median(found) if found else 0.0
    return Figure(f"physics beside a running cell, {name}", "x", 25.0, value, True, note)


def _added(late: dict[bool, list[float]], blocks: int) -> Figure:
    """Return by how much the tail of the twin's wake-ups grows."""
    without, beside = (statistics.median(late[busy]) for busy in (False, True))
    note = (
        f"median of the p99 of each second, {blocks} blocks of {BLOCK_S:g} s each in turns: "
        f"{without:.3f} ms without, {beside:.3f} ms beside it"
    )
    added = 100.0 * (beside / without - 1.0) if without > 0.0 else math.inf
    return Figure("simulator's wake-ups late, p99", "% more", 10.0, added, note=note)


def _told(late: dict[bool, list[float]], speeds: dict[str, list[float]]) -> str:
    tails = (f"{statistics.median(each):.3f} ms" for each in late.values() if each)
    fast = (f"{name} {statistics.median(found):.0f} x" for name, found in speeds.items() if found)
    return f"p99 {', '.join(tails)}; {', '.join(fast)}"


def _lateness(port: int) -> list[float]:
    """Return the tail of the simulator's lateness of each second of a block [ms]."""
    found, begin = [], time.monotonic()
    address = f"ws://127.0.0.1:{port}"
    line = websocket.create_connection(address, timeout=RECEIVE_S, suppress_origin=True)
    with closing(line):
        line.send(json.dumps({"op": "subscribe", "topic": "/diagnostics"}))
        while (now := time.monotonic() - begin) < BLOCK_S:
            packet = json.loads(line.recv())
            for status in packet.get("msg", {}).get("status", ()):
                if status["name"].endswith(STATUS) and now > FIRST_S:
                    values = {each["key"]: each["value"] for each in status["values"]}
                    found.append(float(values[P99]))
    return found


@contextmanager
def _simulating() -> Iterator[Connection]:
    """Give the line to a process of low priority that simulates between True and False."""
    context = multiprocessing.get_context("spawn")
    line, far = context.Pipe()
    process = context.Process(target=_simulate, args=(far,), daemon=True)
    process.start()
    far.close()
    try:
        _answer(line)
        yield line
    finally:
        line.close()
        process.join(READY_S)
        if process.is_alive():
            process.kill()


def _answer(line: Connection) -> list[tuple[str, float]]:
    """Return what the process says.

    Raises:
        RuntimeError: It says nothing for long.
    """
    if not line.poll(READY_S):
        raise RuntimeError(f"the simulated world has not answered for {READY_S:g} s")
    said: list[tuple[str, float]] = line.recv()
    return said


def _simulate(line: Connection) -> None:
    """Make the programs in turns while it is told to; say how fast each run was by the clock."""
    from what_if.cell_files_io import find_program, resting_cell
    from what_if.second_world_io import SETTLING_S, SecondWorld

    os.nice(NICENESS)
    with resting_cell(CONFIG) as (world, _), SecondWorld(world, CONFIG) as second:
        motions = {name: find_program(world.cell, name, CONFIG) for name in PROGRAMS}
        line.send([])
        while _is_told(line):
            found = []
            # What was begun is ended, so a run takes as long as it takes.
            while not line.poll():
                name = PROGRAMS[len(found) % len(PROGRAMS)]
                begin = time.perf_counter()
                made = second.run(world, motions[name])
                took = time.perf_counter() - begin
                found.append((name, (made.duration_s + SETTLING_S) / took))
            line.recv()
            line.send(found)


def _is_told(line: Connection) -> bool:
    """Wait until it shall begin; return whether it shall, and not end."""
    try:
        return bool(line.recv())
    except EOFError:
        return False
