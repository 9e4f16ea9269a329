"""Many cells and a crowd: what is lost, how old it comes, what it costs; beside mosquitto + paho.

Both sides of the comparison get the same states from as many senders, decode them and keep the
newest of each cell: the desk with its router on one side, mosquitto and a subscriber of paho on the
other. Counted is the processor time of what receives, and in a second figure that of the cells too.
"""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path

from harness.processes import free_port
from rich.console import Console

from bench.many_cells.broker import BrokerError, broker
from bench.many_cells.cost import cpu_s, ended_s
from bench.many_cells.stage import DEADLINE_S, JOIN_S, PROCESSES, farm, put_by
from bench.second_world.figure import Figure

MANY, QUICK_HZ, QUICK_S = 100, 50.0, 60.0
CROWD, SLOW_HZ, SLOW_S = 1000, 5.0, 20.0
LATE_S = 2.0
"""What is on its way when the cells end gets so long to come."""
AGE_P99_MS, CPU_PERCENT, CPU_RATIO = 2.0, 40.0, 0.8


def measure_many(share: float, folder: Path, console: Console) -> list[Figure]:
    """Measure 100 cells at 50 Hz for a minute, then the same with mosquitto and paho."""
    seconds = QUICK_S * share
    case = f"{MANY} cells x {QUICK_HZ:g} Hz, {seconds:.0f} s"
    with farm(folder / "many") as stage:
        stage.cells(MANY, QUICK_HZ, seconds)
        stage.wait(lambda told: told["alive"] == MANY, JOIN_S, "all cells")
        stage.asked("begin")
        before = ended_s()
        put = stage.put_by_cells()
        told = stage.asked("end")
        told["all_us"] = 1e6 * (told["cpu_s"] + ended_s() - before) / put
    console.print(f"zenoh: {put} put, {json.dumps(told)}", highlight=False, soft_wrap=True)
    lost = put - told["received"]
    figures = [
        Figure(f"{case}: lost", "", 0.0, lost, note=f"of {put} states", always=True),
        Figure(f"{case}: age", "ms", AGE_P99_MS, told["age_p99_ms"], note="p99"),
        Figure(
            f"{case}: desk with its router",
            "%",
            CPU_PERCENT,
            told["cpu_percent"],
            note="of a core",
        ),
    ]
    try:
        theirs = _paho(seconds, folder / "mosquitto", console)
    except BrokerError as error:
        console.print(f"mosquitto: not measured: {error}")
        return figures
    beside = f"age p99 {theirs['age_p99_ms']:.1f} ms, {theirs['lost']:.0f} lost"
    return [
        *figures,
        *(
            Figure(
                f"{case}: processor time of a state, {what}",
                "x",
                CPU_RATIO,
                told[key] / theirs[key],
                note=f"{told[key]:.0f} us, times {theirs[key]:.0f} us of mosquitto, paho; {beside}",
            )
            for what, key in (("received", "cpu_us"), ("cells included", "all_us"))
        ),
    ]


def _paho(seconds: float, folder: Path, console: Console) -> dict[str, float]:
    """Return what mosquitto and paho took for the same.

    Raises:
        BrokerError: mosquitto is not there and cannot be had.
    """
    folder.mkdir(parents=True, exist_ok=True)
    port = free_port()
    with farm(folder) as stage, broker(folder, port) as pid:
        receiver = stage.start("bench.many_cells.paho_desk", str(port), piped=True)
        assert receiver.stdout is not None
        receiver.stdout.readline()
        part = MANY // PROCESSES
        words = (str(port), str(part), str(QUICK_HZ), str(seconds))
        senders = [
            stage.start("bench.many_cells.paho_cells", *words, str(k * part))
            for k in range(PROCESSES)
        ]
        _until_connected(senders)
        begun = cpu_s(pid) + cpu_s(receiver.pid)
        before = _told(receiver, "begin")["received"]
        ended = ended_s()
        put = sum(map(put_by, senders))
        told, until = _told(receiver, "end"), time.monotonic() + LATE_S
        while told["received"] < put and time.monotonic() < until:
            told = _told(receiver, "end")
        used = cpu_s(pid) + cpu_s(receiver.pid) - begun
        all_us = 1e6 * (used + ended_s() - ended) / put
    console.print(f"mosquitto: {put} put, {json.dumps(told)}", highlight=False, soft_wrap=True)
    cpu_us = 1e6 * used / max(1.0, told["received"] - before)
    lost = put - told["received"]
    return {**told, "lost": lost, "cpu_us": cpu_us, "all_us": all_us}


def _told(receiver: subprocess.Popen[str], word: str) -> dict[str, float]:
    assert receiver.stdin is not None and receiver.stdout is not None
    receiver.stdin.write(f"{word}\n")
    receiver.stdin.flush()
    told: dict[str, float] = json.loads(receiver.stdout.readline())
    return told


def _until_connected(senders: list[subprocess.Popen[str]]) -> None:
    for sender in senders:
        assert sender.stdout is not None
        sender.stdout.readline()


def measure_crowd(share: float, folder: Path, console: Console) -> list[Figure]:
    """Measure 1,000 cells at 5 Hz: how soon all are there, what is lost, the desk's memory."""
    case = f"{CROWD} cells x {SLOW_HZ:g} Hz"
    with farm(folder / "crowd") as stage:
        stage.cells(CROWD, SLOW_HZ, 0.0)
        stage.wait(lambda told: told["shown"] == CROWD, DEADLINE_S, "the crowd")
        stage.restart()
        begun = time.monotonic()
        stage.wait(lambda told: told["shown"] == CROWD, DEADLINE_S, "the crowd again")
        joined = time.monotonic() - begun
        stage.asked("begin")
        time.sleep(SLOW_S * share)
        told = stage.asked("end")
    console.print(json.dumps(told), highlight=False, soft_wrap=True)
    received = f"of {told['received']} states"
    return [
        Figure(f"{case}: all there", "s", 10.0, joined, note="after the desk's start"),
        Figure(f"{case}: lost", "", 0.0, told["lost"], note=received, always=True),
        Figure(f"{case}: desk's memory", "MB", 300.0, told["memory_mb"], note="resident"),
    ]
