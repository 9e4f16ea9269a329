"""What disturbs a wire changes the robot's answers: what changes nothing proves nothing."""

from __future__ import annotations

import json
import struct
from random import Random
from typing import Any

import pytest
from harness.wires.clock_step import ClockStep
from harness.wires.damage import Sometimes
from harness.wires.noise import ROBOT, SCALES, ModbusNoise, WebNoise
from harness.wires.proxy import websocket_units
from harness.wires.state_answer import BLOCK, HEAD, bytes_of


def answer() -> bytes:
    """Return an answer with 100 on each axis and 5000 ms on the clock."""
    size = 2 * BLOCK.count
    unit = bytearray(7) + bytes((3, size)) + bytes(size)
    words = struct.unpack("<18H", struct.pack("<9f", *[100.0] * 9))
    unit[bytes_of("position")] = struct.pack(">18H", *words)
    unit[bytes_of("clock_ms")] = struct.pack(">2H", 5000, 0)
    return bytes(unit)


def test_noise_changes_each_joint_of_the_robots_answer() -> None:
    """As the controller reads it, and nothing else."""
    noise = ModbusNoise(Random(1), 0.5)
    ((_, noisy),) = noise(answer(), True)
    assert noise.report == {"noisy": 1.0}
    words = struct.unpack(">18H", noisy[bytes_of("position")])
    read = struct.unpack("<9f", struct.pack("<18H", *words))
    for joint in ROBOT.joints:
        assert 0.0 < abs(read[joint.axis_number - 1] - 100.0) <= 0.5
    place = bytes_of("position")
    assert place.start == HEAD + 2 * (11001 - 10983)
    assert noisy[: place.start] + noisy[place.stop :] == (
        answer()[: place.start] + answer()[place.stop :]
    )


@pytest.mark.parametrize(("joints", "cell"), [(1, ""), (4, ""), (1, "/cell_1")])
def test_noise_changes_each_joint_of_the_twins_state(joints: int, cell: str) -> None:
    """A frame of any length, also of 123 bytes; what else comes over it stays as it is."""
    names = [joint.name for joint in ROBOT.twin_joints[:joints]]
    packet: dict[str, Any] = {"op": "publish", "topic": f"{cell}/twin/joint_states"}
    packet["msg"] = {"name": names, "position": [0.5] * joints, "velocity": [0.0] * joints}
    noise = WebNoise(Random(1), 0.5)
    ((_, noisy),) = noise(frame(packet), True)
    (unit,) = websocket_units(bytearray(noisy))
    told = json.loads(unit[unit.index(b"{") :])
    for name, q in zip(names, told["msg"].pop("position")):
        assert 0.0 < abs(q - 0.5) <= 0.5 * SCALES[name]
    del packet["msg"]["position"]
    assert told == packet and noise.report == {"noisy": 1.0}
    others = (frame({"op": "publish", "topic": "/twin/state", "msg": {}}), b"\x89\0")
    assert [noise(unit, True) for unit in others] == [[(0.0, unit)] for unit in others]
    assert noise.report == {"noisy": 1.0}


def frame(packet: dict[str, Any]) -> bytes:
    """Return a text frame of a server."""
    body = json.dumps(packet).encode()
    long = struct.pack(">BBH", 0x81, 126, len(body))
    return (bytes((0x81, len(body))) if len(body) < 126 else long) + body


@pytest.mark.parametrize(("step_ms", "read"), [(700, 5700), (-700, 4300)])
def test_a_stepped_clock_is_read_as_such(step_ms: int, read: int) -> None:
    """Both ways."""
    ((_, stepped),) = ClockStep(step_ms)(answer(), True)
    assert struct.unpack(">2H", stepped[bytes_of("clock_ms")]) == (read, 0)


def test_an_answer_that_is_swapped_comes_behind_the_next_one() -> None:
    """Also with a question between them, and not over another connection."""
    fault = Sometimes(Random(1), 1.0, ("swap",))
    assert fault(b"first", True) == []
    fault.chance = 0.0
    assert fault(b"question", False) == [(0.0, b"question")]
    assert fault(b"second", True) == [(0.0, b"secondfirst")]
    assert fault(b"third", True) == [(0.0, b"third")]
    fault.chance = 1.0
    assert fault(b"lost", True) == []
    assert fault(b"HTTP/1.1 101", True) == [(0.0, b"HTTP/1.1 101")]
    fault.chance = 0.0
    assert fault(b"fourth", True) == [(0.0, b"fourth")]


def test_other_units_pass_as_they_are() -> None:
    """Questions, and answers of another length."""
    assert ModbusNoise(Random(1), 0.5)(answer(), False) == [(0.0, answer())]
    assert ClockStep(700)(answer() + b"\0", True) == [(0.0, answer() + b"\0")]
