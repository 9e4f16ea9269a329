"""What the cell says in each scene of the operator's page, worst texts included."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
from operator_panel.view.snapshot import (
    CellState,
    DecisionLine,
    Diagnosis,
    Link,
    Loop,
    Part,
    RobotPackage,
    RobotStatus,
    Sighting,
    Snapshot,
)
from scara_config import Robot
from scara_ros.diagnosis import Level

COMMANDS = (
    *("PAUSE", "STANDSTILL", "RESUME", "RESET", "HOME", "ALIGN", "ACKNOWLEDGE"),
    *("SPEED", "MOVE"),
)
COMMANDS += ("JOG", "RUN")
ONLY_MOVING = "nothing moves that could be paused"
SEAT = "operator 1"
NO_PARTS: dict[str, tuple[Part, ...]] = {}
LINKS = (
    Link("real", True, "", 0.0043, 0.0006, 1.2e6, 0.00016),
    Link("twin", True, "", 0.0021, 0.0009, 0.0, 0.0003),
)
DECISIONS = (
    DecisionLine(
        "2026-03-01T14:03:20", "IDLE", "REAL_LEADS", "the real robot moved: the twin follows"
    ),
    DecisionLine(
        "2026-03-01T14:02:55", "ALIGNING", "IDLE", "the twin is aligned: the pair is ready"
    ),
    DecisionLine(
        "2026-03-01T14:02:51", "OFFLINE", "ALIGNING", "both links are up: it aligns slowly"
    ),
)
LIMITED = (
    "joint_2 was at its effort limit in 12.3 % of the last 1000 steps, allowed are 2 %: "
    "it cannot follow so fast"
)
PAUSED = DecisionLine(
    "2026-03-01T14:03:22",
    "REAL_LEADS",
    "PAUSED",
    "the twin and the real robot came apart (21.3 mm at the tool, allowed are 20 mm): "
    "both are paused until the operator acknowledges",
)


def following(robot: Robot, time: float) -> Snapshot:
    """Return a healthy pair in the middle of a program of the real robot."""
    state = _state(robot, time, 0.0035, mode="REAL_LEADS", leader="real")
    state = msgspec.structs.replace(
        state,
        why="the real robot moved: the twin follows",
        deviation_mm=0.42,
        lag=0.0081,
        speed_requested_percent=60.0,
        speed_applied_percent=60.0,
    )
    package = RobotPackage("program", 60.0, True, True, "ARTICLE line 5 running")
    return _snapshot(robot, state, package, DECISIONS)


def ready(robot: Robot, _: float) -> Snapshot:
    """Return a healthy pair that stands still."""
    state = _state(robot, 2.0, 0.0, mode="IDLE")
    state = msgspec.structs.replace(
        state,
        why="both stand still: the positions are agreed",
        real_standing_still=True,
        twin_standing_still=True,
    )
    package = RobotPackage("none", 100.0, True, False, "")
    package = msgspec.structs.replace(package, **all_joints(robot, state))
    return _snapshot(robot, state, package, DECISIONS)


def all_joints(robot: Robot, state: CellState) -> dict[str, tuple[object, ...]]:
    """Return names and positions [deg or mm] as the real robot shows them; a wrist at 12.5 deg."""
    shown = dict(zip(state.name, state.real_position, strict=True))
    names = tuple(joint.name for joint in robot.joints)
    return {"name": names, "position": tuple(shown.get(name, 12.5) for name in names)}


def alarmed(robot: Robot, time: float) -> Snapshot:
    """Return a pair that came apart, with as many and as long alarms as there can be."""
    state = _state(robot, 2.0, -12.34, mode="PAUSED", leader="real")
    state = msgspec.structs.replace(
        state,
        why=PAUSED.why,
        diverged=True,
        deviation_mm=21.3,
        real_standing_still=True,
        twin_standing_still=True,
        speed_requested_percent=100.0,
        speed_applied_percent=8.0,
        speed_limited=True,
        speed_reason="a person is nearer than 0.8 m: the pair stops before it can touch anybody",
        alarm="the twin and the real robot came apart: look at both, ACKNOWLEDGE, then RESUME",
        links=(
            msgspec.structs.replace(LINKS[0], reason="no fresh data: the robot's clock stands"),
            LINKS[1],
        ),
    )
    found = {
        name: Diagnosis(level, name, text, math.inf)
        for level, name, text in (
            (Level.ERROR, "twin_controller: link real", "no fresh data for 0.31 s"),
            (Level.WARN, "recorder", "the disk is nearly full: 212 MB are free"),
            (Level.WARN, "simulator", LIMITED),
        )
    }
    package = RobotPackage("program", 100.0, False, False, "ARTICLE line 5 held", "PAUSE")
    snapshot = _snapshot(robot, state, package, (PAUSED, *DECISIONS))
    return msgspec.structs.replace(snapshot, diagnoses=found)


def asked(robot: Robot, time: float) -> Snapshot:
    """Return a following pair whose control somebody else asks for."""
    return _with(following(robot, time), asker="fitter 2", answer_left=14.0)


def held(robot: Robot, time: float) -> Snapshot:
    """Return a twin that leads and is held back, with the longest usual reason."""
    return _with(
        following(robot, time),
        mode="TWIN_LEADS",
        leader="twin",
        speed_requested_percent=100.0,
        speed_applied_percent=72.7,
        speed_limited=True,
        speed_reason="the real robot's override is 100 %, and it needs some of that to keep up",
    )


def stopped(robot: Robot, time: float) -> Snapshot:
    """Return a pair that was stopped at the robot, beside which somebody stands."""
    snapshot = _with(
        ready(robot, time), mode="STOPPED", why="STOP by operator 1: the target is cleared"
    )
    somebody = Sighting((0.75, 0.35, 0.2), math.inf)
    return msgspec.structs.replace(snapshot, people={"/scanner": somebody})


def estop(robot: Robot, time: float) -> Snapshot:
    """Return a pair whose drives are off, as the robot's own alarm says."""
    why = "emergency stop at the real robot: RESET once the cause is gone"
    return _with(ready(robot, time), mode="ESTOP", why=why)


def aligning(robot: Robot, time: float) -> Snapshot:
    """Return a pair whose twin comes closer, the longest words of who does what."""
    return _with(ready(robot, time), mode="ALIGNING", why="both links are up: it aligns slowly")


def no_stop(robot: Robot, time: float) -> Snapshot:
    """Return a following pair that no STOP of the page would reach."""
    why = "the twin controller's address is not known: no ROS master has answered yet"
    return msgspec.structs.replace(following(robot, time), no_stop=why)


def no_master(_: Robot, __: float) -> Snapshot:
    """Return what is known before any node has started."""
    return Snapshot()


SCENES: dict[str, Callable[[Robot, float], Snapshot]] = {
    made.__name__: made
    for made in (
        following,
        held,
        ready,
        aligning,
        alarmed,
        asked,
        stopped,
        estop,
        no_stop,
        no_master,
    )
}


def _state(robot: Robot, time: float, apart: float, mode: str, leader: str = "") -> CellState:
    """Return a state; both sides differ by ``apart`` [deg or mm] in each joint."""
    real = tuple(
        round((0.5 + 0.3 * math.sin(0.4 * time + k)) * (high - low) + low, 2)
        for k, (low, high) in enumerate(
            (joint.lower / joint.scale, joint.upper / joint.scale) for joint in robot.twin_joints
        )
    )
    refused = {name: "" for name in COMMANDS}
    if mode == "IDLE":
        refused |= {"PAUSE": ONLY_MOVING, "RESUME": "nothing is paused"}
    elif mode == "REAL_LEADS":
        moves = "the pair moves: STOP first"
        refused |= {name: moves for name in ("HOME", "ALIGN", "MOVE", "JOG", "RUN", "RESUME")}
    return CellState(
        mode=mode,
        leader=leader,
        name=tuple(joint.name for joint in robot.twin_joints),
        unit=tuple(joint.unit for joint in robot.twin_joints),
        real_position=real,
        twin_position=tuple(round(value - apart, 2) for value in real),
        deviation=tuple(round(apart, 2) for _ in real),
        speed_requested_percent=100.0,
        speed_applied_percent=100.0,
        real_gripper="off",
        twin_gripper="off",
        command=tuple(refused),
        refused=tuple(refused.values()),
        holder=SEAT,
        not_in_control=f"{SEAT} is in control: ask for it",
        links=LINKS,
    )


def _snapshot(
    robot: Robot, state: CellState, package: RobotPackage, decisions: tuple[DecisionLine, ...]
) -> Snapshot:
    joints = zip(robot.twin_joints, state.twin_position, strict=True)
    loops = {
        joint.name: Loop(place * joint.scale, place * joint.scale, 0.0, 3.0, math.inf)
        for joint, place in joints
    }
    return Snapshot(
        master=True,
        state=state,
        received=math.inf,
        package=package,
        loops=loops,
        jog="ready",
        status=RobotStatus(2, 0, 1, 1, int(not state.real_standing_still), 0),
        decisions=decisions,
        parts=NO_PARTS,  # the same object each time: what has not changed is not sent
    )


def _with(snapshot: Snapshot, **fields: object) -> Snapshot:
    state = msgspec.structs.replace(snapshot.state, **fields)  # type: ignore[type-var]
    return msgspec.structs.replace(snapshot, state=state)
