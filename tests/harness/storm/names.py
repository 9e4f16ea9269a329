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


def _named(kind: str, draw: Callable[[Random], Arguments], *texts: str) -> tuple[Name, ...]:
    return tuple(Name(text, kind, draw) for text in texts)


MOTIONS = (
    *_named("motion", _point, "MOVE"),
    *_named("motion", _pose, "MOVE_JOINTS"),
    *_named("motion", _percent, "HOME"),
    *_named("motion", _point, "move_to"),
    *_named("motion", _pose, "joint move", "pose target"),
    *_named("motion", _jog, "joint velocity", "joint position", "jog"),
    *_named("motion", _pose, "trajectory"),
    *_named("motion", _point, "gateway MOVE", "gateway move_to"),
    *_named("motion", _jog, "gateway jog"),
    *_named("motion", _page_jog, "page jog"),
    *_named("motion", _program, "pendant program"),
)
WHOLE = ("STOP", "ESTOP", "PAUSE", "gateway STOP", "gateway PAUSE", "page STOP", "page ESTOP")
"""Stops of the pair, given to the twin controller."""
STOPS = (
    *_named("stop", _nothing, *WHOLE),
    *_named("other", _nothing, "twin's STOP", "twin's PAUSE"),
    *_named("stop", _nothing, "pendant abort", "press hold", "press emergency stop"),
)
RELEASES = (
    *_named("release", _nothing, "RESET", "RESET", "release buttons", "pendant reset"),
    *_named("release", _nothing, "twin's RESET", "ACKNOWLEDGE"),
    *_named("stop", _nothing, "STOP"),
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
LEADS_ON = (
    *_named("release", _nothing, "ALIGN"),
    *_named("motion", _nothing, "RESUME", "pendant resume", "twin's RESUME"),
    *_named("release", _nothing, "RESET"),
)
WAY_BACK = (
    *_named("release", _nothing, "release buttons", "RESET"),
    *_named("stop", _nothing, "STOP"),
    *_named("release", _nothing, "ALIGN"),
)
"""What an operator does before the pair shall move again; only STOP leaves a pause."""
OTHERS = (
    *_named("other", _percent, "SPEED", "pendant override"),
    *_named("release", _nothing, "ACKNOWLEDGE"),
)
STRIKES = (
    *_named("strike", _halt, "halt", "halt"),
    *_named("strike", _kill, "kill"),
    *_named("strike", _line, "line", "line"),
    *_named("strike", _clock, "clock"),
    *_named("strike", _stall, "stall"),
)
EVERY = (*MOTIONS, *STOPS, *RELEASES, *LEADS_ON, *OTHERS)
KINDS = {name.text: name.kind for name in EVERY}
"""What a deed may do: see :class:`harness.storm.rules.history.Deed`."""


def arguments(rng: Random, name: str, seconds: float) -> Arguments:
    """Draw what a deed is given; one that is repeated lasts ``seconds``."""
    drawn = next(each for each in EVERY if each.text == name).draw(rng)
    return (*drawn[:-1], seconds) if drawn and drawn[0] in JOINTS else drawn
