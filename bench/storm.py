"""A storm of our own: random commands and faults at once, judged from the truth of both sides."""

from __future__ import annotations

import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from fanuc_kit.sheets import map_file
from harness.faults.fault_cell import SET_UPS, FaultCell
from harness.faults.rows import Row
from harness.ros import Ros, own_master
from harness.storm.crew import Crew, crew
from harness.storm.rules.effects import EFFECTS
from harness.storm.rules.monitor import timeline
from harness.storm.storm import STORM, Scene, Storm, summed
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration
from rich.console import Console
from scara_config.loader import OVERRIDE
from scara_config.modbus_map import load_modbus_map
from scara_config.set_up.kit_map import kit_map

from bench.journal import Journal

EVIDENCE = "violations.txt"


@dataclass(frozen=True)
class Seeds:
    """Which scenes are played.

    Attributes:
        count: So many seeds, each for ``minutes``.
        first: The first of them.
        scene: Only this scene of the first seed; None: all.
    """

    count: int
    minutes: float
    first: int = 0
    scene: int | None = None


def run(seeds: Seeds, folder: Path, console: Console) -> list[Row]:
    """Play the scenes; return how often each rule was broken.

    Each seed is another robot of the field plant's kind, with the map that the kit's sheets make.
    Each violation is printed with its seed, its scene and its evidence, and written into the
    folder. What a scene has found is in the folder's journal at once: a storm that is ended early
    goes on where it was.

    Raises:
        JournalError: The folder's journal was written by another version.
    """
    journal = Journal(folder, ROOT)
    part = folder / time.strftime("part_%H-%M-%S")
    config = part / "config"
    config.mkdir(parents=True)
    copy_configuration(config)
    typed = map_file(kit_map(load_modbus_map(config)))
    (config / "modbus_map.yaml").write_text(typed, encoding="utf-8")
    with (
        own_master(part / "master", "bench") as master,
        closing(Ros(master, part / "cell", "storm")) as ros,
        FaultCell(ros, {OVERRIDE: str(config)}) as cell,
        crew(cell) as made,
    ):
        storm = _Storms(made, journal, folder, console)
        if seeds.scene is not None:
            storm.set_up(seeds.first)
            storm.scene(seeds.first, seeds.scene)
        else:
            for seed in range(seeds.first, seeds.first + seeds.count):
                storm.seed(seed, 60.0 * seeds.minutes)
    return storm.rows()


class _Storms:
    """Plays seeds, shows how far it is, and keeps what was found."""

    def __init__(self, made: Crew, journal: Journal, folder: Path, console: Console) -> None:
        self._crew, self._storm = made, Storm(made)
        self._journal, self._folder, self._console = journal, folder, console
        self._rows: list[Row] = []

    def set_up(self, seed: int) -> None:
        """Start the robot of a seed."""
        self._crew.set_up(SET_UPS[seed % len(SET_UPS)], f"field:{seed}")

    def seed(self, seed: int, seconds: float) -> None:
        """Play the scenes of a seed until ``seconds`` are over, those of the journal included."""
        self.set_up(seed)
        past, number = 0.0, 0
        while past < seconds:
            past += self.scene(seed, number)
            number += 1

    def scene(self, seed: int, number: int) -> float:
        """Play a scene unless it is known; return how long it took [s]."""
        name = f"storm, seed {seed}, scene {number}"
        known = self._journal.take(name)
        if known is None:
            begun = time.monotonic()
            scene = self._storm.play(seed, number)
            known = (scene.rows(), time.monotonic() - begun, [])
            self._tell(scene)
            self._journal.add(name, *known)
        rows, seconds, _ = known
        self._rows += rows
        return seconds

    def rows(self) -> list[Row]:
        """Return how often each rule was broken in all scenes."""
        played = sum(row.metric == EFFECTS[0].name + " [times]" for row in self._rows)
        return [
            *summed(self._rows),
            Row(STORM, "scenes played", 1.0, float(played), at_least=True),
        ]

    def _tell(self, scene: Scene) -> None:
        found = len(scene.violations) - len(scene.apart)
        name = self._folder / f"seed_{scene.seed}_scene_{scene.number}.txt"
        name.write_text("\n".join(timeline(scene.history)) + "\n", encoding="utf-8")
        self._console.print(
            f"seed {scene.seed}, scene {scene.number}: {len(scene.history.deeds)} deeds,"
            f" {len(scene.history.strikes)} faults, {found} violations,"
            f" {len(scene.apart)} while the machine stood still",
            markup=False,
        )
        if scene.violations:
            self._console.print(scene.text(), markup=False)
            with (self._folder / EVIDENCE).open("a", encoding="utf-8") as kept:
                kept.write(scene.text() + "\n\n")
