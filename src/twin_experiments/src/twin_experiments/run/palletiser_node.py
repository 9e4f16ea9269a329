"""The twin palletises: tool by move_to, table by joint_pose_controller/move, suction by gripper.

The robot follows.
"""

from __future__ import annotations

from collections.abc import Callable

from scara_config.palletise import MM, Palletise

from scara_msgs.msg import TwinControllerState
from twin_experiments.run.cell_node import RunError, RunningCell


class Palletiser:
    """Carries parts one by one.

    Args:
        cell: The running cell.
        work: palletise.yaml.
        deadline: For one service call that needs no motion [s].
    """

    def __init__(self, cell: RunningCell, work: Palletise, deadline: float) -> None:
        self._cell, self._work, self._deadline = cell, work, deadline
        self._angle: float | None = None

    def run(self, tell: Callable[[int, str], None]) -> None:
        """Carry all parts; ``tell`` is given how many are done and the next one.

        Raises:
            RunError: A motion was refused or aborted, or a gripper did not do what it was told.
        """
        for number, ((name, _, angle, pick), place) in enumerate(
            zip(self._work.picks(), self._work.pallet.places())
        ):
            tell(number, name)
            self.carry(angle, pick, place)

    def carry(self, angle: float, pick: tuple[float, float], place: tuple[float, float]) -> None:
        """Carry one part from ``pick`` with the table at ``angle`` [rad] to ``place`` [m]."""
        if angle != self._angle:
            self._cell.move_joint(self._work.table.joint, angle, self._work.task.speed_percent)
            self._angle = angle
        self._visit(pick, self._work.pick_height, True)
        self._visit(place, self._work.place_height, False)

    def _visit(self, at: tuple[float, float], height: float, grip: bool) -> None:
        """Go over a place, down to it, switch the suction, and up again."""
        task, travel = self._work.task, self._work.task.travel_mm * MM
        for z, speed in (
            (travel, task.speed_percent),
            (height + task.near_mm * MM, task.lower_percent),
            (height, task.approach_percent),
        ):
            self._go(at, z, speed)
        # The suction acts on both sides, and a robot that was left behind would grip nothing.
        if self._cell.mode == TwinControllerState.PAUSED:
            raise RunError("the pair is paused, the robot does not follow: " + self._cell.why)
        self._switch(grip)
        self._go(at, travel, task.lower_percent)

    def _go(self, at: tuple[float, float], z: float, speed_percent: float) -> None:
        """Move, and wait until the pair is at rest.

        A move that begins while the robot's stream ends would meet its end.
        """
        self._cell.move_to((*at, z), speed_percent)
        self._cell.wait_still(self._work.task.dwell_s)

    def _switch(self, on: bool) -> None:
        """Switch the twin's suction and wait until both sides hold, or have let go."""
        answer = self._cell.grip(on, self._deadline)
        if answer:
            raise RunError(f"gripper {'on' if on else 'off'}: {answer}")
        lacking = f"both grippers to {'hold a part' if on else 'let go'}"
        self._cell.wait_until(
            lambda: self._cell.gripped() == (on, on), self._work.task.placed_s, lacking
        )
