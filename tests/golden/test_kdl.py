"""Kinematics against a second library: KDL, on a chain that is built from the URDF."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import PyKDL
import pytest
from scara_config import load_robot
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.scara import Elbow, Scara
from scara_control.kinematics.screws import ScrewModel, forward_kinematics_batch

from bench.world.scara_batch import solve_batch

ROBOT = load_robot()
SCARA, ARM = Scara.from_robot(ROBOT), ScrewModel.from_robot(ROBOT)
COUNT = 10_000


def chain() -> PyKDL.Chain:
    """Follow the URDF's joints from the base to the tool."""
    tree = ElementTree.parse(ROBOT.description)
    joints = {
        joint.find("child").get("link"): joint
        for joint in tree.getroot().iter("joint")
        if joint.find("child") is not None
    }
    found, link = PyKDL.Chain(), ROBOT.tool_frame
    path = []
    while link in joints:
        path.append(joints[link])
        link = joints[link].find("parent").get("link")
    for joint in reversed(path):
        origin, axis = joint.find("origin"), joint.find("axis")
        xyz = rpy = [0.0] * 3
        if origin is not None:
            xyz, rpy = (
                [float(word) for word in (origin.get(name) or "0 0 0").split()]
                for name in ("xyz", "rpy")
            )
        frame = PyKDL.Frame(PyKDL.Rotation.RPY(*rpy), PyKDL.Vector(*xyz))
        if joint.get("type") == "fixed":
            found.addSegment(PyKDL.Segment(PyKDL.Joint(PyKDL.Joint.Fixed), frame))
            continue
        turning = joint.get("type") != "prismatic"
        direction = frame.M * PyKDL.Vector(*map(float, axis.get("xyz").split()))
        kind = PyKDL.Joint.RotAxis if turning else PyKDL.Joint.TransAxis
        found.addSegment(
            PyKDL.Segment(PyKDL.Joint(joint.get("name"), frame.p, direction, kind), frame)
        )
    return found


def vector(q: np.ndarray) -> PyKDL.JntArray:
    """Return KDL's joint array."""
    array = PyKDL.JntArray(len(q))
    for index, value in enumerate(q.tolist()):
        array[index] = value
    return array


def matrix(frame: PyKDL.Frame) -> list[list[float]]:
    """Return a frame as a homogeneous transform."""
    return [[frame[row, column] for column in range(4)] for row in range(3)]


@pytest.fixture(scope="module")
def q() -> np.ndarray:
    """Joint positions all over the workspace, both elbows."""
    low, high = np.array([(joint.lower, joint.upper) for joint in ROBOT.arm_joints]).T
    return np.random.default_rng(21).uniform(low, high, (COUNT, 3))


def kdl_poses(q: np.ndarray) -> np.ndarray:
    """Return KDL's poses, shape (m, 3, 4)."""
    built, frame, found = chain(), PyKDL.Frame(), []
    solver = PyKDL.ChainFkSolverPos_recursive(built)  # which does not keep the chain alive
    for row in q:
        assert solver.JntToCart(vector(row), frame) == 0
        found.append(matrix(frame))
    return np.array(found)


def test_poses_are_those_of_kdl_on_the_urdf(q: np.ndarray) -> None:
    """Screws of robot.yaml and joints of the URDF are one robot, to rounding, over 10 000 poses."""
    np.testing.assert_allclose(forward_kinematics_batch(ARM, q)[:, :3], kdl_poses(q), atol=1e-13)


def test_inverse_kinematics_brings_kdls_tool_to_the_target(q: np.ndarray) -> None:
    """Both branches: what we solve, KDL finds at the target."""
    targets = forward_kinematics_batch(ARM, q)[:, :3, 3]
    for elbow in Elbow:
        solutions = solve_batch(SCARA, targets, elbow)
        assert solutions.reachable.sum() > COUNT / 2
        reached = kdl_poses(solutions.q[solutions.reachable])[:, :, 3]
        np.testing.assert_allclose(reached, targets[solutions.reachable], atol=1e-12)


def test_tip_jacobian_is_that_of_kdl(q: np.ndarray) -> None:
    """KDL's rows are linear first, ours angular first; both in the base frame."""
    built = chain()
    solver, jacobian = PyKDL.ChainJntToJacSolver(built), PyKDL.Jacobian(built.getNrOfJoints())
    for row in q[:2000]:
        assert solver.JntToJac(vector(row), jacobian) == 0
        theirs = [[jacobian[k, column] for column in range(3)] for k in (3, 4, 5, 0, 1, 2)]
        np.testing.assert_allclose(tip_jacobian(ARM, row), theirs, atol=1e-13)
