"""Make the files of a robot from a URDF that somebody else wrote."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
from scara_config import ConfigError, Robot, load, load_robot, locate
from scara_config.loader import load_text
from scara_config.programs.files import read_listing
from scara_config.programs.tp.printer import print_program
from scara_config.writer import replace_file
from scara_control.keep_out.body import read_body
from scara_control.keep_out.reach import largest_rates
from scara_control.kinematics.screws import ScrewModel
from scara_description.mesh_io import find_mesh, read_mesh

from robot_doctor.chain import DescribedArm, read_description
from robot_doctor.foreign_urdf import Foreign, read_foreign
from robot_doctor.free_space import FreeSpace
from robot_doctor.new_arm import ArmFigures, arm_text, start_acceleration
from robot_doctor.new_places import FoundPlaces, find_places, floor_below
from robot_doctor.new_profile_io import chosen, new_folder, new_urdf, urdf_place
from robot_doctor.new_scara import GRAVITY, LIKE
from robot_doctor.scaled_files import plant_of, started, taught
from robot_doctor.tidied_urdf import tidied
from scara_description.gazebo import CameraView, with_gazebo

POSES = 200
"""At which the arm is weighed."""
SPARE = 1.25
"""Of effort, for friction, velocity coupling and what it carries: our choice."""


def make_arm(
    config: Path, name: str, source: Path, tool: str | None = None, urdf_folder: Path | None = None
) -> Path:
    """Make the files of a robot from its URDF.

    Args:
        config: Folder with all YAML files.
        name: Of the new robot: lower-case letters, digits and underlines.
        source: The URDF; its meshes are looked for beside it and above.
        tool: The link at the end of the arm; None: found.
        urdf_folder: Where URDFs are; default: that of the package scara_description.

    Returns:
        The new folder.

    Raises:
        ConfigError: The name is not usable or taken, or the URDF cannot be used: file, line, joint
            or link, key, value and what is expected; nothing was made then.
    """
    # Here, as the physics engine takes its time: the doctor's other questions need none.
    from scara_simulation.tuning.propose_gains_node import gains_text

    foreign = read_foreign(load_text(source), source.name, tool)
    text = tidied(foreign, name, lambda mesh: read_mesh(find_mesh(mesh, source)))
    target = urdf_place(urdf_folder) / f"{name}.urdf"
    with new_folder(config, name, LIKE) as folder, chosen(name):
        # It is the copied robot's, and a new URDF would be written from it.
        (folder / "body.yaml").unlink()
        view = load(locate("camera.yaml", config), CameraView)
        text = with_gazebo(text, view, foreign.model.root)
        with new_urdf(target, text):
            robot, found = _robot(config, folder, foreign, text, name, source)
            _other_files(folder, robot, found)
            replace_file(folder / "pid_gains.yaml", gains_text(robot, config))
    return folder


def _robot(
    config: Path, folder: Path, foreign: Foreign, text: str, name: str, source: Path
) -> tuple[Robot, FoundPlaces]:
    """Write robot.yaml, each time with what was found by what stood there before."""
    urdf = read_description(text, foreign.tool)
    # Joints base to tool, then those that move no tool.
    joints = {joint.name: urdf.joints[joint.name] for joint in foreign.moving}
    urdf = msgspec.structs.replace(urdf, joints=joints)
    made_by = f"rosrun robot_doctor doctor new {name} --urdf {source.name}"
    frames = (foreign.model.root, foreign.tool)
    home = {}
    for key, joint in urdf.joints.items():
        middle = 0.0 if joint.lower <= 0.0 <= joint.upper else 0.5 * (joint.lower + joint.upper)
        home[key] = round(middle * (180.0 / np.pi if joint.kind == "revolute" else 1e3), 6)

    def written(figures: ArmFigures) -> Robot:
        replace_file(folder / "robot.yaml", arm_text(name, made_by, urdf, frames, figures))
        return load_robot(config)

    # With anything that can be loaded: what is found next needs a profile.
    robot = written(ArmFigures(1.0, home, {"P1": (0.0, 0.0, 0.0)}))
    model = read_body(robot)
    zone = floor_below(robot, model)
    share = _share(robot, urdf)
    robot = written(ArmFigures(share, home, {"P1": (0.0, 0.0, 0.0)}, zone))
    found = find_places(robot, FreeSpace(robot, model))
    return written(ArmFigures(share, found.home, found.positions, zone)), found


def _share(robot: Robot, urdf: DescribedArm) -> float:
    """Return the part of the wanted acceleration for which all joints have the effort.

    Raises:
        ConfigError: A joint cannot hold the arm at all.
    """
    from scara_control.dynamics.arm_model_io import ArmModel
    from scipy.stats import qmc

    joints = robot.twin_joints
    low, high = (np.array([getattr(j, key) for j in joints]) for key in ("lower", "upper"))
    wanted = np.array([start_acceleration(urdf.joints[joint.name]) for joint in joints])
    effort = np.array([joint.effort for joint in joints])
    names, still, share = [joint.name for joint in joints], [0.0] * len(joints), 1.0
    heaviest = np.zeros(len(joints))
    with ArmModel(robot.description, names, robot.tool_frame, gravity=GRAVITY) as model:
        for part in qmc.Halton(len(joints), scramble=False).random(POSES):
            q = (low + part * (high - low)).tolist()
            weight = np.abs(model.inverse_dynamics(q, still, still))
            heaviest = np.maximum(heaviest, weight)
            # All joints may accelerate at once, each in the worse direction.
            moved = np.abs(np.array(model.mass_matrix(q))) @ wanted
            share = min(share, float(((effort / SPARE - weight) / moved).min()))
    for joint, most in zip(joints, heaviest.tolist()):
        if share <= 0.0 and joint.effort <= SPARE * most:
            unit = "N m" if joint.unit == "deg" else "N"
            raise ConfigError(
                f"{robot.urdf}: joint {joint.name}: limit effort = {joint.effort:g}: the arm "
                f"weighs {most:.4g} {unit} on it: Expected more than {SPARE * most:.4g} {unit}"
            )
    return share


def _other_files(folder: Path, robot: Robot, found: FoundPlaces) -> None:
    """Write programs, start, plants and payloads of the new joints."""
    for file in folder.glob("programs/*.LS"):
        values = found.two_points if file.stem == "TWO_POINT" else None
        program = msgspec.structs.replace(read_listing(file), positions=taught(robot, values))
        replace_file(file, print_program(program))
    emulator = folder / "emulator.yaml"
    replace_file(emulator, started(emulator.read_text(encoding="utf-8"), robot))
    for file in folder.glob("plants/*.yaml"):
        replace_file(file, plant_of(file.read_text(encoding="utf-8"), robot.joints))
    replace_file(folder / "payloads.yaml", _payloads(robot))


def _payloads(robot: Robot) -> str:
    """Return payloads.yaml: an empty tool, and what the rest of the weakest effort carries."""
    joints, rates = robot.arm_joints, largest_rates(ScrewModel.from_robot(robot))
    # A slide across an axis changes its radius: by its longest way at most.
    ways = sum(max(-joint.lower, joint.upper) for joint in joints if joint.si_unit == "m")
    far = 1e-3 * robot.reach_mm + ways
    levers = [1.0 if joint.si_unit == "m" else far for joint in joints]
    if rates is not None:
        levers = [max(float(np.linalg.norm(each)), 1e-3) for each in rates]
    loads = [
        (1.0 - 1.0 / SPARE) * joint.effort / (lever * (GRAVITY + lever * joint.acceleration))
        for joint, lever in zip(joints, levers)
    ]
    return f"""\
# What may hang at the tool: PAYLOAD[number], as on a real controller; docs/tuning.md.
# [our] What the efforts of the URDF leave: take it from the manual.
rated_kg: {max(0.01, min(loads)):.2g}
set_number: 1              # what the controller is told at the start
mounted_number: 1          # what hangs at the simulated tool at the start
payloads:
  - {{number: 1, name: empty, mass_kg: 0.0}}
"""
