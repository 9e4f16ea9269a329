"""A cell with a name: its namespace, free ports, room on the machine, its turn, its journal."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from harness.processes import wait_until
from hypothesis import given
from hypothesis import strategies as st
from scara_bringup.config import Ports
from scara_bringup.named.load_io import load
from scara_bringup.named.named_node import meant
from scara_bringup.named.naming import free_ports, namespace_by_name
from scara_bringup.named.room import ProcessorLoad, cores_left, no_room
from scara_bringup.named.turn_io import StartTurn
from scara_bringup.status.running_io import RunningCell
from scara_ros.names import NamespaceError
from unit.scara_bringup.test_plan import DOORS

DEFAULTS = (15020, 19090, 18080, 18090, 11311)


def test_name_is_the_namespace() -> None:
    """What status, journal and ROS call it."""
    assert namespace_by_name("milk_2") == "/milk_2"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("milk 2", "--name milk 2: allowed are letters, digits and _, a letter first"),
        ("2nd", "--name 2nd: allowed are"),
        ("", "this is the cell without a name"),
        ("cell", "--name cell: this is the cell without a name; choose another one"),
    ],
)
def test_what_is_no_name_is_refused(name: str, said: str) -> None:
    """With what is allowed."""
    with pytest.raises(NamespaceError) as caught:
        namespace_by_name(name)
    assert said in str(caught.value)


def test_free_ports_are_those_of_the_files_where_nobody_listens() -> None:
    """So that the first cell has the addresses that all documents name."""
    ports, master = free_ports(DOORS, Ports(), None, (), ())
    assert (ports.modbus, ports.gateway, ports.panel, ports.pendant, master) == DEFAULTS


@given(st.sets(st.sampled_from([port + n for port in DEFAULTS for n in range(12)])))
def test_ports_are_free_and_all_different(taken: set[int]) -> None:
    """Whatever is taken."""
    ports, master = free_ports(DOORS, Ports(), None, (), taken)
    chosen = [ports.modbus, ports.gateway, ports.panel, ports.pendant, master]
    assert len(set(chosen)) == 5 and not set(chosen) & taken


def test_given_ports_stay_and_are_not_given_twice() -> None:
    """The preflight says if one of them is taken."""
    ports, master = free_ports(DOORS, Ports(gateway=18080), 18090, (), {18080})
    assert (ports.gateway, master) == (18080, 18090)
    assert ports.panel == 18081


@pytest.mark.parametrize(
    ("given", "master"),
    [(Ports(panel=19090), None), (Ports(pendant=15020), None), (Ports(), 19090), (Ports(), 18090)],
)
def test_a_port_that_is_given_is_nobody_elses(given: Ports, master: int | None) -> None:
    """Though the turn of whom it is given to comes later."""
    ports, master_port = free_ports(DOORS, given, master, (), ())
    chosen = (ports.modbus, ports.gateway, ports.panel, ports.pendant, master_port)
    assert len(set(chosen)) == 5


def test_port_of_a_real_robot_is_left_alone() -> None:
    """It is the robot's, on another machine."""
    ports, _ = free_ports(DOORS, Ports(), None, ("emulator", "pendant_page"), {15020})
    assert ports.modbus is None and ports.pendant is None and ports.gateway == 19090


def test_no_free_port_is_told() -> None:
    """Rather than a port beyond the last one."""
    with pytest.raises(ValueError, match="no port from 19090 to 65535 is free"):
        free_ports(DOORS, Ports(), None, (), range(19090, 65536))


def test_room_is_what_the_processors_leave_and_the_group_grants() -> None:
    """A container with two of eight processors has no eight."""
    begun = ProcessorLoad(100.0, 10.0, 8, 2.0)
    assert cores_left(begun, ProcessorLoad(116.0, 10.5, 8, 2.0), 2.0) == 1.75
    assert cores_left(begun, ProcessorLoad(101.0, 10.5, 8, 2.0), 2.0) == 0.5
    assert cores_left(ProcessorLoad(0.0, 0.0, 2), ProcessorLoad(5.0, 0.0, 2), 2.0) == 2.0


def test_no_room_says_what_to_do() -> None:
    """And how to start all the same."""
    text = no_room(0.44, 2, "milk_2")
    assert text.startswith("only 0.4 of 2 processors are free, and a cell needs 1: end what")
    assert text.endswith("./cell up --name milk_2 --anyway")
    assert no_room(1.0, 2, "milk_2") == ""


def test_counters_of_this_machine_grow() -> None:
    """Idle time never runs backwards; this process may use a processor at least."""
    first, second = load(), load()
    assert second.idle_s >= first.idle_s >= 0.0 and first.cores >= 1
    assert second.granted_s >= first.granted_s


def test_cells_start_one_after_the_other(tmp_path: Path) -> None:
    """The second one waits until the first is ready, and says so."""
    waited, began = threading.Event(), threading.Event()

    def second() -> None:
        with StartTurn(tmp_path, waited.set):
            began.set()

    first = StartTurn(tmp_path, waited.set)
    assert not waited.is_set()
    thread = threading.Thread(target=second)
    thread.start()
    wait_until(waited.is_set, 5.0, "a second cell that waits")
    assert not began.is_set()
    first.end()
    first.end()
    thread.join(5.0)
    assert began.is_set()


def running(name: str) -> RunningCell:
    """Describe a cell."""
    namespace = "/" if name == "cell" else f"/{name}"
    return RunningCell(1, "up", "r", "ideal", "", namespace, "", {}, [], f"/runs/{name}")


@pytest.mark.parametrize(
    ("words", "namespace", "cells", "found"),
    [
        (["--since", "2h"], "", ["milk_2"], "milk_2"),
        ([], "", ["cell", "milk_2"], None),
        ([], "/milk_2", ["cell", "milk_2"], "milk_2"),
        (["--name", "cell"], "/milk_2", ["cell", "milk_2"], "cell"),
        (["--name=milk_2"], "", ["cell", "milk_2"], "milk_2"),
        (["--name", "milk_3"], "", ["milk_2"], None),
        (["--name"], "", ["milk_2"], "milk_2"),
    ],
)
def test_why_is_asked_of_the_cell_that_is_meant(
    words: list[str], namespace: str, cells: list[str], found: str | None
) -> None:
    """By name, by the shell's namespace, or the only one that runs."""
    cell = meant(words, namespace, [running(name) for name in cells])
    assert (cell and cell.name) == found
