"""Faults of the processes: killed without a farewell, stopped and let go on."""

from __future__ import annotations

import time
from random import Random

from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import (
    MODBUS_FOUND_S,
    TWIN_REACTION_S,
    WEB_FOUND_S,
    reaction,
    still_row,
)
from harness.faults.rows import Row
from harness.processes import wait_until

BACK_S = 30.0
"""A node that was started again is part of an idle cell within this time [s].

Its own start is most of it.
"""


def controller_killed(cell: FaultCell, rng: Random) -> list[Row]:
    """Kill -9 of the twin controller while the robot follows.

    Its own watchdog stops it, a new controller moves nothing.
    """
    cell.move(rng.uniform(10.0, 30.0))
    time.sleep(rng.uniform(0.0, 0.05))
    begun = cell.kill("twin_controller")
    rows = [reaction(cell, "twin_controller killed", begun)]
    rested = time.time()
    cell.start_node("twin_controller")
    cell.recover()
    return [*rows, still_row(cell, "twin_controller killed", rested)]


def controller_killed_under_a_program(cell: FaultCell, rng: Random) -> list[Row]:
    """Kill -9 of the twin controller while the robot runs a program of its own.

    Its watchdog ends the program.
    """
    fault = "twin_controller killed, robot leads"
    cell.recover()
    cell.pendant("run", "TWO_POINT")
    wait_until(
        lambda: cell.mode == "REAL_LEADS" and cell.real.under_way(0.05, 0.1),
        15.0,
        "a robot under way",
    )
    time.sleep(rng.uniform(0.0, 0.1))
    begun = cell.kill("twin_controller")
    rows = [reaction(cell, fault, begun), twin_stops(cell, fault, begun)]
    rested = time.time()
    cell.start_node("twin_controller")
    cell.recover()
    return [*rows, still_row(cell, fault, rested)]


def controller_stopped(cell: FaultCell, rng: Random) -> list[Row]:
    """SIGSTOP and SIGCONT of the twin controller.

    What it had in mind before is not done afterwards.
    """
    cell.move(rng.uniform(10.0, 30.0))
    begun = cell.stop("twin_controller")
    rows = [reaction(cell, "twin_controller stopped", begun)]
    time.sleep(rng.uniform(0.0, 1.0))
    rested = cell.go_on("twin_controller")
    cell.recover()
    time.sleep(0.5)
    return [*rows, still_row(cell, "twin_controller stopped", rested)]


def emulator_killed(cell: FaultCell, rng: Random) -> list[Row]:
    """Kill -9 of the robot's controller: found in time; the twin stops.

    A new one is aligned to, slowly.
    """
    cell.move(rng.uniform(10.0, 30.0))
    begun = cell.kill("emulator")
    rows = [
        Row("robot killed", "found after [s]", MODBUS_FOUND_S, cell.lost(begun) - begun),
        twin_stops(cell, "robot killed", begun),
    ]
    started = time.time()
    cell.start_node("emulator")
    cell.recover()
    cell.pendant("override", "100")
    peak = cell.twin.peak(begun + 1.0)
    limit = 0.105
    return [
        *rows,
        Row("robot killed", "idle again after [s]", BACK_S, time.time() - started),
        Row("robot killed", "twin's speed while it aligns [part of the greatest]", limit, peak),
    ]


def emulator_stopped(cell: FaultCell, rng: Random) -> list[Row]:
    """SIGSTOP of the robot's controller: half-open; found in time.

    Afterwards the robot stays where it is.
    """
    cell.move(rng.uniform(10.0, 30.0))
    begun = cell.stop("emulator")
    rows = [
        Row("robot silent", "found after [s]", MODBUS_FOUND_S, cell.lost(begun) - begun),
        twin_stops(cell, "robot silent", begun),
    ]
    time.sleep(rng.uniform(0.2, 1.0))
    again = cell.go_on("emulator")
    rows.append(reaction(cell, "robot silent, then going on", again))
    rested = time.time()
    cell.recover()
    time.sleep(0.5)
    return [*rows, still_row(cell, "robot silent", rested)]


def twin_side_gone(cell: FaultCell, node: str, how: str, rng: Random) -> list[Row]:
    """Kill or stop gateway, simulator or pose controller while the robot follows.

    It stands, and the cell comes back.
    """
    name = f"{node} {'killed' if how == 'kill' else 'stopped'}"
    cell.move(rng.uniform(10.0, 30.0))
    begun = cell.kill(node) if how == "kill" else cell.stop(node)
    rows = [
        Row(name, "noticed after [s]", WEB_FOUND_S, cell.noticed(begun) - begun),
        reaction(cell, name, begun, TWIN_REACTION_S),
    ]
    rested = time.time()
    if how == "kill":
        cell.start_node(node)
    else:
        time.sleep(rng.uniform(0.0, 1.0))
        cell.go_on(node)
    cell.recover()
    rows.append(Row(name, "idle again after [s]", BACK_S, time.time() - rested))
    time.sleep(0.5)
    return [*rows, still_row(cell, name, rested)]


def twin_stops(cell: FaultCell, fault: str, begun: float) -> Row:
    """Return how long the twin goes on once the robot is gone."""
    wait_until(lambda: cell.twin.standstill(begun) < 5.0, 10.0, "standstill of the twin")
    return Row(fault, "twin stands after [s]", 0.7, cell.twin.standstill(begun))
