"""What a robot's program makes the robot do, one thing after the other."""

from __future__ import annotations

import msgspec

from scara_config.programs.tp.motion import Asked
from scara_config.programs.tp.values import Pose


class MoveStep(msgspec.Struct, frozen=True):
    """A move to be started.

    Attributes:
        line: Its number.
        target: Joint positions [rad or m].
        speed_percent: Programmed speed.
        fine: The next line waits until the motors are there.
        cnt: How far the corner to the next motion is rounded, 0..100, where it is not FINE.
        seconds: It takes so long at an override of 100 % [s]; None: by its speed.
        acc_percent: Of the usual acceleration.
        program: In which the line stands; empty: in that which was started.
    """

    line: int
    target: tuple[float, ...]
    speed_percent: float
    fine: bool
    cnt: float = 0.0
    seconds: float | None = None
    acc_percent: float = 100.0
    program: str = ""


class Target(msgspec.Struct, frozen=True):
    """Where a motion goes to.

    Attributes:
        place: Joint positions in the order of robot.yaml [rad or m], or what a register holds.
        frame: User frame of a Cartesian position.
        tool: Tool frame, by the flange.
        offset: Is added in the user frame.
        tool_offset: Is added in the tool's frame.
    """

    place: tuple[float, ...] | Pose
    frame: Pose
    tool: Pose
    offset: Pose | None = None
    tool_offset: Pose | None = None

    @property
    def shifted(self) -> bool:
        """Something is added to it."""
        return self.offset is not None or self.tool_offset is not None


class PathStep(msgspec.Struct, frozen=True):
    """A motion that is no joint motion to a position that is taught in joints.

    Attributes:
        line: Its number.
        motion: What the line asks for.
        targets: Two for an arc.
        program: In which the line stands; empty: in that which was started.
    """

    line: int
    motion: Asked
    targets: tuple[Target, ...]
    program: str = ""

    @property
    def fine(self) -> bool:
        """The next line waits until the motors are there."""
        return self.motion.cnt is None

    @property
    def cnt(self) -> float:
        """How far the corner to the next motion is rounded, 0..100."""
        return self.motion.cnt or 0.0

    @property
    def speed_percent(self) -> float:
        """Programmed speed; 0: it is told otherwise."""
        return self.motion.percent or 0.0


class WaitStep(msgspec.Struct, frozen=True):
    """A pause of ``seconds``."""

    line: int
    seconds: float
    program: str = ""


class GripperStep(msgspec.Struct, frozen=True):
    """The suction is switched.

    Attributes:
        line: Its number.
        on: Grip, or let go.
        program: In which the line stands; empty: in that which was started.
        awaited: The next step begins when the vacuum is there, or gone; else at once.
    """

    line: int
    on: bool
    program: str = ""
    awaited: bool = True


Step = MoveStep | PathStep | WaitStep | GripperStep
