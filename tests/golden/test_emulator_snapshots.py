"""The stand-in does bit for bit what it did: scenes in virtual time, and a digest of each.

The servo model may be made faster, not different. A digest covers every field of every snapshot,
the words on the wire and the parts. After a change of the model or of a configuration that is
wanted, put the new digests, which a failing test shows, into ``emulator_snapshots.yaml``.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.tp.executor import ProgramState
from ruamel.yaml import YAML
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.palletise import find_palletise

CONFIG = Path(__file__).parents[2] / "config" / "robots"
GOLDEN = YAML(typ="safe").load(Path(__file__).with_name("emulator_snapshots.yaml"))
WORDS_EVERY = 5


_NOT = ("plain_clock_ms", "mode", "tp_enabled", "torques")
SHOWN = msgspec.defstruct(
    "Snapshot", [each for each in Snapshot.__struct_fields__ if each not in _NOT]
)
"""All that a client can read but the controller's plain clock, which is the tick told otherwise,
and switches and torques, of which the words tell."""


class Stage:
    """A controller in virtual time, and the digest of all that it showed."""

    def __init__(self, name: str) -> None:
        folder = CONFIG / name
        self.robot = load_robot(folder)
        self.config = load_emulator(self.robot, folder)
        work = find_palletise(folder)
        self.parts = CellParts(work, self.robot) if work else None
        programs = load_programs(self.robot, folder)
        self.controller = Controller(self.config, self.robot, programs, 1.7e9, self.parts)
        self._image = RegisterImage(load_modbus_map(folder), self.robot)
        self._digest = hashlib.blake2b(digest_size=8)
        self.now: Snapshot = self.controller.snapshot()
        self.home = self.now.positions

    @property
    def digest(self) -> str:
        """Of everything so far."""
        return self._digest.hexdigest()

    def step(self) -> None:
        """Go on for one period."""
        self.now = self.controller.step()
        self._add(self.now)
        if self.now.tick % WORDS_EVERY == 0:
            self._image.show(self.now)
            self._add(self._image.tables)
            if self.parts is not None:
                # Rounded: sine and cosine differ between machines in the last bit.
                places = [self.parts.place(part) for part in self.parts.parts]
                self._add([[round(value, 9) for value in place] for place in places])
                self._add([self.parts.message, self.parts.collisions, self.parts.drops])

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / self.config.dt)):
            self.step()

    def run_until_ended(self) -> None:
        """Let the running program come to its end, and a while more."""
        limit = self.now.tick + round(60.0 / self.config.dt)
        while self.now.program_state is not ProgramState.ABORTED and self.now.tick < limit:
            self.step()
        assert self.now.program_state is ProgramState.ABORTED
        self.run(0.3)

    def pulse(self, name: str) -> None:
        """Switch an input on and off again, for as long as the robot wants to see it."""
        self.controller.write_input(name, True)
        self.run(self.config.settings.shortest_pulse_ms / 1000)
        self.controller.write_input(name, False)
        self.run(0.004)

    def aim(self, positions: list[float]) -> None:
        """Write a set point in SI."""
        self.controller.write_setpoint(positions)
        self.controller.write_setpoint_valid(True)

    def _add(self, shown: object) -> None:
        if isinstance(shown, Snapshot):
            shown = SHOWN(*[getattr(shown, name) for name in SHOWN.__struct_fields__])
        self._digest.update(msgspec.msgpack.encode(shown, order="deterministic"))


def program_at_full_speed(stage: Stage) -> None:
    """A program from its start to its end, and rest before and after."""
    stage.controller.write_override(100)
    stage.run(0.5)
    stage.pulse("rsr2")
    stage.run_until_ended()


def override_while_moving(stage: Stage) -> None:
    """Cold start override, then others on the move; an open fence caps them and pauses."""
    stage.pulse("rsr3")
    stage.run(0.5)
    for percent in (100, 37, 1, 80):
        stage.controller.write_override(percent)
        stage.run(0.31)
    stage.controller.write_input("sfspd", False)
    stage.run(0.2)
    stage.controller.write_input("sfspd", True)
    stage.pulse("start")
    stage.run(0.8)


def hold_and_go_on(stage: Stage) -> None:
    """Held on the way until all stands, and long after; then on, and ended on the way."""
    stage.controller.write_override(100)
    stage.pulse("rsr2")
    for moving, held in ((0.9, 0.02), (0.05, 1.0), (0.4, 0.3)):
        stage.run(moving)
        stage.controller.write_input("hold", False)
        stage.run(held)
        stage.controller.write_input("hold", True)
        stage.pulse("start")
    stage.run(0.5)
    stage.pulse("cstopi")
    stage.run(1.0)
    stage.pulse("rsr2")
    stage.run(1.0)


def emergency_stop(stage: Stage) -> None:
    """Drives off on the way, a reset too early, one in time, the paused program's end, a start."""
    stage.controller.write_override(100)
    stage.pulse("rsr2")
    stage.run(0.75)
    stage.controller.write_input("imstp", False)
    stage.run(0.02)
    stage.pulse("fault_reset")
    stage.controller.write_input("imstp", True)
    stage.pulse("fault_reset")
    stage.run(1.0)
    stage.pulse("rsr2")
    stage.pulse("fault_reset")
    stage.run(0.2)
    stage.pulse("cstopi")
    stage.pulse("rsr2")
    stage.run_until_ended()


def stream_of_set_points(stage: Stage) -> None:
    """Set points each 10 ms: waves, steps, rests, half written ones, slower, held."""
    stage.controller.write_override(100)
    stage.aim(list(stage.home))
    stage.pulse("rsr1")
    stage.run(0.1)

    def wave(seconds: float, size: float) -> None:
        begin = stage.now.tick
        for k in range(round(seconds / 0.01)):
            lift = size * (1.0 - math.cos(2.0 * math.pi * k / 120.0))
            positions = [
                q
                + lift * (joint.upper - q if joint.upper - q > q - joint.lower else joint.lower - q)
                for q, joint in zip(stage.home, stage.robot.joints)
            ]
            stage.aim([round(q, 6) for q in positions])  # the cosine's last bit is the machine's
            stage.controller.write_heartbeat(begin + k + 1)
            stage.run(0.01)

    def beat(seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            stage.controller.write_heartbeat(stage.now.tick % 30000 + 1)
            stage.run(0.02)

    wave(1.8, 0.05)
    beat(0.6)
    wave(0.7, 0.45)
    stage.aim([joint.upper + 5e-7 for joint in stage.robot.joints])
    beat(2.0)
    stage.controller.source.speed_percent = 20
    stage.aim([joint.lower for joint in stage.robot.joints])
    beat(0.5)
    stage.controller.write_setpoint_valid(False)
    beat(0.2)
    stage.controller.write_override(30)
    stage.controller.write_setpoint_valid(True)
    beat(0.3)
    stage.controller.write_input("hold", False)
    beat(0.6)
    stage.aim(list(stage.home))
    beat(0.1)
    stage.controller.write_input("hold", True)
    stage.controller.write_override(100)
    stage.controller.source.speed_percent = 100
    stage.pulse("start")
    beat(2.0)
    wave(0.3, 0.1)
    stage.aim([0.123456789 * q for q in stage.home])
    stage.run(1.0)  # no heartbeat: the watchdog ends it


def jogs(stage: Stage) -> None:
    """Each joint alone in small steps, with rests; as the operator's page does it."""
    stage.controller.write_override(100)
    stage.controller.source.speed_percent = 60
    stage.aim(list(stage.home))
    stage.pulse("rsr1")
    stage.run(0.1)
    positions = list(stage.home)
    for k, joint in enumerate(stage.robot.joints):
        inward = 0.01 * (joint.upper - joint.lower)
        inward = inward if positions[k] + 3 * inward < joint.upper else -inward
        for _ in range(3):
            positions[k] += inward
            stage.aim(positions)
            stage.run(0.15)
        stage.run(0.15)
    stage.pulse("cstopi")
    stage.run(0.5)


def refused_set_points(stage: Stage) -> None:
    """Beyond the range and no number: an alarm pauses the program; a client falls silent."""
    stage.controller.write_override(100)
    for value, begin in ((1e3, "rsr1"), (math.nan, "start")):
        stage.aim(list(stage.home))
        stage.pulse(begin)
        stage.run(0.1)
        stage.aim([value, *stage.home[1:]])
        stage.run(0.1)
        stage.aim(list(stage.home))
        stage.pulse("fault_reset")
        stage.run(0.1)
    stage.pulse("start")
    stage.controller.write_heartbeat(7)
    stage.run(0.5)
    stage.controller.write_heartbeat(8)
    stage.run(0.1)
    stage.controller.write_heartbeat(0)
    stage.pulse("rsr8")
    stage.pulse("start")
    stage.run(0.2)


def parts_carried(stage: Stage) -> None:
    """The program with the gripper; a part let go in the air, all put back, the nozzle too deep."""
    stage.controller.write_override(100)
    stage.pulse("rsr4")
    stage.run(4.0)
    while not stage.now.outputs.vacuum:
        stage.step()
    stage.run(0.6)
    stage.controller.write_input("gripper", False)
    stage.run(0.5)
    stage.pulse("cstopi")
    stage.run(0.5)
    assert stage.parts is not None
    stage.parts.put_back()
    stage.pulse("rsr2")
    stage.run(2.5)
    stage.pulse("cstopi")
    stage.run(0.5)
    lower = [joint.lower if joint.name == "joint_3" else 0.0 for joint in stage.robot.joints]
    stage.pulse("rsr1")
    stage.run(0.1)
    stage.aim(lower)
    stage.run(1.0)
    assert {event.kind for event in stage.parts.events} >= {"placed", "dropped", "collision"}


SCENES: dict[str, Callable[[Stage], None]] = {
    scene.__name__: scene
    for scene in (
        program_at_full_speed,
        override_while_moving,
        hold_and_go_on,
        emergency_stop,
        stream_of_set_points,
        jogs,
        refused_set_points,
        parts_carried,
    )
}


@pytest.mark.parametrize(
    ("name", "scene"), [(name, scene) for name, scenes in GOLDEN.items() for scene in scenes]
)
def test_stand_in_shows_the_same_bits(name: str, scene: str) -> None:
    """Every snapshot of the scene, the words on the wire and the parts."""
    stage = Stage(name)
    SCENES[scene](stage)
    assert stage.digest == GOLDEN[name][scene]
