"""The files of a SCARA from its lengths: all that is not told is that of a small one, scaled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import msgspec

LIKE = "fanuc_sr3ia"
"""The robot whose other files it gets, and whose numbers are scaled: 200 + 200 mm, 200 mm of
stroke."""
REACH_MM = 400.0
HEIGHT_MM = 150.0
"""Of the tool with joint 3 up."""
RATED_KG, RATED_KG_M2 = 3.0, 0.0026
"""What payloads.yaml lets it carry."""
SPARE = 3.0
"""Of effort, over what the largest acceleration asks for with the rated mass: our choice, for
friction and for what two joints do to each other."""
LEAST_EFFORT = 10.0
GRAVITY = 9.81
TABLES = ("table", "table_2")
"""What turntables are called: before it, and on its left."""
PLACES = {"P1": (1.0, 0.0, 0.75), "P2": (0.775, 0.25, 0.45), "P3": (0.775, -0.25, 0.25)}
"""Set positions: x and y in parts of the reach, how far below the upper end in parts of the
stroke."""
CLEAR_MM = 90.0
"""From P1 down to the zone below it: what joint 3 goes at half its speed, as in the experiments,
within ``braking_delay_ms``. A robot that comes down faster than it could be stopped is stopped."""
STOPPING = """\
# Without a means of stopping that was tried at its address a robot is followed, never led.
stopping:
  uop: full
  tried:                   # the stand-in only: rosrun robot_doctor doctor --robot NAME --stops
    hold: 127.0.0.1
    cstopi: 127.0.0.1
    imstp: 127.0.0.1
  braking_delay_ms: 100    # [asm] from a sample until it brakes: doctor --stops measures it
"""
"""What stops the stand-in of a robot that was made here."""


class ScaraSize(msgspec.Struct, frozen=True):
    """What is told of a SCARA.

    Attributes:
        l1_mm: From joint 1 to joint 2.
        l2_mm: From joint 2 to the axis of the tool.
        stroke_mm: Of joint 3.
        axes: 4: joint 4 turns the tool.
        tables: It stands before a turntable, and has another one on its left.
        down: Joint 3 counts downwards.
    """

    l1_mm: float
    l2_mm: float
    stroke_mm: float
    axes: Literal[3, 4] = 4
    tables: Literal[0, 1, 2] = 1
    down: bool = False

    @property
    def reach_mm(self) -> float:
        """Of the stretched arm."""
        return self.l1_mm + self.l2_mm

    @property
    def scale(self) -> float:
        """How much larger it is than the one whose numbers are scaled."""
        return self.reach_mm / REACH_MM

    def places_mm(self) -> dict[str, tuple[float, float, float]]:
        """Return the set positions in the base frame."""
        return {
            name: (x * self.reach_mm, y * self.reach_mm, HEIGHT_MM - z * self.stroke_mm)
            for name, (x, y, z) in PLACES.items()
        }

    def lift_mm(self, z_mm: float) -> float:
        """Return the value of joint 3 that brings the tool to a height."""
        return HEIGHT_MM - z_mm if self.down else z_mm - HEIGHT_MM

    def command(self, name: str) -> str:
        """Return what makes it."""
        table = (" --no-table", "", " --two-tables")[self.tables]
        return (
            f"rosrun robot_doctor doctor new {name} --scara {self.l1_mm:g} {self.l2_mm:g} "
            f"--stroke {self.stroke_mm:g} --axes {self.axes}{table}{' --down' * self.down}"
        )

    @property
    def joints(self) -> list[str]:
        """Names of its joints."""
        names = [f"joint_{number}" for number in range(1, self.axes + 1)]
        return [*names, *(f"{table}_joint" for table in TABLES[: self.tables])]


def robot_text(name: str, size: ScaraSize, inertias: Mapping[str, float]) -> str:
    """Return its robot.yaml.

    Args:
        name: Of the robot.
        size: What is told of it.
        inertias: What each joint sees; empty: not known yet.
    """
    p1, sideways = size.places_mm()["P1"], 0.5 * size.reach_mm
    low, high = (0.0, size.stroke_mm) if size.down else (-size.stroke_mm, 0.0)
    home = {joint: 0.0 for joint in size.joints} | {"joint_3": size.lift_mm(p1[2])}
    homes = ", ".join(f"{joint}: {value:.10g}" for joint, value in home.items())
    places = "\n".join(
        f"  {key}: [{', '.join(f'{1e-3 * value:.6g}' for value in place)}]"
        for key, place in size.places_mm().items()
    )
    zone = [
        [0.4 * size.reach_mm, -sideways, -1000.0 + p1[2]],
        [1.175 * size.reach_mm, sideways, p1[2] - CLEAR_MM],
    ]
    lower, upper = (", ".join(f"{value:.6g}" for value in corner) for corner in zone)
    joints = "".join(_joint(joint, size, inertias.get(joint), (low, high)) for joint in size.joints)
    return f"""\
# Made by `{size.command(name)}`.
# Lengths and stroke as told; [our] all else: take limits, speeds and accelerations from the manual.
name: {name}
urdf: {name}.urdf          # `rosrun scara_description write_urdf {name}` makes it, with body.yaml
base_frame: base_link
tool_frame: tool0
geometry:                  # reach, screw axes and home pose follow from it
  l1_mm: {size.l1_mm:.10g}
  l2_mm: {size.l2_mm:.10g}
  h_mm: {HEIGHT_MM:.10g}
home: {{{homes}}}   # [our] deg, mm; P1, the arm straight
positions_m:               # [our] named positions of the tool
{places}
keep_out:                  # boxes in the base frame that no part of the arm may enter
  - {{name: below_tool, lower_mm: [{lower}], upper_mm: [{upper}]}}   # [our]
{STOPPING}joints:
{joints}"""


def _joint(name: str, size: ScaraSize, inertia: float | None, stroke: tuple[float, float]) -> str:
    """Return the entry of one joint."""
    slower = min(1.0, 1.0 / size.scale)
    low, high, speed, acceleration, jerk, carried = {
        "joint_1": (-142.0, 142.0, 720.0, 4500.0, 70000.0, size.reach_mm),
        "joint_2": (-145.0, 145.0, 780.0, 5500.0, 80000.0, size.l2_mm),
        "joint_3": (*stroke, 1800.0, 18000.0, 400000.0, 0.0),
        "joint_4": (-360.0, 360.0, 1500.0, 9000.0, 150000.0, 0.0),
    }.get(name, (-180.0, 180.0, 180.0, 600.0, 6000.0, 0.0))
    if name in ("joint_1", "joint_2"):
        speed, acceleration, jerk = (slower * x for x in (speed, acceleration, jerk))
    unit, si = ("mm", 1e-3) if name == "joint_3" else ("deg", 0.0174533)
    effort = 1000.0
    if inertia is not None:
        # The rated mass at the tool, as far from the joint's axis as it can be.
        load = RATED_KG * (1e-3 * carried) ** 2 + RATED_KG_M2
        weight = 0.0
        if name == "joint_3":
            load, weight = RATED_KG, GRAVITY * (inertia + RATED_KG)
        effort = max(LEAST_EFFORT, SPARE * ((inertia + load) * si * acceleration + weight))
    screw = ""
    if name not in size.joints[: size.axes]:
        screw = "    screw_axis: null       # does not move the tool\n"
    elif name == "joint_3" and size.down:
        screw = "    screw_axis: [0, 0, 0, 0, 0, -1]   # counts downwards\n"
    return f"""\
  - name: {name}
    type: {"prismatic" if unit == "mm" else "revolute"}
    axis_number: {size.joints.index(name) + 1}
    twin: true
{screw}    lower_{unit}: {low:.10g}
    upper_{unit}: {high:.10g}
    velocity_{unit}_s: {_rounded(speed)}
    acceleration_{unit}_s2: {_rounded(acceleration)}
    jerk_{unit}_s3: {_rounded(jerk)}
    effort: {_rounded(effort)}
"""


def _rounded(value: float) -> str:
    """Return a number with three digits."""
    return f"{float(f'{value:.3g}'):.10g}"


def body_text(name: str, size: ScaraSize) -> str:
    """Return its body.yaml: the small SCARA's links, as long and as heavy as this one's."""
    l1, l2, reach, z = size.l1_mm, size.l2_mm, size.reach_mm, size.places_mm()["P1"][2]
    floor, rod = z - 250.0, size.stroke_mm + 140.0
    one, two, f = 3.2 * l1 / 200.0, 3.4 * l2 / 200.0, size.scale
    # Its right edge stays where it is, whatever stands on the left.
    broad = 760.0 if size.tables < 2 else 850.0
    plate = f"box_mm: [{800 * f:.10g}, {broad * f:.10g}, 20]"
    middle = f"{180 * f:.10g}, {(broad / 2 - 380) * f:.10g}, {floor - 10:.10g}"
    column = 50.0 + 0.5 * floor
    tool_parent = "link_4" if size.axes == 4 else "link_3"
    wrist = f"""\
  - name: link_4
    parent: link_3
    joint: joint_4
    at_mm: [{reach:.10g}, 0, {HEIGHT_MM:.10g}]
    mass_kg: 0.2
    damping: 0.02
    friction: 0.04
    shapes:
      - {{cylinder_mm: [25, 10], at_mm: [0, 0, 19], colour: dark}}
"""
    text = f"""\
# The arm and what stands around it; `rosrun scara_description write_urdf {name}` makes the URDF.
# [our] The links of {LIKE}, as long as robot.yaml says: measure shapes and masses.
links:
  - name: base_link
    mass_kg: 11.5
    shapes:
      - {{box_mm: [180, 170, 30], at_mm: [0, 0, {floor + 15:.10g}], colour: black}}
      - {{cylinder_mm: [68, {40 - floor:.10g}], at_mm: [0, 0, {column:.10g}], colour: black}}
      - {{cylinder_mm: [60, 20], at_mm: [0, 0, 80], colour: green}}
  - name: link_1
    parent: base_link
    joint: joint_1
    at_mm: [0, 0, 90]
    mass_kg: {one:.4g}
    damping: 0.3
    friction: 0.6
    shapes:
      - {{cylinder_mm: [62, 70], at_mm: [0, 0, 35], colour: yellow}}
      - {{box_mm: [{l1:.10g}, 96, 60], at_mm: [{l1 / 2:.10g}, 0, 35], colour: yellow}}
      - {{cylinder_mm: [52, 70], at_mm: [{l1:.10g}, 0, 35], colour: yellow}}
  - name: link_2
    parent: link_1
    joint: joint_2
    at_mm: [{l1:.10g}, 0, 175]
    mass_kg: {two:.4g}
    damping: 0.12
    friction: 0.3
    shapes:
      - {{cylinder_mm: [52, 80], at_mm: [0, 0, 40], colour: yellow}}
      - {{box_mm: [{l2:.10g}, 86, 66], at_mm: [{l2 / 2:.10g}, 0, 40], colour: yellow}}
      - {{cylinder_mm: [44, 80], at_mm: [{l2:.10g}, 0, 40], colour: yellow}}
  - name: link_3
    parent: link_2
    joint: joint_3
    at_mm: [{reach:.10g}, 0, {HEIGHT_MM:.10g}]
    mass_kg: 0.65
    damping: 3.0
    friction: 3.0
    shapes:
      - {{cylinder_mm: [9, {rod:.10g}], at_mm: [0, 0, {20 + rod / 2:.10g}], colour: steel}}
      - {{cylinder_mm: [15, 24], at_mm: [0, 0, {8 + rod:.10g}], colour: blue}}
{wrist if size.axes == 4 else ""}\
  - name: tool0            # its frame is that of home_pose: z down
    parent: {tool_parent}
    mass_kg: 0.05
    shapes:
      - {{cylinder_mm: [8, 14], at_mm: [0, 0, -7], colour: black}}
  - name: cell_plate
    parent: base_link
    mass_kg: 40.0
    shapes:
      - {{{plate}, at_mm: [{middle}], colour: floor}}
"""
    beside = (299.444 * f, 0.0), (0.0, 299.444 * f)
    for table, place in zip(TABLES[: size.tables], beside):
        text += _table_text(size, floor, table, place)
    return text + _stands_text(size, floor) if size.tables else text


def _table_text(size: ScaraSize, floor: float, table: str, place: tuple[float, float]) -> str:
    """Return the links of a turntable, its axis at ``place`` [mm]."""
    f, (x, y) = size.scale, place
    return f"""\
  - name: {table}_base
    parent: cell_plate
    at_mm: [{x:.10g}, {y:.10g}, {floor:.10g}]
    mass_kg: 15.0
    shapes:
      - {{cylinder_mm: [{95 * f:.10g}, 20], at_mm: [0, 0, 10], colour: black}}
      - {{cylinder_mm: [{70 * f:.10g}, 90], at_mm: [0, 0, 65], colour: dark}}
  - name: {table}_link
    parent: {table}_base
    joint: {table}_joint
    at_mm: [{x:.10g}, {y:.10g}, {floor + 112:.10g}]
    mass_kg: {3.0 * f * f:.4g}
    damping: 0.1
    friction: 0.3
    shapes:
      - {{cylinder_mm: [{50 * f:.10g}, 16], at_mm: [0, 0, 8], colour: steel}}
      - {{cylinder_mm: [{135 * f:.10g}, 14], at_mm: [0, 0, 23], colour: white}}
"""


def _stands_text(size: ScaraSize, floor: float) -> str:
    """Return a stand below each set position, on the first turntable."""
    return "".join(
        f"""\
  - name: stand_{number}          # below P{number}
    parent: {TABLES[0]}_link
    at_mm: [{x:.10g}, {y:.10g}, {floor + 220:.10g}]
    mass_kg: 0.3
    shapes:
      - {{cylinder_mm: [18, 78], at_mm: [0, 0, -39], colour: steel}}
"""
        for number, (x, y, _) in enumerate(size.places_mm().values(), start=1)
    )
