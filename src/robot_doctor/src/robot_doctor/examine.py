"""Everything that can be said of a profile without a robot: what the files hold, right or wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
from scara_config import ConfigError, Robot
from scara_config.modbus_map import ModbusMap
from scara_config.programs.tp.listing import Program
from scara_config.quantities import is_this_machine

from robot_doctor.chain import DescribedArmError, read_description
from robot_doctor.finding import Finding, Group, Places, fine, write_urdf, wrong
from robot_doctor.register_checks import check_registers
from robot_doctor.robot_checks import check_programs, check_robot, check_set_positions
from robot_doctor.simulation_checks import check_description, check_gains, check_inertia

COMPUTED = ("watched_points", "inertia")
"""What robot.yaml held once."""
EXAMPLE = "articulated_six"
"""The robot that a new one begins with."""


class RobotProfile(msgspec.Struct, frozen=True):
    """What the files of a profile hold, as far as it could be read.

    Attributes:
        folder: Name of the robot's folder, empty for a flat one.
        robot: robot.yaml as far as it can be read, or why it cannot.
        faults: What is wrong with it: file, key, value, what is expected.
        layout: modbus_map.yaml, not yet checked, or why it cannot be read.
        gains: pid_gains.yaml, parsed, or why not.
        programs: By the name of the file, or why one cannot be read.
        urdf: Text of the URDF, or why it cannot be read.
        written: Text that it should have by robot.yaml and body.yaml; empty: a person writes it.
        decimals: To so many in deg and mm positions are compared.
        places: Of the files.
    """

    folder: str
    robot: Robot | ConfigError
    faults: tuple[str, ...]
    layout: ModbusMap | ConfigError
    gains: Any
    programs: Mapping[str, Program | ConfigError]
    urdf: str | ConfigError
    written: str
    decimals: int
    places: Places

    @property
    def axes_occur_twice(self) -> bool:
        """Whether two joints have one number, so that no program can name them."""
        return any(".axis_number: " in fault for fault in self.faults)


def examine(profile: RobotProfile) -> Iterator[Finding]:
    """Yield what the files say, group by group.

    What hangs on a file that cannot be used is left out.
    """
    robot = profile.robot
    for fault in profile.faults:
        yield wrong(Group.ROBOT, fault, mend(fault, profile.folder))
    if isinstance(robot, ConfigError):
        then = "the other checks of the robot follow then"
        yield wrong(Group.ROBOT, str(robot), f"{mend(str(robot), profile.folder)}; {then}")
        return
    yield from check_robot(robot, profile.folder)
    if not profile.axes_occur_twice:
        yield from check_programs(robot, profile.programs, profile.places)
        yield from check_set_positions(robot, profile.programs, profile.places)
    yield from _simulation(profile, robot)
    if isinstance(profile.layout, ConfigError):
        what = str(profile.layout)
        yield wrong(Group.REGISTERS, what, mend(what, profile.folder))
    else:
        yield from check_registers(robot, profile.layout, profile.decimals)


def mend(what: str, robot: str) -> str:
    """Return what to do about a file that cannot be used: where it is, and the next command.

    Args:
        what: The error: file, then what is wrong.
        robot: Name of the robot's folder, empty for a flat one.
    """
    file, _, rest = what.partition(": ")
    name = file.rpartition("/")[2]
    if rest.startswith("cannot be read: No such file"):
        if name == "pid_gains.yaml":
            return f"write {file}: rosrun scara_simulation propose_gains --robot {robot} --write"
        return (
            f"write {file}: docs/methodology.md says how, config/robots/{EXAMPLE}/{name} is an "
            f"example. All files at once, in a new folder: rosrun robot_doctor doctor new NAME "
            f"--from {EXAMPLE}"
        )
    if any(f"unknown field `{name}`" in rest for name in COMPUTED):
        return f"delete it from {file}: it follows from the lengths and the URDF"
    return f"correct {file}"


def next_command(
    name: str,
    healthy: bool,
    real: str,
    offline: bool = False,
    host: str | None = None,
    port: int | None = None,
) -> str:
    """Return what to type next.

    Args:
        name: Of the robot.
        healthy: Nothing is wrong.
        real: The robot's address in twin_controller.yaml.
        offline: As it was given, as are the next two.
        host: Which robot was looked at, if not that one.
        port: Likewise.
    """
    if not healthy:
        given = {"host": host, "port": port}
        words = "".join(f" --{key} {value}" for key, value in given.items() if value)
        again = f"rosrun robot_doctor doctor --robot {name}{' --offline' * offline}{words}"
        return f"correct this, then {again}"
    # `demo` starts the stand-in, and leads whatever robot is at the address in the file.
    here = is_this_machine(real) and is_this_machine(host or real)
    return f"./cell demo --robot {name}" if here else f"./cell up --robot {name} --without emulator"


def _simulation(profile: RobotProfile, robot: Robot) -> Iterator[Finding]:
    """Yield what concerns the twin."""
    if isinstance(profile.urdf, ConfigError):
        yield wrong(
            Group.SIMULATION,
            str(profile.urdf),
            f"write body.yaml beside {profile.places.robot}, then: {write_urdf(robot.name)}",
        )
    else:
        if profile.written not in ("", profile.urdf):
            what = f"{robot.urdf} was written from another robot.yaml or body.yaml than these"
            yield wrong(Group.SIMULATION, what, write_urdf(robot.name), "URDF robot")
        try:
            # Each fault of the two files is told once, and not of what is written from them too.
            described = read_description(profile.written or profile.urdf, robot.tool_frame)
        except DescribedArmError as error:
            advice = (
                f"correct {profile.places.body or profile.places.urdf}; check_urdf may say more"
            )
            at = "URDF robot"
            if "it has no link" in str(error):
                advice, at = f"name a link of it in {profile.places.robot}", "robot.yaml tool_frame"
            yield wrong(Group.SIMULATION, f"{robot.urdf}: {error}", advice, at)
        else:
            yield fine(Group.SIMULATION, f"{robot.urdf} has {len(described.links)} links")
            yield from check_description(robot, described, profile.places)
            # In a URDF that was written from body.yaml the inertia is computed.
            if not profile.written:
                yield from check_inertia(profile.urdf, profile.places)
    if isinstance(profile.gains, ConfigError):
        what = str(profile.gains)
        yield wrong(Group.SIMULATION, what, mend(what, profile.folder))
    else:
        yield from check_gains(robot, profile.gains)
