"""What of a new SCARA's other files follows from its joints: programs, start and plants."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from scara_config import Joint, Robot
from scara_config.programs.files import axis_names
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position
from scara_control.kinematics.tool import tool_kinematics

from robot_doctor.new_scara import HEIGHT_MM, ScaraSize

TWO_POINTS: Mapping[str, dict[str, float]] = {
    "A": {"joint_1": -30.0, "joint_2": 60.0, "joint_3": 0.7},
    "B": {"joint_1": 45.0, "joint_2": 20.0, "joint_3": 0.25, "joint_4": 90.0},
}
"""Of TWO_POINT: in deg, joint 3 in parts of the stroke from its upper end."""
TABLE_DEG = 60.0
"""At B all turntables stand there."""
SPEEDS = {"deg": 720.0, "mm": 1800.0}
"""Of the turning and the sliding joint that are taken from LIKE's plants [deg/s], [mm/s]."""
BLOCK = r"(?:    .*\n)+"
"""Lines of an axis in a plant."""


def two_points(size: ScaraSize) -> dict[str, dict[str, float]]:
    """Return TWO_POINT's joint values of a SCARA, in deg and mm."""
    tables = {"B": dict.fromkeys(size.joints[size.axes :], TABLE_DEG)}
    lift = {
        name: {"joint_3": size.lift_mm(HEIGHT_MM - values["joint_3"] * size.stroke_mm)}
        for name, values in TWO_POINTS.items()
    }
    return {name: v | tables.get(name, {}) | lift[name] for name, v in TWO_POINTS.items()}


def taught(
    robot: Robot, values: Mapping[str, Mapping[str, float]] | None = None
) -> tuple[Position, ...]:
    """Return the positions of a program.

    Args:
        robot: The profile.
        values: Joint values by the position's name, in deg and mm; None: the set positions, with
            one elbow, near home.

    Raises:
        ScaraControlError: A set position is out of reach or outside the limits.
    """
    if values is None:
        tool = tool_kinematics(robot)
        seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
        elbow = tool.elbow(seed)
        values = {
            name: {
                joint.name: value / joint.scale
                for joint, value in zip(tool.joints, tool.inverse(*place, elbow, seed).chosen.q)
            }
            for name, place in robot.positions_m.items()
        }
    return tuple(
        Position(number, name, (_group(robot, each),))
        for number, (name, each) in enumerate(values.items(), start=1)
    )


def _group(robot: Robot, values: Mapping[str, float]) -> GroupPosition:
    """Return a position by joint values in deg and mm; a joint without one is as at home."""
    told = {**robot.home, **values}
    coordinates = tuple(
        Coordinate(axis, round(told.get(joint.name, 0.0), 9) + 0.0, joint.unit)
        for axis, joint in axis_names(robot).items()
    )
    return GroupPosition(1, "0", "1", "", coordinates)


def started(emulator: str, robot: Robot) -> str:
    """Return emulator.yaml with the robot's home as the start of its stand-in."""
    lines = "".join(
        f"  {joint.name}_{joint.unit}: {robot.home.get(joint.name, 0.0):.10g}\n"
        for joint in robot.joints
    )
    return re.sub(r"(?<=\n)(start_position:.*\n)(?:  .*\n)+", rf"\g<1>{lines}", emulator)


def of_joints(plant: str, joints: Sequence[str]) -> str:
    """Return a plant with the robot's axes, of the lengths in robot.yaml.

    What it has more of, as turntables, moves as the last that it has.
    """
    known = re.findall(r"(?m)^  (\w+):.*\n(?=    )", plant.partition("\naxes:")[2])
    last = re.search(rf"(?m)^  {known[-1]}:.*\n({BLOCK})", plant)
    for axis in set(known) - set(joints):
        plant = re.sub(rf"(?m)^  {axis}:.*\n{BLOCK}", "", plant)
    for axis in joints:
        if axis not in known and last is not None:
            plant += f"  {axis}:\n{last[1]}"
    return re.sub(
        r"(?m)^geometry:.*\n(?:  .*\n)*", "geometry: null    # as robot.yaml says\n", plant
    )


def plant_of(plant: str, joints: Sequence[Joint]) -> str:
    """Return a plant with an axis for each joint: a turning or a sliding one of those it has.

    A slower joint has a longer gear: a turn of the motor moves it less, and its noise is finer.
    """
    head, begin, axes = plant.partition("\naxes:")
    comment, _, rest = axes.partition("\n")
    kinds = {
        unit: body
        # From the end, since of two joints of a kind the later one stays: the first in the file.
        for body in re.findall(rf"(?m)^  \w+:.*\n({BLOCK})", rest)[::-1]
        for unit in ("deg", "mm")
        if f"_per_turn_{unit}:" in body
    }
    gears = {joint: joint.velocity / joint.scale / SPEEDS[joint.unit] for joint in joints}
    rows = "".join(
        f"  {joint.name}:\n{_times(kinds[joint.unit], f'travel_per_turn_{joint.unit}', gear)}"
        for joint, gear in gears.items()
    )
    for unit in SPEEDS:
        slowest = min((gear for joint, gear in gears.items() if joint.unit == unit), default=1.0)
        head = _times(head, f"noise_{unit}", min(1.0, slowest))
    return of_joints(f"{head}{begin}{comment}\n{rows}", [joint.name for joint in joints])


def _times(text: str, key: str, factor: float) -> str:
    """Return a text with the number behind ``key`` multiplied."""
    return re.sub(
        rf"(?<={key}: )[\d.]+", lambda found: f"{float(found[0]) * factor:.3g}", text, count=1
    )
