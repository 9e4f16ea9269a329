"""Write labelled runs as Parquet, with a datasheet: the same bytes, whoever computes them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scara_config import load_robot

from twin_analysis.health.labelled_runs import LABELS, LabelledRun, labelled_run, signal_columns
from twin_analysis.health.virtual_cycles import AMOUNTS, TORQUE_NOISE_PERCENT, VACUUM_NOISE

RUNS, SIGNALS, SHEET = "runs.parquet", "signals.parquet", "datasheet.md"
WHOLE = {"run": pa.int32(), "now": pa.int8(), "time_s": pa.float64()}


def write_dataset(folder: Path, runs: int, seed: int, workers: int, profile: Path) -> str:
    """Write runs, signals and datasheet into a folder; return the digest of both tables.

    Args:
        folder: Made if it is not there; the three files in it are written anew.
        runs: How many.
        seed: The same gives the same bytes, with any number of workers.
        workers: Processes that compute.
        profile: Folder of the robot.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [joint.name for joint in load_robot(profile).joints]
    rows = []
    writer: pq.ParquetWriter | None = None
    for run in _computed(runs, seed, workers, profile):
        rows.append(_row(run))
        columns = signal_columns(run, names)
        arrays = {
            name: pa.array(values).cast(WHOLE.get(name, pa.float32()))
            for name, values in columns.items()
        }
        table = pa.table(arrays)
        if writer is None:
            writer = pq.ParquetWriter(folder / SIGNALS, table.schema, compression="zstd")
        writer.write_table(table)
    if writer is not None:
        writer.close()
    pq.write_table(pa.Table.from_pylist(rows), folder / RUNS, compression="zstd")
    digests = {name: _digest(folder / name) for name in (RUNS, SIGNALS)}
    (folder / SHEET).write_text(datasheet(runs, seed, names, digests), encoding="utf-8")
    return hashlib.sha256("".join(digests.values()).encode()).hexdigest()


def _computed(runs: int, seed: int, workers: int, profile: Path) -> Iterator[LabelledRun]:
    """Yield the runs in their order."""
    compute, numbers = partial(_run, seed, profile), range(1, runs + 1)
    if workers <= 1:
        yield from map(compute, numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(compute, numbers, chunksize=4)


def _run(seed: int, profile: Path, number: int) -> LabelledRun:
    return labelled_run(number, profile, np.random.default_rng([seed, number]))


def _row(run: LabelledRun) -> dict[str, object]:
    wear = run.wear
    return {
        "run": run.number,
        "label": run.label,
        "joint": wear.joint if wear else "",
        "amount": round(wear.amount, 6) if wear else 0.0,
        "plant": f"field:{run.number}",
        "first_celsius": round(run.celsius[0], 6),
        "now_celsius": round(run.celsius[1], 6),
        "first_vacuum_s": round(run.cycles[0].vacuum_s, 7),
        "now_vacuum_s": round(run.cycles[1].vacuum_s, 7),
    }


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def datasheet(runs: int, seed: int, names: Sequence[str], digests: dict[str, str]) -> str:
    """Return what a reader of the data set has to know."""
    amounts = "\n".join(
        f"| {kind} | {low:g} to {high:g} |" for kind, (low, high) in AMOUNTS.items()
    )
    return f"""# Labelled runs of a SCARA that wears
**What.** {runs} runs, seed {seed}: each is a robot of its own, once in its first week and once now,
healthy or with one worn part. Labels take turns: {", ".join(LABELS)}.

**How made.** By this project's stand-in of a FANUC SR-6iA in virtual time, plant `field`, each
number drawn within 30 % by the run's number. No real robot was measured. A cycle is three fast
moves of all joints and three slow ones. Gears are cold in the morning; torques have a noise of
{TORQUE_NOISE_PERCENT:g} % rms, the vacuum's time {100.0 * VACUUM_NOISE:g} %.

**Files.**

| file | sha256 |
|---|---|
| {RUNS} | {digests[RUNS]} |
| {SIGNALS} | {digests[SIGNALS]} |

**{RUNS}**, a row for each run: `run`, `label`, `joint` (empty: of no joint), `amount`, `plant`,
`first_celsius`, `now_celsius` of the gears, `first_vacuum_s`, `now_vacuum_s` (infinite: never).

**{SIGNALS}**, a row for each reading: `run`; `now` 0 in the first week, 1 now; `time_s` from the
cycle's begin; for each of {", ".join(names)}: `_wanted` and `_measured` [rad; m for joint_3],
`_torque_percent` of the largest motor torque.

| label | amount |
|---|---|
{amounts}

Friction: growth of its Coulomb part, 1 is twice. Backlash: play in turns of the motor. Stiffness:
lost part. Payload: mass added [kg]. Vacuum: part of it that a leak takes.

**Limits.** One part wears at a time. The laws of wear are assumed (plant/wear.py): whoever is good
at these runs is good at this stand-in. Times between readings differ from robot to robot.

**The same bytes** come from the same commit with the libraries of `setup/pins*.txt`, with any
number of workers.

**Licence.** BSD-3-Clause, as the project.
"""
