"""All faults by name, as tests and the long campaign run them; and a storm of many at once."""

from __future__ import annotations

import time
from collections.abc import Callable
from random import Random

from harness.faults import (
    gateway_faults,
    link_faults,
    operator_faults,
    process_faults,
    recording_faults,
)
from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import leader_changes, still_row
from harness.faults.rows import Row
from harness.wires.damage import Sometimes

Scenario = Callable[[FaultCell, Random], list[Row]]
_SIDED = (
    link_faults.frozen,
    link_faults.cut,
    link_faults.refused,
    link_faults.slow_line,
    link_faults.byte_by_byte,
)
_GONE = (
    ("gateway", "kill"),
    ("gateway", "stop"),
    ("simulator", "kill"),
    ("simulator", "stop"),
    ("joint_pose_controller", "kill"),
)
ATTACKS = ("flood", "huge", "nested", "slow_loris", "stalled")


def scenarios(seconds: float) -> dict[str, Scenario]:
    """Return every scenario of the cell by name; those that last at will last ``seconds``."""
    found: dict[str, Scenario] = {}
    for side in ("real", "twin"):
        for sided in _SIDED:
            found[f"{sided.__name__} {side}"] = _on_side(sided, side)
        found[f"damaged {side}"] = _damaged(side, seconds)
    for node, how in _GONE:
        found[f"{node} {how}"] = _gone(node, how)
    for attack in ATTACKS:
        found[attack] = _attacked(attack, seconds)
    for plain in (
        process_faults.controller_killed,
        process_faults.controller_killed_under_a_program,
        process_faults.controller_stopped,
        process_faults.emulator_killed,
        process_faults.emulator_stopped,
        operator_faults.estop_released,
        operator_faults.hold_released,
        operator_faults.started_at_once,
        recording_faults.recorder_killed,
        recording_faults.recorder_stopped,
        recording_faults.disk_full,
    ):
        found[plain.__name__] = plain
    found["stop_reaches_both"] = lambda cell, rng: operator_faults.stop_reaches_both(cell, rng, 2)
    return found


def _on_side(fault: Callable[[FaultCell, str, Random], list[Row]], side: str) -> Scenario:
    return lambda cell, rng: fault(cell, side, rng)


def _damaged(side: str, seconds: float) -> Scenario:
    return lambda cell, rng: link_faults.damaged(cell, side, rng, seconds)


def _gone(node: str, how: str) -> Scenario:
    return lambda cell, rng: process_faults.twin_side_gone(cell, node, how, rng)


def _attacked(attack: str, seconds: float) -> Scenario:
    return lambda cell, rng: gateway_faults.attacked(cell, attack, rng, seconds)


def storm(cell: FaultCell, rng: Random, seconds: float) -> list[Row]:
    """Break many things at once for ``seconds``, without any command.

    Nobody leads, nothing moves, and it ends well.
    """
    cell.recover()
    begun = time.time()
    for relay in (cell.modbus, cell.web):
        relay.disturb(Sometimes(Random(rng.random()), rng.choice((0.0, 0.005, 0.03))))
    while time.time() - begun < seconds:
        _strike(cell, rng)
        time.sleep(rng.uniform(0.05, 1.5))
    rows = [
        still_row(cell, "storm", begun),
        Row("storm", "leader changes", 0.0, float(leader_changes(cell, begun)), always=True),
    ]
    healed = time.time()
    cell.recover(90.0)
    return [*rows, Row("storm", "idle again after [s]", 60.0, time.time() - healed)]


def _strike(cell: FaultCell, rng: Random) -> None:
    """Break one thing at random; processes are let go on or started again at once."""
    relay = rng.choice((cell.modbus, cell.web))
    kind = rng.choice(("cut", "freeze", "refuse", "stop", "kill"))
    if kind == "cut":
        relay.cut(rng.random() < 0.5)
    elif kind in ("freeze", "refuse"):
        getattr(relay, kind)(True)
        time.sleep(rng.uniform(0.02, 1.0))
        getattr(relay, kind)(False)
    elif kind == "stop":
        node = rng.choice(
            ("gateway", "simulator", "joint_pose_controller", "twin_controller", "emulator")
        )
        cell.stop(node)
        time.sleep(rng.uniform(0.05, 1.0))
        cell.go_on(node)
    else:
        node = rng.choice(("gateway", "simulator", "joint_pose_controller", "twin_controller"))
        cell.kill(node)
        cell.start_node(node)
