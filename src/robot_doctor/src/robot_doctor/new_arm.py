"""robot.yaml of an arm from its URDF: joints, limits, screws and home pose as it has them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import msgspec
from scara_config import KeepOut
from scara_config.lengths import AGREE, place_of, slid, stretched

from robot_doctor.chain import DescribedArm, DescribedJoint
from robot_doctor.new_scara import STOPPING

START_S = 0.25
"""From rest to full speed where no effort says otherwise; ours, as of arms of 3 to 10 kg."""
RISE_S = 0.06
"""From none to all of the acceleration: our choice."""
LEAST_ACCELERATION = 100.0
"""What quantities.py allows at least [deg/s^2], [mm/s^2]; the jerk is above its own least then."""
DUST = 1e-14
"""What rounding leaves of a written 0."""
LEANS = 1e-9
"""So far the closed form lets an axis lean."""


class ArmFigures(msgspec.Struct, frozen=True):
    """What a URDF does not say, and is found.

    Attributes:
        share: Of the acceleration that reaches full speed in ``START_S``: what the efforts allow.
        home: By the joint's name, in deg and mm.
        positions: Set positions [m].
        zone: Below the arm.
    """

    share: float
    home: Mapping[str, float]
    positions: Mapping[str, Sequence[float]]
    zone: KeepOut | None = None


def start_acceleration(joint: DescribedJoint) -> float:
    """Return the acceleration that reaches full speed in ``START_S``, SI."""
    return joint.velocity / START_S


def arm_text(
    name: str, made_by: str, urdf: DescribedArm, frames: tuple[str, str], figures: ArmFigures
) -> str:
    """Return its robot.yaml.

    Args:
        name: Of the robot.
        made_by: The command that made it.
        urdf: What the URDF says; its joints base to tool, then those that move no tool.
        frames: Root and tool of the URDF.
        figures: What it does not say.
    """
    arm = [joint for joint in urdf.joints.values() if joint.moves_tool]
    tip = [row[3] for row in urdf.tool_pose[:3]]
    size = scara_lengths(urdf)
    screws = [joint.screw for joint in arm]
    geometry, reach = "", 1e3 * stretched(screws, tip)
    if reach < 1e3 * AGREE:
        # A gantry: nothing turns, or only at the tool.
        reach = 1e3 * slid(screws, [(joint.lower, joint.upper) for joint in arm])
    if size is not None:
        l1, l2, h = size
        geometry = (
            f"geometry:                  # two upright axes and a stroke: a SCARA\n"
            f"  l1_mm: {l1!r}\n  l2_mm: {l2!r}\n  h_mm: {h!r}\n"
        )
        reach = l1 + l2
    pose = ", ".join(f"[{', '.join(map(_number, row))}]" for row in urdf.tool_pose)
    homes = ", ".join(f"{key}: {value:.10g}" for key, value in figures.home.items())
    places = "".join(
        f"  {key}: [{', '.join(f'{value:.10g}' for value in place)}]\n"
        for key, place in figures.positions.items()
    )
    zones = ""
    if figures.zone is not None:
        zone = figures.zone
        low, high = (", ".join(f"{x:.10g}" for x in c) for c in (zone.lower_mm, zone.upper_mm))
        zones = (
            "keep_out:                  # boxes that no part of the arm may enter\n"
            f"  - {{name: {zone.name}, lower_mm: [{low}], upper_mm: [{high}]}}   # below the foot\n"
        )
    joints = "".join(
        _joint(key, number, joint, figures.share)
        for number, (key, joint) in enumerate(urdf.joints.items(), start=1)
    )
    return f"""\
# Made by `{made_by}`.
# Joints, limits, speeds, efforts, axes and home pose are the URDF's. [our] Accelerations, as far as
# the efforts carry the arm; home, set positions and zone, found by limits and body.
name: {name}
urdf: {name}.urdf
base_frame: {frames[0]}
tool_frame: {frames[1]}
reach_mm: {_number(math.floor(1e3 * reach) / 1e3 if size is None else reach)}
{geometry}home_pose: [{pose}]
home: {{{homes}}}   # deg, mm
positions_m:               # named positions of the tool, as it is turned at home
{places}{zones}\
{STOPPING}joints:
{joints}"""


def scara_lengths(urdf: DescribedArm) -> tuple[float, float, float] | None:
    """Return l1, l2 and h of a SCARA [mm]; None: the arm is another one.

    A SCARA has two or three turning joints and a sliding one, all along z of the base.
    """
    arm = [joint for joint in urdf.joints.values() if joint.moves_tool]
    turning = [joint for joint in arm if joint.kind == "revolute"]
    # Entries of an upright joint's screw that may be other than 0.
    along = {"revolute": (2, 3, 4), "prismatic": (5,)}
    upright = all(
        max(abs(x) for k, x in enumerate(joint.screw) if k not in along[joint.kind]) < LEANS
        for joint in arm
    )
    if not upright or len(turning) not in (2, 3) or len(arm) != len(turning) + 1:
        return None
    tip = [row[3] for row in urdf.tool_pose[:3]]
    places = [*(place_of(joint.screw) for joint in turning), (tip[0], tip[1])]
    l1, l2 = (1e3 * math.dist(one, other) for one, other in itertools.pairwise(places[:3]))
    # What rounding leaves is no length.
    return round(l1, 9), round(l2, 9), round(1e3 * tip[2], 9) + 0.0


def _joint(name: str, number: int, joint: DescribedJoint, share: float) -> str:
    """Return the entry of one joint."""
    turns = joint.kind == "revolute"
    unit, scale = ("deg", math.pi / 180.0) if turns else ("mm", 1e-3)
    carried = share * start_acceleration(joint) / scale
    acceleration, told = max(LEAST_ACCELERATION, carried), ""
    if carried < LEAST_ACCELERATION:
        told = f"   # the least allowed; speed and efforts ask for {carried:.3g}"
    screw = f"[{', '.join(map(_number, joint.screw))}]" if joint.moves_tool else "null"
    return f"""\
  - name: {name}
    type: {joint.kind}
    axis_number: {number}
    twin: true
    screw_axis: {screw}
    lower_{unit}: {joint.lower / scale:.10g}
    upper_{unit}: {joint.upper / scale:.10g}
    velocity_{unit}_s: {joint.velocity / scale:.10g}
    acceleration_{unit}_s2: {acceleration:.4g}{told}
    jerk_{unit}_s3: {acceleration / RISE_S:.4g}
    effort: {joint.effort:.10g}
"""


def _number(value: float) -> str:
    """Return a number to its last digit, dust of rounding as 0."""
    return repr(0.0 if abs(value) < DUST else float(value))
