"""The URDF of a robot from its profile.

It takes joints, screws and limits of robot.yaml, links and shapes of body.yaml.

All frames but the tool's lie along the base's with all joints at 0, so a joint's axis is that of
its screw as it is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from scara_config import ConfigError, Robot, load, locate
from scara_config.quantities import BodyCoordinate, BodySize

from scara_description.inertia import FloatArray, with_inertia
from scara_description.urdf import rpy_of

Triple = tuple[BodyCoordinate, BodyCoordinate, BodyCoordinate]
ZERO: Triple = (0.0, 0.0, 0.0)
COLOURS = {
    "black": "0.09 0.09 0.10 1",
    "dark": "0.22 0.23 0.25 1",
    "yellow": "0.98 0.76 0.05 1",
    "green": "0.10 0.62 0.24 1",
    "red": "0.83 0.12 0.11 1",
    "blue": "0.10 0.33 0.80 1",
    "steel": "0.72 0.74 0.77 1",
    "white": "0.93 0.93 0.91 1",
    "floor": "0.80 0.82 0.84 1",
}


class SolidShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box (edges) or a cylinder (radius, length; along z) in the link's frame.

    Seen and touched alike.
    """

    colour: str
    box_mm: tuple[BodySize, BodySize, BodySize] | None = None
    cylinder_mm: tuple[BodySize, BodySize] | None = None
    at_mm: Triple = ZERO
    rpy_deg: Triple = ZERO


class Link(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A body: where its frame is with all joints at 0, and what holds it.

    That is a joint of robot.yaml; without one nothing moves it.
    """

    name: str
    mass_kg: BodySize
    shapes: Annotated[list[SolidShape], Meta(min_length=1)]
    parent: str = ""
    joint: str = ""
    at_mm: Triple = ZERO
    damping: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.0
    friction: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.0


class BodyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file body.yaml."""

    links: Annotated[list[Link], Meta(min_length=1)]


def load_body(robot: Robot, directory: Path | str | None = None) -> BodyFile:
    """Read body.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a link hangs on nothing or on an unknown joint, a
            joint of the twin moves no link, a shape is neither box nor cylinder or has an unknown
            colour.
    """
    path = locate("body.yaml", directory)
    body = load(path, BodyFile)
    for problem in _problems(body, robot):
        raise ConfigError(f"{path}: {problem}")
    return body


def urdf_of(robot: Robot, body: BodyFile) -> str:
    """Return the URDF as text."""
    places = {link.name: np.array(link.at_mm) * 1e-3 for link in body.links}
    home = np.array(robot.home_pose, dtype=float)
    # Where the kinematics has it, whatever body.yaml says.
    places[robot.tool_frame] = home[:3, 3]
    lines = [
        '<?xml version="1.0"?>',
        "<!-- Written by write_urdf from robot.yaml and body.yaml: change those. -->",
    ]
    lines.append(f'<robot name="{robot.name}">')
    lines += [
        f'  <material name="{name}"><color rgba="{rgba}"/></material>'
        for name, rgba in COLOURS.items()
    ]
    for link in body.links:
        lines += _link(link)
        if link.parent:
            turn = home[:3, :3] if link.name == robot.tool_frame else np.eye(3)
            lines += _joint(link, robot, places[link.name] - places[link.parent], turn)
    for joint in robot.twin_joints:
        lines += transmission(joint.name)
    return with_inertia("\n".join([*lines, "</robot>", ""]))


def _problems(body: BodyFile, robot: Robot) -> Iterator[str]:
    known: set[str] = set()
    for number, link in enumerate(body.links):
        if (number == 0) != (link.parent == "") or (link.parent and link.parent not in known):
            yield (
                f"links[{number}].parent = {link.parent!r}: Expected a link above it, "
                "none for the first only"
            )
        if link.joint and link.joint not in [joint.name for joint in robot.twin_joints]:
            yield f"links[{number}].joint = {link.joint}: no joint of the twin"
        for shape in link.shapes:
            if (shape.box_mm is None) == (shape.cylinder_mm is None):
                yield f"links[{number}].shapes: each needs either box_mm or cylinder_mm"
            if shape.colour not in COLOURS:
                yield (
                    f"links[{number}].shapes.colour = {shape.colour}: Expected one of "
                    f"{', '.join(COLOURS)}"
                )
        known.add(link.name)
    moved = [link.joint for link in body.links if link.joint]
    if sorted(moved) != sorted(joint.name for joint in robot.twin_joints):
        yield (
            f"links: joints {', '.join(moved)}: Expected each of "
            f"{', '.join(j.name for j in robot.twin_joints)} once"
        )
    for frame in (robot.base_frame, robot.tool_frame):
        if frame not in known:
            yield f"links: there is no {frame}"


def _link(link: Link) -> list[str]:
    lines = [f'  <link name="{link.name}">']
    shapes = [
        (_origin(np.array(s.at_mm) * 1e-3, tuple(math.radians(v) for v in s.rpy_deg)), _solid(s), s)
        for s in link.shapes
    ]
    lines += [
        f'    <visual>{where}{what}<material name="{shape.colour}"/></visual>'
        for where, what, shape in shapes
    ]
    lines += [f"    <collision>{where}{what}</collision>" for where, what, _ in shapes]
    inertial = f'<mass value="{_number(link.mass_kg)}"/>'
    return [*lines, "    <inertial>", f"      {inertial}", "    </inertial>", "  </link>"]


def _solid(shape: SolidShape) -> str:
    if shape.box_mm is not None:
        return f'<geometry><box size="{_numbers(np.array(shape.box_mm) * 1e-3)}"/></geometry>'
    radius, length = shape.cylinder_mm or (0.0, 0.0)
    return (
        f'<geometry><cylinder radius="{_number(radius * 1e-3)}" '
        f'length="{_number(length * 1e-3)}"/></geometry>'
    )


def _joint(link: Link, robot: Robot, at: FloatArray, turn: FloatArray) -> list[str]:
    """Return the joint that holds a link."""
    joint = robot.joint(link.joint) if link.joint else None
    kind = "fixed" if joint is None else "prismatic" if joint.si_unit == "m" else "revolute"
    lines = [
        f'  <joint name="{link.joint or link.name + "_joint"}" type="{kind}">',
        f"    {_origin(at, rpy_of(turn))}",
    ]
    lines += [f'    <parent link="{link.parent}"/>', f'    <child link="{link.name}"/>']
    if joint is not None:
        # A joint that does not move the tool turns about z, or slides along it.
        screw = np.array(joint.screw_axis or (0.0, 0.0, 1.0, 0.0, 0.0, 1.0), dtype=float)
        axis = screw[3:] if joint.si_unit == "m" else screw[:3]
        lines.append(f'    <axis xyz="{_numbers(axis)}"/>')
        limits = (
            # repr keeps all digits: the limits are those of robot.yaml.
            f'lower="{joint.lower!r}" upper="{joint.upper!r}" '
            f'effort="{_number(joint.effort)}" velocity="{joint.velocity!r}"'
        )
        lines.append(f"    <limit {limits}/>")
        lines.append(
            f'    <dynamics damping="{_number(link.damping)}" friction="{_number(link.friction)}"/>'
        )
    return [*lines, "  </joint>"]


def transmission(name: str) -> list[str]:
    """Return the lines of a joint's motor, for Gazebo."""
    kind = "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>"
    return [
        f'  <transmission name="{name}_transmission">',
        "    <type>transmission_interface/SimpleTransmission</type>",
        f'    <joint name="{name}">{kind}</joint>',
        (
            "    <actuator "
            f'name="{name}_motor">{kind}<mechanicalReduction>1</mechanicalReduction></actuator>'
        ),
        "  </transmission>",
    ]


def _origin(at: FloatArray, rpy: tuple[float, ...]) -> str:
    return (
        f'<origin xyz="{_numbers(at)}" '
        f'rpy="{" ".join(repr(value) if value else "0" for value in rpy)}"/>'
    )


def _numbers(values: FloatArray) -> str:
    return " ".join(_number(float(value)) for value in values)


def _number(value: float) -> str:
    """Return a number with 12 digits, without rounding dust."""
    return f"{round(value, 12) + 0.0:.12g}"
