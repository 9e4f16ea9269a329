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


@pytest.mark.parametrize("mode", ["REAL_LEADS", "PAUSED", "STOPPED", "ESTOP", "FAULT"])
def test_a_cell_stays_for_the_person_whom_its_pair_needs(mode: str) -> None:
    """It would end with the page on which RESET is pressed; experiments need a pair that stands."""
    seen = replace(complete(), mode=mode, why="the drives are off")
    assert missing(PLAN, seen) == ()
    what = f"mode IDLE: it is {mode} (the drives are off)"
    assert missing(PLAN, seen, idle=True) == (Missing("twin_controller", what),)


@pytest.mark.parametrize("mode", ["", "OFFLINE", "ALIGNING"])
def test_a_pair_that_still_gets_ready_is_waited_for(mode: str) -> None:
    """A line comes, an alignment ends: by itself."""
    assert [each.node for each in missing(PLAN, replace(complete(), mode=mode))] == [
        "twin_controller"
    ]


def test_cell_without_controller_needs_no_mode() -> None:
    """A plan without the twin controller is complete without its state."""
    nodes = [node for node in PLAN if node.name != "twin_controller"]
    assert missing(nodes, replace(complete(), mode="")) == ()
