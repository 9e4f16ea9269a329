"""What is written goes in an order in which nothing holds a stop up."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest
from scara_config import Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.modbus.outbox_io import Command, Outbox
from twin_controller.modbus.port_io import (
    ModbusSettings,
    Retries,
    UnansweredError,
    WriteRefusedError,
)
from twin_controller.modbus.writer_io import Writer
from twin_controller.registers import RegisterCodec
from twin_controller.robot.link import LinkLostError, RobotCounters

CONFIG = Path(__file__).resolve().parents[4] / "config"
LAYOUT, ROBOT = load_modbus_map(CONFIG), load_robot(CONFIG)
STOP = Command("cstopi", True, True)
START = Command("rsr1", True, True, behind=True)
TIMES = LAYOUT.holding_registers["heartbeat"].offset


def stop(box: Outbox) -> None:
    """Leave a stop, as the robot's signals do."""
    box.drop_setpoints()
    box.put(STOP)


class Port:
    """Notes each write, counts heartbeats of their own; calls back in the middle of one."""

    def __init__(self, beats: int) -> None:
        self._beats, self.beats = beats, 0
        self.written: list[tuple[str, int]] = []
        self.words: list[list[int]] = []  # of the registers among them
        self.levels: list[bool] = []  # of the coils
        self.meanwhile: dict[int, Callable[[], None]] = {}
        # So many of the next writes are done, but not confirmed.
        self.unanswered = 0
        # What the next writes end with.
        self.fails: list[Exception] = []

    def write_words(self, offset: int, words: list[int]) -> None:
        """Note registers."""
        if len(words) == 1 and offset == self._beats:
            self.beats += 1
            return
        self.written.append(("words", offset))
        self.words.append(words)
        self.meanwhile.pop(len(self.written), lambda: None)()
        self._confirm()

    def write_coil(self, offset: int, level: bool) -> None:
        """Note a coil."""
        self.written.append(("coil", offset))
        self.levels.append(level)
        self._confirm()

    def _confirm(self) -> None:
        if self.fails:
            raise self.fails.pop(0)
        if self.unanswered:
            self.unanswered -= 1
            raise UnansweredError("did not answer in time")

    def retries(self, begun: float) -> Retries:
        """Return one that lasts."""
        return Retries("the robot", 60.0, begun)


@pytest.fixture
def line() -> tuple[Writer, Outbox, Port]:
    """Return a writer on a line that answers at once."""
    return made(LAYOUT, ROBOT)


def made(
    layout: ModbusMap, robot: Robot, command_retry: float = 60.0
) -> tuple[Writer, Outbox, Port]:
    """Return a writer, what it takes from, and what it writes to."""
    box, port = Outbox(), Port(layout.holding_registers["heartbeat"].offset)
    listener: Any = type("Listener", (), {"alive": lambda self: True, "rejected": print})()
    settings = ModbusSettings("127.0.0.1", 1, command_retry=command_retry)
    writer = Writer(settings, layout, RegisterCodec(layout, robot), box, RobotCounters(), listener)
    writer._port = port  # type: ignore[assignment]
    return writer, box, port


def nine() -> StreamAhead:
    """Return nine set points over the ring's end: three requests, and the times."""
    home = tuple(0.5 * (joint.lower + joint.upper) for joint in ROBOT.joints)
    points = tuple(RobotSetpoint(home, number, 12 * number) for number in range(5, 14))
    return StreamAhead(points, 13, 50.0)


def test_set_points_come_before_their_times(line: tuple[Writer, Outbox, Port]) -> None:
    """And the start of the stream program behind both."""
    writer, box, port = line
    box.put_ahead(nine())
    box.put(START)
    writer._write_all()
    coil = LAYOUT.coils["rsr1"].offset
    assert port.written == [("words", 11500), ("words", 11572), ("words", TIMES), ("coil", coil)]


@pytest.mark.parametrize("ring", [False, True])
def test_no_heartbeat_comes_before_a_set_point_that_is_not_confirmed(
    line: tuple[Writer, Outbox, Port], ring: bool
) -> None:
    """It carries one; behind it a heartbeat of its own is due again."""
    writer, box, port = line
    if ring:
        box.put_ahead(nine())
    else:
        box.put_setpoint(StreamReal(nine().points[0], 50.0, 0.0))
    port.unanswered = 3
    for _ in range(3):
        writer._write_all()
    assert not port.unanswered and not port.beats
    while box.beats_soon:
        writer._write_all()
    assert not port.beats
    writer._due = 0.0
    writer._write_all()
    assert port.beats == 1


@pytest.mark.parametrize("request_number", [1, 2])
def test_a_stop_goes_before_what_is_left(
    line: tuple[Writer, Outbox, Port], request_number: int
) -> None:
    """It waits for the request that is under way, for no other; the rest is not written.

    Nor is the start that waited for it: the stream program would begin behind the stop.
    """
    writer, box, port = line
    port.meanwhile[request_number] = partial(stop, box)
    box.put_ahead(nine())
    box.put(START)
    writer._write_all()
    assert len(port.written) == request_number + 1
    assert port.written[-1] == ("coil", LAYOUT.coils["cstopi"].offset)
    box.put_ahead(nine())
    writer._write_all()
    assert port.written[-1] == ("words", TIMES), "what comes after it is written again"


def test_another_command_takes_nothing_back(line: tuple[Writer, Outbox, Port]) -> None:
    """An override goes between, and the set points behind it still count."""
    writer, box, port = line
    port.meanwhile[1] = lambda: box.put(Command("override", 50, False))
    box.put_ahead(nine())
    writer._write_all()
    override = LAYOUT.holding_registers["override"].offset
    assert port.written[1:] == [("words", override), ("words", 11572), ("words", TIMES)]


COIL = LAYOUT.coils["cstopi"].offset


@pytest.mark.parametrize("ring", [False, True])
def test_no_start_follows_a_set_point_that_was_refused(
    line: tuple[Writer, Outbox, Port], ring: bool
) -> None:
    """The stream program would begin with an old one."""
    writer, box, port = line
    bad = RobotSetpoint((9.0,) * len(ROBOT.joints), 14, 168)
    if ring:
        box.put_ahead(StreamAhead((bad,), 14, 50.0))
    else:
        box.put_setpoint(StreamReal(bad, 50.0, 0.0))
    box.put(START)
    box.put(STOP)
    writer._write_all()
    assert port.written == [("coil", COIL)] and writer._counters.refused == 1


@pytest.mark.parametrize("unanswered", [1, 2, 3])
def test_set_points_that_are_not_confirmed_are_written_again_before_their_times(
    line: tuple[Writer, Outbox, Port], unanswered: int
) -> None:
    """All requests of them: a time never counts for a place that may be old."""
    writer, box, port = line
    port.unanswered = unanswered
    box.put_ahead(nine())
    for _ in range(unanswered + 1):
        writer._write_all()
    assert port.written[-3:] == [("words", 11500), ("words", 11572), ("words", TIMES)]
    assert port.written[:unanswered] == [("words", 11500)] * unanswered


def test_a_stop_goes_before_set_points_that_are_not_confirmed(
    line: tuple[Writer, Outbox, Port],
) -> None:
    """They are forgotten then, as those that wait."""
    writer, box, port = line
    port.meanwhile[1], port.unanswered = partial(stop, box), 1
    box.put_ahead(nine())
    box.put(START)
    for _ in range(3):
        writer._write_all()
    assert port.written == [("words", 11500), ("coil", COIL)]


def test_no_start_goes_out_between_a_set_point_and_the_stop_that_comes_meanwhile(
    line: tuple[Writer, Outbox, Port],
) -> None:
    """Nor does it hold the stop up; what asks for no set point keeps its order."""
    writer, box, port = line
    port.meanwhile[1] = partial(stop, box)
    box.put_setpoint(StreamReal(nine().points[0], 50.0, 0.0))
    box.put(START)
    box.put(Command("override", 50, False))
    for _ in range(2):
        writer._write_all()
    override = LAYOUT.holding_registers["override"].offset
    assert port.written[1:] == [("words", override), ("coil", COIL)]


def test_a_stop_that_is_not_confirmed_is_repeated_before_all_else(
    line: tuple[Writer, Outbox, Port],
) -> None:
    """And what was left for the robot behind it keeps its place."""
    writer, box, port = line
    port.unanswered = 2
    box.put(STOP)
    box.put(Command("setpoint_valid", 0, False))
    for _ in range(3):
        writer._write_all()
    valid = LAYOUT.holding_registers["setpoint_valid"].offset
    assert port.written == [*[("coil", COIL)] * 3, ("words", valid)]


def test_a_numbered_command_that_is_not_confirmed_is_repeated_at_once() -> None:
    """Not only when the robot should have shown its number."""
    six = CONFIG / "robots" / "articulated_six"
    layout = load_modbus_map(six)
    writer, box, port = made(layout, load_robot(six))
    writer.echo, port.unanswered = 4, 1
    box.put(Command("hold", False, False))
    for _ in range(3):
        writer._write_all()
    assert layout.command_word is not None
    assert len(port.written) == 2 and port.written[0] == port.written[1]


def test_a_numbered_command_that_is_refused_is_not_repeated_at_once() -> None:
    """A robot in local mode refuses each: its five tries are told, not one each turn."""
    six = CONFIG / "robots" / "articulated_six"
    writer, box, port = made(load_modbus_map(six), load_robot(six))

    def refuse() -> None:
        raise WriteRefusedError("exception 4")

    writer.echo, port.meanwhile[1] = 4, refuse
    box.put(Command("hold", False, False))
    for _ in range(3):
        writer._write_all()
    assert len(port.written) == 1 and writer._counters.refused == 1


@pytest.mark.parametrize("high_first", [False, True])
def test_a_heartbeat_of_two_words_is_written_as_the_map_says(high_first: bool) -> None:
    """A plain R[] has two; in the wrong one the robot reads 65536, and the farewell disarms not."""
    ahead = [name for name in LAYOUT.holding_registers if name.startswith("ring_")]
    registers = {k: one for k, one in LAYOUT.holding_registers.items() if k not in ahead}
    beat, speed = registers["heartbeat"], registers["stream_speed"]
    registers["heartbeat"] = msgspec.structs.replace(beat, type="int32")
    registers["stream_speed"] = msgspec.structs.replace(speed, address=beat.address + 2)
    order = "high_first" if high_first else "low_first"
    layout = msgspec.structs.replace(LAYOUT, holding_registers=registers, word_order=order)
    writer, _, port = made(layout, ROBOT)
    for value in (1, 0):
        writer._beat(value)
    assert port.words == [[0, 1] if high_first else [1, 0], [0, 0]]


def test_ends_of_pulses_outlive_a_link_that_is_lost_in_one_of_them(
    line: tuple[Writer, Outbox, Port],
) -> None:
    """They are written on the next connection: a signal that stays on pulses no more."""
    writer, box, port = line
    names = ("cstopi", "rsr1", "start")
    for name in names:
        box.end_pulse(name, 0.0)
    port.fails = [LinkLostError("closed")]
    with pytest.raises(LinkLostError, match="closed"):
        writer._write_all()
    box.discard()
    writer._write_all()
    ends = [("coil", LAYOUT.coils[name].offset) for name in names[:2]]
    assert port.written == [ends[0], *ends], "the end of START would be a start"
    assert not any(port.levels) and not box.unfinished


@pytest.mark.parametrize(
    ("error", "levels"),
    [(LinkLostError("closed"), [True, False]), (WriteRefusedError("exception 4"), [True])],
    ids=("lost", "refused"),
)
def test_a_pulse_whose_beginning_nobody_confirmed_is_ended_too(
    error: Exception, levels: list[bool]
) -> None:
    """The signal may be on. One that was refused is not."""
    at_once = msgspec.structs.replace(LAYOUT.coils["cstopi"], pulse_ms=0)
    layout = msgspec.structs.replace(LAYOUT, coils={**LAYOUT.coils, "cstopi": at_once})
    writer, box, port = made(layout, ROBOT)
    port.fails = [error]
    box.put(STOP)
    with contextlib.suppress(LinkLostError):
        writer._write_all()
    box.discard()
    writer._write_all()
    assert port.levels == levels and not box.unfinished


@pytest.mark.parametrize("deaf", [False, True])
def test_numbered_commands_that_wait_at_the_end_are_still_written(deaf: bool) -> None:
    """HOLD would stay away else. A robot that confirms none is told each of them all the same."""
    six = CONFIG / "robots" / "articulated_six"
    writer, box, port = made(load_modbus_map(six), load_robot(six), command_retry=0.001)
    writer.echo = 4
    if not deaf:
        for count in (1, 2, 3):
            port.meanwhile[count] = lambda: setattr(writer, "echo", port.words[-1][1])
    for command in (Command("hold", False, False), STOP, Command("hold", True, False)):
        box.put(command)
    box.close()
    writer._run()
    assert list(dict.fromkeys(words[0] for words in port.words)) == [3, 10, 4]
    assert len(port.words) == (15 if deaf else 3) and writer._counters.refused == 3 * deaf
