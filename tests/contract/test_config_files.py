"""Every shipped YAML file loads, and whatever is wrong in one is refused with file, key and value."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from fanuc_emulator.config import load_programs
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration, shipped
from ruamel.yaml import YAML
from scara_config import ConfigError, files_in_force, load_robot, locate

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)
SINGLE: dict[str, str] = {
    "bringup.yaml": "scara_bringup.config:load_bringup",
    "camera.yaml": "scara_simulation.camera.config:load_camera",
    "comparison.yaml": "twin_experiments.comparison.config:load_comparison",
    "gateway.yaml": "scara_simulation.gateway_config:load_gateway_config",
    "modbus_map.yaml": "scara_config.modbus_map:load_modbus_map",
    "operator_panel.yaml": "operator_panel.config:load_panel",
    "palletise.yaml": "scara_config.palletise:load_palletise",
    "motion.yaml": "scara_control.config:load_motion",
    "robot.yaml": "scara_config.robot:load_robot",
}
WITH_ROBOT: dict[str, str] = {
    "experiments.yaml": "twin_experiments.config:load_experiments",
    "emulator.yaml": "fanuc_emulator.config:load_emulator",
    "pid_gains.yaml": "scara_simulation.config:load_gains",
    "simulation.yaml": "scara_simulation.config:load_simulation",
    "twin_controller.yaml": "twin_controller.config:load_twin_controller",
}


def loader(name: str) -> Callable[[Path], Any]:
    """Return the loader of a file: a function of the folder it stands in."""
    module, _, function = (SINGLE.get(name) or WITH_ROBOT[name]).partition(":")
    load = getattr(import_module(module), function)
    return load if name in SINGLE else partial(load, ROBOT)


LOADERS = {name: loader(name) for name in sorted(SINGLE | WITH_ROBOT)}
PROGRAMS = sorted(file.name for file in locate("programs", CONFIG).glob("*.yaml"))
TREES: dict[str, Any] = {name: YAML(typ="safe").load(shipped(name)) for name in LOADERS}
Path_ = tuple[str | int, ...]


def leaves(tree: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Yield the path and value of everything that is neither a mapping nor a list."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def replaced(tree: Any, path: Path_, value: Any) -> Any:
    """Return a copy of a tree with one value replaced."""
    copy = json.loads(json.dumps(tree))
    branch = copy
    for key in path[:-1]:
        branch = branch[key]
    branch[path[-1]] = value
    return copy


def refusal(name: str, folder: Path, tree: Any) -> str:
    """Write ``tree`` as the file ``name`` into a copy of the configuration; return the error of its loader."""
    copy_configuration(folder)
    with (folder / name).open("w") as stream:
        YAML(typ="safe", pure=True).dump(tree, stream)
    with pytest.raises(ConfigError) as caught:
        LOADERS[name](folder)
    return str(caught.value)


def some(name: str, numbers_only: bool = False, at_most: int = 12) -> list[Path_]:
    """Choose values spread evenly over a file."""
    paths = [
        path
        for path, value in leaves(TREES[name])
        if not numbers_only or (isinstance(value, (int, float)) and not isinstance(value, bool))
    ]
    return paths[:: max(1, math.ceil(len(paths) / at_most))]


def cases(numbers_only: bool = False) -> list[Any]:
    """Return (file, path) for some values of every file."""
    return [
        pytest.param(name, path, id=f"{name}:{'.'.join(map(str, path))}") for name in LOADERS for path in some(name, numbers_only)
    ]


def test_every_yaml_file_has_a_typed_loader() -> None:
    """No file is read untyped, none is forgotten by these tests."""
    assert {name for name in files_in_force(CONFIG) if "/" not in name} == set(LOADERS)


@pytest.mark.parametrize("name", LOADERS)
def test_shipped_file_loads(name: str) -> None:
    """The cell starts with what is shipped."""
    assert LOADERS[name](CONFIG)


@pytest.mark.parametrize("name", PROGRAMS)
def test_shipped_program_loads(name: str) -> None:
    """Every program of the robot stand-in is read by its loader."""
    stem = name.removesuffix(".yaml").upper()
    assert stem in {program.name for program in load_programs(ROBOT, CONFIG).values()}


@pytest.mark.parametrize("name", LOADERS)
def test_missing_file_is_named(name: str, tmp_path: Path) -> None:
    """The text names the file that is looked for."""
    with pytest.raises(ConfigError, match=rf"{name}: cannot be read: No such file"):
        LOADERS[name](tmp_path)


@pytest.mark.parametrize("name", LOADERS)
def test_unknown_key_is_refused(name: str, tmp_path: Path) -> None:
    """A typing error in a key must not leave the default in force unseen."""
    text = refusal(name, tmp_path, {**TREES[name], "no_such_key": 1})
    assert name in text and "no_such_key" in text


@pytest.mark.parametrize("name", LOADERS)
def test_missing_key_is_refused(name: str, tmp_path: Path) -> None:
    """Nothing of a shipped file is optional at the top level."""
    key = next(iter(TREES[name]))
    text = refusal(name, tmp_path, {k: v for k, v in TREES[name].items() if k != key})
    assert name in text and key in text


@pytest.mark.parametrize(("name", "path"), cases())
def test_value_of_a_wrong_type_is_refused_with_its_key(name: str, path: Path_, tmp_path: Path) -> None:
    """A mapping where a plain value belongs: file and key are in the text."""
    text = refusal(name, tmp_path, replaced(TREES[name], path, {"wrong": "type"}))
    assert name in text
    assert str([key for key in path if isinstance(key, str)][-1]) in text


@pytest.mark.parametrize("value", [math.nan, math.inf], ids=str)
@pytest.mark.parametrize(("name", "path"), cases(numbers_only=True))
def test_not_a_finite_number_is_refused(name: str, path: Path_, value: float, tmp_path: Path) -> None:
    """YAML knows .nan and .inf; a robot does not."""
    text = refusal(name, tmp_path, replaced(TREES[name], path, value))
    assert name in text
    assert str([key for key in path if isinstance(key, str)][-1]) in text and str(value) in text


@pytest.mark.parametrize("name", LOADERS)
def test_every_number_carries_a_source_or_a_reason(name: str) -> None:
    """Each file says where its numbers come from: a tag, or our choice and why."""
    text = shipped(name).read_text().lower()
    assert any(tag in text for tag in ("[paper]", "[src]", "[chk]", "[asm]", "[our]", "our choice"))
