"""Where an arm begins and what it visits, found by its own limits, body and kinematics.

Home is the most agile of many poses in which the arm is clear of its zone, halfway out. The set
positions stand beside it as those of the article do, as far as the arm gets there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from scara_config import ConfigError, Joint, KeepOut, Robot
from scara_control.errors import ScaraControlError
from scara_control.keep_out.points import WatchedPoint, all_positions, watched_points
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ToolKinematics, tool_kinematics
from scara_control.kinematics.twists import FloatArray

from robot_doctor.free_space import CLEAR_MM, FreeSpace
from scara_description.urdf import Model, Shape, link_pose, origin_transform

POSES = 2000
"""That fill the joint space evenly."""
TRIED = 25
"""So many of the best free poses may be home."""
WITHIN = 0.8
"""Part of each joint's range in which home is looked for, and turns of more than half a round are
not; the rest is room for moves."""
ROOM = 0.02
"""Part of a joint's range that a set position stays away from its ends."""
NEAREST, HALFWAY, FARTHEST = 0.3, 0.6, 0.85
"""Of the reach: how far home is from the first axis."""
BESIDE = {"P2": (-0.12, 0.25, 0.06), "P3": (-0.12, -0.25, 0.1)}
"""Of P1, in parts of the reach: outwards from the first axis, to its left, upwards."""
SHRUNK = (1.0, 0.7, 0.5, 0.35, 0.2)
FAR = 2.0
"""How far the zone below reaches, in parts of the reach."""


class FoundPlaces(NamedTuple):
    """Home, positions and programs of an arm.

    Attributes:
        home: By the joint's name, in deg and mm.
        positions: Set positions in the base frame [m].
        two_points: Joint values of two other places, in deg and mm.
    """

    home: Mapping[str, float]
    positions: Mapping[str, tuple[float, float, float]]
    two_points: Mapping[str, Mapping[str, float]]


def floor_below(robot: Robot, model: Model) -> KeepOut:
    """Return the zone below the arm: up to the underside of its foot.

    Args:
        robot: The profile, without zones.
        model: Its URDF with the shapes that collide.
    """
    foot = [joint.child for joint in model.chain(robot.tool_frame)]
    lows = [
        _underside(link_pose(model, link, {}) @ origin_transform(shape.xyz, shape.rpy), shape)
        for link in (model.root, *foot)
        for shape in model.shapes[link]
        if not any(joint.moves for joint in model.chain(link))
    ]
    # What hangs near the foot cannot stand higher: a tenth of the poses has to be clear.
    clear = np.quantile(_undersides(watched_points(robot), _poses(robot)[1]).min(axis=0), 0.9)
    lows.append(float(clear) - 2e-3 * CLEAR_MM)
    # A rail carries the arm beyond its reach.
    top, side = math.floor(1e3 * min(lows)), math.ceil(FAR * robot.reach_mm + robot.slides_mm)
    return KeepOut("floor", (-side, -side, top - side), (side, side, top))


def find_places(robot: Robot, space: FreeSpace) -> FoundPlaces:
    """Find home, set positions and two more places.

    Args:
        robot: The profile with its zone; its home and positions are not looked at.
        space: Its zone and bodies.

    Raises:
        ConfigError: The arm has no pose, or no places, that are as they must be.
    """
    homes = list(itertools.islice(_homes(robot, space), TRIED))
    for shrink, home in itertools.product(SHRUNK, homes):
        arm = msgspec.structs.replace(robot, home=home)
        places = _places(arm, shrink)
        if corners := _corners(arm, space, places):
            return FoundPlaces(home, places, _two_points(arm, space, corners))
    known = ", ".join(joint.name for joint in robot.arm_joints)
    raise ConfigError(
        f"{robot.urdf}: {len(robot.arm_joints)} joints ({known}) find no home from which the tool "
        "gets to three places above the floor: give the arm more range, or another --tool"
    )


def _underside(pose: FloatArray, shape: Shape) -> float:
    """Return the height of the underside of the box around a shape [m]."""
    radius, length = shape.size[0], shape.size[-1]
    round_one = (2 * radius, 2 * radius, length if shape.kind == "cylinder" else 2 * radius)
    edges = shape.size if shape.kind == "box" else round_one
    return float(pose[2, 3] - 0.5 * np.abs(pose[2, :3]) @ np.array(edges))


def _homes(robot: Robot, space: FreeSpace) -> Iterator[dict[str, float]]:
    """Yield poses of the arm that are free in deg and mm, the most agile first."""
    chain, reach = ScrewModel.from_robot(robot), 1e-3 * robot.reach_mm
    poses, rows = _poses(robot)
    floor = max((1e-3 * zone.upper_mm[2] for zone in robot.keep_out), default=-math.inf)
    clear = _undersides(space.points, rows).min(axis=0) > floor + 1e-3 * CLEAR_MM
    ranked = []
    for k in np.flatnonzero(clear).tolist():
        out = float(np.linalg.norm(forward_kinematics(chain, poses[k])[:2, 3] - _foot(chain)))
        if NEAREST <= out / reach <= FARTHEST:
            # Folded it would be as agile, and in its own way.
            near = min(1.0, out / (HALFWAY * reach))
            ranked.append((-near * _agility(chain, poses[k], reach), k))
    for _, k in sorted(ranked):
        if space.touches_nothing(rows[k : k + 1]):
            shown = zip(robot.twin_joints, rows[k].tolist())
            yield {joint.name: _rounded(joint, q) for joint, q in shown}


def _poses(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return poses of the arm's joints, and of all joints of the twin: shapes (POSES, n)."""
    # Half a second, which the doctor's other questions need not wait for.
    from scipy.stats import qmc

    joints = robot.arm_joints
    low, high = (np.array([getattr(joint, key) for joint in joints]) for key in ("lower", "upper"))
    turns = np.array([joint.si_unit == "rad" for joint in joints])
    middle, half = 0.5 * (low + high), 0.5 * WITHIN * (high - low)
    low, high = middle - half, middle + half
    low, high = (np.where(turns, np.clip(x, -math.pi, math.pi), x) for x in (low, high))
    # Not scrambled: the same URDF gives the same robot each time.
    poses = low + qmc.Halton(len(joints), scramble=False).random(POSES) * (high - low)
    # The foot looks ahead: where the arm stands about its first axis is nobody's choice.
    if turns[0] and low[0] < 0.0 < high[0]:
        poses[:, 0] = 0.0
    # What moves no tool stands at 0, or as near to it as it can.
    still = [min(max(0.0, joint.lower), joint.upper) for joint in robot.twin_joints]
    rows = np.tile(still, (POSES, 1))
    rows[:, [robot.twin_joints.index(joint) for joint in joints]] = poses
    return poses, rows


def _undersides(points: Sequence[WatchedPoint], rows: FloatArray) -> FloatArray:
    """Return how low each watched point's box is in each pose [m], shape (points, poses)."""
    half = np.array([point.half[2] for point in points])
    found: FloatArray = all_positions(points, rows)[:, :, 2] - half[:, None]
    return found


def _foot(chain: ScrewModel) -> FloatArray:
    """Return where the first upright axis stands, x and y [m]."""
    for screw in chain.screw_axes.T:
        if abs(screw[2]) > 0.5:
            place: FloatArray = np.cross(screw[:3], screw[3:])[:2]
            return place
    return np.zeros(2)


def _agility(chain: ScrewModel, q: FloatArray, reach: float) -> float:
    """Return the smallest singular value of the Jacobian, lengths in parts of the reach."""
    jacobian = tip_jacobian(chain, q)
    jacobian[3:] /= reach
    rows = jacobian if chain.joint_count >= 6 else jacobian[3:]
    return float(np.linalg.svd(rows, compute_uv=False)[-1])


def _places(robot: Robot, shrink: float) -> dict[str, tuple[float, float, float]]:
    """Return the set positions from home, whole millimetres."""
    chain = ScrewModel.from_robot(robot)
    q = [robot.home[joint.name] * joint.scale for joint in robot.arm_joints]
    tip, foot = forward_kinematics(chain, q)[:3, 3], _foot(chain)
    out = (tip[:2] - foot) / np.linalg.norm(tip[:2] - foot)
    found = {"P1": tip}
    for name, (outwards, left, up) in BESIDE.items():
        # To the left is outwards turned by a quarter about z.
        x, y = outwards * out + left * np.array([-out[1], out[0]])
        found[name] = tip + shrink * 1e-3 * robot.reach_mm * np.array([x, y, up])
    return {
        # Adding 0.0 keeps -0.0 out of the file.
        name: (round(float(x), 3) + 0.0, round(float(y), 3) + 0.0, round(float(z), 3) + 0.0)
        for name, (x, y, z) in found.items()
    }


def _corners(
    robot: Robot, space: FreeSpace, places: Mapping[str, Sequence[float]]
) -> list[tuple[float, ...]]:
    """Return joint positions at home and at all places, each way between them clear of the zones.

    None, if the arm does not get to one of them.
    """
    try:
        # From home alone: a place that only another start leads to is no neighbour of home, and an
        # arm that gets to none would be asked for minutes.
        tool = tool_kinematics(robot, starts=0)
        corners = [
            tuple(robot.home_positions),
            *(_solved(robot, tool, place) for place in places.values()),
        ]
    except ScaraControlError:
        return []
    inside = all(
        joint.lower + ROOM * (joint.upper - joint.lower)
        <= value
        <= joint.upper - ROOM * (joint.upper - joint.lower)
        for corner in corners
        for joint, value in zip(robot.twin_joints, corner)
        if joint.screw_axis is not None
    )
    free = inside and all(space.has_way(*way) for way in itertools.combinations(corners, 2))
    return corners if free else []


def _solved(robot: Robot, tool: ToolKinematics, place: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions of the twin for a place, near home."""
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    x, y, z = place
    q = dict(zip(tool.joints, tool.inverse(x, y, z, tool.elbow(seed), seed).chosen.q))
    return tuple(q.get(joint, robot.home[joint.name] * joint.scale) for joint in robot.twin_joints)


def _two_points(
    robot: Robot, space: FreeSpace, corners: Sequence[tuple[float, ...]]
) -> dict[str, dict[str, float]]:
    """Return joint values of two places on either side of home, else of P2 and P3, in deg, mm."""
    home = corners[0]
    for part in (0.3, 0.2, 0.1, 0.05):
        ends: list[tuple[float, ...]] = []
        for sign in (-1.0, 1.0):
            signs = itertools.cycle((sign, sign, -sign))
            ends.append(
                tuple(
                    q + part * (joint.upper - q if s > 0.0 else q - joint.lower) * s
                    for joint, q, s in zip(robot.twin_joints, home, signs)
                )
            )
        if all(space.has_way(*way) for way in itertools.combinations((home, *ends), 2)):
            break
    else:
        ends = list(corners[-2:])
    return {
        name: {j.name: _rounded(j, q) for j, q in zip(robot.twin_joints, end)}
        for name, end in zip("AB", ends)
    }


def _rounded(joint: Joint, q: float) -> float:
    """Return a joint position in deg or mm with two decimals, within the joint's range."""
    value = round(q / joint.scale, 2) + 0.0
    # Rounding may have put it a hundredth outside.
    inwards = (value * joint.scale < joint.lower) - (value * joint.scale > joint.upper)
    return round(value + 0.01 * inwards, 2)
