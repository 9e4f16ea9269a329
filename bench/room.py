"""What rows share.

Folder, console, peers that are installed once, cells that several rows look at.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from harness.processes import Process, Stage, free_port, wait_until
from harness.ros import Ros, own_master
from harness.workspace import workspace_environment
from rich.console import Console
from scara_config import Robot, load_robot
from typing_extensions import Self

from bench.peers.install import install

T = TypeVar("T")


class Room:
    """One run of the bench; a context manager that ends what rows have started.

    Attributes:
        folder: For logs, bags and what else the rows leave.
        console: For progress.
        robot: robot.yaml of the workspace.
    """

    def __init__(self, folder: Path, console: Console) -> None:
        self.folder, self.console = folder, console
        self.robot: Robot = load_robot()
        self._kept: dict[str, Any] = {}
        self._ending = contextlib.ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.close()

    @functools.cached_property
    def peers(self) -> str:
        """Install the peers; return what is missing, empty when all is there."""
        return install(self.console, self.folder / "peers.log")

    @functools.cached_property
    def ros(self) -> Ros:
        """Give a ROS master on a port of its own, with this process as a node of it."""
        master = self._ending.enter_context(own_master(self.place("master"), "bench"))
        ros = Ros(master, self.place("nodes"), "bench")
        return self._ending.enter_context(contextlib.closing(ros))

    @contextlib.contextmanager
    def robot_stand_in(self) -> Iterator[int]:
        """Run the emulator alone, without a ROS master; give its Modbus port."""
        port = free_port()
        stage = Stage(
            self.place("emulator"),
            {**workspace_environment(), "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"},
        )
        try:
            process: Process = stage.start("rosrun", "fanuc_emulator", "emulator", f"_port:={port}")
            wait_until(lambda: f":{port}" in process.output, 30.0, "the emulator's port")
            yield port
        finally:
            stage.close()

    def say(self, text: str) -> None:
        """Tell the user what takes time."""
        self.console.print(f"    {text}", markup=False, highlight=False)

    def once(self, key: str, make: Callable[[], T]) -> T:
        """Return what ``make`` returned the first time; a failure is kept too and raised again."""
        if key not in self._kept:
            try:
                self._kept[key] = make()
            except Exception as error:
                self._kept[key] = error
        kept = self._kept[key]
        if isinstance(kept, Exception):
            raise RuntimeError(str(kept)) from kept
        value: T = kept
        return value

    def place(self, name: str) -> Path:
        """Return a new folder for a row's files."""
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        return folder
