"""Set points ahead as words: by hand, and as the stand-in, which was written apart, reads them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.streaming.ring import SetpointRing
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import ConfigError, load_robot
from scara_config.modbus_map import load_modbus_map
from twin_controller.core.actions import RobotSetpoint, StreamAhead
from twin_controller.modbus import ring
from twin_controller.modbus.blocks import ring_block
from twin_controller.modbus.ring import EMPTY, RingCodec
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import SetpointError

replace = msgspec.structs.replace

ROBOTS = Path(__file__).resolve().parents[4] / "config" / "robots"
NAMES = ("fanuc_sr6ia", "articulated_six")


class Robot:
    """The stand-in's registers and ring, without its controller."""

    def __init__(self, name: str) -> None:
        self.profile, self.layout = load_robot(ROBOTS / name), load_modbus_map(ROBOTS / name)
        self.codec = RegisterCodec(self.layout, self.profile)
        self.image = RegisterImage(self.layout, self.profile)
        self.client = RingCodec(self.layout, self.codec)
        self.ring = SetpointRing(self.layout.ring_places)
        self.source = self
        self.heartbeat = self.speed_percent = -1

    def write_heartbeat(self, heartbeat: int) -> None:
        """Take R[1]."""
        self.heartbeat = heartbeat

    def write(self, ahead: StreamAhead, heartbeat: int = 7) -> None:
        """Write as the link does."""
        for offset, words in self.client.setpoints(ahead):
            self.take(offset, words)
        self.take(*self.client.times(ahead, heartbeat))

    def take(self, offset: int, words: list[int]) -> None:
        """Take one request."""
        assert len(words) <= 123
        self.image.apply(self, self.image.take(offset, words))  # type: ignore[arg-type]

    def points(self, rows: Iterable[tuple[int, int, float]]) -> tuple[RobotSetpoint, ...]:
        """Return set points (number, time, fraction of each joint's range)."""
        joints = self.profile.joints
        return tuple(
            RobotSetpoint(tuple(j.lower + part * (j.upper - j.lower) for j in joints), number, time)
            for number, time, part in rows
        )


def test_places_times_and_number_stand_where_the_map_says() -> None:
    """Places 9, 10 and 1 take numbers 9 to 11: two requests, then times, number and R[1], R[2]."""
    robot = Robot("fanuc_sr6ia")
    ahead = StreamAhead(robot.points([(9, 900, 0.5), (10, 1000, 0.5), (11, 1100, 0.5)]), 11, 50.7)
    requests = list(robot.client.setpoints(ahead))
    assert [(offset, len(words)) for offset, words in requests] == [(11500, 18), (11644, 36)]
    offset, words = robot.client.times(ahead, 7)
    assert (offset, words[:3]) == (11069, [7, 50, 11])
    times = [low + (high << 16) for low, high in zip(words[3::2], words[4::2], strict=True)]
    assert times == [1100, *[EMPTY & 0xFFFFFFFF] * 7, 900, 1000]


@pytest.mark.parametrize("most", [123, 108])
def test_neighbouring_places_go_in_one_request_as_far_as_it_carries_them(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six of 18 words; a seventh would be more than the 123 that one request may write."""
    monkeypatch.setattr(ring, "MOST_WRITTEN", most)
    robot = Robot("fanuc_sr6ia")
    points = robot.points([(number, 100 * number, 0.5) for number in range(1, 9)])
    requests = list(robot.client.setpoints(StreamAhead(points, 8, 50.0)))
    assert [(offset, len(words)) for offset, words in requests] == [(11500, 108), (11608, 36)]


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=60, deadline=None)
@given(st.integers(1, 32760), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=9), st.data())
def test_the_stand_in_drives_what_was_written(
    name: str, first: int, parts: list[float], data: st.DataObject
) -> None:
    """Whatever the numbers, in one go or in several, some of them anew."""
    robot = Robot(name)
    rows = [
        ((first - 1 + k) % 32760 + 1, 2**31 - 50 + 12 * k, part) for k, part in enumerate(parts)
    ]
    points = robot.points(rows)
    cut = data.draw(st.integers(1, len(points)))
    early = tuple(replace(p, q=points[0].q) for p in points[:cut])
    robot.write(StreamAhead(early, early[-1].number, 100.0))
    robot.write(StreamAhead(points, points[-1].number, 42.9), heartbeat=32767)
    assert (robot.heartbeat, robot.speed_percent) == (32767, 42)
    for point in points:
        seen = robot.ring.at(point.clock_ms % 2**31)
        assert seen == pytest.approx(point.q, abs=2e-5)
    assert robot.ring.read == points[-1].number


def test_a_place_that_no_longer_counts_is_marked_free() -> None:
    """What stands behind the newest number is not driven later by accident."""
    robot = Robot("fanuc_sr6ia")
    robot.write(StreamAhead(robot.points([(1, 100, 0.2), (2, 112, 0.4), (3, 124, 0.6)]), 3, 50.0))
    robot.write(StreamAhead((), 2, 50.0))
    _, words = robot.client.times(StreamAhead((), 2, 50.0), 1)
    assert words[7:9] == [0xFFFF, 0xFFFF], "number 3 is free"
    assert robot.ring.at(112) == robot.ring.at(200)


def test_nothing_of_a_lost_connection_counts() -> None:
    """The link forgets what it had written, and says so with the next times."""
    robot = Robot("fanuc_sr6ia")
    robot.write(StreamAhead(robot.points([(1, 100, 0.2), (2, 112, 0.4)]), 2, 50.0))
    robot.client.empty()
    robot.write(StreamAhead(robot.points([(3, 400, 0.6)]), 3, 50.0))
    assert robot.ring.at(112) is None
    assert robot.ring.at(400) is not None


def test_a_set_point_out_of_range_is_not_sent() -> None:
    """None of its request's words leaves, and no time is given to what stands in its place."""
    robot = Robot("fanuc_sr6ia")
    bad = replace(robot.points([(1, 100, 0.5)])[0], q=(9.0, 0.0, -0.1, 0.0, 0.0))
    with pytest.raises(SetpointError, match=r"joint_1 = 9\.0 rad is outside"):
        list(robot.client.setpoints(StreamAhead((bad,), 1, 50.0)))
    _, words = robot.client.times(StreamAhead((), 1, 50.0), 7)
    assert set(words[3:]) == {0xFFFF}


def test_a_gap_in_the_written_block_is_refused() -> None:
    """It would be written too."""
    layout = load_modbus_map(ROBOTS / "fanuc_sr6ia")
    moved = msgspec.structs.replace(layout.holding_registers["ring_clock_ms"], address=11080)
    registers = {**layout.holding_registers, "ring_clock_ms": moved}
    layout = msgspec.structs.replace(layout, holding_registers=registers)
    with pytest.raises(ConfigError, match="heartbeat, stream_speed, ring_write, ring_clock_ms"):
        ring_block(layout)


def test_a_place_is_free_from_the_first_request_until_the_last_is_written() -> None:
    """A line that breaks off between two requests leaves no set point of which half is older."""
    robot = Robot("fanuc_sr6ia")
    robot.write(StreamAhead(robot.points([(1, 100, 0.2), (2, 112, 0.4)]), 2, 50.0))
    again = StreamAhead(robot.points([(1, 100, 0.3), (2, 112, 0.5)]), 2, 50.0)
    requests = robot.client.setpoints(again)
    assert next(requests)
    _, words = robot.client.times(again, 1)
    assert words[3:7] == [0xFFFF] * 4, "numbers 1 and 2 are free"
    assert not list(requests)
    _, words = robot.client.times(again, 1)
    assert words[3:7] == [100, 0, 112, 0]
