"""Readiness is judged from names, ports and the controller's mode."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scara_bringup.config import Doors
from scara_bringup.plan import cell_plan
from scara_bringup.readiness import Missing, SeenCell, missing
from scara_config.quantities import ServerAddress
from scara_ros.names import resolve

PLAN = cell_plan(
    Doors(
        modbus=ServerAddress("127.0.0.1", 15020),
        gateway=ServerAddress("127.0.0.1", 19090),
        panel=ServerAddress("127.0.0.1", 18080),
        pendant=ServerAddress("127.0.0.1", 18090),
    )
)


def complete(namespace: str = "/") -> SeenCell:
    """Return the sight of a ready cell."""
    return SeenCell(
        services=frozenset(resolve(name, namespace) for node in PLAN for name in node.services),
        topics=frozenset(resolve(name, namespace) for node in PLAN for name in node.topics),
        ports=frozenset({15020, 19090, 22}),
        mode="IDLE",
    )


@pytest.mark.parametrize("namespace", ["/", "/cell_2", "cell_2/", "cell_2", "hall/cell_2"])
def test_nothing_is_missing_in_a_complete_cell(namespace: str) -> None:
    """Relative names are looked for in the namespace of the cell."""
    absolute = "/" + namespace.strip("/")
    assert missing(PLAN, complete(absolute), namespace) == ()


def test_services_of_another_namespace_do_not_count() -> None:
    """A second cell is not ready because the first one is."""
    assert Missing("motion_server", "service move_to") in missing(PLAN, complete("/"), "/cell_2")


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (
            replace(complete(), ports=frozenset({15020})),
            Missing("gateway", "a listener at port 19090"),
        ),
        (replace(complete(), topics=frozenset()), Missing("simulator", "topic twin/joint_states")),
        (
            replace(complete(), services=complete().services - {"/move_to"}),
            Missing("motion_server", "service move_to"),
        ),
        (
            replace(complete(), mode=""),
            Missing("twin_controller", "mode IDLE (no twin_controller/state yet)"),
        ),
        (
            replace(complete(), mode="OFFLINE", why="no answer of the robot"),
            Missing("twin_controller", "mode IDLE: it is OFFLINE (no answer of the robot)"),
        ),
    ],
)
def test_what_is_missing_is_named(seen: SeenCell, expected: Missing) -> None:
    """The node and the thing, in words that help."""
    assert expected in missing(PLAN, seen)


def test_cell_without_controller_needs_no_mode() -> None:
    """A plan without the twin controller is complete without its state."""
    nodes = [node for node in PLAN if node.name != "twin_controller"]
    assert missing(nodes, replace(complete(), mode="")) == ()
