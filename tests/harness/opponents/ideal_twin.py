"""The core of joint_pose_controller, tick by tick, with a twin that is at its set point."""

from __future__ import annotations

import numpy as np
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.pose_control import PoseController

ROBOT, CONFIG = load_robot(), load_motion()
JOINTS = ROBOT.twin_joints
NAMES = tuple(joint.name for joint in JOINTS)
ACCELERATION = np.array([joint.acceleration for joint in JOINTS])
HOME = (0.0, 0.0, -0.16, 0.0)
FAR = (1.0, -0.8, -0.02, 0.4)
DT = CONFIG.period
MODES = dict.fromkeys(NAMES, "trajectory")


class Bench:
    """A controller, its clock and an ideal twin."""

    def __init__(self, q=HOME):
        self.now = 50.0
        self.core = PoseController(ROBOT, CONFIG, self.now)
        self.q, self.qdot = tuple(q), (0.0,) * 4
        self.setpoints, self.packets, self.outcomes, self.states = [], [], [], []
        self.measuring = True
        self.modes(MODES)
        self.tick()

    def modes(self, modes):
        """Tell the controller whom each joint obeys."""
        self.core.update_modes(modes)

    def obey(self, packet):
        """Put the twin where a packet wants it."""
        columns = [NAMES.index(name) for name in packet.names]
        q, qdot = list(self.q), list(self.qdot)
        for column, position, velocity in zip(columns, packet.points[0].q, packet.points[0].qdot):
            q[column], qdot[column] = position, velocity
        self.q, self.qdot = tuple(q), tuple(qdot)

    def tick(self, count=1):
        """Go on by periods; return the last state."""
        for _ in range(count):
            self.now += DT
            if self.measuring:
                self.core.measure(JointMotion.measured(self.q, self.qdot, self.now))
            packet = self.core.tick(self.now)
            if packet is not None:
                self.packets.append(packet)
                self.obey(packet)
                self.setpoints.append(packet.points[0])
            self.outcomes += self.core.take_outcomes()
            self.states.append(self.core.report(self.now).state)
        return self.states[-1]

    def until(self, state, most=1000):
        """Tick until ``state`` is reported; fail if it never is."""
        for _ in range(most):
            if self.tick() == state:
                return
        raise AssertionError(f"never {state}: {self.states[-5:]}")

    def move(self, target=FAR, percent=100.0, names=()):
        """Begin a move."""
        return self.core.move(names, target, percent, self.now)

    def command(self, command, reason=""):
        """Give a command."""
        self.core.command(command, reason, self.now)
        self.outcomes += self.core.take_outcomes()

    def stream(self, q, qdot=(0.0,) * 4, names=NAMES, stamp=None):
        """Send one streamed point; return what is forwarded."""
        point = JointMotion(tuple(q), tuple(qdot), (0.0,) * len(names))
        packet = Setpoints.due(names, [self.now if stamp is None else stamp], [point])
        passed = self.core.follow(packet, self.now)
        self.outcomes += self.core.take_outcomes()
        self.obey(passed)
        return passed

    @property
    def report(self):
        """Return the controller's report now."""
        return self.core.report(self.now)


def smooth(setpoints):
    """Return whether no velocity changes by more than acceleration times dt.

    5 % more are allowed for the curve between.
    """
    return (np.abs(np.diff([s.qdot for s in setpoints], axis=0)) <= ACCELERATION * DT * 1.05).all()
