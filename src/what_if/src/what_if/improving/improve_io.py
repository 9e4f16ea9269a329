"""Improve a program: descents from several beginnings, side by side, and the proof."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from fanuc_emulator.config import load_emulator
from fanuc_emulator.tp.rehearsal import library_of
from scara_config.programs.files import read_listing, taught_of
from scara_config.programs.tp.listing import Program

from what_if.cell_files_io import Models
from what_if.improving.choices import Choice, Order, Way, chosen
from what_if.improving.descent import Found, Values, descend
from what_if.improving.finding import choices_of, motions_of
from what_if.improving.plants import PlantRun, run_on
from what_if.improving.telling import Change, Proof
from what_if.improving.trying import Bench
from what_if.improving.ways import ways_of
from what_if.judging import judge
from what_if.side_by_side_io import side_by_side
from what_if.uncertainty.many_worlds_io import chances
from what_if.verdict import Outcome
from what_if.world import World

PLANTS = ("ideal", "field")
"""What a perfect robot would do, and what published measurements say."""
PLANT_SEED = 1


class Improver:
    """A program, what of it may be otherwise, and how well that does.

    Args:
        world: In which it begins, at rest.
        path: Its file.
        directory: Of the YAML files.

    Raises:
        ConfigError: The file is wrong, or what the program does cannot be told beforehand.
        WhatIfError: The program is refused itself.
    """

    def __init__(self, world: World, path: Path, directory: Path | None) -> None:
        robot = world.cell.robot
        self._world, self._path, self._directory = world, path, directory
        self._library = library_of(path, robot, directory)
        self.bench = Bench(world, read_listing(path), self._library)
        taught, steps = self.bench.taught, self.bench.steps
        ways = ways_of(world, taught, steps, motions_of(taught, steps))
        # An order of rounds comes last: it takes positions along as the others have left them.
        self.choices: list[Choice] = [*ways, *choices_of(taught, steps, robot)]

    @property
    def program(self) -> Program:
        """As it was written."""
        return self.bench.program

    def descended(self, number: int, seed: int) -> Found:
        """Descend once: from the program as it was written, the others from a drawn beginning."""
        count = len(self.choices)
        begin, sequence = [None] * count, list(range(count))
        if number:
            # The number is part of the seed: which process takes it, and when, changes nothing.
            rng = np.random.default_rng([seed, number])
            sequence = rng.permutation(count).tolist()
            begin = self._drawn(rng)
        bench = self.bench
        return descend(
            self.program,
            self.choices,
            begin,
            sequence,
            bench.seconds,
            lambda program: not bench.against(program),
        )

    def _drawn(self, rng: np.random.Generator) -> Values:
        """Return values to begin with: another order, the arm bent to the other side, or both."""
        order: Values = [None] * len(self.choices)
        bend: Values = [None] * len(self.choices)
        for k, choice in enumerate(self.choices):
            if isinstance(choice, Order):
                order[k] = tuple(rng.permutation(len(choice.rounds)).tolist())
            elif isinstance(choice, Way):
                bend[k] = choice.mirrored or None
        both = [one or other for one, other in zip(order, bend)]
        drawn = [both, bend, order] if rng.integers(2) else [order]
        for values in drawn:
            if not self.bench.against(chosen(self.program, self.choices, values)):
                return values
        return [None] * len(self.choices)

    def search(self, tries: int, seed: int, workers: int, told: Callable[[], None]) -> list[Found]:
        """Return what came of each beginning, the quickest first.

        Raises:
            WhatIfError: The processes were killed.
        """
        work = partial(_descended, self._path, self._directory, seed)
        numbers = {number: number for number in range(tries)}
        done = side_by_side(self._world, work, numbers, workers, self._directory, lambda _: told())
        return sorted((done[number] for number in numbers), key=lambda found: found.seconds)

    def changes(self, found: Found) -> list[Change]:
        """Return what was changed, each with what it alone saves: all others stay changed."""
        changes = []
        for k, (choice, value) in enumerate(zip(self.choices, found.values)):
            if value is not None:
                without = [*found.values[:k], None, *found.values[k + 1 :]]
                back = self.bench.seconds(chosen(self.program, self.choices, without))
                changes.append(Change(*choice.words(value), back - found.seconds))
        return changes

    def proof(
        self,
        program: Program,
        worlds: int,
        seed: int,
        workers: int,
        told: Callable[[int], None],
    ) -> Proof:
        """Run and judge a program as a person would.

        Args:
            program: As it would stand in its file.
            worlds: So many that differ; 0: none.
            seed: Of these.
            workers: Processes; 0: one for each processor.
            told: Is called with the number of worlds that are done.

        Raises:
            ConfigError: A file of the cell is wrong.
            WhatIfError: The processes were killed.
        """
        motion = self.bench.motion(program)
        verdict = judge(self._world, motion)
        on = {
            plant: (self._run(self.program, plant), self._run(program, plant)) for plant in PLANTS
        }
        made = None
        if self._world.cell.work is not None and verdict.outcome is not Outcome.REFUSED:
            # Loaded late: it brings the simulator, which only a cell with parts needs.
            from what_if.second_world_io import SecondWorld

            with SecondWorld(self._world, self._directory) as second:
                made = second.run(self._world, motion)
        tried = None
        if worlds:
            question = (self._world, motion, worlds, seed, workers, self._directory)
            tried = chances(*question, told)
        jerks = self.bench.jerk_percent(self.program), self.bench.jerk_percent(program)
        tolerance = self._world.cell.work.task.tolerance_mm if self._world.cell.work else 0.0
        return Proof(on, self.bench.verdict, verdict, jerks, made, tried, tolerance)

    def _run(self, program: Program, plant: str) -> PlantRun | None:
        robot = self._world.cell.robot
        config = load_emulator(robot, self._directory, plant)
        taught = taught_of(program, robot, program.name)
        # The old and the new program meet the same chance, so only the text makes them differ.
        chance = np.random.default_rng(PLANT_SEED)
        return run_on(config, self._world.cell, taught, chance, tuple(self._library.values()))


_improvers: dict[Path, Improver] = {}
"""Of this process: what one descent has tried the next need not."""


def _descended(
    path: Path, directory: Path | None, seed: int, world: World, _: Models, number: int
) -> Found:
    """Descend once in a process of its own."""
    if path not in _improvers:
        _improvers[path] = Improver(world, path, directory)
    return _improvers[path].descended(number, seed)


def named(program: Program, name: str) -> Program:
    """Return a program with another name."""
    return msgspec.structs.replace(program, name=name)


def result_of(improver: Improver, found: Found, name: str) -> Program:
    """Return the program that was found, under a name of its own."""
    return named(chosen(improver.program, improver.choices, found.values), name)
