"""The rooms and their arrows: each package uses what the table lets it use, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from graphlib import TopologicalSorter

import pytest
from harness.running.rooms import MESSAGES, REACH, RINGS, ROOMS
from harness.sources import PACKAGES, Module, imported_names, modules, package_name

OUR = set(ROOMS)
DOOR = ("scara_ros.page.", "scara_ros.shell.command_line_io", "scara_ros.shell.program_io")
"""What the farm's desk may use of scara_ros: no ROS is in it."""
LINK_OF_THE_FARM = tuple(f"src/farm/src/farm/{part}/" for part in ("link",))
"""Where messages and nodes are used."""
LINKS = ("config", "registers", "robot_sample", "estimation", "modbus", "robot", "twin", "engine")
"""What robot_doctor may use of twin_controller: what talks to the two sides, and its settings."""


def arrows() -> Iterator[tuple[str, str, str]]:
    """Yield (room, imported name, where) of every import of another room."""
    for module in modules():
        for name, line in imported_names(module.tree):
            if name.split(".")[0] in OUR - {module.package}:
                yield module.package, name, f"{module.relative}:{line}"


def test_every_package_is_a_room() -> None:
    """A new package says what it may use before it uses it."""
    assert {package_name(folder) for folder in PACKAGES} == OUR


def test_rooms_use_only_what_they_may() -> None:
    """All arrows that are not in the table."""
    assert [
        f"{where}: {room} uses {name}"
        for room, name, where in arrows()
        if name.split(".")[0] not in ROOMS[room]
    ] == []


def test_every_room_is_in_one_ring() -> None:
    """A new package says who can do without it."""
    assert sorted(room for rooms in RINGS.values() for room in rooms) == sorted(ROOMS)


@pytest.mark.parametrize("ring", RINGS)
def test_no_ring_uses_one_further_out(ring: str) -> None:
    """The cell imports no tool, tools no farm, the farm neither but messages and settings."""
    outside = {room: ROOMS[room] - REACH[ring] for room in RINGS[ring]}
    assert {room: found for room, found in outside.items() if found} == {}


def test_no_room_uses_itself_by_a_detour() -> None:
    """The table has an order: every room stands on rooms below it."""
    left = dict(ROOMS)
    while free := {room for room, below in left.items() if not below & set(left)}:
        left = {room: below for room, below in left.items() if room not in free}
    assert left == {}


def test_no_module_imports_itself_by_a_detour() -> None:
    """Also within a function: what is late to avoid a circle belongs elsewhere."""
    trees = {name_of(module): module.tree for module in modules()}
    imports: dict[str, set[str]] = {}
    for name, tree in trees.items():
        names = {imported for imported, _ in imported_names(tree)}
        used = {each if each in trees else each.rpartition(".")[0] for each in names}
        imports[name] = used & set(trees) - {name}
    assert imports["farm.__main__"] >= {"farm.desk.command_line_io"}
    assert list(TopologicalSorter(imports).static_order())


def name_of(module: Module) -> str:
    """Return the dotted name by which a module is imported."""
    package = module.relative.partition("src/")[2].rpartition("src/")[2]
    return package.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def test_the_doctor_uses_the_controllers_links_alone() -> None:
    """Not its core: a check must not need to know how the controller decides."""
    assert [
        f"{where}: {name}"
        for room, name, where in arrows()
        if room == "robot_doctor"
        and name.startswith("twin_controller.")
        and name.split(".")[1] not in LINKS
    ] == []


def test_only_the_farms_link_knows_ros() -> None:
    """The desk runs where no ROS is: it uses settings, and the door of our pages."""
    allowed = ("scara_config", *DOOR)
    assert [
        f"{where}: {name}"
        for room, name, where in arrows()
        if room == "farm"
        and not where.startswith(LINK_OF_THE_FARM)
        and not name.startswith(allowed)
    ] == []


def test_the_real_side_shares_nothing_with_the_twin_but_the_wire() -> None:
    """The stand-in uses messages only where it is a ROS node, for what it shows."""
    assert [
        f"{where}: {name}"
        for room, name, where in arrows()
        if room == "fanuc_emulator" and name.split(".")[0] in MESSAGES and "_node.py:" not in where
    ] == []
