"""Command ``replay_decisions``.

The recorded inputs through the actual core give the same decisions, bit for bit.

    rosrun twin_analysis replay_decisions BAG

Needs no cell and no ROS master. Exit code: 0 all the same, 1 a difference, lost messages, or
nothing to compare, 2 wrong configuration in the bag, 3 the bag cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from rich.console import Console
from scara_config import ConfigError
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import UNUSABLE, WRONG
from twin_controller.reporting.snapshots import SnapshotError

from twin_analysis.replay.decision_reader_io import read_decisions, read_inputs, read_setups
from twin_analysis.replay.decisions import ReplayResult, replay

DIFFERENT = 1
MOST = 10

app = CommandLine(
    "replay_decisions",
    {ConfigError: WRONG, BagError: UNUSABLE, SnapshotError: UNUSABLE},
    help="Replay the twin controller's decisions from a bag.",
)


@app.command()
def replay_decisions(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
) -> None:
    """Replay the recorded inputs through the core; compare every decision and state."""
    result, repaired = _replay(bag)
    _print(result, repaired, Console(highlight=False, markup=False, soft_wrap=True))
    raise typer.Exit(0 if result.exact else DIFFERENT)


def _replay(bag: Path) -> tuple[ReplayResult, bool]:
    """Read and replay.

    Raises:
        BagError: It cannot be read, lacks a topic, or holds no state to begin with.
    """
    with open_bag(bag) as opened:
        setups, recorded = read_setups(opened), read_decisions(opened)
        result = replay(setups, read_inputs(opened), recorded, opened.end - opened.start)
        if not result.messages:
            raise BagError(
                f"{bag}: {result.skipped} messages of inputs, but no state to begin with"
            )
        return result, opened.repaired


def _print(result: ReplayResult, repaired: bool, console: Console) -> None:
    """Print what was replayed and what is different."""
    if repaired:
        console.print("the recording was not finished, a repaired copy was read")
    begun = ", ".join(f"{at:.2f}" for at in result.starts)
    console.print(
        f"{result.messages} messages with {result.inputs} inputs replayed, from {begun} s on"
    )
    if result.skipped:
        console.print(f"{result.skipped} messages not replayed: no state to begin with")
    for texts in (result.restarts, result.lost):
        for text in texts[:MOST]:
            console.print(text)
        if len(texts) > MOST:
            console.print(f"... {len(texts)} in all")
    if result.outside or result.unrecorded:
        console.print(
            f"at the edges: {result.outside} decisions without inputs, "
            f"{result.unrecorded} not recorded"
        )
    console.print(
        f"{result.decisions} decisions and {result.snapshots} states compared: "
        f"{len(result.differences)} differences"
        + (f", messages are lost at {len(result.lost)} places" if result.lost else "")
    )
    if not result.compared:
        console.print("nothing was compared: record for longer, until a decision or a second state")
    if result.differences:
        console.print(f"first difference: {result.differences[0]}")


main = app.run
