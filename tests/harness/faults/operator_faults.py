"""What must hold whoever does what: STOP reaches both, a release moves nothing, noise is no leader."""

from __future__ import annotations

import math
import statistics
import time
from random import Random

from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import leader_changes, still_row
from harness.faults.rows import Row
from harness.processes import wait_until
from harness.wires.damage import Tap
from harness.wires.noise import ModbusNoise, WebNoise

CYCLES_S = 0.0194
"""Two polls of the robot (config/twin_controller.yaml)."""
CSTOPI_ON = bytes((5, 6003 >> 8, 6003 & 0xFF, 0xFF, 0x00))
STOP_COMMAND = b'"command":1'
NOISE = 0.01
"""Amplitude [deg or mm] on each joint of both sides: one of the last digit shown, half the hysteresis."""
WATCHED_S = 1.5


STOPS = {"the operator": "STOP", "the robot's pendant": "REAL_STOPPED", "the twin's side": "TWIN_STOPPED"}
"""Who stops, and the decision that it leads to."""


def stop_reaches_both(cell: FaultCell, rng: Random, count: int) -> list[Row]:
    """STOP during moves, from each side ``count`` times: how soon after the decision on both wires, and whether one is lost."""
    to_real, to_twin, lost = [], [], 0
    for source, event in count * list(STOPS.items()):
        cell.move(rng.uniform(3.0, 5.0))  # slow: the pendant is a program that has to start
        cell.modbus.disturb(Tap(CSTOPI_ON))
        cell.web.disturb(Tap(STOP_COMMAND))
        begun = time.time()
        _stop(cell, source)
        decided = _decided(cell, begun, event)
        seen = [
            wait_until(relay.report, 2.0, f"STOP by {source} on the wire").get("seen", 0.0) for relay in (cell.modbus, cell.web)
        ]
        if decided is None or any(at < begun for at in seen):
            lost += 1
        else:
            to_real.append(seen[0] - decided)
            to_twin.append(seen[1] - decided)
            wait_until(lambda: max(cell.real.standstill(begun), cell.twin.standstill(begun)) < 2.0, 5.0, "standstill of both")  # noqa: B023
        cell.recover()
    name = f"STOP by {', '.join(STOPS)}"
    return [
        Row(name, "lost", 0.0, float(lost), always=True),
        Row(name, "on the wire to the robot after [s], median", CYCLES_S, statistics.median(to_real or [math.inf])),
        Row(name, "on the wire to the twin after [s], median", CYCLES_S, statistics.median(to_twin or [math.inf])),
    ]


def _decided(cell: FaultCell, since: float, event: str) -> float | None:
    """Return when ``event`` was decided (ROS time); None if it was not in the time that a pendant may take."""
    try:
        return cell.noticed(since, events=(event,))
    except AssertionError as error:
        print(f"a STOP was lost: {error}")
        return None


def _stop(cell: FaultCell, source: str) -> None:
    """Stop as somebody on that side does."""
    if source == "the operator":
        assert cell.command("STOP").success
    elif source == "the robot's pendant":
        cell.pendant("abort")
    else:
        from scara_msgs.msg import MotionCommand

        publisher = cell.ros.publisher("motion_command", MotionCommand)
        publisher.publish(MotionCommand(command=MotionCommand.STOP, id=1, reason="stopped on the twin's side"))


def estop_released(cell: FaultCell, rng: Random) -> list[Row]:
    """ESTOP during a move, RESET, ALIGN: no release gives the motion back."""
    cell.move(rng.uniform(10.0, 30.0))
    begun = time.time()
    assert cell.command("ESTOP").success
    wait_until(lambda: max(cell.real.standstill(begun), cell.twin.standstill(begun)) < 2.0, 5.0, "standstill of both")
    rested = time.time()
    assert cell.command("RESET").success
    cell.wait_for("STOPPED", 10.0)
    time.sleep(WATCHED_S)
    rows = [still_row(cell, "ESTOP released", rested), still_row(cell, "ESTOP released", rested, "twin")]
    cell.recover()
    return [*rows, Row("ESTOP released", "leader changes", 0.0, float(leader_changes(cell, rested)), always=True)]


def hold_released(cell: FaultCell, rng: Random) -> list[Row]:
    """A program held on the robot's own panel, then STOP: the hold is released by it, and nothing goes on."""
    cell.recover()
    cell.pendant("run", "TWO_POINT")
    cell.wait_for("REAL_LEADS", 10.0)
    time.sleep(rng.uniform(0.3, 0.8))
    cell.pendant("hold")
    begun = time.time()
    wait_until(lambda: cell.real.standstill(begun) < 2.0, 10.0, "a robot that is held")
    assert cell.command("STOP").success
    wait_until(lambda: max(cell.real.standstill(begun), cell.twin.standstill(begun)) < 2.0, 5.0, "standstill of both")
    rested = time.time()
    time.sleep(WATCHED_S)
    rows = [still_row(cell, "hold released", rested), still_row(cell, "hold released", rested, "twin")]
    cell.recover()
    return rows


def noisy(cell: FaultCell, rng: Random, seconds: float) -> list[Row]:
    """Sensor noise on both sides of an idle cell."""
    cell.recover()
    begun = time.time()
    cell.modbus.disturb(ModbusNoise(Random(rng.random()), NOISE))
    cell.web.disturb(WebNoise(Random(rng.random()), NOISE))
    time.sleep(seconds)
    changes = leader_changes(cell, begun)
    name = f"noise of {NOISE:g} deg or mm on both sides, idle"
    rows = [Row(name, "leader changes", 0.0, float(changes), always=True), still_row(cell, name, begun)]
    cell.recover()
    return rows
