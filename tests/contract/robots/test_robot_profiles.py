"""Every shipped robot profile.

It loads, its doctor finds nothing, its URDF and gains are those of its numbers.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import rosparam
from fanuc_emulator.config import load_emulator, load_programs
from harness.programs import steps_of
from harness.workspace import ROOT
from robot_doctor.examine import examine
from robot_doctor.finding import Level
from robot_doctor.profile_files_io import read_profile
from scara_config import Robot, load, load_robot, locate
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import CHOICE, known_robots
from scara_config.programs.steps import MoveStep
from scara_control.kinematics.tool import tool_kinematics
from scara_description.body import load_body, urdf_of
from scara_description.inertia import largest_inertia
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.tuning.stability import KINDS, Plant, spectral_radius
from scara_simulation.world_io import World
from twin_experiments.config import RealLeads, load_experiments

from scara_description.gazebo import CameraView, controllers_of, with_gazebo
from scara_description.urdf import parse_urdf

CONFIG = ROOT / "config"
ROBOTS = known_robots(CONFIG)
POSES = 200


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Robot]:
    """Choose one robot after the other."""
    monkeypatch.setenv(CHOICE, request.param)
    yield load_robot(CONFIG)


def test_there_are_five_robots_and_one_is_no_scara() -> None:
    """The article's, its smaller sister, two that turn their tool, and one that is no SCARA."""
    assert ROBOTS == ["articulated_six", "epson_gx4", "fanuc_sr3ia", "fanuc_sr6ia", "scara_4axis"]


def test_the_doctor_finds_nothing_wrong_and_nothing_to_look_at(robot: Robot) -> None:
    """What is shipped is healthy: all findings of the files are fine."""
    assert [
        finding for finding in examine(read_profile(CONFIG)) if finding.level is not Level.FINE
    ] == []


def test_the_stand_in_reads_its_files(robot: Robot) -> None:
    """Servo model, map and programs fit the robot."""
    assert load_modbus_map(CONFIG).device_id > 0
    assert set(load_emulator(robot, CONFIG).plant.axes) == {joint.name for joint in robot.joints}


def test_each_experiments_program_is_there_and_visits_its_positions(robot: Robot) -> None:
    """Joint values of the program are the inverse kinematics of the set positions, to 1 um."""
    tool, columns = (
        tool_kinematics(robot),
        [robot.joints.index(joint) for joint in robot.arm_joints],
    )
    programs = {program.name: program for program in load_programs(robot, CONFIG).values()}
    experiment = load_experiments(robot, CONFIG).experiments["real_leads"]
    assert isinstance(experiment, RealLeads)
    moves = [step for step in steps_of(programs[experiment.program]) if isinstance(step, MoveStep)]
    assert len(moves) == len(experiment.visits)
    for visit, move in zip(experiment.visits, moves):
        assert tool.position([move.target[k] for k in columns]) == pytest.approx(
            robot.positions_m[visit], abs=1e-6
        )


def test_the_written_urdf_is_up_to_date(robot: Robot) -> None:
    """`write_urdf` changes nothing; the reference parser reads it.

    The article's cell is written by hand.
    """
    if locate("body.yaml", CONFIG).is_file():
        text = urdf_of(robot, load_body(robot, CONFIG))
        view = load(locate("camera.yaml", CONFIG), CameraView)
        text = with_gazebo(text, view, parse_urdf(text).root)
        assert robot.description.read_text(encoding="utf-8") == text
    answer = subprocess.run(
        ["check_urdf", str(robot.description)],
        capture_output=True,
        text=True,
        timeout=20,
        check=False,
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    # Gazebo lets fall what is not fixed to its world.
    root, base = answer.stdout.partition("root Link: ")[2].splitlines()[:2]
    assert (root.split()[:3], base.split()) == (
        ["world", "has", "1"],
        ["child(1):", robot.base_frame],
    )


def test_what_gazebo_needs_is_up_to_date(robot: Robot) -> None:
    """`write_gazebo` changes nothing; ROS's own loader of parameters reads the controllers.

    Neither was run in Gazebo.
    """
    text = robot.description.read_text(encoding="utf-8")
    view = load(locate("camera.yaml", CONFIG), CameraView)
    assert with_gazebo(text, view, parse_urdf(text).root) == text
    gains = load(locate("pid_gains.yaml", CONFIG), dict[str, dict[str, dict[str, Any]]])
    folder = ROOT / "src" / "scara_description" / "gazebo"
    file = folder / f"{robot.name}_controllers.yaml"
    assert file.read_text(encoding="utf-8") == controllers_of(robot, gains)
    ((read, namespace),) = rosparam.load_file(str(file), default_namespace="/")
    assert (namespace, list(read)) == ("/", ["twin"])
    for joint in robot.twin_joints:
        for loop in ("position", "velocity"):
            controller = read["twin"][f"{joint.name}_{loop}_controller"]
            assert controller["joint"] == joint.name
            assert controller["pid"] == gains[joint.name][loop]


def test_efforts_suffice_inertia_is_right_and_gains_are_stable(robot: Robot) -> None:
    """Over the workspace.

    Inverse dynamics at full speed and acceleration, the largest inertia, all poles inside the
    circle.
    """
    joints, config, gains = (
        robot.twin_joints,
        load_simulation(robot, CONFIG),
        load_gains(robot, CONFIG),
    )
    random = np.random.default_rng(5)
    limits, speeds, accelerations, efforts = (
        np.array([getattr(joint, key) for joint in joints])
        for key in ("lower", "velocity", "acceleration", "effort")
    )
    poses = random.uniform(limits, [joint.upper for joint in joints], (POSES, len(joints))).tolist()
    with World(
        robot.description, [j.name for j in joints], robot.tool_frame, dt=config.dt, gravity=9.81
    ) as world:
        damping, friction = np.array(world.damping), np.array(world.friction)
        worst = np.zeros(len(joints))
        for pose in poses:
            signs, pushes = random.choice([-1.0, 1.0], (2, len(joints)))
            needed = world.inverse_dynamics(
                pose, (signs * speeds).tolist(), (pushes * accelerations).tolist()
            )
            worst = np.maximum(worst, np.abs(needed + damping * signs * speeds + friction * signs))
        matrices = np.array([world.mass_matrix(pose) for pose in poses])
    assert (worst < efforts).all(), dict(zip([joint.name for joint in joints], worst.round(2)))
    urdf = robot.description.read_text(encoding="utf-8")
    ranges = {joint.name: (joint.lower, joint.upper) for joint in joints}
    for joint, seen in zip(joints, np.diagonal(matrices, axis1=1, axis2=2).max(axis=0)):
        found = largest_inertia(urdf, ranges, joint.name)
        assert 0.6 * found < seen <= 1.001 * found, joint.name
    plant = Plant(matrices, damping, config.dt, config.tracking_bandwidth_rad_s)
    for kind in KINDS:
        assert (
            spectral_radius(plant, [(kind, getattr(loops, kind)) for loops in gains]) <= 1.0 + 1e-7
        )
