"""What must hold whoever does what.

STOP reaches both, a release moves nothing, noise is no leader.
"""

from __future__ import annotations

import concurrent.futures
import math
import statistics
import time
from collections.abc import Callable
from itertools import pairwise
from random import Random

from fanuc_emulator.pendant.pendant_link_io import PendantLink
from scara_config.modbus_map import load_modbus_map

from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import both_stand, give_stop, leader_changes, still_row
from harness.faults.rows import Row
from harness.processes import wait_until
from harness.running.repeats import NOTES
from harness.scenes.truth import farthest_apart_mm
from harness.wires.damage import Tap
from harness.wires.noise import ModbusNoise, WebNoise
from harness.workspace import ROOT

CYCLES_S = 0.0194
"""Two polls of the robot (config/twin_controller.yaml)."""
CSTOPI_ON = bytes((5, 6003 >> 8, 6003 & 0xFF, 0xFF, 0x00))
STOP_COMMAND = b'"command":1'
NOISE = 0.01
"""Amplitude [deg or mm] on each joint of both sides.

One of the last digit shown, half the hysteresis.
"""
WATCHED_S = 1.5
ON_WIRE_S = 3.0
"""A STOP is lost that is not on a wire by then: a link that has to be made anew takes less."""
GAP_S = 0.1
"""Both sides begin within this."""
TWO_POINT = 3
"""RSR number of that program in config/robots/fanuc_sr6ia/emulator.yaml."""
LEADERS = ("REAL_LEADS", "TWIN_LEADS", "OPERATOR_LEADS")


STOPS = {
    "the operator": "STOP",
    "the robot's pendant": "REAL_STOPPED",
    "the twin's side": "TWIN_STOPPED",
}
"""Who stops, and the decision that it leads to."""


def stop_reaches_both(cell: FaultCell, rng: Random, count: int) -> list[Row]:
    """STOP during moves, from each side ``count`` times.

    How soon after the decision on both wires, and whether one is lost.
    """
    to_real, to_twin, lost = [], [], 0
    waiting = count * list(STOPS.items())
    while waiting:
        source, event = waiting.pop()
        cell.recover()
        moved = time.time()
        cell.go(rng.uniform(1.5, 2.5))  # slow: on a busy machine the stop may come seconds later
        cell.modbus.disturb(Tap(CSTOPI_ON))
        cell.web.disturb(Tap(STOP_COMMAND))
        begun = time.time()
        _stop(cell, source)
        decided = _decided(cell, begun, event)
        if decided is None:
            ended = _ended_itself(cell, moved, begun)
            if ended:
                # There was nothing left to stop. How often that may be is counted.
                NOTES.add(f"{ended}; STOP by {source}")
                waiting.append((source, event))
            else:
                lost += 1
            continue
        seen = _on_wires(cell, source)
        if any(at < begun for at in seen):
            lost += 1
        else:
            to_real.append(seen[0] - decided)
            to_twin.append(seen[1] - decided)
            both_stand(cell, decided)
    cell.recover()
    name = f"STOP by {', '.join(STOPS)}"
    return [
        Row(name, "lost", 0.0, float(lost), always=True),
        Row(
            name,
            "on the wire to the robot after [s], median",
            CYCLES_S,
            statistics.median(to_real or [math.inf]),
        ),
        Row(
            name,
            "on the wire to the twin after [s], median",
            CYCLES_S,
            statistics.median(to_twin or [math.inf]),
        ),
    ]


def _on_wires(cell: FaultCell, source: str) -> list[float]:
    """Return when a STOP was seen on each wire (ROS time), 0 where it was not."""
    relays = (cell.modbus, cell.web)
    try:
        wait_until(lambda: all(relay.report() for relay in relays), ON_WIRE_S, f"STOP by {source}")
    except AssertionError as error:
        print(f"a STOP was lost on a wire: {error}")
    return [relay.report().get("seen", 0.0) for relay in relays]


def _decided(cell: FaultCell, since: float, event: str) -> float | None:
    """Return when ``event`` was decided (ROS time).

    None if it was not in the time that a pendant may take.
    """
    try:
        return cell.noticed(since, events=(event,))
    except AssertionError as error:
        made = [(d.event, round(d.header.stamp.to_sec() - since, 3)) for d in cell.decided(since)]
        print(f"a STOP was lost: {error}; decided since it [s]: {made}")
        return None


def _ended_itself(cell: FaultCell, moved: float, stopped: float) -> str:
    """Return why the motion begun at ``moved`` had ended without the stop asked for at ``stopped``.

    Empty if it had not. Before the stop it may end for any reason; after it only because a side was
    lost by a standstill of the machine, which the node sees that ran on that processor alone.

    Raises:
        AssertionError: A side was lost after the stop, and no node saw why. That ends a motion too,
            so no stop is lost; only a standstill that is seen from here excuses it.
    """
    for decision in cell.decided(moved):
        why, after = str(decision.why), decision.header.stamp.to_sec() - stopped
        if after < 0.0 and decision.mode_after not in LEADERS:
            return why
        if decision.event == "LINK_LOST":
            assert "this machine stood still" in why, f"{after:.3f} s behind the stop: {why}"
            return why
    return ""


def _stop(cell: FaultCell, source: str) -> None:
    """Stop as somebody on that side does."""
    if source == "the operator":
        give_stop(cell, "STOP")
    elif source == "the robot's pendant":
        with _pendant(cell) as pendant:
            pendant.pulse("panel_abort")
    else:
        from scara_msgs.msg import MotionCommand

        # The gateway, the simulator and the pose controller: a STOP waits for nobody.
        publisher = cell.ros.publisher("motion_command", MotionCommand, subscribers=3)
        publisher.publish(
            MotionCommand(command=MotionCommand.STOP, id=1, reason="stopped on the twin's side")
        )


def estop_released(cell: FaultCell, rng: Random) -> list[Row]:
    """ESTOP during a move, RESET, ALIGN: no release gives the motion back."""
    cell.move(rng.uniform(10.0, 30.0))
    begun = time.time()
    give_stop(cell, "ESTOP")
    both_stand(cell, begun)
    rested = time.time()
    assert cell.command("RESET").success
    cell.wait_for("STOPPED", 10.0)
    time.sleep(WATCHED_S)
    rows = [
        still_row(cell, "ESTOP released", rested),
        still_row(cell, "ESTOP released", rested, "twin"),
    ]
    cell.recover()
    return [
        *rows,
        Row(
            "ESTOP released",
            "leader changes",
            0.0,
            float(leader_changes(cell, rested)),
            always=True,
        ),
    ]


def started_at_once(cell: FaultCell, rng: Random) -> list[Row]:
    """Start a program on the pendant within 0.1 s of a move of the operator, or of the twin.

    One side leads after the other, they stay together, and end together at rest.
    """
    cell.recover()
    who, gap = rng.choice(("the operator", "the twin")), rng.uniform(-GAP_S, GAP_S)
    begun = time.time()
    with _pendant(cell) as pendant, concurrent.futures.ThreadPoolExecutor(2) as hands:
        at = time.monotonic() + 2.0 * GAP_S
        program = hands.submit(_at, at, lambda: pendant.pulse(f"panel_run{TWO_POINT}"))
        move = hands.submit(_at, at + gap, lambda: _move(cell, who))
        program.result(10.0)
        wait_until(lambda: _modes(cell, begun), 10.0, "a leader")
        cell.wait_for("IDLE", 60.0)
        move.result(60.0)
    time.sleep(WATCHED_S)  # whoever were to move again does so now
    # As a program does that had to wait for the end of our stream.
    cell.wait_for("IDLE", 60.0)
    modes = _modes(cell, begun)
    changes = [(a, b) for a, b in pairwise(modes) if a != b and "IDLE" not in (a, b)]
    others = sum(mode not in (*LEADERS, "IDLE") for mode in modes)
    apart = farthest_apart_mm(cell.real.truth(begun), cell.twin.truth(begun))
    name = f"a program and a move of {who} at once"
    return [
        Row(name, "modes other than leading and IDLE", 0.0, float(others)),
        Row(name, "changes from one leader to another", 1.0, float(len(changes))),
        Row(name, "leaders that take over from the robot", 0.0, float(_from_robot(changes))),
        Row(name, "largest distance of the tools at an instant [% of reach]", 5.0, apart / 6.5),
        Row(name, "idle at the end", 1.0, float(cell.mode == "IDLE"), at_least=True),
    ]


def _at(moment: float, action: Callable[[], object]) -> None:
    """Do something at a moment of the monotonic clock [s]."""
    time.sleep(max(0.0, moment - time.monotonic()))
    action()


def _pendant(cell: FaultCell) -> PendantLink:
    """Return a pendant that answers at once; the command is a program that has to start."""
    return PendantLink("127.0.0.1", cell.modbus_port, load_modbus_map(ROOT / "config"))


def _move(cell: FaultCell, who: str) -> None:
    """Let somebody move; whether it is carried out is for the pair to decide."""
    from scara_msgs.srv import MoveJoints

    target = cell.farther_pose()
    if who == "the operator":
        cell.command("MOVE_JOINTS", joint_positions=target, speed_percent=30.0)
    else:
        fields = {"joint_positions": target, "speed_percent": 50.0}
        cell.call("joint_pose_controller/move", MoveJoints, timeout=60.0, **fields)


def _modes(cell: FaultCell, since: float) -> list[str]:
    """Return the modes that decisions have led to since then (ROS time)."""
    return [decision.mode_after for decision in cell.decided(since)]


def _from_robot(changes: list[tuple[str, str]]) -> int:
    """Count who took the lead from a robot that leads: its program has the right of way."""
    return sum(before == "REAL_LEADS" for before, _ in changes)


def hold_released(cell: FaultCell, rng: Random) -> list[Row]:
    """A program held on the robot's own panel, then STOP.

    The hold is released by it, and nothing goes on.
    """
    cell.recover()
    cell.pendant("run", "TWO_POINT")
    cell.wait_for("REAL_LEADS", 10.0)
    time.sleep(rng.uniform(0.3, 0.8))
    cell.pendant("hold")
    begun = time.time()
    wait_until(lambda: cell.real.standstill(begun) < 2.0, 10.0, "a robot that is held")
    give_stop(cell, "STOP")
    both_stand(cell, begun)
    rested = time.time()
    time.sleep(WATCHED_S)
    rows = [
        still_row(cell, "hold released", rested),
        still_row(cell, "hold released", rested, "twin"),
    ]
    cell.recover()
    return rows


def noisy(cell: FaultCell, rng: Random, seconds: float) -> list[Row]:
    """Sensor noise on both sides of an idle cell."""
    cell.recover()
    begun = time.time()
    cell.modbus.disturb(ModbusNoise(Random(rng.random()), NOISE))
    cell.web.disturb(WebNoise(Random(rng.random()), NOISE))
    time.sleep(seconds)
    noisy_units = min(sum(relay.report().values()) for relay in (cell.modbus, cell.web))
    changes = leader_changes(cell, begun)
    name = f"noise of {NOISE:g} deg or mm on both sides, idle"
    rows = [
        Row(name, "leader changes", 0.0, float(changes), always=True),
        still_row(cell, name, begun),
        Row(name, "noisy units on the wire with fewer", 1.0, noisy_units, at_least=True),
    ]
    cell.recover()
    return rows
