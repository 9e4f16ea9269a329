"""The robot profile of robot.yaml: joints, limits, lengths, screw axes, stopping; in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec
from msgspec import Meta

from scara_config.lengths import (
    AGREE,
    SHORTEST_REACH,
    place_of,
    slid,
    stretched,
    with_lengths,
)
from scara_config.loader import ConfigError, load
from scara_config.profile import description_path, locate
from scara_config.quantities import (
    AngleDeg,
    CoordinateM,
    CoordinateMm,
    JointAcceleration,
    JointEffort,
    JointJerk,
    JointSpeed,
    LengthMm,
)
from scara_config.stopping import Stopping

UNIT_TOLERANCE = 1e-3
"""Our choice: directions are written with so many digits."""
Millimetres3 = tuple[CoordinateMm, CoordinateMm, CoordinateMm]
Row4 = tuple[CoordinateM, CoordinateM, CoordinateM, CoordinateM]
Twist = tuple[CoordinateM, CoordinateM, CoordinateM, CoordinateM, CoordinateM, CoordinateM]


class _JointFields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: str
    axis_number: Annotated[int, Meta(ge=1, le=9)]
    twin: bool
    screw_axis: Twist | None
    effort: JointEffort


class RevoluteJoint(
    _JointFields,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag="revolute",
):
    """A joint that turns: [rad] inside, degrees at the borders."""

    lower_deg: AngleDeg
    upper_deg: AngleDeg
    velocity_deg_s: JointSpeed
    acceleration_deg_s2: JointAcceleration
    jerk_deg_s3: JointJerk
    unit: ClassVar[str] = "deg"
    scale: ClassVar[float] = math.pi / 180.0
    si_unit: ClassVar[str] = "rad"

    @property
    def lower(self) -> float:
        """Lower limit [rad]."""
        return self.lower_deg * self.scale

    @property
    def upper(self) -> float:
        """Upper limit [rad]."""
        return self.upper_deg * self.scale

    @property
    def velocity(self) -> float:
        """Largest speed [rad/s]."""
        return self.velocity_deg_s * self.scale

    @property
    def acceleration(self) -> float:
        """Largest acceleration of the twin's motion [rad/s^2]."""
        return self.acceleration_deg_s2 * self.scale

    @property
    def jerk(self) -> float:
        """Largest jerk of the twin's motion [rad/s^3]."""
        return self.jerk_deg_s3 * self.scale


class PrismaticJoint(
    _JointFields,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag="prismatic",
):
    """A joint that slides: [m] inside, millimetres at the borders."""

    lower_mm: CoordinateMm
    upper_mm: CoordinateMm
    velocity_mm_s: JointSpeed
    acceleration_mm_s2: JointAcceleration
    jerk_mm_s3: JointJerk
    unit: ClassVar[str] = "mm"
    scale: ClassVar[float] = 1e-3
    si_unit: ClassVar[str] = "m"

    @property
    def lower(self) -> float:
        """Lower limit [m]."""
        return self.lower_mm * self.scale

    @property
    def upper(self) -> float:
        """Upper limit [m]."""
        return self.upper_mm * self.scale

    @property
    def velocity(self) -> float:
        """Largest speed [m/s]."""
        return self.velocity_mm_s * self.scale

    @property
    def acceleration(self) -> float:
        """Largest acceleration of the twin's motion [m/s^2]."""
        return self.acceleration_mm_s2 * self.scale

    @property
    def jerk(self) -> float:
        """Largest jerk of the twin's motion [m/s^3]."""
        return self.jerk_mm_s3 * self.scale


Joint = RevoluteJoint | PrismaticJoint


class Geometry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lengths of the closed-form kinematics."""

    l1_mm: LengthMm
    l2_mm: LengthMm
    h_mm: CoordinateMm


class KeepOut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box in the base frame that no part of the arm may enter."""

    name: str
    lower_mm: Millimetres3
    upper_mm: Millimetres3


LEAD_IS_FALSE = "robot.yaml: lead is false"
"""So begins why the robot hears nothing at all, no stop either."""


class Robot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The robot of robot.yaml."""

    name: str
    urdf: str
    base_frame: str
    tool_frame: str
    reach_mm: LengthMm
    home_pose: tuple[Row4, Row4, Row4, Row4]
    joints: list[Joint]
    home: dict[str, CoordinateMm]
    positions_m: dict[str, tuple[CoordinateM, CoordinateM, CoordinateM]]
    stopping: Stopping
    keep_out: list[KeepOut] = []
    geometry: Geometry | None = None
    lead: bool = True
    """False: it is only followed, and nothing is ever written to it."""

    def only_followed(self, address: str) -> str:
        """Return why the robot at ``address`` is never led, and what to do; empty: it may be."""
        if not self.lead:
            return f"{LEAD_IS_FALSE}: nothing is ever written to the robot"
        return self.stopping.only_followed(address, self.name)

    @property
    def description(self) -> Path:
        """Where the URDF of this robot's cell is.

        Raises:
            ConfigError: It is not there.
        """
        return description_path(self.urdf)

    @property
    def home_positions(self) -> list[float]:
        """Home of the twin's joints, in file order [rad] or [m]."""
        return [self.home[joint.name] * joint.scale for joint in self.twin_joints]

    @property
    def twin_joints(self) -> list[Joint]:
        """The joints that the twin moves, in file order."""
        return [joint for joint in self.joints if joint.twin]

    @property
    def arm_joints(self) -> list[Joint]:
        """The twin's joints that move the tool, in file order."""
        return [joint for joint in self.twin_joints if joint.screw_axis is not None]

    @property
    def slides_mm(self) -> float:
        """How far the arm's sliding joints carry the tool at most."""
        arm = self.arm_joints
        limits = [(joint.lower, joint.upper) for joint in arm]
        return 1e3 * slid([joint.screw_axis or () for joint in arm], limits)

    def joint(self, name: str) -> Joint:
        """Return the joint called ``name``.

        Raises:
            ConfigError: There is none; the text lists those that exist.
        """
        for joint in self.joints:
            if joint.name == name:
                return joint
        raise ConfigError(
            f"unknown joint {name!r}: robot.yaml has {', '.join(j.name for j in self.joints)}"
        )


def load_robot(directory: Path | str | None = None) -> Robot:
    """Read robot.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a limit is inverted, a name or axis number occurs
            twice, a direction is none, lengths, axes, tool and reach contradict each other, home
            does not fit the twin's joints, a means of stopping was tried that it does not have.
    """
    path = locate("robot.yaml", directory)
    robot = load(path, Robot, with_lengths)
    if faults := [f"{path}: {fault}" for fault in robot_faults(robot)]:
        raise ConfigError("\n".join(faults))
    return robot


def robot_faults(robot: Robot) -> Iterator[str]:
    """Yield everything in which a profile contradicts itself: key, value, what is expected."""
    if not robot.arm_joints:
        yield "joints: no joint moves the tool: Expected one with twin: true and a screw_axis"
        return
    for joint in robot.joints:
        if not joint.lower < joint.upper:
            yield f"joints.{joint.name}: lower limit is not below the upper limit"
    for key, values in (
        ("name", [j.name for j in robot.joints]),
        ("axis_number", [str(j.axis_number) for j in robot.joints]),
    ):
        twice = sorted({value for value in values if values.count(value) > 1})
        if twice:
            second = len(values) - 1 - values[::-1].index(twice[0])
            yield f"joints[{second}].{key}: {key} {', '.join(twice)} occurs more than once"
    yield from _wrong_axes(robot)
    yield from _wrong_lengths(robot)
    yield from robot.stopping.faults()
    yield from _wrong_twin(robot)


def _wrong_axes(robot: Robot) -> Iterator[str]:
    """Yield directions that are no unit vectors: a comma that slipped shows there."""
    for joint in robot.joints:
        if joint.screw_axis is None:
            continue
        omega, v = joint.screw_axis[:3], joint.screw_axis[3:]
        turns = joint.unit == "deg"
        length = math.hypot(*(omega if turns else v))
        # What must be 0: a turning axis has no pitch, and one that slides turns nothing.
        rest = sum(a * b for a, b in zip(omega, v)) if turns else math.hypot(*omega)
        if abs(length - 1.0) > UNIT_TOLERANCE or abs(rest) > UNIT_TOLERANCE:
            what = "a unit omega, and v across it" if turns else "omega 0, a unit v"
            yield (f"joints.{joint.name}.screw_axis = {list(joint.screw_axis)}: Expected {what}")
    turn = [row[:3] for row in robot.home_pose[:3]]
    products = [[sum(a * b for a, b in zip(one, two)) for two in turn] for one in turn]
    straight = all(
        abs(product - (i == k)) <= UNIT_TOLERANCE
        for i, row in enumerate(products)
        for k, product in enumerate(row)
    )
    if not straight or robot.home_pose[3] != (0.0, 0.0, 0.0, 1.0):
        yield "home_pose: Expected a rotation, a place, and 0 0 0 1 below"


def _wrong_lengths(robot: Robot) -> Iterator[str]:
    """Yield axes, tool or reach that are not what follows from the lengths."""
    arm, size = robot.arm_joints, robot.geometry
    turning = [joint for joint in arm if joint.unit == "deg"]
    if size is not None and len(turning) < 2:
        yield "geometry: Expected two turning joints of the arm, or no geometry"
        return
    if size is None:
        axes = [joint.screw_axis or () for joint in arm]
        longest = 1e3 * stretched(axes, [row[3] for row in robot.home_pose[:3]])
        least, longest = SHORTEST_REACH * longest, longest + robot.slides_mm
        what = f"{least:g} to {longest:g}"
    else:
        yield from _wrong_places(robot, size, turning)
        least = longest = size.l1_mm + size.l2_mm
        what = f"{longest:g} = l1_mm + l2_mm"
    if not least - 1e3 * AGREE <= robot.reach_mm <= longest + 1e3 * AGREE:
        yield f"reach_mm = {robot.reach_mm:g}: Expected {what}"


def _wrong_places(robot: Robot, size: Geometry, turning: list[Joint]) -> Iterator[str]:
    """Yield what a SCARA's axes and tool are apart, and its height, where its lengths differ.

    Only distances count: a maker may count the other way round, and stand elsewhere.
    """
    tip = ("home_pose", (robot.home_pose[0][3], robot.home_pose[1][3]))
    axes = [(f"joints.{j.name}.screw_axis", place_of(j.screw_axis)) for j in turning]
    # Two lengths: from the first turning joint to the second, and on to the next or the tool.
    places = [*axes, tip][:3]
    for (_, begin), (what, end), key in zip(places, places[1:], ("l1_mm", "l2_mm")):
        found, wanted = 1e3 * math.dist(begin, end), getattr(size, key)
        if abs(found - wanted) > 1e3 * AGREE:
            yield (
                f"{what}: {found:g} mm from the axis before: Expected geometry.{key} = {wanted:g}, "
                f"or no {what.rpartition('.')[2]}"
            )
    height = 1e3 * robot.home_pose[2][3]
    if abs(height - size.h_mm) > 1e3 * AGREE:
        yield (
            f"home_pose: the tool at z = {height:g} mm: Expected geometry.h_mm = {size.h_mm:g}, "
            "or no home_pose"
        )


def _wrong_twin(robot: Robot) -> Iterator[str]:
    """Yield a home that does not fit the twin's joints, and zones that are no boxes."""
    joints = {joint.name: joint for joint in robot.twin_joints}
    for name in sorted(set(joints) ^ set(robot.home)):
        what = (
            "is missing"
            if name in joints
            else f"is no joint of the twin; it has {', '.join(joints)}"
        )
        yield f"home.{name}: {what}"
    for name, value in robot.home.items():
        if name not in joints:
            continue
        joint = joints[name]
        if not joint.lower <= value * joint.scale <= joint.upper:
            low, high = joint.lower / joint.scale, joint.upper / joint.scale
            yield f"home.{name} = {value:g}: Expected {low:g} to {high:g} {joint.unit}"
    for zone in robot.keep_out:
        if not all(low < high for low, high in zip(zone.lower_mm, zone.upper_mm)):
            yield f"keep_out.{zone.name}: lower_mm is not below upper_mm"
