"""The names of all deeds and faults, each with the arguments that a scene draws for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

Arguments = tuple[float | str, ...]
JOINTS = ("joint_1", "joint_2", "joint_3", "table_joint")
NODES = (
    "gateway",
    "simulator",
    "joint_pose_controller",
    "twin_controller",
    "emulator",
    "motion_server",
    "kinematics_server",
    "joint_vel_controller",
    "trajectory_server",
    "recorder",
    "operator_panel",
)
"""What is stopped and let go on; the heart of the cell comes first."""
KILLED = NODES[:5] + ("motion_server", "trajectory_server")


@dataclass(frozen=True)
class Name:
    """A deed's name, its kind, and how its arguments are drawn."""

    text: str
    kind: str
    draw: Callable[[Random], Arguments]


def _nothing(rng: Random) -> Arguments:
    return ()


def _pose(rng: Random) -> Arguments:
    """Draw joint positions [rad, m] and a speed [%]."""
    span = (1.4, 1.4, 0.0, 1.2)
    pose = [
        round(rng.uniform(-s, s), 3) if s else round(rng.uniform(-0.17, -0.02), 3) for s in span
    ]
    return (*pose, rng.choice((5.0, 15.0, 30.0, 60.0, 100.0)))


def _point(rng: Random) -> Arguments:
    """Draw a point [m], not always one that can be reached, and a speed [%]."""
    reach = rng.choice((0.35, 0.5, 0.6, 0.7))
    place = (reach, rng.uniform(-0.3, 0.3), rng.uniform(-0.03, 0.15))
    return (*(round(value, 3) for value in place), rng.choice((10.0, 30.0, 80.0)))


def _jog(rng: Random) -> Arguments:
    """Draw a joint, a part of its greatest speed with its sign, and how long [s]."""
    part = rng.choice((-0.9, -0.3, -0.1, 0.02, 0.1, 0.3, 1.0))
    return (rng.choice(JOINTS), part, round(rng.uniform(0.1, 1.0), 2))


def _page_jog(rng: Random) -> Arguments:
    """Draw a joint, a part of its speed that the page may ask for, mostly, and how long [s]."""
    name, _, seconds = _jog(rng)
    return (name, rng.choice((-0.1, 0.1, -0.03, 0.02, 0.3)), seconds)


def _program(rng: Random) -> Arguments:
    return (rng.choice(("2", "3")),)


def _percent(rng: Random) -> Arguments:
    return (rng.choice((1.0, 10.0, 40.0, 100.0)),)


def _halt(rng: Random) -> Arguments:
    return (rng.choice(NODES[:5] + NODES), round(rng.choice((0.05, 0.2, 0.5, 1.0)), 2))


def _kill(rng: Random) -> Arguments:
    return (rng.choice(KILLED), round(rng.uniform(0.0, 0.5), 2))


def _line(rng: Random) -> Arguments:
    seconds = round(rng.choice((0.02, 0.1, 0.3, 1.0)), 2)
    return (rng.choice(("modbus", "web")), rng.choice(("cut", "freeze", "refuse", "slow")), seconds)


def _clock(rng: Random) -> Arguments:
    return (rng.choice((-5000.0, -300.0, 50.0, 300.0, 5000.0)), round(rng.uniform(0.2, 1.5), 2))


def _stall(rng: Random) -> Arguments:
    return (rng.choice((0.05, 0.15, 0.3, 0.5)),)


MOTIONS = (
    Name("MOVE", "motion", _point),
    Name("MOVE_JOINTS", "motion", _pose),
    Name("HOME", "motion", _percent),
    Name("move_to", "motion", _point),
    Name("joint move", "motion", _pose),
    Name("pose target", "motion", _pose),
    Name("joint velocity", "motion", _jog),
    Name("joint position", "motion", _jog),
    Name("jog", "motion", _jog),
    Name("trajectory", "motion", _pose),
    Name("gateway MOVE", "motion", _point),
    Name("gateway move_to", "motion", _point),
    Name("gateway jog", "motion", _jog),
    Name("page jog", "motion", _page_jog),
    Name("pendant program", "motion", _program),
)
STOPS = (
    Name("STOP", "stop", _nothing),
    Name("ESTOP", "stop", _nothing),
    Name("PAUSE", "stop", _nothing),
    Name("gateway STOP", "stop", _nothing),
    Name("gateway PAUSE", "stop", _nothing),
    Name("page STOP", "stop", _nothing),
    Name("page ESTOP", "stop", _nothing),
    Name("twin's STOP", "other", _nothing),
    Name("twin's PAUSE", "other", _nothing),
    Name("pendant abort", "stop", _nothing),
    Name("press hold", "stop", _nothing),
    Name("press emergency stop", "stop", _nothing),
)
RELEASES = (
    Name("RESET", "release", _nothing),
    Name("RESET", "release", _nothing),
    Name("release buttons", "release", _nothing),
    Name("pendant reset", "release", _nothing),
    Name("twin's RESET", "release", _nothing),
    Name("ACKNOWLEDGE", "release", _nothing),
    Name("STOP", "stop", _nothing),
)
READY_S = 0.25
"""A node stands still so long after that is due: lines to it are opened before."""
THROUGH = {
    "gateway": ("gateway MOVE", "gateway move_to", "gateway jog"),
    "simulator": ("joint velocity", "joint position"),
    "joint_pose_controller": ("MOVE", "MOVE_JOINTS", "move_to", "joint move", "pose target"),
    "twin_controller": ("MOVE", "MOVE_JOINTS", "HOME"),
    "motion_server": ("move_to", "gateway move_to"),
    "joint_vel_controller": ("jog", "gateway jog", "page jog"),
    "trajectory_server": ("trajectory",),
    "operator_panel": ("page jog",),
}
"""What waits in a node while it stands still, so that a STOP can overtake it there."""
DEAF = (
    "move_to",
    "joint move",
    "pose target",
    "joint velocity",
    "joint position",
    "jog",
    "trajectory",
    "gateway move_to",
    "gateway jog",
)
"""What a program may send again and again that never hears of a stop."""
BEGINS = (
    "MOVE",
    "MOVE_JOINTS",
    "HOME",
    "RESUME",
    "gateway MOVE",
    "twin's RESUME",
    "pendant program",
    "pendant resume",
)
"""By these a person begins a motion of a pair that was stopped; ALIGN lets others lead again."""
WHOLE = ("STOP", "ESTOP", "PAUSE", "gateway STOP", "gateway PAUSE", "page STOP", "page ESTOP")
"""Stops of the pair, given to the twin controller."""
LEADS_ON = (
    Name("ALIGN", "release", _nothing),
    Name("RESUME", "motion", _nothing),
    Name("pendant resume", "motion", _nothing),
    Name("twin's RESUME", "motion", _nothing),
    Name("RESET", "release", _nothing),
)
WAY_BACK = (
    Name("release buttons", "release", _nothing),
    Name("RESET", "release", _nothing),
    Name("ALIGN", "release", _nothing),
)
"""What an operator does before the pair shall move again."""
OTHERS = (
    Name("SPEED", "other", _percent),
    Name("pendant override", "other", _percent),
    Name("ACKNOWLEDGE", "release", _nothing),
)
STRIKES = (
    Name("halt", "strike", _halt),
    Name("halt", "strike", _halt),
    Name("kill", "strike", _kill),
    Name("line", "strike", _line),
    Name("line", "strike", _line),
    Name("clock", "strike", _clock),
    Name("stall", "strike", _stall),
)
EVERY = (*MOTIONS, *STOPS, *RELEASES, *LEADS_ON, *OTHERS)
KINDS = {name.text: name.kind for name in EVERY}
"""What a deed may do: see :class:`harness.storm.rules.history.Deed`."""


def arguments(rng: Random, name: str, seconds: float) -> Arguments:
    """Draw what a deed is given; one that is repeated lasts ``seconds``."""
    drawn = next(each for each in EVERY if each.text == name).draw(rng)
    return (*drawn[:-1], seconds) if drawn and drawn[0] in JOINTS else drawn
