"""What the page asks of the cell; the node answers with ROS, a test with whatever it likes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import msgspec
from scara_ros.names import Seat

from operator_panel.view.robot.registers import Entry
from operator_panel.view.snapshot import Snapshot


class Answer(msgspec.Struct, frozen=True):
    """What a command or a question came to.

    Attributes:
        success: Whether it was done.
        message: In words.
        values: What else was answered.
        lost: Nobody answered: whether it was done is not known.
    """

    success: bool
    message: str
    values: Mapping[str, Any] = {}
    lost: bool = False


class Gains(msgspec.Struct, frozen=True):
    """The parameters of one joint's tuning server.

    Attributes:
        values: Name to number.
        ranges: Name to (smallest, largest).
        switches: Name to on or off.
        told: How often the server has told them; it grows even when a change and its undoing come
            to the same values.
    """

    values: dict[str, float]
    ranges: dict[str, tuple[float, float]] = {}
    switches: dict[str, bool] = {}
    told: int = 0


class CellDoor(Protocol):
    """The cell behind the page. Coroutines answer in time; no fault of the cell raises."""

    def snapshot(self) -> Snapshot:
        """Return what is known now."""

    def watch(self, watched: bool) -> None:
        """Say whether a page is open: while none is, the snapshot may be some tenths old."""

    async def command(self, seat: Seat, command: str, **fields: Any) -> Answer:
        """Send a command other than STOP and ESTOP of ``seat`` to the twin controller.

        With ``asked`` (monotonic [s]) it is as old as that: each newer stop refuses it.
        """

    async def control(self, seat: Seat, action: str, moves: bool) -> Answer:
        """Take, ask for, give, deny, release or keep control; ``moves``: it moves the twin."""

    def stop(self, seat: Seat, command: str) -> Awaitable[Answer]:
        """Send STOP or ESTOP now, not when it is awaited; values: confirmed.

        The answer always comes, maybe late.

        Raises:
            RuntimeError: Nothing was sent.
        """

    async def judge(self, **fields: Any) -> Answer:
        """Ask where MOVE would lead; ``fields`` are those of scara_msgs/JudgeMove.

        Values: name, target, elbow, refused_now.
        """

    async def try_motion(self, motion: str, **fields: Any) -> Answer:
        """Ask the second world what would come of a motion that begins now; nothing moves.

        Values: the fields of scara_msgs/JudgeMotion's answer, ``place`` as x, y, z [m].

        Args:
            motion: As in scara_msgs/JudgeMotion.
            fields: Further fields of the question.
        """

    async def convert(self, text: str, to: str, frame: int = -1) -> Answer:
        """Say a program's positions otherwise, by the second world; values: text.

        Args:
            text: Of the program's file.
            to: joints, or cartesian.
            frame: User frame of Cartesian positions, 0: the base; -1: each stays in its own.
        """

    async def shadow(self, time: float) -> Answer:
        """Ask for the pair at a time [s]; values: document (JSON), without it nobody answered."""

    async def picture(self, after: str) -> tuple[str, bytes] | None:
        """Wait a short while for a picture newer than that of ``after``; None if none came.

        Its stamp is text that grows with its time; the picture is a JPEG.
        """

    async def record(self, path: str) -> Answer:
        """Start a recording; values: path."""

    async def stop_recording(self) -> Answer:
        """Stop it; values: path."""

    async def report(self, bag: Path) -> Answer:
        """Write the report of a bag into its folder; this may take minutes."""

    def reporting(self) -> str:
        """Return the name of the run whose report is being made, empty while none is."""

    def gains(self, joint: str) -> Gains | None:
        """Return a joint's tuning parameters; None while its server is missing."""

    async def tune(
        self, joint: str, values: Mapping[str, float], switches: Mapping[str, bool]
    ) -> Answer:
        """Set a joint's tuning parameters."""

    async def undo_tuning(self) -> Answer:
        """Take the last change of gains back."""

    def jog(self, velocities: Mapping[str, float]) -> None:
        """Send joint velocities [rad/s] or [m/s]."""

    async def grip(self, close: bool, asked: float) -> Answer:
        """Close or open the twin's gripper; the real robot's follows. As old as :meth:`command`."""

    async def registers(self) -> tuple[Sequence[Entry], str]:
        """Read the robot's registers and signals once; with it why that failed, or nothing."""

    async def robot_frames(self) -> Answer:
        """Read the robot's user and tool frames once; values: frames, as Numbered."""

    async def put_parts_back(self) -> Answer:
        """Put the parts of both sides where they stood at the start."""

    async def pendant(self, *words: str, asked: float, barred: Callable[[], str]) -> Answer:
        """Press a key of the real robot's pendant.

        ``run`` is as old as ``asked``, and given up once ``barred`` tells why its page may not
        command any longer.
        """
