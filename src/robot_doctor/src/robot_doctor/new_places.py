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
from numpy.typing import NDArray
from scara_config import ConfigError, KeepOut, Robot
from scara_control.errors import ScaraControlError
from scara_control.keep_out.points import WatchedPoint, all_positions, watched_points
from scara_control.keep_out.zones import judge_way
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ToolKinematics, tool_kinematics
from scara_control.kinematics.twists import FloatArray

from scara_description.urdf import Model, link_pose, origin_transform

POSES = 2000
TRIED = 25
"""So many of the best poses may be home."""
WITHIN = 0.8
"""Part of each joint's range in which home is looked for, and turns of more than half a round are
not; the rest is room for moves."""
ROOM = 0.02
"""Part of a joint's range that a set position stays away from its ends."""
NEAREST, HALFWAY, FARTHEST = 0.3, 0.6, 0.85
"""Of the reach: how far home is from the first axis."""
CLEAR_MM = 20.0
"""How far the ways stay away from the zone; the twin controller refuses those nearer than 5 mm."""
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
    chain = [model.root, *(joint.child for joint in model.chain(robot.tool_frame))]
    lows = [middle[2] - half[2] for middle, half in _standing(model, chain)]
    # What hangs near the foot cannot stand higher: a tenth of the poses has to be clear.
    clear = np.quantile(_undersides(watched_points(robot), _poses(robot)[1]).min(axis=0), 0.9)
    lows.append(float(clear) - 2e-3 * CLEAR_MM)
    top, side = math.floor(1e3 * min(lows)), math.ceil(FAR * robot.reach_mm)
    return KeepOut("floor", (-side, -side, top - side), (side, side, top))


def around(robot: Robot, model: Model) -> list[KeepOut]:
    """Return boxes around what stands beside the arm, as zones in the base frame.

    Args:
        robot: The profile.
        model: Its URDF with the shapes that collide.
    """
    chain = [model.root, *(joint.child for joint in model.chain(robot.tool_frame))]
    beside = [link for link in model.shapes if link not in chain]
    return [
        KeepOut("around", _triple(1e3 * (middle - half)), _triple(1e3 * (middle + half)))
        for middle, half in _standing(model, beside, False)
    ]


def _standing(
    model: Model, links: Sequence[str], still: bool = True
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield middle and half edges [m] of a box around each shape, with all joints at 0.

    Args:
        model: A URDF with its shapes.
        links: Whose shapes.
        still: Only those that no joint moves.
    """
    for link in links:
        pose = link_pose(model, link, {})
        for shape in () if still and _moved(model, link) else model.shapes[link]:
            size = np.array(shape.size)
            if shape.kind != "box":
                size = np.array([2 * size[0], 2 * size[0], size[-1] * (1 + (len(size) == 1))])
            place = pose @ origin_transform(shape.xyz, shape.rpy)
            yield place[:3, 3], 0.5 * np.abs(place[:3, :3]) @ size


def _moved(model: Model, link: str) -> bool:
    return any(joint.moves for joint in model.chain(link))


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def find_places(robot: Robot) -> FoundPlaces:
    """Find home, set positions and two more places.

    Args:
        robot: The profile with all boxes as zones that the arm shall not be in; its home and
            positions are not looked at.

    Raises:
        ConfigError: The arm has no pose, or no places, that are as they must be.
    """
    points = watched_points(robot)
    homes = list(_homes(robot, points))
    for shrink, home in itertools.product(SHRUNK, homes):
        arm = msgspec.structs.replace(robot, home=home)
        begin, places = tuple(arm.home_positions), _places(arm, shrink)
        if _ways(arm, points, places, begin):
            return FoundPlaces(home, places, _two_points(arm, points, begin))
    known = ", ".join(joint.name for joint in robot.arm_joints)
    raise ConfigError(
        f"{robot.urdf}: {len(robot.arm_joints)} joints ({known}) find no home from which the tool "
        "gets to three places above the floor: give the arm more range, or another --tool"
    )


def _homes(robot: Robot, points: Sequence[WatchedPoint]) -> Iterator[dict[str, float]]:
    """Yield poses of the arm that are clear of the zones in deg and mm, the most agile first."""
    chain, reach = ScrewModel.from_robot(robot), 1e-3 * robot.reach_mm
    poses, rows = _poses(robot)
    ranked = []
    for q in poses[_clear(robot, points, rows)]:
        out = float(np.linalg.norm(forward_kinematics(chain, q)[:2, 3] - _foot(chain)))
        if NEAREST <= out / reach <= FARTHEST:
            # Folded it would be as agile, and in its own way.
            ranked.append(
                (-min(1.0, out / (HALFWAY * reach)) * _agility(chain, q, reach), q.tolist())
            )
    for _, q in sorted(ranked)[:TRIED]:
        home = {joint.name: 0.0 for joint in robot.twin_joints}
        yield home | {j.name: round(x / j.scale, 2) + 0.0 for j, x in zip(robot.arm_joints, q)}


def _clear(robot: Robot, points: Sequence[WatchedPoint], rows: FloatArray) -> NDArray[np.bool_]:
    """Return for each pose whether all watched points' boxes are clear of all zones."""
    places = all_positions(points, rows)
    half = np.array([point.half for point in points])[:, None] + 1e-3 * CLEAR_MM
    clear = np.ones(len(rows), dtype=bool)
    for zone in robot.keep_out:
        low, high = 1e-3 * np.array(zone.lower_mm), 1e-3 * np.array(zone.upper_mm)
        clear &= ~((places + half > low) & (places - half < high)).all(axis=2).any(axis=0)
    return clear


def _poses(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return poses of the arm's joints, and of all joints of the twin: shapes (POSES, n)."""
    from scipy.stats import (
        qmc,
    )  # half a second, which the doctor's other questions need not wait for

    joints = robot.arm_joints
    low, high = (np.array([getattr(joint, key) for joint in joints]) for key in ("lower", "upper"))
    turns = np.array([joint.si_unit == "rad" for joint in joints])
    middle, half = 0.5 * (low + high), 0.5 * WITHIN * (high - low)
    low, high = middle - half, middle + half
    low, high = (np.where(turns, np.clip(x, -math.pi, math.pi), x) for x in (low, high))
    poses = low + qmc.Halton(len(joints), scramble=False).random(POSES) * (high - low)
    # The foot looks ahead: where the arm stands about its first axis is nobody's choice.
    if turns[0] and low[0] < 0.0 < high[0]:
        poses[:, 0] = 0.0
    rows = np.zeros((POSES, len(robot.twin_joints)))
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
        x, y = outwards * out + left * np.array([-out[1], out[0]])
        found[name] = tip + shrink * 1e-3 * robot.reach_mm * np.array([x, y, up])
    return {
        name: (round(float(x), 3) + 0.0, round(float(y), 3) + 0.0, round(float(z), 3) + 0.0)
        for name, (x, y, z) in found.items()
    }


def _ways(
    robot: Robot,
    points: Sequence[WatchedPoint],
    places: Mapping[str, Sequence[float]],
    begin: tuple[float, ...],
) -> bool:
    """Return whether the arm gets to all places, and from one to the next, clear of the zones."""
    try:
        tool = tool_kinematics(robot)
        corners = [begin, *(_solved(robot, tool, place) for place in places.values())]
    except ScaraControlError:
        return False
    inside = all(
        joint.lower + ROOM * (joint.upper - joint.lower)
        <= value
        <= joint.upper - ROOM * (joint.upper - joint.lower)
        for corner in corners
        for joint, value in zip(robot.twin_joints, corner)
        if joint.screw_axis is not None
    )
    return inside and all(
        _is_free(robot, points, one, other) for one, other in itertools.combinations(corners, 2)
    )


def _solved(robot: Robot, tool: ToolKinematics, place: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions of the twin for a place, near home."""
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    x, y, z = place
    q = dict(zip(tool.joints, tool.inverse(x, y, z, tool.elbow(seed), seed).chosen.q))
    return tuple(q.get(joint, robot.home[joint.name] * joint.scale) for joint in robot.twin_joints)


def _is_free(
    robot: Robot, points: Sequence[WatchedPoint], one: tuple[float, ...], other: tuple[float, ...]
) -> bool:
    velocity = tuple(joint.velocity for joint in robot.twin_joints)
    return not judge_way(points, robot.keep_out, one, other, velocity, CLEAR_MM).violation


def _two_points(
    robot: Robot, points: Sequence[WatchedPoint], home: tuple[float, ...]
) -> dict[str, dict[str, float]]:
    """Return joint values of two places on either side of home, in deg and mm."""
    for part in (0.3, 0.2, 0.1, 0.05, 0.0):
        ends = []
        for sign in (-1.0, 1.0):
            signs = itertools.cycle((sign, sign, -sign))
            ends.append(
                tuple(
                    q + part * (joint.upper - q if s > 0.0 else q - joint.lower) * s
                    for joint, q, s in zip(robot.twin_joints, home, signs)
                )
            )
        if all(_is_free(robot, points, *way) for way in itertools.combinations((home, *ends), 2)):
            break
    return {
        name: {j.name: round(q / j.scale, 2) for j, q in zip(robot.twin_joints, end)}
        for name, end in zip("AB", ends)
    }
