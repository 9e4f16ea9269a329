"""Faults of the recording: its process killed, its disk full."""

from __future__ import annotations

import itertools
import shutil
import time
from pathlib import Path
from random import Random

from cell_recorder.reading.bag_reader_io import open_bag

from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import losses
from harness.faults.rows import Row
from harness.processes import wait_until

LOST_S, ERROR_S = 0.2, 1.0
TRUTH = "real/ground_truth"
FILE_LIMIT = 1_500_000
"""A process may write no longer file [bytes]: a full disk without filling a disk."""


def recorder_killed(cell: FaultCell, rng: Random) -> list[Row]:
    """Kill -9 during a recording: what is lost, and who can read the rest."""
    path = begin(cell)
    time.sleep(rng.uniform(1.5, 3.0))
    killed = cell.kill("recorder")
    ours = stamps(path)
    copy = path.with_name(f"reindexed_{path.name}")  # a second backup of one name would be skipped
    shutil.copy(path, copy)
    cell.ros.shell("rosbag", "reindex", "-q", str(copy), timeout=60.0)
    standard, last = (
        float(cell.ros.shell("rosbag", "info", "-y", "-k", key, str(copy), timeout=60.0))
        for key in ("messages", "end")
    )
    with open_bag(path) as bag:
        count = sum(bag.topics.values())
    cell.start_node("recorder")
    return [
        Row("recorder killed", "lost before the kill [s]", LOST_S, killed - ours[-1]),
        Row("recorder killed", "largest hole in what is kept [s]", 0.1, hole(ours)),
        # The last write may be cut: rosbag gives up that chunk, ours reads its whole messages.
        Row("recorder killed", "lost for standard tools [s]", LOST_S, killed - last),
        Row(
            "recorder killed",
            "messages that only standard tools read",
            0.0,
            max(0.0, standard - count),
            always=True,
        ),
    ]


def recorder_stopped(cell: FaultCell, rng: Random) -> list[Row]:
    """SIGSTOP during a recording: its topics back up, and nobody who publishes waits for it."""
    cell.recover()
    path = begin(cell)
    time.sleep(0.5)
    begun = cell.stop("recorder")
    cell.go(rng.uniform(10.0, 30.0))
    cell.wait_for("IDLE")
    time.sleep(rng.uniform(0.5, 1.5))
    control = losses(cell, "recorder stopped", begun)
    again = cell.go_on("recorder")
    wait_until(
        lambda: stamps(path)[-1] > again + 0.2, 10.0, "messages after it goes on", period=0.3
    )
    cell.kill("recorder")
    cell.start_node("recorder")
    return [
        control,
        Row(
            "recorder stopped",
            "records again after [s]",
            1.0,
            min(t for t in stamps(path) if t > again) - again,
        ),
    ]


def disk_full(cell: FaultCell, rng: Random) -> list[Row]:
    """The bag cannot grow any more.

    All before is kept, an ERROR tells it, the control feels nothing.
    """
    from diagnostic_msgs.msg import DiagnosticArray

    cell.processes["recorder"].stop()
    limit = FILE_LIMIT + rng.randrange(300_000)
    cell.start_node("recorder", "prlimit", f"--fsize={limit}")
    said = cell.ros.collect("/diagnostics", DiagnosticArray)
    path = begin(cell)
    begun = time.time()

    def errors() -> list[float]:
        recorder = cell.ros.name("recorder")
        return [
            m.header.stamp.to_sec()
            for m in list(said)
            for s in m.status
            if s.name == recorder and s.level == 2
        ]

    told = wait_until(errors, 60.0, "an ERROR of the recorder")[0]
    time.sleep(0.5)
    kept = stamps(path)
    control = losses(cell, "disk full", begun)
    cell.processes["recorder"].stop()
    cell.start_node("recorder")
    return [
        Row("disk full", "ERROR after the last message kept [s]", ERROR_S, told - kept[-1]),
        Row("disk full", "largest hole in what is kept [s]", 0.1, hole(kept)),
        Row(
            "disk full",
            "kept [part of what the disk took]",
            0.8,
            path.stat().st_size / limit,
            at_least=True,
        ),
        control,
    ]


def begin(cell: FaultCell) -> Path:
    """Start a recording and return its file."""
    from scara_msgs.srv import StartRecording

    path = cell.ros.folder / f"fault_{time.monotonic_ns()}.bag"

    def started() -> bool:
        return bool(cell.call("recorder/start", StartRecording, path=str(path)).success)

    cell.until(started, 15.0, "a recording")
    return path


def stamps(path: Path) -> list[float]:
    """Return the stamps of the ground truth in a bag, read by our own tools."""
    with open_bag(path) as bag:
        return [float(stamp) for stamp, _ in bag.messages(TRUTH)]


def hole(times: list[float]) -> float:
    """Return the longest time between two neighbours."""
    return max(after - before for before, after in itertools.pairwise(times))
