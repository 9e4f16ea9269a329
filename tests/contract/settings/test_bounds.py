"""Numbers that safety, orders, change detection and following read have bounds with a meaning.

A number with no bound can switch supervision off: with ``change.still_tolerance: 1000`` a side that
moves by 64 deg stands still. A bound helps if a comma that slips by three places breaks it, in
either direction; each number that is shipped is tried so, through the loader that the nodes use.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, get_type_hints

import msgspec.inspect as inspect
import pytest
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, copy_configuration, leaves, replaced
from operator_panel.config import PanelConfig
from rosbridge_gateway.config import GatewayConfig
from ruamel.yaml import YAML
from scara_config import ConfigError, load_robot
from scara_config.profile import known_robots
from scara_config.readers import READERS_WITH_ROBOT, check_files, reader
from scara_config.rollout.change import Change
from scara_config.rollout.kept import changed_copy, faults_of
from scara_control.config import MotionConfig
from scara_simulation.config import SimulationConfig
from twin_controller.core.setup import Setup
from what_if.config import WhatIfConfig

CONFIG = ROOT / "config"
OF_THE_CORE = [
    kind for name, kind in get_type_hints(Setup.__init__).items() if name in ("robot", "config")
]
KINDS = [*OF_THE_CORE, MotionConfig, SimulationConfig, GatewayConfig, WhatIfConfig, PanelConfig]
"""Besides: what nodes follow and stop by, what lets a stop through, what judges a motion before."""
FILES = (
    *("robot.yaml", "twin_controller.yaml", "motion.yaml", "simulation.yaml"),
    *("gateway.yaml", "what_if.yaml", "operator_panel.yaml"),
)
PLACES = [
    *(CONFIG / name for name in FILES if (CONFIG / name).exists()),
    *(CONFIG / "robots" / robot / FILES[0] for robot in known_robots(CONFIG)),
]
ROBOT = load_robot(CONFIG)
Keys = tuple[str | int, ...]

PORT = "which port is meant nobody knows"
PLACE = "a coordinate: no place of the cell is wrong by itself"
ESTIMATE = "an estimate of what nobody knows: 0 is exactly as planned"
STRICT = "a smaller tolerance refuses more"
TUNING = "how the simulated world feels, which the twin's figures show"
MAY: dict[str, str] = {
    # Which of them stays within its bounds although a comma slipped, and why that is no harm.
    "robot.yaml /1000 joints.*.*er_deg": PLACE,
    "robot.yaml /1000 home.*": PLACE,
    "robot.yaml /1000 positions_m.*": PLACE,
    "robot.yaml /1000 geometry.h_mm": PLACE,
    "robot.yaml /1000 keep_out.*_mm.*": PLACE,
    "robot.yaml /1000 joints.*.screw_axis.*": PLACE,
    "twin_controller.yaml /1000 real.port": PORT,
    "gateway.yaml /1000 port": PORT,
    "operator_panel.yaml /1000 port": PORT,
    "gateway.yaml ?1000 roles.*.takes.bytes_per_second": "pictures need 500 times what words do",
    "gateway.yaml ?1000 roles.*.takes.shortest_fragment": "a client may want pieces of any size",
    "gateway.yaml /1000 roles.*.places": "without places of its own it shares limits.clients",
    "simulation.yaml /1000 gravity_m_s2": TUNING,
    "simulation.yaml /1000 tracking_bandwidth_rad_s": TUNING,
    "simulation.yaml /1000 saturation_limit_percent": "0 tells of each step: nothing is missed",
    "simulation.yaml /1000 *_tolerance_percent": STRICT,
    "simulation.yaml /1000 stick_band_*": TUNING,
    "what_if.yaml /1000 program.*": ESTIMATE,
    "what_if.yaml /1000 lag.*": ESTIMATE,
    "what_if.yaml /1000 uncertainty.*": ESTIMATE,
    "what_if.yaml /1000 learning.*": "an alarm that comes too early",
    "twin_controller.yaml /1000 real.sample_latency_ms": "a register may show a position at once",
}


def numbers(tree: Any) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and value of each number."""
    for keys, value in leaves(tree):
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield keys, value


def slipped(value: float) -> Iterator[tuple[str, float]]:
    """Yield a number whose comma slipped by three places; what is whole stays whole."""
    yield "*1000", value * 1000
    yield "/1000", type(value)(value / 1000)


def unbounded(kind: Any, keys: str = "") -> Iterator[str]:
    """Yield the numbers below a type that lack a lower or an upper bound."""
    if isinstance(kind, inspect.IntType | inspect.FloatType):
        if (kind.ge is None and kind.gt is None) or (kind.le is None and kind.lt is None):
            yield keys
    elif isinstance(kind, inspect.StructType):
        for field in kind.fields:
            yield from unbounded(field.type, f"{keys}.{field.name}".lstrip("."))
    elif isinstance(kind, inspect.DictType):
        yield from unbounded(kind.value_type, f"{keys}.*")
    elif isinstance(kind, inspect.TupleType):
        for number, part in enumerate(kind.item_types):
            yield from unbounded(part, f"{keys}.{number}")
    elif isinstance(kind, inspect.ListType | inspect.VarTupleType | inspect.SetType):
        yield from unbounded(kind.item_type, f"{keys}.*")
    elif isinstance(kind, inspect.UnionType):
        for part in kind.types:
            yield from unbounded(part, keys)
    elif isinstance(kind, inspect.Metadata):
        yield from unbounded(kind.type, keys)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_number_has_a_lower_and_an_upper_bound(kind: Any) -> None:
    """One that somebody adds tomorrow, too."""
    assert list(unbounded(inspect.type_info(kind))) == []


def test_the_core_is_made_of_robot_and_controller_numbers() -> None:
    """The list of types is taken from the code, and it is the whole one."""
    assert {kind.__name__ for kind in OF_THE_CORE} == {"Robot", "TwinControllerConfig"}


def accepted(place: Path, folder: Path) -> Iterator[str]:
    """Yield the numbers of a file whose comma may slip: file, direction, key.

    Args:
        place: The shipped file.
        folder: Where the wrong ones are written.
    """
    name = place.name
    tree = YAML(typ="safe").load(place)
    read, given = reader(name), [ROBOT] if name in READERS_WITH_ROBOT else []
    for keys, value in numbers(tree):
        for how, wrong in slipped(value) if value else ():  # the comma of a 0 does not show
            row = f"{name} {how} {'.'.join(map(str, keys))}"
            (folder / name).write_text(json.dumps(replaced(tree, keys, wrong)))
            try:
                read(*given, folder)
            except ConfigError as error:
                assert name in str(error), row
            else:
                yield row


@pytest.mark.thorough
@pytest.mark.usefixtures("quick")
def test_a_comma_that_slips_by_three_places_is_refused(tmp_path: Path) -> None:
    """Each number of each file, in both directions, but those that say why they may pass."""
    taken = [row for place in PLACES for row in accepted(place, tmp_path)]
    assert [row for row in taken if not any(fnmatch(row, each) for each in MAY)] == []
    assert [each for each in MAY if not any(fnmatch(row, each) for row in taken)] == []


SENTENCES = [
    ("change.still_tolerance", 1000, "<= 0.5"),
    ("change.hysteresis", 0.00002, ">= 0.001"),
    ("change.confirm", 2000, "<= 10"),
    ("twin.stale_ms", 220_000, "<= 1000.0"),
    ("stop.retry_ms", 0.15, ">= 30.0"),
    ("estop.shown_ms", 1_000_000, "<= 3000.0"),
    ("divergence.path_mm", 20_000, "<= 200.0"),
    ("separation.human_speed_mm_s", 1.6, ">= 1600.0"),
    ("separation.intrusion_mm", 0.2, ">= 60.0"),
    ("cell.cartesian_speed_mm_s", 0.25, ">= 1.0"),
    ("own_gap.forgive_ms", 100_000, "<= 500.0"),
    ("response.measured", {"joint_1": {"delay_ms": 20_000}}, "<= 2000.0"),
]


@pytest.mark.parametrize(("key", "value", "allowed"), SENTENCES)
def test_who_slips_reads_one_sentence_with_file_line_key_and_range(
    key: str, value: Any, allowed: str, tmp_path: Path
) -> None:
    """The person at the cell finds the place and what may stand there."""
    folder = copy_configuration(tmp_path)
    changed_yaml(folder / FILES[1], folder, list(key.split(".")), value)
    with pytest.raises(ConfigError) as caught:
        reader(FILES[1])(ROBOT, folder)
    (sentence,) = str(caught.value).splitlines()
    start = rf"{re.escape(str(folder))}/twin_controller\.yaml: {re.escape(key)}[\w.]* = [-\de.]+: "
    assert re.fullmatch(rf"{start}Expected `(float|int)` {allowed} \(line \d+\)", sentence)


@pytest.mark.parametrize(("key", "value", "allowed"), SENTENCES)
def test_a_change_from_elsewhere_goes_through_the_same_loader(
    key: str, value: Any, allowed: str, tmp_path: Path
) -> None:
    """Were it allowed to touch these keys, it would still be refused."""
    change = Change("slip", {FILES[1]: {key: value}})
    with changed_copy(change, CONFIG) as folder:
        (fault,) = check_files(folder)
    assert key in fault and allowed in fault


@pytest.mark.parametrize(
    ("file", "key", "value", "allowed"),
    [
        ("motion.yaml", "trim.range_mm", 5000.0, "<= 20.0"),
        ("motion.yaml", "move.position_tolerance_deg", 20.0, "<= 1.0"),
        ("twin_controller.yaml", "response.first_ms", 100_000.0, "<= 2000.0"),
    ],
)
def test_what_may_be_rolled_out_has_the_same_bounds(
    file: str, key: str, value: float, allowed: str
) -> None:
    """The desk is told by the cell, with the sentence of the loader."""
    (fault,) = faults_of(Change("slip", {file: {key: value}}), CONFIG)
    assert fault.startswith(f"{file}: {key} = ") and allowed in fault and "(line " in fault
