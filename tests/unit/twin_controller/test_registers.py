"""The twin controller's view of the registers against words written by hand."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import msgspec
import pytest
from harness.followed import FOLLOW_MAP
from hypothesis import given
from hypothesis import strategies as st
from scara_config import ConfigError, Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.set_up.kit_map import kit_map
from twin_controller.modbus.blocks import Block, check_robot
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    SampleError,
    SetpointError,
    WatchdogState,
)

CONFIG = Path(__file__).resolve().parents[3] / "config"
ROBOT: Robot = load_robot(CONFIG)
LAYOUT: ModbusMap = load_modbus_map(CONFIG)
CODEC = RegisterCodec(LAYOUT, ROBOT)
SIGNALS = [True, True, True, False, False, False, False, False, False, True] + [False] * 14


def low_first(*values: float) -> list[int]:
    """Return float32 words as the controller's manual lays them out: low word first."""
    return list(struct.unpack(f"<{2 * len(values)}H", struct.pack(f"<{len(values)}f", *values)))


def state_words(
    position: tuple[float, ...] = (10.0, 20.0, -160.0, 30.0, -40.0), **changed: Any
) -> list[int]:
    """Return an answer to the state block: 66 words from 10983 on, motor torques first."""
    words = low_first(50.0, -25.0, 0.0, 10.0, changed.get("table_torque", 0), 0.0, 0.0, 0.0, 0.0)
    words += low_first(*position, 0.0, 0.0, 0.0, 0.0) + [changed.get("valid", 1)]
    words += [0x5678, changed.get("clock_high", 0x1234)] + low_first(
        1.0, 2.0, 3.0, 4.0, 5.0, 0.0, 0.0, 0.0, 0.0
    )
    words += [
        changed.get("control", 2),
        changed.get("speed", 50),
        77,
        changed.get("watchdog", 1),
        changed.get("override", 100),
        changed.get("ring_read", 12345),
        changed.get("underruns", 3),
        *(changed.get("b0", 1), changed.get("b1", 1)),
    ]
    return words


def test_one_read_covers_the_state_and_one_write_the_set_point() -> None:
    """10983-11048 is read, 11051-11071 written, UO[1..10] and the gripper read, a request each.

    PDU addresses are one less.
    """
    assert CODEC.state == Block(10982, 66)
    assert CODEC.setpoint == Block(11050, 21)
    assert CODEC.ring == Block(11069, 23)
    assert CODEC.outputs == Block(6000, 24)
    assert CODEC.program.count <= 125 and CODEC.alarm.count <= 125


def test_a_state_block_is_decoded_in_si_in_the_order_of_the_profile() -> None:
    """Degrees and millimetres become rad and m; J5 is table_joint; signals have names."""
    sample = CODEC.decode_sample(state_words(), SIGNALS)
    expected = (math.radians(10), math.radians(20), -0.160, math.radians(30), math.radians(-40))
    assert sample.motion.q == pytest.approx(expected, rel=1e-6)
    assert sample.motion.qdot == pytest.approx(
        (math.radians(1), math.radians(2), 0.003, math.radians(4), math.radians(5)), rel=1e-6
    )
    assert sample.clock_ms == 0x12345678
    assert (sample.control_type, sample.watchdog_state) == (ControlType.STREAM, WatchdogState.ARMED)
    assert (sample.program_speed, sample.override, sample.heartbeat_echo) == (50, 100, 77)
    assert (sample.ring_places, sample.ring_read, sample.ring_underruns) == (10, 12345, 3)
    assert sample.outputs == {"cmdenbl", "sysrdy", "progrun", "busy"}
    assert sample.efforts == pytest.approx([150.0, -30.0, 0.0, 2.0, 0.0]), "of efforts in N m, N"


def test_a_torque_that_is_no_number_is_left_out_and_the_reading_stays() -> None:
    """No motion hangs on it; a robot without the register tells no effort at all."""
    assert CODEC.decode_sample(state_words(table_torque=float("nan")), SIGNALS).efforts == ()


def test_a_robot_that_takes_nothing_ahead_shows_an_empty_ring() -> None:
    """Its map knows no ring, no mode switch and no torque: the state block is without them."""
    gone = ("ring_", "mode_", "motor_")
    registers = {k: v for k, v in LAYOUT.holding_registers.items() if not k.startswith(gone)}
    codec = RegisterCodec(msgspec.structs.replace(LAYOUT, holding_registers=registers), ROBOT)
    assert codec.ring is None
    sample = codec.decode_sample(state_words()[18:][: codec.state.count], SIGNALS)
    assert (sample.ring_places, sample.ring_read, sample.ring_underruns) == (0, 0, 0)
    assert (sample.operation_mode, sample.efforts) == ("", ())


@pytest.mark.parametrize(
    ("b0", "b1", "mode"), [(1, 1, "AUTO"), (0, 0, "T1"), (0, 1, "T2"), (1, 0, ""), (7, 7, "")]
)
def test_two_bits_tell_the_mode_switch(b0: int, b1: int, mode: str) -> None:
    """What no switch can show is not known, and refuses no sample."""
    assert CODEC.decode_sample(state_words(b0=b0, b1=b1), SIGNALS).operation_mode == mode


@pytest.mark.parametrize(
    ("words", "signals", "text"),
    [
        (state_words()[:-1], SIGNALS, "65 words instead of 66"),
        (state_words() + [0], SIGNALS, "67 words instead of 66"),
        (state_words(), SIGNALS[:9], "9 signals instead of 24"),
        (state_words(valid=0), SIGNALS, "position is not valid"),
        (state_words((math.nan, 0.0, 0.0, 0.0, 0.0)), SIGNALS, "joint_1 = nan deg is outside"),
        (state_words((0.0, math.inf, 0.0, 0.0, 0.0)), SIGNALS, "joint_2 = inf deg is outside"),
        (
            state_words((148.5, 0.0, 0.0, 0.0, 0.0)),
            SIGNALS,
            r"joint_1 = 148.5 deg is outside \[-148, 148\]",
        ),
        (
            state_words((0.0, 0.0, 1.0, 0.0, 0.0)),
            SIGNALS,
            r"joint_3 = 1.0 mm is outside \[-210, 0\]",
        ),
        (state_words(control=3), SIGNALS, "3 is not a valid ControlType"),
        (state_words(watchdog=-1), SIGNALS, "is not a valid WatchdogState"),
        (state_words(override=101), SIGNALS, r"override_now = 101 is outside \[0, 100\]"),
        (state_words(clock_high=0x8000), SIGNALS, "clock_ms = -2147461512 is negative"),
    ],
)
def test_a_doubtful_answer_is_refused_with_its_reason(
    words: list[int], signals: list[bool], text: str
) -> None:
    """Nothing that cannot be true gets inside."""
    with pytest.raises(SampleError, match=text):
        CODEC.decode_sample([word & 0xFFFF for word in words], signals)


@pytest.mark.parametrize("speed", [700.0, -700.0, math.inf, -math.inf, math.nan])
def test_an_impossible_speed_is_refused(speed: float) -> None:
    """One far above the joint's greatest is a wrong answer, not a motion, either way."""
    words = state_words()
    words[39:41] = low_first(speed)
    with pytest.raises(SampleError, match=rf"joint_1 moves at {speed} deg/s"):
        CODEC.decode_sample(words, SIGNALS)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_speed_up_to_half_as_much_again_is_read(sign: float) -> None:
    """A robot may be a little faster than its data sheet, either way."""
    joint = ROBOT.joints[0]
    words = state_words()
    words[39:41] = low_first(sign * 1.49 * joint.velocity / joint.scale)
    assert CODEC.decode_sample(words, SIGNALS).motion.qdot[0] == pytest.approx(
        sign * 1.49 * joint.velocity, rel=1e-6
    )


def test_a_clock_that_begins_is_read() -> None:
    """0 ms is a time, too."""
    words = state_words(clock_high=0)
    words[37] = 0
    assert CODEC.decode_sample(words, SIGNALS).clock_ms == 0


def test_a_position_just_over_its_limit_is_read() -> None:
    """Rounding at the end of the range is no error."""
    assert (
        CODEC.decode_sample(state_words((148.0001, 0.0, 0.0002, 0.0, 0.0)), SIGNALS).motion.q[2]
        > 0.0
    )


def test_set_points_stand_low_word_first_in_degrees_and_millimetres() -> None:
    """PR[1], valid, R[1], R[2]: 90 deg is 0x42B40000, -160 mm is 0xC3200000.

    A speed is rounded down to whole percent: it is the most that is allowed.
    """
    _, words = CODEC.encode_setpoint((math.pi / 2, 0.0, -0.160, 0.0, 0.0), 4711, 79.2)
    assert words[0:2] == [0x0000, 0x42B4]
    assert words[4:6] == [0x0000, 0xC320]
    assert words[6:18] == [0] * 12
    assert words[18:] == [1, 4711, 79]
    assert CODEC.encode_setpoint((0.0, 0.0, -0.160, 0.0, 0.0), 4711, 0.4)[1][20] == 1, "not less"


def test_an_axis_without_a_joint_is_written_as_it_was_read() -> None:
    """In PR[1] and in a place of the ring; what is no number is 0."""
    words = state_words()
    words[28:32] = low_first(-98.26, math.nan)
    sample = CODEC.decode_sample(words, SIGNALS)
    whole = (*sample.motion.q, *sample.axes)
    _, written = CODEC.encode_setpoint(whole, 1, 50.0)
    assert written[10:14] == [*low_first(-98.26), 0, 0]
    assert CODEC.encode_positions(whole) == written[:18]


@pytest.mark.parametrize(
    ("positions", "speed", "text"),
    [
        ((0.0,) * 4, 50.0, "4 positions for 5 joints"),
        ((math.nan, 0.0, 0.0, 0.0, 0.0), 50.0, "joint_1 = nan rad is outside"),
        ((0.0, 2.7, 0.0, 0.0, 0.0), 50.0, r"joint_2 = 2.7 rad is outside \[-2.61799, 2.61799\]"),
        ((0.0, 0.0, 0.001, 0.0, 0.0), 50.0, r"joint_3 = 0.001 m is outside \[-0.21, 0\]"),
        ((0.0,) * 5, 0.0, r"speed_percent = 0.0 is outside"),
        ((0.0,) * 5, 101.0, r"speed_percent = 101.0 is outside"),
    ],
)
def test_a_set_point_that_cannot_be_meant_is_refused(
    positions: tuple[float, ...], speed: float, text: str
) -> None:
    """The last check before the wire rejects, it never clamps."""
    with pytest.raises(SetpointError, match=text):
        CODEC.encode_setpoint(positions, 1, speed)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_set_point_at_the_end_of_its_range_may_be_off_by_what_rounding_loses(sign: float) -> None:
    """A billionth of a rad beyond it is the end, two are outside."""
    end = sign * ROBOT.joints[1].upper
    assert CODEC.encode_setpoint((0.0, end + sign * 0.9e-9, 0.0, 0.0, 0.0), 1, 50.0)
    with pytest.raises(SetpointError, match="joint_2"):
        CODEC.encode_setpoint((0.0, end + sign * 2e-9, 0.0, 0.0, 0.0), 1, 50.0)


@given(
    st.tuples(
        st.floats(-2.5, 2.5),
        st.floats(-2.6, 2.6),
        st.floats(-0.21, 0.0),
        st.floats(-12.0, 12.0),
        st.floats(-3.1, 3.1),
    )
)
def test_what_is_written_is_read_back_by_the_same_layout(positions: tuple[float, ...]) -> None:
    """PR[1] and POS[0] have one layout: the words of a set point are a legal position block."""
    written = CODEC.encode_setpoint(positions, 1, 100.0)[1][:18]
    sample = CODEC.decode_sample(state_words()[:18] + written + state_words()[36:], SIGNALS)
    assert sample.motion.q == pytest.approx(positions, rel=1e-6, abs=1e-9)


def test_high_word_first_is_obeyed() -> None:
    """Another controller may order its words the other way."""
    swapped = RegisterCodec(msgspec.structs.replace(LAYOUT, word_order="high_first"), ROBOT)
    assert swapped.encode_setpoint((math.pi / 2, 0.0, 0.0, 0.0, 0.0), 1, 50.0)[1][0:2] == [
        0x42B4,
        0x0000,
    ]
    assert swapped.encode_int("override", 100) == [0, 100]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [("override", 100, [100, 0]), ("override", -2, [0xFFFE, 0xFFFF]), ("setpoint_valid", 0, [0])],
)
def test_integers_are_encoded_by_their_width(name: str, value: int, words: list[int]) -> None:
    """int32 low word first, int16 one word."""
    assert CODEC.encode_int(name, value) == words


def test_an_integer_that_does_not_fit_is_refused() -> None:
    """No wrap-around on the wire."""
    with pytest.raises(SetpointError, match=r"stream_speed = 40000 is outside"):
        CODEC.encode_int("stream_speed", 40000)


def test_program_and_alarm_blocks_become_text() -> None:
    """Two characters a word, ended by NUL."""
    program = [0x4152, 0x5449, 0x434C, 0x4500, 0, 0, 0, 0, 5, 2]
    assert CODEC.decode_program(program) == ProgramStatus("ARTICLE", 5, ProgramState.RUNNING)
    alarm = [0] * CODEC.alarm.count
    assert CODEC.decode_alarm(alarm).text == ""
    alarm[0:2] = [11, 37]
    alarm[11:13] = [0x4142, 0x4300]
    assert CODEC.decode_alarm(alarm) == AlarmStatus(11, 37, "", "ABC", "")


@pytest.mark.parametrize(("number", "severity"), [(0, ""), (1, "WARN"), (4, "SERVO"), (7, "")])
def test_an_alarm_whose_severity_is_told_as_a_number_has_its_word(
    number: int, severity: str
) -> None:
    """A map may have no register for the word: without one a warning would count as a stop."""
    held = dict(LAYOUT.holding_registers)
    del held["alarm_severity_text"]
    codec = RegisterCodec(msgspec.structs.replace(LAYOUT, holding_registers=held), ROBOT)
    words = [11, 37, *[0] * (codec.alarm.count - 2)]
    words[held["alarm_severity"].address - held["alarm_id"].address] = number
    assert codec.decode_alarm(words).severity == severity


@pytest.mark.parametrize(
    ("decode", "words", "text"),
    [
        ("decode_program", [0] * 9, "9 words"),
        ("decode_program", [0] * 9 + [7], "ProgramState"),
        ("decode_alarm", [0], "1 words"),
    ],
)
def test_wrong_status_blocks_are_refused(decode: str, words: list[int], text: str) -> None:
    """As for the state block."""
    with pytest.raises(SampleError, match=text):
        getattr(CODEC, decode)(words)


def test_a_set_point_goes_without_what_the_robot_has_no_register_for() -> None:
    """What stands behind it in the request is written all the same."""
    held = dict(LAYOUT.holding_registers)
    del held["setpoint_valid"]
    held["setpoint"] = msgspec.structs.replace(
        held["setpoint"], address=held["setpoint"].address + 1
    )
    codec = RegisterCodec(msgspec.structs.replace(LAYOUT, holding_registers=held), ROBOT)
    _, words = codec.encode_setpoint((0.0, 0.0, -0.160, 0.0, 0.0), 4711, 79.2)
    assert words[18:] == [4711, 79]


@pytest.mark.parametrize(
    ("name", "address", "text"),
    [("override_now", 11200, "one request carries 125"), ("stream_speed", 11090, "without a gap")],
)
def test_a_map_that_needs_more_than_one_request_is_refused(
    name: str, address: int, text: str
) -> None:
    """Position, speed and clock must come in one answer, the set point go in one request."""
    registers = {
        **LAYOUT.holding_registers,
        name: msgspec.structs.replace(LAYOUT.holding_registers[name], address=address),
    }
    with pytest.raises(ConfigError, match=text):
        RegisterCodec(msgspec.structs.replace(LAYOUT, holding_registers=registers), ROBOT)


def test_a_map_without_positions_has_no_place_for_an_axis() -> None:
    """The first joint is named."""
    held = {name: each for name, each in LAYOUT.holding_registers.items() if name != "position"}
    layout = msgspec.structs.replace(LAYOUT, holding_registers=held)
    with pytest.raises(ConfigError, match="position has 0 values, joint_1 is axis 1"):
        check_robot(layout, ROBOT)


FOLLOWED = RegisterCodec(FOLLOW_MAP, msgspec.structs.replace(ROBOT, lead=False))


def followed_words(clock: int = 1000) -> list[int]:
    """Return an answer of a delivered robot: POS[0], $FAST_CLOCK, the override."""
    position = low_first(10.0, 20.0, -160.0, 30.0, -40.0, 0.0, 0.0, 0.0, 0.0)
    return [*position, 1, clock & 0xFFFF, clock >> 16 & 0xFFFF, 77, 0]


@pytest.mark.parametrize(
    ("told", "control"),
    [((), ControlType.NONE), (("progrun",), ControlType.PROGRAM), (("paused",), 1)],
)
def test_what_a_robot_does_not_give_is_unknown_or_told_by_prg(
    told: tuple[str, ...], control: ControlType
) -> None:
    """Never 0 and never true: an echo of 0 would be a watchdog that nobody keeps awake."""
    sample = FOLLOWED.decode_sample(followed_words(), (), frozenset(told))
    assert sample.motion.q[0] == pytest.approx(math.radians(10))
    assert (sample.motion.qdot, sample.clock_ms, sample.override) == ((), 2000, 77)
    assert sample.plain_clock and not CODEC.decode_sample(state_words(), SIGNALS).plain_clock
    assert (sample.program_speed, sample.speed_percent) == (None, None)
    assert (sample.heartbeat_echo, sample.watchdog_state) == (None, None)
    assert sample.control_type is ControlType(control) and sample.outputs == set(told)
    assert FOLLOWED.setpoint is None and FOLLOWED.outputs is None


def test_only_a_robot_with_signals_tells_whether_its_pendant_is_enabled() -> None:
    """Without them a pendant that is off would make it automatic."""
    enabled = [name == "tpenbl" for name in LAYOUT.discrete_inputs] + [False] * 10
    assert CODEC.decode_sample(state_words(), enabled).pendant_enabled is True
    assert CODEC.decode_sample(state_words(), SIGNALS).pendant_enabled is False
    assert FOLLOWED.decode_sample(followed_words()).pendant_enabled is None


@pytest.mark.parametrize(
    ("ticks", "clock_ms"), [(2**30 - 1, 2**31 - 2), (2**30, 0), (-(2**31), 0), (-1, 2**31 - 2)]
)
def test_the_controllers_own_clock_begins_again_where_ours_does(ticks: int, clock_ms: int) -> None:
    """It counts 2 ms at a time: after 24 days it is beyond our wrap, after 49 negative."""
    assert FOLLOWED.decode_sample(followed_words(ticks)).clock_ms == clock_ms


@pytest.mark.parametrize(
    ("name", "on", "control"),
    [
        ("RSR0101", "progrun", ControlType.STREAM),
        ("RSR0101", "paused", ControlType.STREAM),
        ("RSR0101", "", ControlType.NONE),
        ("ARTICLE", "progrun", ControlType.PROGRAM),
    ],
)
def test_the_programs_name_tells_a_stream_where_no_register_does(
    name: str, on: str, control: ControlType
) -> None:
    """It stands in the same answer as the position: not even for a cycle is it another one."""
    kit = kit_map(LAYOUT)
    codec = RegisterCodec(kit, ROBOT)
    words = [0] * codec.state.count
    words[: 19 + 2] = followed_words()[: 19 + 2]
    begin = kit.holding_registers["program_name"].offset - codec.state.offset
    text = name.ljust(16, "\0").encode()
    words[begin : begin + 8] = struct.unpack(">8H", text)
    assert codec.outputs is not None
    signals = [bit == on for bit in kit.discrete_inputs]
    assert codec.decode_sample(words, signals).control_type is control
