"""The pendant as a device.

It looks at the robot several times a second and presses keys, over Modbus only.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import msgspec
from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from fanuc_emulator.pendant.pendant_link_io import PendantError, PendantLink

PERIOD_S = 0.2  # our choice: a display for people
RETRY_S = 1.0
STATES = ("aborted", "paused", "running")
SWITCHES = ("panel_imstp", "panel_hold", "sfspd", "enbl")


class DisplayReading(msgspec.Struct, frozen=True):
    """What the display shows.

    Attributes:
        trouble: Why nothing can be shown, or an empty text.
        rows: For each joint name, position and speed in deg or mm, unit. No speed: the robot does
            not tell.
        program: Name, line and state.
        override: In force [%].
        mode: At what the mode switch stands; empty: the robot does not tell.
        alarm: As the controller words it, or an empty text.
        lamps: Outputs UO by name.
        switches: Level of the inputs that are switches here.
    """

    trouble: str
    rows: tuple[tuple[str, float, float | None, str], ...] = ()
    program: str = ""
    override: int = 0
    mode: str = ""
    alarm: str = ""
    lamps: dict[str, bool] = {}
    switches: dict[str, bool] = {}


class PendantStation:
    """One connection to the robot, kept up by a thread; a context manager."""

    def __init__(self, host: str, port: int, layout: ModbusMap, robot: Robot) -> None:
        """Remember where the robot is."""
        self._address = (host, port, layout)
        self._robot = robot
        self._lock = threading.Lock()
        self._link: PendantLink | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="pendant", daemon=True)
        self.reading = DisplayReading("looking for the robot")

    def __enter__(self) -> PendantStation:
        """Start looking."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(2.0)
        self._close()

    def press(self, key: Callable[[PendantLink], None]) -> str:
        """Let ``key`` act on the robot; return why it could not, or an empty text."""
        try:
            with self._lock:
                key(self._connected())
        except PendantError as error:
            self._close()
            return str(error)
        return ""

    def _watch(self) -> None:
        while not self._ended.is_set():
            try:
                with self._lock:
                    self.reading = self._read(self._connected())
                self._ended.wait(PERIOD_S)
            except PendantError as error:
                self._close()
                self.reading = DisplayReading(str(error))
                self._ended.wait(RETRY_S)

    def _connected(self) -> PendantLink:
        if self._link is None:
            self._link = PendantLink(*self._address).__enter__()
        return self._link

    def _close(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            link.__exit__(None, None, None)

    def _read(self, link: PendantLink) -> DisplayReading:
        positions, velocities = link.read("position"), link.read("velocity")
        rows = tuple(
            (
                joint.name,
                float(positions[joint.axis_number - 1]),
                float(velocities[joint.axis_number - 1]) if velocities else None,
                joint.unit,
            )
            for joint in self._robot.joints
        )
        state = int(link.read("program_state")[0])
        name, line = link.read("program_name") or "no program", link.read("program_line")[0]
        return DisplayReading(
            trouble="",
            rows=rows,
            program=f"{name}  line {line}  {STATES[state] if state < len(STATES) else state}",
            override=int(link.read("override_now")[0]),
            mode=link.mode(),
            alarm=link.alarm(),
            lamps=link.outputs(),
            switches={name: link.signal(name) for name in SWITCHES},
        )


def expire_heartbeat(link: PendantLink) -> None:
    """Arm the robot's watchdog with a heartbeat that never changes.

    That raises the alarm of a controller that died.
    """
    # The watchdog is armed by a change only: the clock makes it another number each time, never 0,
    # which would disarm it.
    link.write("heartbeat", [time.monotonic_ns() % 30000 + 1])
