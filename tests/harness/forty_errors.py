"""Forty errors of a profile, and what the doctor says of each."""

from __future__ import annotations

from typing import NamedTuple

BIG, SMALL = "fanuc_sr6ia", "fanuc_sr3ia"
"""One whose URDF a person writes, and one with a body.yaml."""


class Planted(NamedTuple):
    """An error: in the robot's ``file`` the first ``old`` becomes ``new``."""

    robot: str
    file: str
    old: str
    new: str
    # What the doctor says of it, and what to do.
    what: str
    remedy: str
    # Where it is told, if not at the first changed line: file and text.
    there: tuple[str, str] = ("", "")


def robot(old: str, new: str, what: str, remedy: str, there: str = "", name: str = BIG) -> Planted:
    """Return an error of robot.yaml."""
    return Planted(
        name, "robot.yaml", old, new, what, remedy, ("robot.yaml" if there else "", there)
    )


def register(old: str, new: str, what: str, remedy: str, there: str = "") -> Planted:
    """Return an error of modbus_map.yaml."""
    place = ("modbus_map.yaml" if there else "", there)
    return Planted(BIG, "modbus_map.yaml", old, new, what, remedy, place)


J1, J2, J3 = (f"  - name: joint_{number}\n" for number in (1, 2, 3))
TABLE = "  - name: table_joint\n"
GEOMETRY = "geometry:                  #"
ARTICLE = "programs/ARTICLE.LS"
PROGRAM = (ARTICLE, 'P[3:"P3"]{')
FORTY = {
    "l1": robot(
        "l1_mm: 350.0", "l1_mm: 340.0", r"geometry.l1_mm = 340: .* has 350", "`l1_mm: 350`"
    ),
    "l2": robot(
        "l2_mm: 300.0", "l2_mm: 325.0", r"geometry.l2_mm = 325: .* has 300", "`l2_mm: 300`"
    ),
    "h": robot("h_mm: 160.0", "h_mm: 150.0", r"geometry.h_mm = 150: .* has 160", "`h_mm: 160`"),
    "reach": robot(GEOMETRY, f"reach_mm: 700.0\n{GEOMETRY}", "reach_mm = 700: Expected", "correct"),
    "home pose": robot(
        GEOMETRY,
        f"home_pose: [[0, -1, 0, 0.55], [-1, 0, 0, 0], [0, 0, -1, 0.16], [0, 0, 0, 1]]\n{GEOMETRY}",
        r"home_pose: 200 mm from the axis before: Expected geometry.l2_mm = 300",
        "correct",
    ),
    "axis": robot(
        J2,
        f"{J2}    screw_axis: [0, 0, 1, 0, -0.33, 0]\n",
        r"joints.joint_2.screw_axis: 330 mm from the axis before: Expected geometry.l1_mm",
        "correct",
        "screw_axis: [0, 0, 1, 0, -0.33",
    ),
    "no unit vector": robot(
        J1,
        f"{J1}    screw_axis: [0, 0, 10, 0, 0, 0]\n",
        "Expected a unit omega",
        "correct",
        "[0, 0, 10",
    ),
    "sign of joint 3": robot(
        J3,
        f"{J3}    screw_axis: [0, 0, 0, 0, 0, -1]\n",
        "joint_3: the sign of its axis is the opposite of the URDF's",
        "jog the real joint by a positive value",
        "0, -1]",
    ),
    "sign of joint 1": robot(
        J1,
        f"{J1}    screw_axis: [0, 0, -1, 0, 0, 0]\n",
        "joint_1: the sign of its axis is the opposite of the URDF's",
        "jog the real joint by a positive value",
        "[0, 0, -1, 0, 0, 0]",
    ),
    "inertia": robot(
        J1, f"{J1}    inertia: 1.15\n", "unknown field `inertia`", "delete it from", "inertia: 1.15"
    ),
    "points": robot(
        "keep_out:",
        "watched_points: []\nkeep_out:",
        "unknown field `watched_points`",
        "delete it from",
    ),
    "P2 out of reach": robot(
        "P2: [0.51, 0.16,", "P2: [0.61, 0.36,", r"positions_m\.P2: .*outside the reach", "move the"
    ),
    "P3 elsewhere": Planted(
        BIG,
        "robot.yaml",
        "P3: [0.51, -0.16,",
        "P3: [0.49, -0.16,",
        r"ARTICLE.LS: P\[3:P3\] brings the tool to .* 20.0 mm from positions_m.P3",
        r"with J1= .* deg, J2= .* deg, J3= .* mm",
        PROGRAM,
    ),
    "program beyond": Planted(
        BIG,
        ARTICLE,
        "J1= -49.15770074",
        "J1= 190.0",
        r"ARTICLE.LS: P\[3\]\.J1 = 190 deg: outside",
        "deg for a turning joint",
        PROGRAM,
    ),
    "program elsewhere": Planted(
        BIG,
        ARTICLE,
        "J1= -49.15770074",
        "J1= -39.15770074",
        r"ARTICLE.LS: P\[3:P3\] brings the tool to",
        "with J1= ",
        PROGRAM,
    ),
    "no line": Planted(BIG, ARTICLE, "  ENDFOR", "  ENDLESS", "line 10 of the program", "correct"),
    "home beyond": robot(
        "joint_3: -160.0, table",
        "joint_3: 160.0, table",
        "home.joint_3 = 160: Expected",
        "correct",
    ),
    "home missing": robot("{joint_1: 0.0, ", "{", "home.joint_1: is missing", "correct"),
    "zone": robot(
        "lower_mm: [250.0,",
        "lower_mm: [950.0,",
        "keep_out.below_table: lower_mm is not below",
        "correct",
    ),
    "upper": robot(
        "upper_deg: 148.0", "upper_deg: 170.0", "joint_1: upper 170 .* 148", "`upper_deg: 148`"
    ),
    "lower": robot(
        "lower_deg: -150.0", "lower_deg: -120.0", "joint_2: lower -120 .* -150", "`lower_deg: -150`"
    ),
    "stroke": robot(
        "lower_mm: -210.0", "lower_mm: -310.0", "joint_3: lower -310 .* -210", "`lower_mm: -210`"
    ),
    "turned round": robot(
        "upper_deg: 148.0",
        "upper_deg: -149.0",
        "joints.joint_1: lower limit is not below",
        "correct",
        J1,
    ),
    "radians": robot(
        "lower_deg: -148.0      # [asm]\n    upper_deg: 148.0       # [asm]\n"
        "    velocity_deg_s: 440.0",
        "lower_deg: -2.58\n    upper_deg: 2.58\n    velocity_deg_s: 7.68",
        r"joint_1: limits \[-2.58, 2.58\] deg at 7.68 deg/s look like rad",
        "lower_deg: -147.8",
    ),
    "speed": robot(
        "velocity_deg_s: 700.0",
        "velocity_deg_s: 900.0",
        "joint_2: velocity 900",
        "`velocity_deg_s: 700`",
    ),
    "effort": robot("effort: 120.0", "effort: 100.0", "joint_2: effort 100", "`effort: 120`"),
    "axis number": robot(
        "axis_number: 5",
        "axis_number: 4",
        "axis_number 4 occurs more",
        "correct",
        "axis_number: 4         # ext",
    ),
    "name": robot("name: fanuc_sr6ia", "name: fanuc_sr6", "says name: fanuc_sr6", "the same text"),
    "table not moved": robot(
        f"{TABLE}    type: revolute\n"
        "    axis_number: 5         # extended axis of the real controller [asm]\n    twin: true",
        f"{TABLE}    type: revolute\n    axis_number: 5\n    twin: false",
        "table_joint: the URDF moves and the twin does not",
        "so that both move the same joints",
        "    twin: false\n    screw_axis: null",
    ),
    "table's limit": robot(
        "upper_deg: 180.0", "upper_deg: 170.0", "table_joint: upper 170 .* 180", "`upper_deg: 180`"
    ),
    "stopping": robot(
        "uop: full", "uop: simple", "stopping.tried.imstp: uop is simple", "correct", "imstp: 127"
    ),
    "overlap": register(
        "velocity:          {address: 11022,",
        "velocity:          {address: 11015,",
        "velocity.address = 11015: overlaps position",
        "correct address, type or count",
        "velocity:          {address: 11015,",
    ),
    "hidden address": register(
        "override:          {address: 11101,",
        "override:          {address: 9999,",
        "slot 1 of a",
        "move it",
    ),
    "no heartbeat": register(
        "  heartbeat:  ",
        "  heart_beat: ",
        "heartbeat: is missing",
        "add a counter",
        "holding_registers:",
    ),
    "unit": register(
        'count: 9, unit: axis, variable: "POS',
        'count: 9, unit: rad, variable: "POS',
        "position has unit 'rad'",
        "`unit: axis`",
    ),
    "written state": register(
        "position:          {address: 11001,",
        "position:          {write: true, address: 11001,",
        "position has write: true",
        "remove `write`",
    ),
    "speed not written": register(
        "stream_speed:      {address: 11071, type: int16, unit: percent, write: true,",
        "stream_speed:      {address: 11071, type: int16, unit: percent,",
        "stream_speed: must be a holding register with write: true",
        "correct the entry",
    ),
    "clock in seconds": register(
        'type: int32, unit: ms, variable: "R[21]"',
        'type: int32, unit: s, variable: "R[21]"',
        "clock_ms has unit 's'",
        "`unit: ms`",
    ),
    "no sysrdy": register(
        "  sysrdy: ",
        "  sysready: ",
        "discrete_inputs.sysrdy: is missing",
        "find where the robot has it",
        "discrete_inputs:",
    ),
    "no gains": Planted(
        BIG,
        "pid_gains.yaml",
        "joint_3:",
        "joint_9:",
        "pid_gains.yaml: joint_3 is missing",
        "propose_gains --robot",
        ("pid_gains.yaml", "joint_1:"),
    ),
    "stale": Planted(
        SMALL,
        "robot.yaml",
        "velocity_deg_s: 720.0",
        "velocity_deg_s: 700.0",
        "fanuc_sr3ia.urdf was written from another",
        "write_urdf fanuc_sr3ia",
        ("fanuc_sr3ia.urdf", "<robot"),
    ),
    "body elsewhere": Planted(
        SMALL,
        "body.yaml",
        "at_mm: [200, 0, 175]",
        "at_mm: [190, 0, 175]",
        r"geometry.l1_mm = 200: the arm of .*body.yaml has 190",
        "or correct .*body.yaml; then: rosrun",
        ("robot.yaml", "l1_mm: 200.0"),
    ),
    "table without joint": Planted(
        SMALL,
        "body.yaml",
        "    joint: table_joint\n",
        "",
        "links: joints .*: Expected each of",
        "correct",
        ("body.yaml", "links:"),
    ),
    "start": Planted(
        SMALL,
        "emulator.yaml",
        "joint_3_mm: -150.0",
        "joint_3_mm: 150.0",
        "start_position.joint_3_mm = 150",
        "correct",
    ),
}
"""By what is wrong: lengths, points, reach, inertia, signs, limits, table, signals."""
ALONE = (
    "l2",
    "home pose",
    "axis",
    "sign of joint 1",
    "P3 elsewhere",
    "program elsewhere",
    "no line",
    "turned round",
    "radians",
    "home missing",
    "table's limit",
    "no unit vector",
    "axis number",
    "table without joint",
)
"""What another one of the same robot hides, or stands in its place."""
