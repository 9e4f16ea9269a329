"""The URDF is data: it agrees with robot.yaml, with the kinematics and with physics."""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet
import pytest
import rospkg
from scara_config import load_robot
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.scara import Scara, branches, tool_position
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_description.inertia import inertial_of, with_inertia
from scipy.spatial.transform import Rotation

PATH = Path(rospkg.RosPack().get_path("scara_description")) / "urdf" / "scara_cell.urdf"
TREE = ET.fromstring(PATH.read_text(encoding="utf-8"))
LINKS = {link.attrib["name"]: link for link in TREE.findall("link")}
del LINKS["world"]  # only what the cell is fixed to
JOINTS = {joint.attrib["name"]: joint for joint in TREE.findall("joint")}
ROBOT = load_robot()
ARM = ScrewModel.from_robot(ROBOT)
SCARA = Scara.from_robot(ROBOT)
TWIN = [joint.name for joint in ROBOT.twin_joints]
ARM_LINKS = ["base_link", "link_1", "link_2", "link_3", "flange", "tool0"]
POSITIONS = {
    "stand_1": (0.65, 0.0, 0.0),
    "stand_2": (0.51, 0.16, 0.10),
    "stand_3": (0.51, -0.16, 0.16),
}  # [paper]


class Cell:
    """The URDF in PyBullet."""

    def __init__(self) -> None:
        """Load it with its own inertia, everything able to touch everything but its parent."""
        self.client = pybullet.connect(pybullet.DIRECT)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION
        self.body = pybullet.loadURDF(
            str(PATH), useFixedBase=True, flags=flags, physicsClientId=self.client
        )
        infos = [
            pybullet.getJointInfo(self.body, i, self.client)
            for i in range(pybullet.getNumJoints(self.body, self.client))
        ]
        self.joint = {info[1].decode(): info[0] for info in infos}
        self.link = {info[12].decode(): info[0] for info in infos}
        self.name = {number: name for name, number in self.link.items()} | {-1: "world"}
        self.moving = [info[1].decode() for info in infos if info[2] != pybullet.JOINT_FIXED]

    def set(self, q: np.ndarray, table: float = 0.0) -> None:
        """Put the joints somewhere."""
        for name, value in zip([*TWIN[:3], "table_joint"], [*q, table]):
            pybullet.resetJointState(
                self.body, self.joint[name], value, physicsClientId=self.client
            )

    def pose(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation and origin of a link.

        From the centre of mass, the frame itself is given in single precision.
        """
        state = pybullet.getLinkState(
            self.body, self.link[link], computeForwardKinematics=1, physicsClientId=self.client
        )
        rotation = Rotation.from_quat(state[1]).as_matrix()
        return rotation, np.array(state[0]) - rotation @ np.array(state[2])

    def contacts(self) -> set[tuple[str, str]]:
        """Return the pairs of links that touch."""
        pybullet.performCollisionDetection(self.client)
        points = pybullet.getContactPoints(self.body, self.body, physicsClientId=self.client)
        return {(self.name[point[3]], self.name[point[4]]) for point in points}


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    """Load the cell once."""
    cell = Cell()
    yield cell
    pybullet.disconnect(cell.client)


def random_q(count: int, lowest_z: float) -> np.ndarray:
    """Return joint positions within the limits, corners first, the tool not below ``lowest_z``."""
    lower, upper = (
        np.array([getattr(joint, side) for joint in ROBOT.arm_joints])
        for side in ("lower", "upper")
    )
    lower[2] = lowest_z - SCARA.h
    corners = np.array(list(itertools.product(*zip(lower, upper))))
    return np.vstack([corners, np.random.default_rng(7).uniform(lower, upper, (count, 3))])


@pytest.mark.parametrize("name", LINKS)
def test_link_has_visual_collision_and_inertial(name):
    """A link without inertial would weigh 1 kg in PyBullet."""
    for part in ("visual", "collision", "inertial"):
        assert LINKS[name].find(part) is not None


@pytest.mark.parametrize("name", LINKS)
def test_inertia_is_that_of_the_shapes(name):
    """Mass, centre and inertia follow from the collision shapes; ``write_inertia`` writes them."""
    expected = inertial_of(LINKS[name])
    written = LINKS[name].find("inertial")
    values = {key: float(value) for key, value in written.find("inertia").attrib.items()}
    matrix = np.array(
        [[values["i" + "".join(sorted(row + column))] for column in "xyz"] for row in "xyz"]
    )
    np.testing.assert_allclose(matrix, expected.inertia, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(
        [float(v) for v in written.find("origin").attrib["xyz"].split()], expected.centre, atol=1e-6
    )
    moments = np.linalg.eigvalsh(matrix)
    assert moments[0] > 0.0
    assert moments[0] + moments[1] > moments[2]


def test_written_inertia_is_up_to_date():
    """Running ``write_inertia`` on the shipped file changes nothing."""
    text = PATH.read_text(encoding="utf-8")
    assert with_inertia(text) == text


def test_masses_of_the_arm_sum_to_the_robots():
    """About 30 kg [asm]."""
    assert sum(
        float(LINKS[name].find("inertial/mass").attrib["value"]) for name in ARM_LINKS
    ) == pytest.approx(30.0)


@pytest.mark.parametrize("joint", ROBOT.twin_joints, ids=TWIN)
def test_limits_speed_and_effort_are_those_of_the_profile(joint):
    """One number, two files, compared."""
    element = JOINTS[joint.name]
    limit = {key: float(value) for key, value in element.find("limit").attrib.items()}
    expected = {
        "lower": joint.lower,
        "upper": joint.upper,
        "velocity": joint.velocity,
        "effort": joint.effort,
    }
    assert limit == pytest.approx(expected, rel=1e-15, abs=1e-15)
    assert element.attrib["type"] == ("prismatic" if joint.si_unit == "m" else "revolute")
    assert float(element.find("dynamics").attrib["damping"]) > 0.0
    assert float(element.find("dynamics").attrib["friction"]) > 0.0


def test_moving_joints_are_the_twins():
    """Joint 4 is fixed in the twin, as in the article."""
    moving = [name for name, joint in JOINTS.items() if joint.attrib["type"] != "fixed"]
    assert moving == TWIN
    assert JOINTS["joint_4"].attrib["type"] == "fixed"


def test_each_moving_joint_has_a_transmission_with_an_actuator():
    """As the article lists."""
    transmissions = TREE.findall("transmission")
    assert [item.find("joint").attrib["name"] for item in transmissions] == TWIN
    for item in transmissions:
        assert item.find("type").text == "transmission_interface/SimpleTransmission"
        assert float(item.find("actuator/mechanicalReduction").text) > 0.0
        assert (
            item.find("joint/hardwareInterface").text
            == item.find("actuator/hardwareInterface").text
        )


def test_frames_of_the_profile_exist():
    """The base frame is the root, the tool frame a link."""
    assert ROBOT.base_frame == "base_link" and ROBOT.tool_frame in LINKS


def test_tool_frame_at_zero_joints_is_the_home_pose(cell):
    """M of the screw model."""
    cell.set(np.zeros(3))
    rotation, origin = cell.pose("tool0")
    np.testing.assert_allclose(rotation, np.array(ROBOT.home_pose)[:3, :3], atol=1e-12)
    np.testing.assert_allclose(origin, np.array(ROBOT.home_pose)[:3, 3], atol=1e-12)


def test_tool_pose_is_that_of_the_screw_model(cell):
    """PyBullet's forward kinematics of the URDF and ours, within 1e-9."""
    for q in random_q(200, -0.05):
        cell.set(q, 1.0)
        rotation, origin = cell.pose("tool0")
        expected = forward_kinematics(ARM, q)
        np.testing.assert_allclose(rotation, expected[:3, :3], atol=1e-9)
        np.testing.assert_allclose(origin, expected[:3, 3], atol=1e-9)


def test_tip_jacobian_is_pybullets(cell):
    """Rows (omega, v of the tool's origin), columns joint_1, joint_2, joint_3.

    The table moves nothing.
    """
    assert cell.moving == TWIN
    for q in random_q(20, -0.05):
        cell.set(q)
        state = pybullet.getLinkState(cell.body, cell.link["tool0"], physicsClientId=cell.client)
        origin = (-np.array(state[2])).tolist()
        zeros = [0.0] * 4
        linear, angular = pybullet.calculateJacobian(
            cell.body,
            cell.link["tool0"],
            [0.0, 0.0, 0.0],
            [*q, 0.0],
            zeros,
            zeros,
            physicsClientId=cell.client,
        )
        # The point is the centre of mass; it lies on the tool's axis, so joint_1 and joint_2 move
        # both alike.
        assert origin[:2] == [0.0, 0.0]
        expected = tip_jacobian(ARM, q)
        np.testing.assert_allclose(np.vstack([angular, linear])[:, :3], expected, atol=1e-9)
        np.testing.assert_array_equal(np.vstack([angular, linear])[:, 3], 0.0)


@pytest.mark.parametrize("name", POSITIONS)
def test_stand_is_below_its_position(cell, name):
    """At table_joint = 0 the article's positions lie above the stands, with room for a part."""
    cell.set(np.zeros(3))
    _, top = cell.pose(name)
    np.testing.assert_allclose(top[:2], POSITIONS[name][:2], atol=1e-9)
    assert top[2] == pytest.approx(-0.03)
    assert POSITIONS[name][2] - top[2] >= 0.03 - 1e-9


def test_stands_turn_with_the_table(cell):
    """About the table's own axis, counter-clockwise positive."""
    cell.set(np.zeros(3), 0.0)
    before = cell.pose("stand_1")[1]
    axis = cell.pose("table_link")[1]
    cell.set(np.zeros(3), 1.0)
    turn = Rotation.from_euler("z", 1.0).as_matrix()
    np.testing.assert_allclose(cell.pose("stand_1")[1], axis + turn @ (before - axis), atol=1e-9)


def test_whole_pallet_is_within_reach(cell):
    """Each point of the deck is reached from deck height to the top of the stroke.

    Somewhere on that way there is an elbow to spare.
    """
    cell.set(np.zeros(3))
    _, top = cell.pose("pallet")
    assert top[2] == pytest.approx(-0.04) and top[2] > SCARA.h + SCARA.joints[2].lower
    for dx, dy in itertools.product(np.linspace(-0.12, 0.12, 5), repeat=2):
        for z in (top[2], SCARA.h):
            assert any(q is not None for q in branches(SCARA, top[0] + dx, top[1] + dy, z))


def test_nothing_touches_while_the_tool_is_above_the_stands(cell):
    """Arm, table, stands and pallet are clear of each other.

    This holds in every pose with the tool at z >= -0.02.
    """
    tables = np.random.default_rng(9).uniform(-math.pi, math.pi, 3008)
    touching = {}
    for q, table in zip(random_q(3000, -0.02), tables):
        cell.set(q, table)
        for pair in cell.contacts():
            touching.setdefault(pair, (q.tolist(), table))
    assert touching == {}


def test_tool_pressed_into_a_stand_is_seen(cell):
    """The check above can fail: below the stand's top there is a contact."""
    q1, q2, _ = 0.0, 0.0, 0.0
    cell.set(np.array([q1, q2, -0.04 - SCARA.h]))
    assert tool_position(SCARA, q1, q2, -0.04 - SCARA.h)[2] == pytest.approx(-0.04)
    assert cell.contacts() & {("tool0", "stand_1"), ("stand_1", "tool0")}


def test_efforts_suffice_for_the_accelerations_in_the_worst_pose(cell):
    """All joints at full acceleration at once, at full speed, any signs.

    Inverse dynamics stays below the limits.
    """
    joints = ROBOT.twin_joints
    speed, acceleration, effort = (
        np.array([getattr(j, key) for j in joints])
        for key in ("velocity", "acceleration", "effort")
    )
    dynamics = [JOINTS[name].find("dynamics").attrib for name in TWIN]
    damping, friction = (
        np.array([float(item[key]) for item in dynamics]) for key in ("damping", "friction")
    )
    pybullet.setGravity(0, 0, -9.81, physicsClientId=cell.client)
    worst = np.zeros(4)
    signs = list(itertools.product((-1.0, 1.0), repeat=4))
    for q2 in np.linspace(joints[1].lower, joints[1].upper, 31):
        for moving, pushing in itertools.product(signs[:8], signs):
            qdot, qddot = np.array(moving) * speed, np.array(pushing) * acceleration
            torque = pybullet.calculateInverseDynamics(
                cell.body,
                [0.0, q2, -0.1, 0.0],
                qdot.tolist(),
                qddot.tolist(),
                physicsClientId=cell.client,
            )
            worst = np.maximum(worst, np.abs(torque + damping * qdot + friction * np.sign(qdot)))
    assert (worst < effort).all(), dict(zip(TWIN, (worst / effort).round(3)))
    assert (worst > 0.01 * effort).all()
