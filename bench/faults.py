"""The long fault campaign.

Every scenario with many seeds, sensor noise for minutes, then random faults.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from random import Random

from harness.faults import gateway_faults, operator_faults, person_faults, value_faults
from harness.faults.campaign import scenarios, storm
from harness.faults.fault_cell import NODES, SET_UPS, FaultCell
from harness.faults.roscore_faults import MasterCell, master_killed, master_stopped
from harness.faults.rows import Row, repeated, worst
from harness.ros import Master, Ros, own_master
from harness.workspace import ROOT
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench.journal import Journal

LIES = 10_000
SECONDS = 4.0
STALLED_S = 60.0
STORM_S = 15.0
NOISE_MINUTES = 10.0
ALL, REPEATED = "all faults", "scenarios repeated because a limit was missed once [part of all]"


def run(seeds: int, minutes: float, folder: Path, console: Console) -> list[Row]:
    """Run the campaign and return, for each fault and metric, the worst that was measured.

    What each scenario measured is written at once into the folder's journal: a campaign that is
    ended early leaves its rows, and goes on where it was when it is begun again in the same folder.

    Args:
        seeds: How often each scenario is run.
        minutes: Of random faults.
        folder: For logs, bags and the journal.
        console: Where progress is shown.

    Raises:
        JournalError: The folder's journal was written by another version.
    """
    columns = (
        TextColumn("{task.description:<40}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        journal = Journal(folder, ROOT)
        part = folder / time.strftime(
            "part_%H-%M-%S"
        )  # one that is continued has the logs and bags of an earlier part
        part.mkdir()
        campaign = Campaign(journal, part, progress)
        campaign.values(seeds)
        campaign.without_master(seeds)
        with own_master(part / "master", "bench") as master:
            campaign.people(master, seeds)
            with closing(Ros(master, part / "cell", "faults")) as ros, FaultCell(ros) as cell:
                campaign.scenarios(cell, seeds)
                campaign.long(cell, min(minutes, NOISE_MINUTES))
                campaign.storms(cell, minutes)
    for text in campaign.repeated:
        console.print(f"repeated: {text}", markup=False)
    return campaign.worst()


class Campaign:
    """Runs scenarios, shows how far it is, and keeps what they measured.

    Attributes:
        repeated: For each scenario that had to be repeated, what was missed: a machine that was
            busy, or a rare fault of ours.
    """

    def __init__(self, journal: Journal, folder: Path, progress: Progress) -> None:
        """Begin with what the journal knows; ``folder`` is for logs and bags."""
        self._journal, self._folder, self._progress = journal, folder, progress
        self._rows: list[Row] = []
        self._scenarios = 0
        self.repeated: list[str] = []

    def values(self, seeds: int) -> None:
        """Let robot and twin lie."""
        task = self._progress.add_task("lies", total=2 * seeds * LIES)
        for seed in range(seeds):
            for lies in (value_faults.robot_lies, value_faults.twin_lies):
                self._run(lies.__name__, lambda k=seed, told=lies: told(k, LIES))  # type: ignore[misc]
                self._progress.advance(task, LIES)

    def without_master(self, seeds: int) -> None:
        """Kill and stop the ROS master."""
        if not seeds:
            return
        task = self._progress.add_task("roscore", total=seeds)
        with MasterCell(self._folder / "roscore") as cell:
            for seed in range(seeds):
                self._run("roscore killed", lambda: master_killed(cell))
                self._run("roscore silent", lambda k=seed: master_stopped(cell, 4.0 + k % 3))  # type: ignore[misc]
                cell.home()
                self._progress.advance(task)

    def people(self, master: Master, seeds: int) -> None:
        """Let somebody come near a cell that monitors separation."""
        if not seeds:
            return
        task = self._progress.add_task("people", total=seeds)
        environment = person_faults.monitored(self._folder / "monitored_config")
        with (
            closing(Ros(master, self._folder / "monitored", "people")) as ros,
            person_faults.Person(ros) as person,
            FaultCell(ros, environment) as cell,
        ):
            for seed in range(seeds):
                for name, action in person_faults.scenarios(cell, person, Random(seed)).items():
                    self._run(name, action)
                self._progress.advance(task)

    def scenarios(self, cell: FaultCell, seeds: int) -> None:
        """Run each scenario once for each seed, each time in another order."""
        found = scenarios(SECONDS)
        task = self._progress.add_task("", total=seeds * len(found))
        for seed in range(seeds):
            rng = Random(seed)
            cell.set_up(SET_UPS[seed % len(SET_UPS)])
            for name in rng.sample(sorted(found), len(found)):
                self._progress.update(task, description=f"seed {seed}: {name}")
                self._in_cell(cell, name, lambda n=name, r=rng: found[n](cell, r))  # type: ignore[misc]
                self._progress.advance(task)

    def long(self, cell: FaultCell, minutes: float) -> None:
        """Let the sensors of an idle cell be noisy for ``minutes``.

        A client that never reads stays for one of them.
        """
        if not minutes:
            return
        task = self._progress.add_task(f"noise for {minutes:g} min", total=2)
        self._in_cell(cell, "noise", lambda: operator_faults.noisy(cell, Random(0), 60.0 * minutes))
        self._progress.update(task, description=f"a stalled client for {STALLED_S:g} s", advance=1)
        self._in_cell(
            cell,
            "stalled for long",
            lambda: gateway_faults.attacked(cell, "stalled", Random(0), STALLED_S),
        )
        self._progress.advance(task)

    def storms(self, cell: FaultCell, minutes: float) -> None:
        """Break things at random until the time is over."""
        task = self._progress.add_task("random faults [s]", total=round(60.0 * minutes))
        past, seed = 0.0, 0
        while past < 60.0 * minutes:
            self._progress.update(task, completed=round(past))
            past += self._in_cell(
                cell, "storm", lambda k=seed: storm(cell, Random(1000 + k), STORM_S)
            )  # type: ignore[misc]
            seed += 1
        self._progress.update(task, completed=round(60.0 * minutes))
        if seed:
            self._rows.append(Row("storm", "storms weathered", 1.0, float(seed), at_least=True))

    def worst(self) -> list[Row]:
        """Return the worst row of each fault and metric, and the number of repeated scenarios."""
        share = (
            [Row(ALL, REPEATED, 0.05, len(self.repeated) / self._scenarios)]
            if self._scenarios
            else []
        )
        return [*worst(self._rows), *share]

    def _in_cell(self, cell: FaultCell, name: str, action: Callable[[], list[Row]]) -> float:
        """Run a scenario on an idle cell; whatever it breaks for good is mended before the next.

        Return how long it took [s].
        """

        def on_idle_cell() -> list[Row]:
            _mend(cell)
            return action()

        return self._run(name, on_idle_cell)

    def _run(self, name: str, action: Callable[[], list[Row]]) -> float:
        """Keep the rows of a scenario, and whether it was repeated.

        Return how long it took [s], now or before.
        """
        known = self._journal.take(name)
        rows, seconds, missed = known or self._measured(name, action)
        if known is None:
            self._journal.add(name, rows, seconds, missed)
        self._rows += rows
        self._scenarios += 1
        if missed:
            self.repeated.append(f"{name}: {' | '.join(missed)}")
        for row in rows:
            if not row.holds:
                self._progress.console.print(row.text, markup=False)
        return seconds

    @staticmethod
    def _measured(name: str, action: Callable[[], list[Row]]) -> tuple[list[Row], float, list[str]]:
        """Run a scenario; one that fails is a row that does not hold."""
        begun = time.monotonic()
        try:
            rows, missed = repeated(action)
        except Exception as error:
            text = str(error).splitlines()[0][:100] if str(error) else repr(error)
            rows, missed = (
                [Row(f"{name}: {text}", "did not end as described", 0.0, 1.0, always=True)],
                [],
            )
        return rows, time.monotonic() - begun, missed


def _mend(cell: FaultCell) -> None:
    """Start again what has died, let go on what was stopped, wait until the cell is idle."""
    cell.modbus.refuse(False)
    cell.web.refuse(False)
    for node in NODES:
        if cell.processes[node].poll() is not None:
            cell.start_node(node)
        else:
            cell.go_on(node)
    cell.recover()
