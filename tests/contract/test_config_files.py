"""Every shipped YAML file loads; what is wrong in one is refused with file, key and value.

Each test is one rule over all files and lists everything that breaks it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from fanuc_emulator.config import load_programs
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration, leaves, replaced, shipped
from ruamel.yaml import YAML
from scara_config import ConfigError, files_in_force, load_robot, locate
from scara_config.profile import CHOICE, PLANT_CHOICE, known_robots
from scara_config.readers import OPTIONAL, READERS, READERS_WITH_ROBOT, check_files, reader

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)


def loader(name: str) -> Callable[[Path], Any]:
    """Return the loader of a file: a function of the folder it stands in."""
    load = reader(name)
    return load if name in READERS else partial(load, ROBOT)


LOADERS = {
    name: loader(name)
    for name in sorted(READERS | READERS_WITH_ROBOT)
    if name.endswith(".yaml") and (name not in OPTIONAL or locate(name, CONFIG).exists())
}
PROGRAMS = sorted(file.name for file in locate("programs", CONFIG).glob("*.yaml"))
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
        text = json.dumps(tree)  # JSON is YAML but for these two, and written much faster
        file.write_text(text.replace("NaN", ".nan").replace("Infinity", ".inf"))
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
    kinds = ("programs/", "plants/")
    assert {name for name in files_in_force(CONFIG) if not name.startswith(kinds)} == set(LOADERS)


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
    assert {name.removesuffix(".yaml").upper() for name in PROGRAMS} <= loaded


def test_missing_files_are_named(tmp_path: Path) -> None:
    """The text names the file that is looked for."""
    said = {}
    for name in LOADERS:
        with pytest.raises(ConfigError) as caught:
            LOADERS[name](tmp_path)
        said[name] = str(caught.value)
    wanted = "{}: cannot be read: No such file"
    assert {name: text for name, text in said.items() if wanted.format(name) not in text} == {}


def test_unknown_keys_are_refused(tmp_path: Path) -> None:
    """A typing error in a key must not leave the default in force unseen."""
    bench = Bench(tmp_path)
    said = {name: bench.refusal(name, {**TREES[name], "no_such_key": 1}) for name in LOADERS}
    assert [name for name, text in said.items() if unnamed(text, name, "no_such_key")] == []


def test_missing_keys_are_refused(tmp_path: Path) -> None:
    """Nothing of a shipped file is optional at the top level."""
    bench, offenders = Bench(tmp_path), []
    for name, tree in TREES.items():
        key = next(iter(tree))
        text = bench.refusal(name, {k: v for k, v in tree.items() if k != key})
        if unnamed(text, name, key):
            offenders.append(f"{name}: without {key}: {text or 'loads'}")
    assert offenders == []


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


def test_values_of_a_wrong_type_are_refused_with_their_key(tmp_path: Path) -> None:
    """A mapping where a plain value belongs: file and key are in the text."""
    assert accepted(Bench(tmp_path), {"wrong": "type"}) == []


@pytest.mark.parametrize("value", [math.nan, math.inf], ids=str)
def test_what_is_no_finite_number_is_refused(value: float, tmp_path: Path) -> None:
    """YAML knows .nan and .inf; a robot does not."""
    assert accepted(Bench(tmp_path), value, str(value), numbers_only=True) == []


def test_every_number_carries_a_source_or_a_reason() -> None:
    """Each file says where its numbers come from: a tag, or our choice and why."""
    tags = ("[paper]", "[src]", "[chk]", "[asm]", "[our]", "our choice")
    texts = {name: shipped(name).read_text().lower() for name in LOADERS}
    assert [name for name, text in texts.items() if not any(tag in text for tag in tags)] == []
