"""Rows of whole cells: sync_error, sync_error_slow, state_age, cell_cost, start."""

from __future__ import annotations

import json
import statistics
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from harness.processes import Stage, free_port, wait_until
from harness.workspace import workspace_environment
from scara_config.modbus_map import load_modbus_map
from twin_controller.registers import RegisterCodec

from bench.cells.cell_run import Changes, experiment
from bench.cells.hold import held_errors_mm
from bench.cells.whole_cell import STARTS, Cost, Watched, watch
from bench.goal_table import SYNC_RATIOS
from bench.record import Beside, Goal, Record, quantile
from bench.room import Room

POLL_S, POLLS = 10.0, 2
# Goals; our choice: two cells on two cores, and a twin that is no later than a drive's own rhythm.
MOVING_PERCENT, REST_PERCENT, WAKES, MEMORY_MB, START_S = 50.0, 35.0, 4000.0, 450.0, 3.0
AGE_MS, AGE_P99_MS = 2.2, 3.5


def _sync(
    room: Room, name: str, delay_ms: tuple[float, float], changes: Changes, rate: str
) -> Record:
    """Compare the twin's error with that of a twin that holds the newest value.

    Both are taken from the same run.
    """
    outcome = experiment(room.place(name), delay_ms, changes)
    held = held_errors_mm(outcome.bag, room.robot)
    ours = [entry["path_error_max_mm"] for entry in outcome.entries]
    rms = [entry["path_error_rms_mm"] for entry in outcome.entries]
    return Record(
        name,
        statistics.median(ours),
        statistics.median(held),
        "mm",
        (Goal("ratio", SYNC_RATIOS[name]),),
        measured="largest distance of both tools at the same instant, robot leads ARTICLE at "
        f"override 100 %, {rate} poll, each web-socket packet {delay_ms[0]:g} to "
        f"{delay_ms[1]:g} ms late in both directions; ground truth of both sides",
        against="the same run: an ideal twin that stands at the newest position it has been sent "
        "until the next one arrives",
        statistic="median of the largest",
        rounds=len(ours),
        spread_percent=100.0 * (max(ours) - min(ours)) / statistics.median(ours),
        baseline_spread_percent=100.0 * (max(held) - min(held)) / statistics.median(held),
        beside=(Beside("root mean square of our path error", statistics.median(rms), "mm"),),
        note=outcome.note,
    )


def sync_error(room: Room) -> Record:
    """About 100 Hz, 5 to 8 ms."""
    return _sync(room, "sync_error", (5.0, 8.0), {}, "100 Hz")


def sync_error_slow(room: Room) -> Record:
    """About 50 Hz, 20 to 30 ms.

    A divergence is reported but pauses nobody, so that there is an error to measure.
    """
    changes: Changes = {
        "twin_controller.yaml": {("real", "poll_period_ms"): 19.7, ("divergence", "pause"): False}
    }
    return _sync(room, "sync_error_slow", (20.0, 30.0), changes, "50 Hz")


def _watched(room: Room) -> Watched:
    return room.once("whole_cell", lambda: watch(room))


def _bare_ages(room: Room) -> list[float]:
    """Return the age of the robot's state at the other end [s].

    It ends when a bare program's message has been parsed there.
    """
    layout = load_modbus_map(None)
    codec = RegisterCodec(layout, room.robot)
    with room.robot_stand_in() as modbus_port:
        stage = Stage(room.place("bare"), workspace_environment())
        try:
            port, block = free_port(), codec.state
            sink = stage.start(sys.executable, "-m", "bench.bare_nodes", "sink", str(port))
            wait_until(lambda: "listening" in sink.output, 20.0, "the sink")
            words = [modbus_port, port, block.offset, block.count, layout.device_id, POLL_S]
            poll = stage.start(sys.executable, "-m", "bench.bare_nodes", "poll", *map(str, words))
            poll.wait(POLL_S + 30.0)
            found = json.loads(poll.output.splitlines()[-1])
        finally:
            stage.close()
    return _ages(found, codec)


def _ages(found: dict[str, Any], codec: RegisterCodec) -> list[float]:
    """Turn the robot's clock into ours by the shortest reads, and return the ages at arrival.

    The smallest difference of a second belongs to a state that was latched right before it was
    read; its age is taken as 0.2 ms, as in twin_controller.yaml (sample_latency_ms).
    """
    signals = [False] * codec.outputs.count
    clocks = [codec.decode_sample(words, signals).clock_ms * 1e-3 for _, words in found["reads"]]
    read = np.array([at for at, _ in found["reads"]])
    late, arrived = read - np.array(clocks), np.array(found["arrivals"])
    ages = []
    for first in range(0, len(late) - 50, 100):
        part = slice(first, first + 100)
        ages += (arrived[part] - read[part] + late[part] - late[part].min() + 2e-4).tolist()
    return ages[50:]


def state_age(room: Room) -> Record:
    """From the robot's state to its set point at the twin's simulator.

    The time begins when the state was true.
    """
    room.say("bare reader and sender")
    bare = [_bare_ages(room)]
    seen = _watched(room)
    if seen.failure:
        raise RuntimeError(seen.failure)
    bare.append(_bare_ages(room))
    each = [quantile(ages, 0.99) for ages in bare]
    return Record(
        "state_age",
        quantile(seen.ages, 0.99) * 1e3,
        statistics.mean(each) * 1e3,
        "ms",
        (Goal("ratio", 2.0), Goal("ours", AGE_P99_MS)),
        measured="robot's state block -> twin_controller (checks, clock, decision) -> gateway -> "
        "joint_pose_controller -> "
        "simulator, whole cell, robot leads; by the recorder's clock",
        against="a bare loop on absolute deadlines: pymodbus reads the same block, "
        "websocket-client sends it, a bare websockets server parses it; nothing else "
        "runs; before and after ours",
        statistic="p99",
        ours_p99=quantile(seen.ages, 0.99) * 1e3,
        baseline_p99=statistics.mean(each) * 1e3,
        baseline_spread_percent=100.0 * (max(each) - min(each)) / statistics.mean(each),
        rounds=POLLS,
        beside=(
            _below("median, ours", statistics.median(seen.ages) * 1e3, "ms", AGE_MS),
            Beside(
                "median, baseline",
                statistics.median([age for ages in bare for age in ages]) * 1e3,
                "ms",
            ),
        ),
        note="up to 2 ms of both is the robot's own: it latches its state every 2 ms; the "
        "baseline's tail is mostly what the machine did meanwhile, hence the goal of our own"
        + (f"; {seen.note}" if seen.note else ""),
    )


def cell_cost(room: Room) -> Record:
    """Processor time and memory of every process of the cell."""
    seen = _watched(room)
    if seen.failure:
        raise RuntimeError(seen.failure)
    moving, rest = sum(c.cpu for c in seen.moving.values()), sum(c.cpu for c in seen.rest.values())
    memory = sum(c.memory for c in seen.moving.values())
    resident = sum(c.resident for c in seen.moving.values())
    return Record(
        "cell_cost",
        moving,
        None,
        "% of a core",
        (Goal("ours", MOVING_PERCENT),),
        measured="all processes of ./cell up, operator page included (no browser on it), robot "
        "leads, everything is recorded",
        against="none",
        statistic="mean",
        beside=(
            _below("the same at rest", rest, "% of a core", REST_PERCENT),
            _below("wakes at rest", _wakes(seen.rest), "/s", WAKES),
            Beside("processor time of a wake at rest", _per_wake_us(seen.rest), "us"),
            Beside("wakes while the robot leads", _wakes(seen.moving), "/s"),
            Beside("processor time of one then", _per_wake_us(seen.moving), "us"),
            _below("memory, shared pages counted once", memory, "MB", MEMORY_MB),
            Beside("sum of the resident sizes, as top shows them", resident, "MB"),
            *(_node(name, cost, seen.rest.get(name)) for name, cost in _by_cost(seen)),
        ),
        note=seen.note,
    )


def _below(what: str, value: float, unit: str, limit: float) -> Beside:
    return Beside(what, value, unit, f"<= {limit:g}", value <= limit)


def _wakes(costs: Mapping[str, Cost]) -> float:
    return sum(cost.wakes for cost in costs.values())


def _per_wake_us(costs: Mapping[str, Cost]) -> float:
    """Return how long the processor works for each wake, what it computes included [us]."""
    return sum(cost.cpu for cost in costs.values()) * 1e4 / max(_wakes(costs), 1.0)


def _by_cost(seen: Watched) -> list[tuple[str, Cost]]:
    return sorted(seen.moving.items(), key=lambda item: -item[1].cpu)


def _node(name: str, cost: Cost, rest: Cost | None) -> Beside:
    at_rest = f"{rest.cpu:.1f} % and {rest.wakes:.0f} wakes/s at rest, " if rest else ""
    return Beside(f"{name} ({at_rest}{cost.memory:.0f} MB)", cost.cpu, "% of a core")


def start(room: Room) -> Record:
    """From ./cell up to the twin controller's IDLE.

    By then the twin has been aligned by following the robot.
    """
    starts = _watched(room).starts
    return Record(
        "start",
        statistics.median(starts),
        None,
        "s",
        (Goal("ours", START_S),),
        measured="./cell up, set-up done, operator page included, until it says ready: every node "
        "answers, both links are up, "
        "the twin has followed the robot's samples to its pose and would follow the next motion",
        against="none",
        rounds=STARTS,
        spread_percent=100.0 * (max(starts) - min(starts)) / statistics.median(starts),
    )
