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

from twin_analysis.health.labelled_runs import (
    DIGITS,
    LABELS,
    TORQUE_DIGITS,
    LabelledRun,
    labelled_run,
    signal_columns,
)
from twin_analysis.health.virtual_cycles import AMOUNTS, TORQUE_NOISE_PERCENT, VACUUM_NOISE

RUNS, SIGNALS, SHEET = "runs.parquet", "signals.parquet", "datasheet.md"
AMOUNT_WORDS = {
    "friction": "growth of its Coulomb part; 1 is twice",
    "backlash": "play in turns of the motor",
    "stiffness": "part of the servo's stiffness that is lost",
    "payload": "mass added [kg]",
    "vacuum": "part of the best vacuum that a leak takes",
}
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
            # What is drawn by noise has no word twice: its bytes are sorted by their place instead.
            drawn = [name for name in columns if name not in ("run", "now")]
            writer = pq.ParquetWriter(
                folder / SIGNALS,
                table.schema,
                compression="zstd",
                use_dictionary=["run", "now"],
                use_byte_stream_split=drawn,
            )
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
    # A generator for each run, so that it does not matter which worker computes it, or when.
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
        f"| {kind} | {low:g} to {high:g} | {AMOUNT_WORDS[kind]} |"
        for kind, (low, high) in AMOUNTS.items()
    )
    return f"""# Labelled runs of a SCARA that wears
**Made, not measured.** All of it comes from a simulated robot: this project's stand-in of a FANUC
SR-6iA, in virtual time. No real robot, no person and no workplace is in it.

**What for.** To compare methods that tell from set points, positions and motor torques which part
of a robot has worn; to teach; to test software that reads such recordings.

**Not for.** No threshold, service interval or stop of a real robot may come from it, and no figure
on it is a figure on steel: the laws of wear are assumed (plant/wear.py), and whoever is good at
these runs is good at this stand-in. It has no failures, no crashes, no ageing of all joints at
once, no part that wears beside another one, no other robot and no other cycle.

**What.** {runs} runs, seed {seed}: each is a robot of its own, once in its first week and once now,
healthy or with one worn part. Labels take turns: {", ".join(LABELS)}.

**How made.** Plant `field`; drawn within 30 % by the run's number: accelerations and gains of the
servo loops, friction, delays, noise of the positions. Lengths, gears and encoders are those of the
type. A cycle is three fast moves of all joints and three slow ones, read each 4 to 16 ms: one time
for each robot. Gears are at about 21 C in the morning and 30 C in the evening; torques have a noise
of {TORQUE_NOISE_PERCENT:g} % rms, the vacuum's time {100.0 * VACUUM_NOISE:g} %. Joint, amount,
temperatures and noise come from numpy's generator, seeded by seed and run. Positions are rounded to
{DIGITS} places, torques to {TORQUE_DIGITS}; both are float32. Nothing was left out or mended.

**Files.**

| file | sha256 |
|---|---|
| {RUNS} | {digests[RUNS]} |
| {SIGNALS} | {digests[SIGNALS]} |

**{RUNS}**, a row for each run: `run`, `label`, `joint` (empty: of no joint), `amount`, `plant`,
`first_celsius`, `now_celsius` of the gears, `first_vacuum_s`, `now_vacuum_s`.

**{SIGNALS}**, a row for each reading, a row group for each run: `run`; `now` 0 in the first week,
1 now; `time_s` from the cycle's begin; for each of {", ".join(names)}:
`_wanted` and `_measured` [rad; m for joint_3], `_torque_percent` of the largest motor torque.

| label | amount, evenly drawn | of |
|---|---|---|
{amounts}

**Traps.**
- `run` and `plant` tell the label (they take turns): they are names, no features. Nor are the
  temperatures: a real robot does not tell them.
- Split by run. The robot of a run is the same in each data set, whatever its seed: whoever learns
  from run 7 of seed 1 has seen the robot of run 7 of seed 2.
- The robot is behind its set points by the stream's delay: another one in each cycle, the same for
  all joints. It is no wear.

**The same bytes** come from the same commit with the libraries of `setup/pins*.txt`:
`./cell dataset health --runs {runs} --seed {seed}`, with any number of workers.

**Licence.** BSD-3-Clause, as the project. Mistakes: to the project's issues. It is not kept up: a
commit that changes the stand-in writes other bytes, and its CHANGELOG says so.
"""
