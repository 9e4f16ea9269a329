"""Somebody near the robot.

What speed and separation monitoring keeps, and what no leaving and no silence may start.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

from scara_config.loader import OVERRIDE

from harness.faults.fault_cell import ROBOT, FaultCell
from harness.faults.link_faults import REACTION_S, both_stand, give_stop, reaction, still_row
from harness.faults.process_faults import twin_stops
from harness.faults.rows import Row, must
from harness.opponents.person import FAR, PERIOD_S, WALK_M_S, Person
from harness.plants.known_robot import known_robot
from harness.scenes.truth import tool_and_elbow, tool_speed
from harness.yaml_files import changed_yaml

KEPT_MM = 310.0
"""What the formula keeps of the distance when the robot has come to rest.

C + Z_d + Z_r of config/twin_controller.yaml.
"""
NAMES = [joint.name for joint in ROBOT.twin_joints]
STALE_S = 0.3
STANDS_M_S = 0.02
WATCHED_S = 1.0


def monitored(folder: Path) -> dict[str, str]:
    """Return the environment of a cell that monitors separation.

    Its configuration is a copy in ``folder``.
    """
    known_robot(folder)
    changed_yaml(folder / "twin_controller.yaml", folder, ["separation", "enabled"], True)
    changed_yaml(folder / "twin_controller.yaml", folder, ["separation", "sensors"], ["/person"])
    return {OVERRIDE: str(folder)}


def scenarios(cell: FaultCell, person: Person, rng: Random) -> dict[str, Callable[[], list[Row]]]:
    """Return every scenario with a person by name."""
    return {
        "walks_in real": lambda: walks_in(cell, person, "real", rng),
        "walks_in operator": lambda: walks_in(cell, person, "operator", rng),
        "stands_by": lambda: stands_by(cell, person, rng),
        "sensor_silent": lambda: sensor_silent(cell, person),
    }


def walks_in(cell: FaultCell, person: Person, leader: str, rng: Random) -> list[Row]:
    """Somebody walks up to a robot that moves.

    It stands in time, nothing goes on when the person leaves, until RESUME.
    """
    fault = f"a person walks in, {leader} leads"
    person.stand(FAR)
    _begin(cell, leader)
    angle = rng.uniform(-0.5, 0.5)
    person.stand((2.2 * math.cos(angle), 2.2 * math.sin(angle), rng.uniform(0.0, 0.5)))
    begun = person.walk((0.5, 0.1, 0.2))
    cell.wait_for("PAUSED", 10.0)
    both_stand(cell, begun, within=5.0, timeout=10.0)
    stood = begun + cell.real.standstill(begun)
    rows = [
        Row(
            fault,
            "person's distance when the robot stands [mm]",
            KEPT_MM,
            _distance(cell, person, stood),
            at_least=True,
        )
    ]
    rested = time.time()
    stays_refused(cell, "RESUME", "mm away")
    person.walk(FAR, 3.0)
    time.sleep(WATCHED_S)
    rows += [still_row(cell, fault, rested), still_row(cell, fault, rested, "twin")]
    cell.until(lambda: bool(cell.command("RESUME").success), 10.0, "a way on")
    resumed = time.time()
    cell.wait_for("IDLE", 60.0)
    rows.append(
        Row(
            fault,
            "the robot goes on after RESUME [deg or mm]",
            1.0,
            cell.real.travel(resumed),
            at_least=True,
        )
    )
    cell.recover()
    return rows


def stands_by(cell: FaultCell, person: Person, rng: Random) -> list[Row]:
    """Somebody stands beside a robot that moves.

    It is never faster than the protective distance allows.
    """
    fault = "a person stands by"
    person.stand(FAR)
    cell.recover()
    away = rng.uniform(1.3, 1.6)
    person.stand((away * math.cos(0.9), away * math.sin(0.9), 0.2))
    time.sleep(4 * PERIOD_S)
    begun = time.time()
    cell.go(30.0, left_percent=2.0)
    cell.wait_for("IDLE", 60.0)
    share, fastest = 0.0, 0.0
    for message in cell.real.between(begun):
        q = _of_twin(message.name, message.position)
        speed = tool_speed(q, _of_twin(message.name, message.velocity))
        fastest = max(fastest, speed)
        if speed > STANDS_M_S:
            share = max(
                share,
                protective(speed) / (_distance(cell, person, message.header.stamp.to_sec()) * 1e-3),
            )
    person.stand(FAR)
    cell.recover()
    return [
        Row(fault, "protective distance at the robot's speed [part of the distance]", 1.0, share),
        Row(fault, "the robot's tool moves all the same [m/s]", 0.1, fastest, at_least=True),
    ]


def sensor_silent(cell: FaultCell, person: Person) -> list[Row]:
    """The sensor falls silent during a move: the robot stands.

    Beside a silent sensor no move begins.
    """
    fault = "the sensor for people falls silent"
    person.stand(FAR)
    cell.recover()
    cell.go(5.0)
    begun = person.hide()
    cell.wait_for("PAUSED", 10.0)
    rows = [
        reaction(cell, fault, begun, STALE_S + PERIOD_S + REACTION_S),
        twin_stops(cell, fault, begun),
    ]
    rested = time.time()
    stays_refused(cell, "RESUME", "silent")
    give_stop(cell, "STOP")
    cell.wait_for("STOPPED", 5.0)
    stays_refused(cell, "ALIGN", "silent")
    person.stand(FAR)
    time.sleep(WATCHED_S)
    rows += [still_row(cell, fault, rested), still_row(cell, fault, rested, "twin")]
    cell.recover()
    return rows


def protective(speed: float) -> float:
    """Return ISO/TS 15066's protective distance [m] by the terms of config/twin_controller.yaml.

    0.1 s, 10 m/s2, 0.31 m.
    """
    stopping = speed / 10.0
    return WALK_M_S * (0.1 + stopping) + speed * 0.1 + speed * speed / 20.0 + KEPT_MM * 1e-3


def stays_refused(cell: FaultCell, command: str, why: str) -> None:
    """See that a command is refused beside a person.

    On a late machine it may be refused for another reason, such as a lost link; it is never taken.
    """
    answer = cell.command(command)
    must(not answer.success, f"{command} is taken beside a person: {answer.message}")
    assert why in answer.message, answer


def _begin(cell: FaultCell, leader: str) -> None:
    """Let the robot run its program, or the operator move both for three seconds.

    Time for somebody to come.
    """
    cell.recover()
    if leader == "operator":
        cell.go(5.0)
    else:
        cell.pendant("run", "TWO_POINT")
        cell.wait_for("REAL_LEADS", 15.0)


def _distance(cell: FaultCell, person: Person, stamp: float) -> float:
    """Return how far the person was from tool or elbow of the robot at ``stamp`` [mm]."""
    before = cell.real.between(stamp - 0.5, stamp)[-1]
    q = _of_twin(before.name, before.position)
    return 1e3 * min(math.dist(point, person.at(stamp)) for point in tool_and_elbow(q))


def _of_twin(names: Sequence[str], values: Sequence[float]) -> list[float]:
    """Return the values of the twin's joints in their order, as truth.py takes them."""
    by_name = dict(zip(names, values))
    return [by_name[joint] for joint in NAMES]
