"""What a Modbus client sees and what its writes mean."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import pytest
from fanuc_emulator.controller import Controller
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.registers import NoRegisterError, RegisterError, Value, decode
from fanuc_emulator.streaming.ring import EMPTY
from harness.followed import FOLLOW_MAP
from scara_config.modbus_map import ModbusMap, load_modbus_map

if TYPE_CHECKING:
    from conftest import Bench

CONFIG = Path(__file__).resolve().parents[3] / "config"


@pytest.fixture(scope="module")
def layout() -> ModbusMap:
    """Return the shipped register map."""
    return load_modbus_map(CONFIG)


@pytest.fixture
def image(layout: ModbusMap, bench: Bench) -> RegisterImage:
    """Return an image that shows the freshly booted controller."""
    image = RegisterImage(layout, bench.robot)
    image.show(bench.now)
    return image


def held(image: RegisterImage) -> list[int]:
    """Return the holding registers' words."""
    return image.tables["holding_registers"]


def at(image: RegisterImage, layout: ModbusMap, name: str) -> object:
    """Decode one register of the image."""
    register = layout.holding_registers[name]
    begin = register.offset - image.first["holding_registers"]
    return decode(register, held(image)[begin : begin + register.words])


def test_pose_stands_at_1001_in_degrees_and_millimetres_low_word_first(
    image: RegisterImage,
) -> None:
    """J3 = -160 mm is 0xC3200000: 11005 holds 0x0000, 11006 holds 0xC320, 11019 says valid."""
    begin = 11000 - image.first["holding_registers"]
    assert held(image)[begin + 4 : begin + 6] == [0x0000, 0xC320]
    assert held(image)[begin + 18] == 1


def test_a_moving_snapshot_is_shown_whole(
    image: RegisterImage, layout: ModbusMap, bench: Bench
) -> None:
    """All of the block is of one snapshot; table_joint is J5, J6 to J9 are zero."""
    bench.pulse("rsr3")
    bench.run_until(lambda now: max(abs(v) for v in now.measured_velocities) > 1.0)
    image.show(bench.now)
    position, velocity = at(image, layout, "position"), at(image, layout, "velocity")
    torque = at(image, layout, "motor_torque")
    assert torque[0] == pytest.approx(bench.now.torques[0], rel=1e-6) and torque[5:] == (0.0,) * 4
    assert 0.0 < max(map(abs, torque)) <= 100.0
    assert isinstance(position, tuple) and isinstance(velocity, tuple)
    for axis, joint in enumerate(bench.robot.joints):
        assert position[axis] == pytest.approx(
            bench.now.measured_positions[axis] / joint.scale, rel=1e-6
        )
        assert velocity[axis] == pytest.approx(
            bench.now.measured_velocities[axis] / joint.scale, rel=1e-6
        )
    assert position[5:] == (0.0,) * 4 and velocity[5:] == (0.0,) * 4
    assert at(image, layout, "clock_ms") == (bench.now.clock_ms,)
    assert at(image, layout, "program_name") == "TWO_POINT"
    assert at(image, layout, "program_state") == (2,)
    assert at(image, layout, "control_type") == (1,)
    assert at(image, layout, "override_now") == (100,)


def test_alarm_block_names_code_severity_time_and_cause(
    image: RegisterImage, layout: ModbusMap, bench: Bench
) -> None:
    """ALM[1] while an alarm is active, zeros and empty texts afterwards."""
    bench.controller.write_input("imstp", False)
    image.show(bench.run(0.2))
    assert (at(image, layout, "alarm_id"), at(image, layout, "alarm_number")) == ((11,), (37,))
    assert (at(image, layout, "alarm_severity"), at(image, layout, "alarm_severity_text")) == (
        (4,),
        "SERVO",
    )
    assert at(image, layout, "alarm_message") == "SRVO-037 IMSTP input"
    assert at(image, layout, "alarm_cause") == "the input was switched off"
    assert at(image, layout, "alarm_time") == (2023, 11, 14, 22, 13, 20)
    bench.controller.write_input("imstp", True)
    bench.pulse("fault_reset")
    image.show(bench.now)
    assert (at(image, layout, "alarm_id"), at(image, layout, "alarm_message")) == ((0,), "")
    assert (at(image, layout, "alarm_number"), at(image, layout, "alarm_severity")) == ((0,), (0,))
    assert at(image, layout, "alarm_time") == (0,) * 6


def test_one_request_with_set_point_heartbeat_and_speed_reaches_the_controller(
    image: RegisterImage, bench: Bench
) -> None:
    """11051-11071 in one request, as the twin controller writes it."""
    axes = [11.459155902616466, 0.0, -160.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    words = list(struct.unpack("<18H", struct.pack("<9f", *axes))) + [1, 77, 60]
    bench.controller.write_input("rsr1", True)
    bench.run(0.118)
    image.apply(bench.controller, image.take(11050, words))
    bench.run(0.01)
    assert (bench.now.heartbeat, bench.now.program_speed) == (77, 60)
    bench.controller.write_heartbeat(0)
    bench.run(0.5)
    assert bench.now.positions[0] == pytest.approx(0.2, abs=1e-6)


def test_one_request_fills_the_ring_whatever_its_order(
    layout: ModbusMap, image: RegisterImage, bench: Bench
) -> None:
    """The newest number counts behind rows and times, wherever it stands; 0 takes all back."""
    rows = [(90.0, 0.0, -160.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)] * layout.ring_places
    flat = tuple(value for row in rows for value in row)
    times = (100, 110, *[EMPTY] * (layout.ring_places - 2))
    written: list[tuple[str, Value]]
    written = [("ring_write", (2,)), ("ring_setpoint", flat), ("ring_clock_ms", times)]
    for values in (written, written[::-1]):
        controller = Controller(bench.config, bench.robot, {}, 1.7e9, ring_places=len(times))
        ring = controller.source.ring
        image.apply(controller, values)
        assert ring.at(99) is None
        assert ring.at(110) == pytest.approx((math.pi / 2, 0.0, -0.16, 0.0, 0.0))
        assert (ring.at(120), ring.read, ring.underruns) == (ring.at(110), 2, 1)
        image.apply(controller, [("ring_write", (0,)), ("ring_clock_ms", times)])
        assert ring.at(130) is None and not ring.fed
        image.apply(controller, [("ring_write", (2,))])
        assert ring.at(130) is None, "what came with the 0 is taken back too"


def test_half_a_value_keeps_its_other_half(image: RegisterImage) -> None:
    """A client may write words one by one; each write gives the value that the words make then."""
    assert image.take(11051, [0x3F80]) == [("setpoint", (1.0,) + (0.0,) * 8)]


@pytest.mark.parametrize(
    ("offset", "words", "text"),
    [
        (11100, [0, 0], r"override = 0 is outside \[1, 100\]"),
        (11100, [101, 0], r"override = 101 is outside"),
        (11070, [0], r"stream_speed = 0 is outside"),
        (11070, [101], r"stream_speed = 101 is outside \[1, 100\]"),
        (11069, [0x8000], r"heartbeat = -32768 is outside \[0, 32767\]"),
        (11069, [0xFFFF], r"heartbeat = -1 is outside"),
        (11068, [0xFFFF], r"setpoint_valid = -1 is outside \[0, 1\]"),
        (11068, [2], r"setpoint_valid = 2 is outside"),
        (11071, [0xFFFF], r"ring_write = -1 is outside \[0, 32760\]"),
        (11071, [32761], r"ring_write = 32761 is outside"),
    ],
)
def test_a_value_outside_its_range_is_refused_and_not_kept(
    image: RegisterImage, offset: int, words: list[int], text: str
) -> None:
    """Modbus answers exception 3 and the register keeps its value."""
    before = list(held(image))
    with pytest.raises(RegisterError, match=text):
        image.take(offset, words)
    assert held(image) == before


@pytest.mark.parametrize(
    ("offset", "first", "last"),
    [(11100, 1, 100), (11070, 1, 100), (11069, 0, 32767), (11068, 0, 1), (11071, 0, 32760)],
)
def test_the_ends_of_its_range_are_taken(
    image: RegisterImage, offset: int, first: int, last: int
) -> None:
    """Override, R[2], R[1], whether PR[1] is complete, the ring's number."""
    for value in (first, last):
        ((_, (taken,)),) = image.take(offset, [value])
        assert taken == value


def test_a_register_that_is_not_there_is_named_by_its_number(
    image: RegisterImage, layout: ModbusMap
) -> None:
    """As the map counts, from 1."""
    held = layout.holding_registers
    number = held["position"].address
    with pytest.raises(NoRegisterError, match=f"^register {number}: it does not exist or is read"):
        image.check_writable(number - 1, 1)
    last = max(each.address + each.words for each in held.values())
    with pytest.raises(NoRegisterError, match=f"^register {last}: the map has none there in hold"):
        image.read("holding_registers", last - 2, 2)


def test_payload_that_the_robot_was_told_is_shown(layout: ModbusMap, bench: Bench) -> None:
    """The plant's, where the map has a register for it."""
    image = RegisterImage(layout, bench.robot, 2.5)
    image.show(bench.now)
    assert at(image, layout, "payload_mass") == (2.5,)


def test_what_was_written_is_read_back_whatever_older_snapshot_comes(
    image: RegisterImage, layout: ModbusMap, bench: Bench
) -> None:
    """Function 23 writes and reads, and the next tick, which knew one of two, may come between."""
    image.apply(bench.controller, image.take(11100, [50, 0]))
    image.take(11100, [60, 0])
    image.show(bench.run(bench.config.dt))
    assert at(image, layout, "override") == (60,)


def test_an_override_that_a_program_sets_right_behind_a_write_is_read(
    image: RegisterImage, layout: ModbusMap, bench: Bench
) -> None:
    """What was written counts until the first tick that knows of it, though nobody reads that."""
    older = bench.run(bench.config.dt)
    image.apply(bench.controller, image.take(11100, [50, 0]))
    image.show(older)
    assert at(image, layout, "override") == (50,)
    bench.controller.write_override(20)
    image.show(bench.run(bench.config.dt))
    assert at(image, layout, "override") == (20,)


@pytest.mark.parametrize(("percent", "shown"), [(80, 5), (3, 3)])
def test_an_override_that_an_open_fence_caps_is_read_as_it_is(
    image: RegisterImage, layout: ModbusMap, bench: Bench, percent: int, shown: int
) -> None:
    """Also once the fence is closed."""
    assert bench.config.safety_speed_percent == 5
    bench.controller.write_input("sfspd", False)
    image.apply(bench.controller, image.take(11100, [percent, 0]))
    for closed in (False, True):
        bench.controller.write_input("sfspd", closed)
        image.show(bench.run(bench.config.dt))
        assert at(image, layout, "override") == at(image, layout, "override_now") == (shown,)


def test_a_delivered_robot_shows_its_own_clock_and_no_register_of_a_program(bench: Bench) -> None:
    """$FAST_CLOCK counts whole ticks of 2 ms; speeds, echo and watchdog have no register."""
    image = RegisterImage(FOLLOW_MAP, bench.robot)
    shown = []
    for offset in range(4):
        image.show(msgspec.structs.replace(bench.now, plain_clock_ms=1000001 + offset))
        shown.append(at(image, FOLLOW_MAP, "clock_ms"))
    assert shown == [(1000000.0,), (1000002.0,), (1000002.0,), (1000004.0,)]
    assert len(held(image)) == 141 and not FOLLOW_MAP.leads
