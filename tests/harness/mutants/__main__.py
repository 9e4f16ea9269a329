"""Make mutants and see which the tests kill.

    python -m harness.mutants [ROOM ...] [--mutants 200] [--seed N] [--jobs 1] [--continue] [--list]

Each verdict is kept in build/mutants.jsonl; ``--continue`` with the same seed goes on from there.
What became of each room is told in build/mutants.json.
Exit code 1: of the mutants that are not equivalent, fewer than 95 % were killed, or the tests of a
room fail without any.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from harness.mutants import summary
from harness.mutants.mutant import Mutant, Place, places_of
from harness.mutants.record import FILE, Record
from harness.mutants.rooms import Room, is_equivalent, load_equivalent, load_rooms
from harness.mutants.trial import POLL_S, Trial, Verdict, preload
from harness.workspace import ROOT, enter_workspace

WANTED = 0.95
PATIENCE, LEAST_S = 3.0, 30.0
"""A trial may take so many times as long as the tests without a fault, and so long at least [s]."""


@dataclass
class Tally:
    """What became of the mutants of one room."""

    verdicts: Counter[Verdict] = field(default_factory=Counter)
    survivors: list[Mutant] = field(default_factory=list)
    equivalent: int = 0
    seconds: float = 0.0
    sound: bool = True
    """Whether the tests pass without a mutant; else they say nothing about faults."""

    @property
    def tried(self) -> int:
        """How many were tried, without equivalent ones."""
        return sum(self.verdicts.values())

    @property
    def killed(self) -> int:
        """How many of them were noticed."""
        return self.tried - self.verdicts[Verdict.SURVIVED]

    @property
    def told(self) -> summary.RoomSummary:
        """What the file says of the room."""
        survivors = tuple(mutant.words for mutant in self.survivors)
        counts = (self.tried, self.killed, self.equivalent)
        return summary.RoomSummary(*counts, self.seconds, survivors, self.sound)


def main(
    rooms: Annotated[list[str] | None, typer.Argument(help="Of rooms.yaml; default: all.")] = None,
    mutants: Annotated[int, typer.Option(help="So many at random; 0: all, hours.", min=0)] = 200,
    seed: Annotated[int | None, typer.Option(help="Of the choice; default: the date.")] = None,
    jobs: Annotated[int, typer.Option(help="Trials at the same time.", min=1)] = 1,
    go_on: Annotated[bool, typer.Option("--continue", help="Where a run was ended.")] = False,
    only_list: Annotated[bool, typer.Option("--list", help="Only count the mutants.")] = False,
) -> None:
    """Make mutants and see which the tests kill."""
    chosen = {name: room for name, room in load_rooms().items() if name in (rooms or [name])}
    unknown = sorted(set(rooms or []) - set(chosen))
    if unknown:
        print(f"mutants: no room is called {', '.join(unknown)}: {', '.join(load_rooms())}")
        raise typer.Exit(2)
    seed = seed if seed is not None else int(datetime.now(timezone.utc).strftime("%Y%m%d"))
    found = {
        name: [place for path in room.paths() for place in places_of(path)]
        for name, room in chosen.items()
    }
    if empty := [name for name, places in found.items() if not places]:
        print(f"mutants: {', '.join(empty)}: tests/mutants/rooms.yaml leads to no module there")
        raise typer.Exit(2)
    total = sum(map(len, found.values()))
    print(f"places: {total}, {', '.join(f'{name} {len(all_)}' for name, all_ in found.items())}")
    if only_list:
        raise typer.Exit(0)
    print(f"seed {seed}: repeat this choice with --mutants {mutants} --seed {seed}", flush=True)
    enter_workspace()
    os.chdir(ROOT)
    preload()
    source, tallies, record = random.Random(seed), {}, Record(FILE, go_on)
    for name, room in chosen.items():
        places = found[name]
        share = round(mutants * len(places) / total) if mutants else len(places)
        sample = _choose(source.sample(places, len(places)), max(share, 1))
        begun = time.monotonic()
        tallies[name] = _try(name, room, sample, jobs, record)
        tallies[name].seconds = time.monotonic() - begun
    told = {name: tally.told for name, tally in tallies.items()}
    summary.FILE.write_bytes(msgspec.json.encode(summary.Summary(mutants, seed, told)))
    raise typer.Exit(0 if _report(tallies) else 1)


def _choose(places: Sequence[Place], count: int) -> list[Mutant]:
    """Make mutants at the first places where there are some, each of them once."""
    made: dict[str, Mutant] = {}
    for place in places:
        if len(made) == count:
            break
        mutant = place.make(ROOT)
        if mutant is not None:
            made.setdefault(mutant.source, mutant)
    return list(made.values())


def _try(name: str, room: Room, sample: Sequence[Mutant], jobs: int, record: Record) -> Tally:
    """Try mutants, ``jobs`` at the same time, those that the record does not hold."""
    tally, known = Tally(), load_equivalent()
    waiting = [mutant for mutant in sample if not is_equivalent(mutant, known)]
    tally.equivalent = len(sample) - len(waiting)
    before = [(mutant, record.known(mutant.path, mutant.source)) for mutant in waiting]
    for mutant, verdict in before:
        if verdict is not None:
            _count(mutant, verdict, tally)
    waiting = [mutant for mutant, verdict in before if verdict is None]
    if not waiting:
        return tally
    with tempfile.TemporaryDirectory(prefix="mutants_") as folder:
        tests = room.tests_of(Path("none"))
        plain = Trial(ROOT, None, "", tests, 3600.0, Path(folder) / "plain.txt")
        if plain.wait() is not Verdict.SURVIVED:
            print(f"mutants: {name}: the tests fail without a mutant:\n{plain.log.read_text()}")
            tally.sound = False
            return tally
        limit = max(LEAST_S, PATIENCE * plain.seconds * jobs)
        print(f"{name}: {len(waiting)} mutants, the tests take {plain.seconds:.0f} s", flush=True)
        running: list[tuple[Mutant, Trial]] = []
        number = 0
        while waiting or running:
            while waiting and len(running) < jobs:
                mutant, number = waiting.pop(0), number + 1
                path, log = ROOT / mutant.path, Path(folder) / f"{number}.txt"
                tests = room.tests_of(path)
                running.append((mutant, Trial(ROOT, path, mutant.source, tests, limit, log)))
            running = [entry for entry in running if not _ended(*entry, tally, record)]
            time.sleep(POLL_S)
    return tally


def _ended(mutant: Mutant, trial: Trial, tally: Tally, record: Record) -> bool:
    """Take the verdict of a trial that has ended."""
    verdict = trial.poll()
    if verdict is None:
        return False
    record.add(mutant.path, mutant.source, verdict)
    _count(mutant, verdict, tally)
    return True


def _count(mutant: Mutant, verdict: Verdict, tally: Tally) -> None:
    """Count one mutant, and print it if it survived."""
    tally.verdicts[verdict] += 1
    if verdict is Verdict.SURVIVED:
        tally.survivors.append(mutant)
        print(f"survived: {mutant.words}", flush=True)


def _report(tallies: dict[str, Tally]) -> bool:
    """Print what became of all; return whether enough were killed."""
    for name, tally in tallies.items():
        late = tally.verdicts[Verdict.TIMED_OUT]
        print(
            f"{name}: {tally.killed} of {tally.tried} killed ({late} by their time), "
            f"{tally.equivalent} equivalent, {len(tally.survivors)} survived"
        )
    killed = sum(tally.killed for tally in tallies.values())
    tried = sum(tally.tried for tally in tallies.values())
    enough = killed >= WANTED * tried and all(tally.sound for tally in tallies.values())
    share = 100.0 * killed / max(tried, 1)
    print(f"mutants: {killed} of {tried} killed, {share:.1f} %, wanted {100.0 * WANTED:.0f} %")
    if not enough:
        print(
            "Write a test that fails with each survivor. One that changes nothing the project "
            "promises goes into tests/mutants/equivalent.yaml, with the reason."
        )
    return enough


if __name__ == "__main__":
    sys.argv[0] = "mutants"
    typer.run(main)
