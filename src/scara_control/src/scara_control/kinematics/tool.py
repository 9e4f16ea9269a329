"""What moves the tool.

Every robot is asked the same; a SCARA answers in closed form, others numerically.

The profile decides: a robot with ``geometry`` in robot.yaml is a SCARA.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from scara_config import Joint, Robot

from scara_control.kinematics.numeric import (
    STARTS,
    NumericArm,
    inverse,
    near,
    tool_velocity_of,
    turn_between,
    velocities_for,
)
from scara_control.kinematics.scara import (
    Elbow,
    Scara,
    Solution,
    Triple,
    branches,
    solve,
    solve_elbow,
    tool_position,
    tool_yaw,
)
from scara_control.kinematics.scara_velocity import JointVelocities, joint_velocities, tool_velocity


class InverseAnswer(NamedTuple):
    """The chosen solution, and both branches of a SCARA; None for one that breaks a limit."""

    chosen: Solution
    righty: tuple[float, ...] | None
    lefty: tuple[float, ...] | None


class ToolKinematics(Protocol):
    """Position and velocity of the tool's origin, and back; SI, in the base frame."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints that move the twin's tool, base to tool."""

    @property
    def turns(self) -> bool:
        """Whether the tool's yaw can be chosen."""

    def position(self, q: Sequence[float]) -> Triple:
        """Return where the tool is [m]."""

    def yaw(self, q: Sequence[float]) -> float:
        """Return how far the tool is turned about z of the base [rad].

        A SCARA's from zero joints, whole turns included; another arm's from home.
        """

    def velocity(self, q: Sequence[float], qdot: Sequence[float]) -> Triple:
        """Return the velocity of the tool's origin [m/s]."""

    def joint_velocities(
        self, q: Sequence[float], velocity: Sequence[float], yaw_rate: float = 0.0
    ) -> JointVelocities:
        """Return joint velocities for a velocity of the tool's origin [m/s].

        Where the tool could turn, it turns about z of the base by ``yaw_rate`` [rad/s].

        Raises:
            ScaraControlError: A ``yaw_rate`` that this arm cannot have.
        """

    def turn(self, begin: Sequence[float], end: Sequence[float]) -> Triple:
        """Return by what the tool is turned from one place to another, a rotation vector [rad].

        In the base frame; zeros where its turn cannot be chosen.
        """

    def rates(self, q: Sequence[float], velocity: Triple, turn_rate: Triple) -> JointVelocities:
        """Return joint velocities for a velocity of the tool's origin [m/s] and of its turn.

        Args:
            q: Joint positions, shape (n,).
            velocity: In the base frame.
            turn_rate: Likewise [rad/s]; left out where the turn cannot be chosen.
        """

    def near(
        self, begin: Sequence[float], guess: Sequence[float], point: Triple, turn: Triple
    ) -> tuple[float, ...]:
        """Return the joint positions next to a guess that bring the tool to a point [m].

        Args:
            begin: Joint positions where the tool's turn is counted from, and whose elbow is kept.
            guess: Near to what is wanted, shape (n,).
            point: In the base frame.
            turn: See :meth:`turn`.

        Raises:
            ScaraControlError: Out of reach or outside the limits.
        """

    def inverse(
        self,
        x: float,
        y: float,
        z: float,
        elbow: Elbow | None,
        seed: Sequence[float] | None,
        yaw: float | None = None,
    ) -> InverseAnswer:
        """Return joint positions for a tool position [m] and its ``yaw`` [rad], near ``seed``.

        Without a ``yaw`` a SCARA keeps that of ``seed``, another arm that of home, if it can.

        Raises:
            ScaraControlError: Out of reach or outside the limits, or a ``yaw`` that this arm cannot
                choose; the text says why.
        """

    def elbow(self, q: Sequence[float]) -> Elbow | None:
        """Return the branch of joint positions, None if the arm has none by name."""


class ScaraTool:
    """A SCARA, in closed form."""

    def __init__(self, scara: Scara) -> None:
        """Wrap the lengths and joints."""
        self.scara = scara

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Three or four."""
        return self.scara.joints

    @property
    def turns(self) -> bool:
        """Whether it has a wrist."""
        return self.scara.axes.wrist is not None

    def position(self, q: Sequence[float]) -> Triple:
        """See :func:`scara_control.kinematics.scara.tool_position`."""
        return tool_position(self.scara, *q)

    def yaw(self, q: Sequence[float]) -> float:
        """See :func:`scara_control.kinematics.scara.tool_yaw`."""
        return tool_yaw(self.scara, q)

    def velocity(self, q: Sequence[float], qdot: Sequence[float]) -> Triple:
        """See :func:`scara_control.kinematics.scara_velocity.tool_velocity`."""
        return tool_velocity(self.scara, q, qdot)

    def joint_velocities(
        self, q: Sequence[float], velocity: Sequence[float], yaw_rate: float = 0.0
    ) -> JointVelocities:
        """See :func:`scara_control.kinematics.scara_velocity.joint_velocities`."""
        return joint_velocities(self.scara, q, velocity, yaw_rate)

    def turn(self, begin: Sequence[float], end: Sequence[float]) -> Triple:
        """About z, whole turns included."""
        return 0.0, 0.0, self.yaw(end) - self.yaw(begin) if self.turns else 0.0

    def rates(self, q: Sequence[float], velocity: Triple, turn_rate: Triple) -> JointVelocities:
        """See :func:`scara_control.kinematics.scara_velocity.joint_velocities`."""
        return joint_velocities(self.scara, q, velocity, turn_rate[2] if self.turns else 0.0)

    def near(
        self, begin: Sequence[float], guess: Sequence[float], point: Triple, turn: Triple
    ) -> tuple[float, ...]:
        """See :func:`scara_control.kinematics.scara.solve_elbow`."""
        elbow = Elbow.of(self.scara.bend(begin))
        yaw = self.yaw(begin) + turn[2] if self.turns else None
        return solve_elbow(self.scara, *point, elbow, guess, yaw)

    def inverse(
        self,
        x: float,
        y: float,
        z: float,
        elbow: Elbow | None,
        seed: Sequence[float] | None,
        yaw: float | None = None,
    ) -> InverseAnswer:
        """See :func:`scara_control.kinematics.scara.solve`."""
        chosen = solve(self.scara, x, y, z, elbow, seed, yaw)
        return InverseAnswer(chosen, *branches(self.scara, x, y, z, seed, yaw))

    def elbow(self, q: Sequence[float]) -> Elbow | None:
        """Righty or lefty."""
        return Elbow.of(self.scara.bend(q))


class NumericTool:
    """Any other arm, from its screw axes."""

    def __init__(self, arm: NumericArm) -> None:
        """Wrap the arm."""
        self.arm = arm

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints of the arm."""
        return self.arm.joints

    @property
    def turns(self) -> bool:
        """Whether it has joints enough for a place and an orientation."""
        return self.arm.keeps_turn

    def position(self, q: Sequence[float]) -> Triple:
        """Forward kinematics."""
        return self.arm.tool_position(q)

    def yaw(self, q: Sequence[float]) -> float:
        """See :meth:`scara_control.kinematics.numeric.NumericArm.tool_yaw`."""
        return self.arm.tool_yaw(q)

    def velocity(self, q: Sequence[float], qdot: Sequence[float]) -> Triple:
        """See :func:`scara_control.kinematics.numeric.tool_velocity_of`."""
        return tool_velocity_of(self.arm, q, qdot)

    def joint_velocities(
        self, q: Sequence[float], velocity: Sequence[float], yaw_rate: float = 0.0
    ) -> JointVelocities:
        """See :func:`scara_control.kinematics.numeric.velocities_for`."""
        return velocities_for(self.arm, q, velocity, (0.0, 0.0, yaw_rate))

    def turn(self, begin: Sequence[float], end: Sequence[float]) -> Triple:
        """See :func:`scara_control.kinematics.numeric.turn_between`."""
        return turn_between(self.arm, begin, end)

    def rates(self, q: Sequence[float], velocity: Triple, turn_rate: Triple) -> JointVelocities:
        """See :func:`scara_control.kinematics.numeric.velocities_for`."""
        return velocities_for(self.arm, q, velocity, turn_rate)

    def near(
        self, begin: Sequence[float], guess: Sequence[float], point: Triple, turn: Triple
    ) -> tuple[float, ...]:
        """See :func:`scara_control.kinematics.numeric.near`."""
        return near(self.arm, begin, guess, point, turn)

    def inverse(
        self,
        x: float,
        y: float,
        z: float,
        elbow: Elbow | None,
        seed: Sequence[float] | None,
        yaw: float | None = None,
    ) -> InverseAnswer:
        """See :func:`scara_control.kinematics.numeric.inverse`."""
        found = inverse(self.arm, (x, y, z), elbow is not None, seed, yaw)
        return InverseAnswer(Solution(found, None), None, None)

    def elbow(self, q: Sequence[float]) -> Elbow | None:
        """None: its branches have no names."""
        return None


def tool_kinematics(robot: Robot, starts: int = STARTS) -> ToolKinematics:
    """Return what answers for the arm of ``robot``.

    Args:
        robot: The profile.
        starts: So many an arm without a closed form tries beside the given one and home.

    Raises:
        ScaraControlError: The profile has ``geometry`` and is no SCARA, or its screw axes are no
            mechanism.
    """
    return (
        NumericTool(NumericArm.from_robot(robot, starts))
        if robot.geometry is None
        else ScaraTool(Scara.from_robot(robot))
    )
