"""docs/interfaces.md lists exactly the topics and services that a living cell has."""

from __future__ import annotations

import re
import xmlrpc.client
from collections.abc import Iterator
from typing import Any

import pytest
from harness.live_cell import NODES, LiveCell
from harness.processes import wait_until
from harness.sources import started_by
from harness.workspace import ROOT
from scara_ros.starting.running_node import help_of

pytestmark = pytest.mark.system

TWIN_JOINTS = ("joint_1", "joint_2", "joint_3", "table_joint")
# What every ROS node has.
USUAL = re.compile(r"^/(rosout|rosout_agg|clock)$|/(get_loggers|set_logger_level)$|^/rosapi/")
# What people look at; a cell for tests leaves it out.
SHOWN = {"camera": "scara_simulation", "robot_state_publisher": "scara_description"}
# The gateway does what its clients ask for; its own names are in its section as text.
OURS = sorted({*NODES, *SHOWN} - {"gateway"})
Row = tuple[str, str, str]


def sections() -> dict[str, str]:
    """Return the text of each node's section."""
    text = (ROOT / "docs" / "interfaces.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (\w+).*$", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def expand(name: str) -> list[str]:
    """Write a documented name as absolute names, one for each joint."""
    names = (
        [name.replace("<joint>", joint) for joint in TWIN_JOINTS] if "<joint>" in name else [name]
    )
    return [each if each.startswith("/") else f"/{each}" for each in names]


def rows(section: str) -> list[Row]:
    """Return (name, type, direction) of each line of a section's table."""
    found: list[Row] = []
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| `") or len(cells) < 3:
            continue
        names = re.findall(r"`([^`]+)`", cells[0])
        stem = names[0].split("_position_controller")[0]
        for name in (name.replace("...", stem) for name in names):
            found += [(each, cells[1], cells[2].split(",")[0].split()[0]) for each in expand(name)]
    return found


class Graph:
    """The topics and services of a running master."""

    def __init__(self, uri: str) -> None:
        """Ask the master once."""
        master: Any = xmlrpc.client.ServerProxy(uri)
        publishers, subscribers, services = master.getSystemState("/tests")[2]
        self.types = dict(master.getTopicTypes("/tests")[2])
        self.out, self.into, self.services = publishers, subscribers, services
        self._master = master

    def of(self, node: str) -> set[tuple[str, str]]:
        """Return (name, direction) of everything that a node has and that is not usual."""
        kinds = (("out", self.out), ("in", self.into), ("service", self.services))
        found = {
            (name, kind) for kind, table in kinds for name, nodes in table if f"/{node}" in nodes
        }
        return {(name, kind) for name, kind in found if not USUAL.search(name)}

    def type_of(self, name: str, kind: str) -> str:
        """Return the type of a topic, or of a service by asking it."""
        if kind != "service":
            return str(self.types.get(name, ""))
        import rosservice

        headers = rosservice.get_service_headers(
            name, self._master.lookupService("/tests", name)[2]
        )
        return str(headers["type"])


@pytest.fixture(scope="module")
def graph(live_cell: LiveCell) -> Iterator[Graph]:
    """Give the graph of the living cell, once a client is through the gateway."""
    shown = [live_cell.stage.start("rosrun", package, node) for node, package in SHOWN.items()]
    wait_until(
        lambda: {"/camera/image_raw", "/tf"} <= {n for n, _ in Graph(live_cell.master_uri).out},
        30.0,
        "camera and frames",
    )
    wait_until(
        lambda: any(name == "/move_to" for name, _ in Graph(live_cell.master_uri).services), 10.0
    )
    yield Graph(live_cell.master_uri)
    for node in shown:
        node.stop()


PACKAGE_OF = {
    **SHOWN,
    "simulator": "scara_simulation",
    "kinematics_server": "scara_control",
    "joint_pose_controller": "scara_control",
    "joint_vel_controller": "scara_control",
    "motion_server": "scara_control",
    "trajectory_server": "scara_control",
    "emulator": "fanuc_emulator",
    "twin_controller": "twin_controller",
    "recorder": "cell_recorder",
    "journal": "cell_recorder",
    "operator_panel": "operator_panel",
}


def pattern(line: str) -> re.Pattern[str]:
    """Return what a line of the help can stand for: <joint> is any word."""
    name = line.split()[0]
    absolute = name if name.startswith("/") else f"/{name}"
    return re.compile(re.sub(r"<\w+>", r"\\w+", absolute))


@pytest.mark.parametrize(("node", "package"), PACKAGE_OF.items())
def test_help_of_a_node_names_what_is_documented(node: str, package: str) -> None:
    """Each topic and service in a table with its type, or in the node's own words."""
    text = help_of(started_by(ROOT / "src" / package / "nodes" / node))
    told, _, tables = text.partition("usage: rosrun")
    listed = [line for line in tables.splitlines() if line.startswith("  ")]
    for name, type_name, _ in rows(sections()[node]):
        lines = [line for line in listed if pattern(line).fullmatch(name)]
        if any(line.split()[-1].endswith("Action") for line in listed):  # five topics each
            lines += [line for line in listed if pattern(line).fullmatch(name.rpartition("/")[0])]
            type_name = type_name if "/joint_trajectory_action/" not in name else ""
        if not lines:
            in_words = [
                word for word in re.findall(r"[\w/<>]+", told) if "/" in word or "_" in word
            ]
            assert any(pattern(word).fullmatch(name) for word in in_words), (node, name)
        elif type_name:
            assert any(line.split()[1] == type_name for line in lines), (name, lines)


def test_every_node_of_the_cell_has_a_section() -> None:
    """A reader finds each node by its name."""
    assert {*NODES, *SHOWN} <= set(sections())


@pytest.mark.parametrize("node", OURS)
def test_everything_a_node_offers_or_hears_is_documented(graph: Graph, node: str) -> None:
    """What is not in its section does not exist for a user."""
    section = sections()[node]
    documented = {(name, kind) for name, _, kind in rows(section)}
    mentioned = {each for name in re.findall(r"`([\w/<>~.]+)`", section) for each in expand(name)}
    undocumented = {
        (name, kind)
        for name, kind in graph.of(node) - documented
        if name not in mentioned or name in {n for n, _ in documented}
    }
    assert undocumented == set()


@pytest.mark.parametrize("node", OURS)
def test_everything_documented_of_a_node_exists_with_its_type(graph: Graph, node: str) -> None:
    """A promise of the document is kept by the running node."""
    live = graph.of(node)
    for name, type_name, kind in rows(sections()[node]):
        if USUAL.search(name):
            continue
        assert (name, kind) in live, f"{node}: {name} ({kind}) is documented but not there"
        if type_name:
            assert graph.type_of(name, kind) == type_name, name
