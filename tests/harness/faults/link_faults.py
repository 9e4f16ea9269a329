"""Faults of the two wires: silence, refusal, cuts, delay, splitting, damage, noise."""

from __future__ import annotations

import math
import time
from random import Random

from harness.faults.fault_cell import ROBOT, FaultCell
from harness.faults.rows import Row, must
from harness.processes import wait_until
from harness.wires.damage import Delayed, Fault, Sometimes, Split
from harness.wires.relay import Relay

MODBUS_FOUND_S, WEB_FOUND_S = 0.1, 0.25
REACTION_S = 0.2
TWIN_REACTION_S = 0.3
"""When the twin leads and its side is gone: what finding that may take, and a follower's lag."""
TOLD_S = 0.05
"""From the decision to the twin's first slower set point, on a busy machine."""
STILL_MM_DEG = 0.05
MOVES_ON = 0.01
"""A robot whose fastest joint has more than this part of its speed moves on."""
NOT_ANSWERED = "the controller did not answer in time"
"""What the twin controller's service answers for a controller that stands still."""


def reaction(cell: FaultCell, fault: str, since: float, allowed: float = REACTION_S) -> Row:
    """Return how long the robot moved on after ``since``.

    Allowed is so long, and the ramp that its speed asks for.
    """
    found = [math.inf]

    def stands() -> bool:
        found.append(cell.real.standstill(since))
        return found[-1] < 5.0

    wait_until(stands, 10.0, "standstill of the robot")
    # As it was found: a joint that settles by a hair later is judged by whether it moves by itself.
    return Row(
        fault,
        f"robot stands after [s], {allowed:g} and its ramp",
        allowed + cell.real.ramp(since),
        found[-1],
    )


def give_stop(cell: FaultCell, command: str) -> None:
    """Give the pair a stop, and see that it is taken.

    On a late machine the controller may answer late, or not see in time that both stand; nothing
    lets it refuse a stop.
    """
    answer = cell.command(command)
    must(answer.sent or answer.message == NOT_ANSWERED, f"{command} is refused: {answer.message}")
    assert answer.success, answer.message


def both_stand(cell: FaultCell, since: float, within: float = 2.0, timeout: float = 5.0) -> None:
    """Wait until both sides stand, ``within`` seconds from ``since`` on.

    Nothing excuses a robot that moves on when the time is out; a twin may be aligned by then.
    """
    try:
        wait_until(
            lambda: max(cell.real.standstill(since), cell.twin.standstill(since)) < within,
            timeout,
            "standstill of both",
        )
    except AssertionError:
        must(not cell.real.under_way(MOVES_ON, 0.1), f"the robot moves on after {timeout:g} s")
        raise


def twin_stands(cell: FaultCell, fault: str, since: float, allowed: float) -> Row:
    """Return how long the twin moved on after ``since``; allowed is so long, and its ramp."""
    found = [math.inf]

    def stands() -> bool:
        found.append(cell.twin.standstill(since))
        return found[-1] < 5.0

    wait_until(stands, 10.0, "standstill of the twin")
    label = f"twin stands after [s], {allowed:g} and its ramp"
    return Row(fault, label, allowed + cell.twin.ramp(since), found[-1])


def still_row(cell: FaultCell, fault: str, begin: float, side: str = "real") -> Row:
    """Return how far a side has moved since ``begin``: nothing moves by itself."""
    travel = getattr(cell, side).travel(begin)
    return Row(
        fault,
        f"{'robot' if side == 'real' else 'twin'} moves by itself [deg or mm]",
        STILL_MM_DEG,
        travel,
        always=True,
    )


def losses(cell: FaultCell, fault: str, since: float) -> Row:
    """Return how often the twin controller lost a link since then; why is printed."""
    lost = [decision.why for decision in cell.decided(since) if decision.event == "LINK_LOST"]
    print("\n".join(lost), end="\n" if lost else "")
    return Row(fault, "links lost by the twin controller", 0.0, float(len(lost)))


def frozen(cell: FaultCell, side: str, rng: Random) -> list[Row]:
    """Half-open while the robot follows a move.

    Found in time, the robot stands, nothing is replayed.
    """
    fault, proxy, limit = _wire(cell, side)
    cell.move(speed_percent=rng.uniform(10.0, 30.0))
    time.sleep(rng.uniform(0.0, 0.05))
    begun = time.time()
    proxy.freeze(True)
    rows = [
        Row(f"{fault} half-open", "found after [s]", limit, cell.lost(begun) - begun),
        reaction(
            cell, f"{fault} half-open", begun, REACTION_S if side == "real" else TWIN_REACTION_S
        ),
    ]
    rested = time.time()
    time.sleep(0.3)
    proxy.freeze(False)
    cell.recover()
    time.sleep(0.5)
    return [*rows, still_row(cell, f"{fault} half-open", rested)]


def cut(cell: FaultCell, side: str, rng: Random) -> list[Row]:
    """A connection ends while the robot follows a move.

    When it is back, nothing goes on by itself.
    """
    fault, proxy, limit = _wire(cell, side)
    cell.move(speed_percent=rng.uniform(10.0, 30.0))
    begun = time.time()
    proxy.cut(reset=rng.random() < 0.5)
    rows = [
        Row(f"{fault} cut", "found after [s]", limit, cell.lost(begun) - begun),
        reaction(cell, f"{fault} cut", begun),
    ]
    rested = time.time()
    cell.recover()
    time.sleep(0.5)
    return [*rows, still_row(cell, f"{fault} cut", rested)]


def own_way(cell: FaultCell, how: str, rng: Random) -> list[Row]:
    """The twin moves by its own side's command, and its line to the controller is lost for long."""
    from sensor_msgs.msg import JointState

    fault, proxy, limit = _wire(cell, "twin")
    cell.recover()
    target = JointState(
        name=[joint.name for joint in ROBOT.twin_joints],
        position=cell.farther_pose(),
        velocity=[20.0],
    )
    cell.ros.publisher("joint_pose_controller/target", JointState).publish(target)
    wait_until(lambda: cell.twin.under_way(0.12, 0.1), 8.0, "a twin under way")
    time.sleep(rng.uniform(0.0, 0.05))
    begun = time.time()
    if how == "cut":
        proxy.refuse(True)
        proxy.cut(reset=rng.random() < 0.5)
    else:
        proxy.freeze(True)
    rows = [twin_stands(cell, f"{fault} {how}, its own way", begun, limit + TOLD_S)]
    rested = time.time()
    time.sleep(0.5)
    rows.append(still_row(cell, f"{fault} {how}, its own way", rested, "twin"))
    if how == "cut":
        proxy.refuse(False)
    else:
        proxy.freeze(False)
    cell.recover()
    return rows


def refused(cell: FaultCell, side: str, rng: Random) -> list[Row]:
    """Nobody listens for a while: the link comes back by itself within its longest pause."""
    fault, proxy, _ = _wire(cell, side)
    cell.recover()
    begun = time.time()
    proxy.refuse(True)
    cell.lost(begun)
    time.sleep(rng.uniform(0.2, 1.5))
    back = time.time()
    proxy.refuse(False)
    wait_until(proxy.connections, 5.0, "a new connection")
    found = time.time() - back
    cell.recover()
    return [
        Row(f"{fault} refused", "connected again after [s]", 2.2, found),
        still_row(cell, f"{fault} refused", begun),
    ]


def disturbed(cell: FaultCell, side: str, name: str, fault: Fault, duration: float) -> list[Row]:
    """Do something to every unit of an idle cell.

    Nobody leads, nothing moves, and it is idle again afterwards.
    """
    wire, proxy, _ = _wire(cell, side)
    cell.recover()
    begun = time.time()
    proxy.disturb(fault)
    time.sleep(duration)
    moved = still_row(cell, f"{wire} {name}", begun)
    struck = sum(proxy.report().values())
    changes = leader_changes(cell, begun)
    cell.recover()
    rows = [moved, Row(f"{wire} {name}", "leader changes", 0.0, float(changes), always=True)]
    if hasattr(fault, "report"):
        rows.append(Row(f"{wire} {name}", "units damaged", 1.0, float(struck), True))
    return rows


def slow_line(cell: FaultCell, side: str, rng: Random) -> list[Row]:
    """Delay and jitter well below the time-outs, three questions a cycle on the robot's side.

    No link is lost.
    """
    begun = time.time()
    delay = Delayed(0.002, 0.003, rng) if side == "real" else Delayed(0.010, 0.010, rng)
    rows = disturbed(cell, side, "delayed", delay, 2.0)
    return [*rows, losses(cell, f"{_wire(cell, side)[0]} delayed", begun)]


def byte_by_byte(cell: FaultCell, side: str, rng: Random) -> list[Row]:
    """Each byte in a segment of its own: the pair moves as if nothing was."""
    wire, proxy, _ = _wire(cell, side)
    cell.recover()
    begun = time.time()
    proxy.disturb(Split(16 if side == "twin" else 1000, rng))
    cell.go(rng.uniform(10.0, 30.0))
    cell.wait_for("IDLE", 30.0)
    proxy.heal()
    return [losses(cell, f"{wire} byte by byte", begun)]


def damaged(cell: FaultCell, side: str, rng: Random, duration: float) -> list[Row]:
    """Duplicated, corrupted, truncated, dropped, swapped answers."""
    return disturbed(cell, side, "damaged", Sometimes(rng, 0.02), duration)


def leader_changes(cell: FaultCell, since: float) -> int:
    """Count how often somebody began to lead."""
    before, changes = "", 0
    for decision in cell.decided(since):
        changes += bool(decision.leader and decision.leader != before)
        before = decision.leader
    return changes


def _wire(cell: FaultCell, side: str) -> tuple[str, Relay, float]:
    return (
        ("Modbus", cell.modbus, MODBUS_FOUND_S)
        if side == "real"
        else ("web socket", cell.web, WEB_FOUND_S)
    )
