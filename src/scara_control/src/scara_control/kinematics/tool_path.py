r"""A line or an arc of the tool as a path of the joints.

The tool's place goes along the curve, and the tool turns evenly from how it is at the beginning to
how it is at the end, where it can; joints that do not move it go evenly, too. The inverse
kinematics is solved at points that are near each other. Between them the joints go by quintics
that have the curve's own first and second derivatives at both ends:

.. math:: q' = J^{-1} p', \qquad q'' = \frac{d}{ds} J(q(s))^{-1} p'(s)

with the way :math:`s` of the tool. The points are 10 mm apart, or so near that the tool is off its
curve by less than a micrometre between them: near a singularity the joints bend their ways sharply.
Where the most points do not bring it so near, the curve is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scara_config import Joint

from scara_control.errors import ScaraControlError
from scara_control.joint_motion import Vector
from scara_control.joint_track import JointTrack
from scara_control.kinematics.arm_kinematics import parse_elbow
from scara_control.kinematics.scara import Elbow, Triple
from scara_control.kinematics.tool import ToolKinematics
from scara_control.kinematics.twists import FloatArray
from scara_control.limits import check_limits

PATHS = ("joint", "linear", "circular")
"""What a message may ask for; empty: joint."""
STRIDE = 0.01
"""From one solved point to the next, at most [m] (our choice, see above)."""
FEWEST, MOST = 8, 400
"""Parts of a path (our choice)."""
OFF_M = 1e-6
"""The tool may be so far off its curve in the middle of a part, or the parts are halved (our
choice: a tenth of the robot's repeatability)."""
TURN_ARM = 0.3
"""A tool that turns in one place counts as going so far for each radian [m] (our choice: the length
of a link)."""
LOOKS = 4
"""Looks at each part for its limits and derivatives."""
_NO_WAY = 1e-7
"""A shorter way of the tool [m], and a smaller turn [rad], is none."""
MOST_PLACES = 16
"""A move passes so many places at most (our choice: a robot's stop waits for no longer plan)."""
_SAME = 1e-6
"""The path ends so near the target's joints [rad, m], or it ends in others."""
_STEP = 1e-6
"""Part of the way over which the second derivative is taken (our choice: so near the end that no
place beyond it counts as singular)."""


class ToolPathError(ScaraControlError):
    """The tool cannot go along the curve; the text says where and why."""


class Curve(NamedTuple):
    """Where the tool goes.

    Attributes:
        length: Of the way [m].
        at: Place after a way [m], shape (3,).
        tangent: Direction there, of length 1.
    """

    length: float
    at: Callable[[float], FloatArray]
    tangent: Callable[[float], FloatArray]


def line(begin: Triple, end: Triple) -> Curve:
    """Return the straight way between two places [m]."""
    first, whole = np.array(begin), np.array(end) - np.array(begin)
    length = float(np.linalg.norm(whole))
    direction = whole / length if length > _NO_WAY else np.zeros(3)
    return Curve(length, lambda s: first + s * direction, lambda s: direction)


def arc(begin: Triple, via: Triple, end: Triple) -> Curve:
    """Return the arc through three places [m], from the first past the second to the third.

    Raises:
        ToolPathError: Two of them are the same, or all three are in one line.
    """
    first = np.array(begin)
    a, b = np.array(via) - first, np.array(end) - first
    normal = np.cross(a, b)
    square = float(normal @ normal)
    # Seen from the first, the others are less than 0.1 mrad apart.
    if square <= 1e-8 * float(a @ a) * float(b @ b):
        raise ToolPathError("no arc: its three places are in one line, or two are the same")
    middle = first + np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * square)
    out = first - middle
    radius = float(np.linalg.norm(out))
    out /= radius
    across = np.cross(normal / math.sqrt(square), out)
    last = np.array(end) - middle
    angle = math.atan2(float(last @ across), float(last @ out)) % math.tau

    def at(s: float) -> FloatArray:
        turned = s / radius
        found: FloatArray = middle + radius * (math.cos(turned) * out + math.sin(turned) * across)
        return found

    def tangent(s: float) -> FloatArray:
        found: FloatArray = math.cos(s / radius) * across - math.sin(s / radius) * out
        return found

    return Curve(radius * angle, at, tangent)


@dataclass(frozen=True)
class MoveWay:
    """How a move goes where it leads.

    Attributes:
        path: One of :data:`PATHS`.
        via: Joint positions at the places that it passes on its way, all joints; an arc has one.
        speed_mm_s: Largest speed of the tool on a line or an arc [mm/s]; 0: as fast as the joints
            allow.
        corner_mm: The tool passes the places of a joint move or of lines no further away than this
            [mm]; 0: it stops at each.
    """

    path: str
    via: tuple[Vector, ...]
    speed_mm_s: float
    corner_mm: float

    @property
    def passed(self) -> tuple[Vector, ...]:
        """Places at which one leg ends and the next begins; that of an arc is on its one leg."""
        return self.via if self.path != "circular" else ()


def check_way(
    joints: Sequence[Joint],
    path: str,
    via: Sequence[float] = (),
    speed_mm_s: float = 0.0,
    corner_mm: float = 0.0,
) -> MoveWay | None:
    """Return the way of a move that a message asks for; None: straight to the joints' targets.

    Args:
        joints: The joints there are, in order.
        path: joint or empty, linear, circular.
        via: Joint positions, of all joints, one place after the other. See :class:`MoveWay`.
        speed_mm_s: Largest speed of the tool; 0: as the joints allow.
        corner_mm: How far from those places the tool may pass.

    Raises:
        ToolPathError: Another path, a number that has no meaning for it, or too many places.
        JointVectorError: ``via`` has a wrong count.
        JointLimitError: ... or is outside the limits.
    """
    path = path or "joint"
    if path not in PATHS:
        raise ToolPathError(f"path = {path!r}: expected one of {', '.join(PATHS)}, or empty")
    if not (math.isfinite(speed_mm_s) and speed_mm_s >= 0.0):
        raise ToolPathError(f"speed_mm_s = {speed_mm_s:g} is no speed (0: as the joints allow)")
    if path == "joint" and speed_mm_s:
        raise ToolPathError("speed_mm_s: a joint move has none, speed_percent counts")
    if not (math.isfinite(corner_mm) and corner_mm >= 0.0):
        raise ToolPathError(f"corner_mm = {corner_mm:g} is no distance (0: stop at each place)")
    n = len(joints)
    # A count that is no multiple is refused by the limits, in words with the joints.
    places = [tuple(check_limits(joints, via[k : k + n])) for k in range(0, len(via), n)]
    if path == "circular" and (len(places) != 1 or corner_mm):
        what = f"via has {len(places)}" if len(places) != 1 else f"corner_mm = {corner_mm:g}"
        raise ToolPathError(f"circular: an arc passes one place and has no corner: {what}")
    if len(places) > MOST_PLACES:
        raise ToolPathError(f"via has {len(places)} places: allowed are {MOST_PLACES}")
    if corner_mm and not places:
        raise ToolPathError("corner_mm: without places in via there is no corner")
    if path == "joint" and not places:
        return None
    return MoveWay(path, tuple(places), speed_mm_s, corner_mm)


def wanted_elbow(tool: ToolKinematics, text: str, path: str, seed: Sequence[float]) -> Elbow | None:
    """Return the elbow that a target shall have: the one named, or on a line the arm's own.

    Raises:
        ScaraControlError: No elbow is called ``text``.
    """
    if not text and path == "linear":
        return tool.elbow(seed)
    return parse_elbow(text)


@dataclass(frozen=True, eq=False)
class SolvedPath:
    """The solved path.

    Attributes:
        track: Joint positions by the way of the tool [m] in place of the time.
        rows: First, second and third derivatives by the way, shape (3, m, n), at many places of it.
        speed_mm_s: Largest speed of the tool that was asked for; 0: as the joints allow.
    """

    track: JointTrack
    rows: FloatArray
    speed_mm_s: float

    @property
    def corners(self) -> tuple[Vector, ...]:
        """Joint positions at the solved points, from the beginning to the end."""
        return self.track.positions


def solve_path(
    tool: ToolKinematics,
    joints: Sequence[Joint],
    begin: Sequence[float],
    target: Sequence[float],
    via: Sequence[float] = (),
    speed_mm_s: float = 0.0,
) -> SolvedPath | None:
    """Solve the joints' path for a line or an arc of the tool.

    Args:
        tool: Kinematics of those joints that move the tool.
        joints: All of the twin.
        begin: Their positions where it begins, shape (n,): [rad], prismatic [m].
        target: ... and where it ends. The tool has its place and turn there.
        via: Joint positions at a place that an arc passes, all joints; empty: a line.
        speed_mm_s: Largest speed of the tool [mm/s]; 0: as the joints allow.

    Returns:
        None if the tool stays where it is and as it is turned: any way of the joints will do.

    Raises:
        ToolPathError: On the way is a place out of reach, outside a joint's limits, singular or
            almost so, or it ends with other joint positions, as on the other side of the elbow.
    """
    columns = [k for k, joint in enumerate(joints) if joint in tool.joints]
    corners = [begin, via, target] if via else [begin, target]
    of_tool = [[q[column] for column in columns] for q in corners]
    first, last = of_tool[0], of_tool[-1]
    places = [tool.position(q) for q in of_tool]
    curve = arc(*places) if via else line(*places)
    turned = TURN_ARM * math.hypot(*(turn := tool.turn(first, last)))
    # A tool that turns in one place has no way to divide by: its turn stands for it.
    span = curve.length if curve.length > _NO_WAY else turned
    if span <= TURN_ARM * _NO_WAY:
        middle = [0.5 * (a + b) for a, b in zip(first, last)]
        strays = math.dist(tool.position(middle), places[0]) > OFF_M
        # The other elbow, or a wrist turned over: on the way to it the tool goes elsewhere.
        if strays or math.hypot(*tool.turn(first, middle)) > _SAME:
            raise ToolPathError("the target is the same place with other joints: that is no line")
        return None
    if tool.elbow(first) is None and len(first) != (6 if tool.turns else 3):
        raise ToolPathError(f"its {len(first)} joints are not fixed by the tool's place: no line")
    count = min(max(math.ceil(max(curve.length, turned) / STRIDE), FEWEST), MOST)
    while True:
        track = _solved(tool, joints, columns, (begin, target), curve, turn, span, count)
        middles = [span * (k + 0.5) / count for k in range(count)]
        off, s = max(
            (
                math.dist(
                    tool.position([track.sample(s)[0][column] for column in columns]),
                    curve.at(s * curve.length / span),
                ),
                s,
            )
            for s in middles
        )
        if off <= OFF_M:
            return SolvedPath(track, _derivatives(joints, track, count), speed_mm_s)
        if count == MOST:
            raise ToolPathError(
                f"{_where(s / span, curve.at(s * curve.length / span))}: it is almost singular "
                f"there, as where the arm is straight: it would be {1e3 * off:.3f} mm off its way, "
                f"allowed {1e3 * OFF_M:g}"
            )
        count = min(2 * count, MOST)


def solve_legs(
    tool: ToolKinematics,
    joints: Sequence[Joint],
    begin: Sequence[float],
    target: Sequence[float],
    way: MoveWay,
) -> list[tuple[Vector, SolvedPath | None]]:
    """Solve each leg of a way from place to place; see :func:`solve_path`.

    Returns:
        Where each ends, and its path; None: straight to the joints' targets.
    """
    ends = (*way.passed, tuple(target))
    if way.path == "joint":
        return [(end, None) for end in ends]
    arc = way.via[0] if way.path == "circular" else ()
    return [
        (end, solve_path(tool, joints, start, end, arc, way.speed_mm_s))
        for start, end in pairwise((tuple(begin), *ends))
    ]


def _solved(
    tool: ToolKinematics,
    joints: Sequence[Joint],
    columns: Sequence[int],
    both: tuple[Sequence[float], Sequence[float]],
    curve: Curve,
    turn: Triple,
    span: float,
    count: int,
) -> JointTrack:
    """Solve the joints at ``count + 1`` points of the curve; see :func:`solve_path`."""
    begin, target = both
    first = [begin[column] for column in columns]
    going, turning, h = curve.length / span, np.array(turn) / span, _STEP * span

    def slope(q: FloatArray, s: float) -> FloatArray:
        found = tool.rates(q.tolist(), _triple(going * curve.tangent(s)), _triple(turning))
        if found.damped:
            raise ToolPathError("it is singular there, as where the arm is straight")
        return np.array(found.qdot)

    rows = np.zeros((3, count + 1, len(joints)))
    even = (np.array(target) - np.array(begin)) / span
    guess = np.array(first)
    for k in range(count + 1):
        s = span * k / count
        place = _triple(curve.at(going * s))
        rows[0, k], rows[1, k] = np.array(begin) + s * even, even
        try:
            q = np.array(tool.near(first, guess.tolist(), place, _triple(s * turning)))
            rows[0, k, columns], rows[1, k, columns] = q, slope(q, s)
            by = h * rows[1, k, columns]
            # Along the path: the curve's tangent and the Jacobian both change with the way.
            rows[2, k, columns] = (slope(q + by, s + h) - slope(q - by, s - h)) / (2.0 * h)
            check_limits(joints, rows[0, k].tolist())
        except ScaraControlError as error:
            raise ToolPathError(f"{_where(k / count, place)}: {error}") from error
        # From here Newton goes on, and a joint of many turns stays on its turn.
        guess = q + rows[1, k, columns] * span / count
    for column in columns:
        ends = rows[0, -1, column]
        # The same place by the other elbow, or a whole turn further, is no end of this line.
        if abs(ends - target[column]) > _SAME:
            joint, one = joints[column], tool.elbow(first)
            other = tool.elbow([target[each] for each in columns])
            if one is not None and other is not None and one is not other:
                raise ToolPathError(
                    f"a line keeps its elbow: the arm is {one.value}, the target is {other.value}"
                )
            raise ToolPathError(
                f"the line ends with {joint.name} at {ends / joint.scale:.3f} {joint.unit}, the "
                f"target has it at {target[column] / joint.scale:.3f} {joint.unit}"
            )
    return JointTrack(
        np.linspace(0.0, span, count + 1).tolist(),
        *(table.tolist() for table in rows),
        # Nobody asks for what is beyond the end: the way stops there.
        extrapolation_limit=0.0,
        stop_accelerations=[1.0] * len(joints),
    )


def _where(part: float, place: Iterable[float]) -> str:
    """Say where the tool cannot go on: after which part of its way, at which place [m]."""
    x, y, z = (1e3 * each for each in place)
    return (
        f"the tool cannot go along the line: after {part:.0%} of the way, "
        f"at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
    )


def _triple(vector: FloatArray) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


def _derivatives(joints: Sequence[Joint], track: JointTrack, count: int) -> FloatArray:
    """Return the first three derivatives of the track by the way, shape (3, m, n).

    Raises:
        ToolPathError: A joint leaves its limits between two solved points.
    """
    # Just before the end: a hair beyond its last point a track ramps down.
    ways = np.linspace(0.0, track.last_time * (1.0 - 1e-12), LOOKS * count + 1)
    found = np.array([track.sample(float(s)) for s in ways]).transpose(1, 0, 2)
    for way, q in zip(ways, found[0]):
        try:
            check_limits(joints, q.tolist())
        except ScaraControlError as error:
            where = f"after {way / track.last_time:.0%} of the way"
            raise ToolPathError(f"the tool cannot go along the line: {where}: {error}") from error
    return np.array([found[1], found[2], np.gradient(found[2], ways, axis=0)])
