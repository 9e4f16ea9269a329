"""What the twin's joints hold that its coming set points do not name.

A trajectory over some joints leaves the others where they are. The real robot follows all of them,
so the others' set points are filled in: from their last set point of the same stream, else from
where they are measured to stand.
"""

from __future__ import annotations

from collections.abc import Sequence

from scara_config.robot import Joint
from scara_control.joint_motion import JointMotion, Setpoints

from twin_controller.twin.fields import PacketError

_STANDING = 0.005
"""Part of its largest speed below which a joint stands (our choice)."""
_LEFT = 0.005
"""Part of its range by which a joint that holds may be pushed off by the motion of the others (our
choice); further off something else moves it."""
_PAUSE_S = 0.5
"""Set points that come so much later belong to another stream (our choice)."""


class HeldJoints:
    """Remembers what each joint holds; of one connection to the twin.

    Args:
        joints: The twin's, in the core's order.
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        self._joints = tuple(joints)
        self._names = tuple(joint.name for joint in joints)
        self._measured: JointMotion | None = None
        # Of the running stream; empty before its first set points.
        self._held: dict[str, float] = {}
        self._heard = float("-inf")

    def forget(self) -> None:
        """Begin anew: the connection is another one."""
        self._measured, self._held = None, {}

    def measure(self, measured: JointMotion) -> None:
        """Take in where the joints are."""
        self._measured = measured

    def complete(self, setpoints: Setpoints, now: float) -> Setpoints:
        """Return the set points of all joints.

        Args:
            setpoints: Of some of them, or all.
            now: When they came [s].

        Raises:
            PacketError: A joint that is not named moves, or was never measured.
        """
        if now - self._heard > _PAUSE_S:
            self._held.clear()
        self._heard = now
        for column, joint in enumerate(self._joints):
            if joint.name not in setpoints.names:
                self._held[joint.name] = self._rest(joint, column)
        whole = setpoints.completed(self._names, self._held)
        self._held.update(zip(self._names, whole.points[-1].q))
        return whole

    def _rest(self, joint: Joint, column: int) -> float:
        """Return where a joint holds that is not named."""
        if self._measured is None:
            raise PacketError(f"joint_names: {joint.name} missing, and never measured")
        q, held = self._measured.q[column], self._held.get(joint.name)
        if held is not None and abs(q - held) <= _LEFT * (joint.upper - joint.lower):
            return held
        if abs(self._measured.qdot[column]) > _STANDING * joint.velocity:
            raise PacketError(f"joint_names: {joint.name} missing, and it moves")
        return q
