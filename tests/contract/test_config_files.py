"""Every shipped YAML file loads; what is wrong in one is refused with file, key and value.

Each test is one rule over all files and lists everything that breaks it. Whole files that are bad,
and keys that are missing or unknown: settings/test_bad_files.py.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from fanuc_emulator.config import load_emulator, load_programs
from farm.config import load_farm
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration, leaves, loaders, replaced, shipped
from ruamel.yaml import YAML
from scara_bringup.config import load_doors
from scara_config import ConfigError, files_in_force, load_robot, locate
from scara_config.profile import CHOICE, PLANT_CHOICE, known_robots
from scara_config.programs.files import program_files
from scara_config.readers import check_files

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)


LOADERS = loaders(ROBOT)
TREES: dict[str, Any] = {name: YAML(typ="safe").load(shipped(name)) for name in LOADERS}
Path_ = tuple[str | int, ...]


class Bench:
    """A copy of the configuration in which one file at a time is wrong."""

    def __init__(self, folder: Path) -> None:
        copy_configuration(folder)
        self._folder = folder

    def refusal(self, name: str, tree: Any) -> str:
        """Write ``tree`` as the file ``name``; return its loader's error, empty if it loads."""
        file = self._folder / name
        shipped_text = file.read_text() if file.exists() else None
        file.write_text(json.dumps(tree))
        try:
            LOADERS[name](self._folder)
        except ConfigError as error:
            return str(error)
        finally:
            file.unlink()
            if shipped_text is not None:
                file.write_text(shipped_text)
        return ""


def unnamed(text: str, *wanted: str) -> list[str]:
    """Return what an error's text lacks; everything if there was no error."""
    return [word for word in wanted if word not in text]


def some(name: str, numbers_only: bool = False, at_most: int = 12) -> list[Path_]:
    """Choose values spread evenly over a file."""
    paths = [
        path
        for path, value in leaves(TREES[name])
        if not numbers_only or (isinstance(value, (int, float)) and not isinstance(value, bool))
    ]
    return paths[:: max(1, math.ceil(len(paths) / at_most))]


def test_every_yaml_file_has_a_typed_loader() -> None:
    """No file is read untyped, none is forgotten by these tests."""
    kinds = ("programs/", "plants/", "settings/")
    assert {name for name in files_in_force(CONFIG) if not name.startswith(kinds)} == set(LOADERS)


def test_cell_and_farm_of_one_machine_want_ports_of_their_own() -> None:
    """Who starts both as the page of the farm says must not be refused."""
    doors = load_doors(CONFIG)
    cell = [door.port for door in (doors.modbus, doors.gateway, doors.panel, doors.pendant)]
    ports = [*cell, load_farm(CONFIG).desk.port]
    assert len(set(ports)) == len(ports), ports


def test_shipped_files_load() -> None:
    """The cell starts with what is shipped."""
    assert [name for name in LOADERS if not LOADERS[name](CONFIG)] == []


def test_files_of_every_robot_and_plant_are_found_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `./cell up` looks at before it starts a node."""
    for robot in known_robots(CONFIG):
        monkeypatch.setenv(CHOICE, robot)
        for plant in sorted(file.stem for file in locate("plants", CONFIG).glob("*.yaml")):
            monkeypatch.setenv(PLANT_CHOICE, plant)
            assert check_files(CONFIG) == [], (robot, plant)


def test_shipped_programs_load() -> None:
    """Every program of the robot stand-in is read by its loader."""
    loaded = {program.name for program in load_programs(ROBOT, CONFIG).values()}
    loaded |= {program.name for program in load_emulator(ROBOT, CONFIG).background}
    assert set(program_files(CONFIG)) <= loaded


def accepted(bench: Bench, value: Any, *said: str, numbers_only: bool = False) -> list[str]:
    """Put ``value`` in the place of some values of each file; return where that is not refused.

    Args:
        bench: Where to try.
        value: What is wrong.
        said: What the text has to name beside file and key.
        numbers_only: Take only the places of numbers.
    """
    offenders = []
    for name in LOADERS:
        for path in some(name, numbers_only):
            text = bench.refusal(name, replaced(TREES[name], path, value))
            key = [key for key in path if isinstance(key, str)][-1]
            if unnamed(text, name, key, *said):
                offenders.append(f"{name}: {'.'.join(map(str, path))}: {text or 'loads'}")
    return offenders


@pytest.mark.usefixtures("quick")
def test_values_of_a_wrong_type_are_refused_with_their_key(tmp_path: Path) -> None:
    """A mapping where a plain value belongs: file and key are in the text."""
    assert accepted(Bench(tmp_path), {"wrong": "type"}) == []


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("value", [math.nan, math.inf], ids=str)
def test_what_is_no_finite_number_is_refused(value: float, tmp_path: Path) -> None:
    """YAML knows .nan and .inf; a robot does not."""
    assert accepted(Bench(tmp_path), value, str(value), numbers_only=True) == []


def test_every_number_carries_a_source_or_a_reason() -> None:
    """Each file says where its numbers come from: a tag, or our choice and why."""
    tags = ("[paper]", "[src]", "[chk]", "[asm]", "[our]", "our choice")
    texts = {name: shipped(name).read_text().lower() for name in LOADERS}
    assert [name for name, text in texts.items() if not any(tag in text for tag in tags)] == []
