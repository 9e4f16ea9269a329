"""The playing robot: Modbus server and real-time loop around a playback."""

from __future__ import annotations

import time

from fanuc_emulator.config import load_emulator
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import RobotServer
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snapshot import Snapshot
from scara_config import Robot
from scara_config.modbus_map import load_modbus_map
from typing_extensions import Self

from twin_analysis.replay.playback import Playback, PlaybackController


class StageError(RuntimeError):
    """The playing robot has failed; the text says why."""


class Stage:
    """Serves a playback in the real robot's place; a context manager."""

    def __init__(
        self, robot: Robot, playback: Playback, host: str, port: int, directory: str | None
    ) -> None:
        """Prepare the robot; it is not there before the context is entered.

        Args:
            robot: Profile.
            playback: What is played.
            host: Address to listen on.
            port: Likewise.
            directory: Configuration: emulator.yaml, modbus_map.yaml.

        Raises:
            ConfigError: A file is wrong.
        """
        config, layout = load_emulator(robot, directory), load_modbus_map(directory)
        self._controller = PlaybackController(config, robot, playback)
        self._loop = ServoLoop(self._controller, config.dt, 0.0, self._observe)
        self._server = RobotServer(host, port, layout, RegisterImage(layout, robot), self._loop)
        self._begun: float | None = None

    def __enter__(self) -> Self:
        """Start listening.

        Raises:
            PortError: The port is taken.
        """
        self._loop.__enter__()
        try:
            self._server.__enter__()
        # Nobody leaves a context that was never entered.
        except BaseException:
            self._loop.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Be gone."""
        self._server.__exit__()
        self._loop.__exit__()

    def play(self) -> None:
        """Begin."""
        # Through the mailbox: only the loop changes the controller.
        self._loop.post(lambda _: self._controller.play())

    def check(self) -> None:
        """Look whether the robot still plays, or waits to.

        Raises:
            StageError: It has failed.
        """
        if (failure := self._loop.failure) is not None:
            name = type(failure).__name__
            raise StageError(f"the playing robot has failed: {name}: {failure}") from failure

    @property
    def ended(self) -> bool:
        """Whether all has been played.

        Raises:
            StageError: The robot has failed.
        """
        self.check()
        return self._controller.ended

    @property
    def begun(self) -> float:
        """When the first row was shown, ROS time [s]."""
        assert self._begun is not None
        return self._begun

    @property
    def part(self) -> float:
        """How much has been played, 0 to 1."""
        return self._controller.part

    def _observe(self, snapshot: Snapshot, due: float) -> None:
        """Note when the first row is shown, on the axis of ROS time."""
        if self._begun is None and self._controller.playing:
            self._begun = due + time.time() - time.monotonic()
