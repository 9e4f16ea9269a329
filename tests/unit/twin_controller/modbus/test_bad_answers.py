"""Answers that are busy, late, lost, doubled or short cost no connection, and nothing twice."""

from __future__ import annotations

import asyncio
import math
import struct
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from harness.opponents.modbus_robot import CLOCK, HEARTBEAT, LATE, Robot
from harness.processes import free_port, wait_until
from harness.wires.damage import Sometimes
from harness.wires.proxy import Proxy, modbus_units
from pymodbus.client import ModbusTcpClient
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.modbus import connection_io, port_io
from twin_controller.modbus.blocks import MOST_WRITTEN, Block
from twin_controller.modbus.connection_io import BUSY_PAUSE
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.modbus.outbox_io import Command, Outbox
from twin_controller.modbus.port_io import LinkLostError, ModbusPort, UnansweredError
from twin_controller.robot.signals import Pulse

CONFIG = Path(__file__).resolve().parents[4] / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)
FIRST, SECOND = Block(11000, 2), Block(11010, 2)
READ, COIL, REGISTERS = 3, 5, 16
TIMEOUT = 5.0
SHORT = 1.0
"""For what waits for the whole of it."""
WAIT = 0.1
"""No answer of this machine takes so long [s], however busy it is."""
STOP = LAYOUT.coils["cstopi"].offset


@pytest.fixture
def robot() -> Iterator[Robot]:
    """Return a robot that listens; its blocks differ."""
    robot = Robot()
    robot.words |= {11000: 1, 11001: 2, 11010: 3, 11011: 4}
    yield robot
    robot.close()


@pytest.fixture
def timeout() -> float:
    """Return how long the port is patient."""
    return TIMEOUT


@pytest.fixture
def port(robot: Robot, timeout: float, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModbusPort]:
    """Return a port that knows how fast the robot answers."""
    monkeypatch.setattr(connection_io, "SHORTEST_WAIT", WAIT)
    port = ModbusPort("127.0.0.1", robot.port, LAYOUT.device_id, timeout)
    port.open()
    for _ in range(20):
        port.read_words(FIRST)
    port.tally.clear()
    yield port
    port.close()


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        *(("busy", "busy"), ("acknowledge", "busy"), ("lost", "lost"), ("late", "late")),
        *(("short", "short"), ("doubled", "doubled")),
    ],
)
def test_one_bad_answer_is_asked_for_again_and_counted(
    robot: Robot, port: ModbusPort, fault: str, kind: str
) -> None:
    """On the same connection; each answer is that to its own question."""
    robot.once[READ].append(fault)
    assert port.read_words(FIRST) == [1, 2]
    end = time.monotonic() + 1.2 * LATE
    while time.monotonic() < end:
        assert port.read_words(SECOND) == [3, 4] and port.read_words(FIRST) == [1, 2]
    # A busy machine may make an answer late by itself.
    assert {each: count for each, count in port.tally.items() if count and each != "late"} == (
        {} if kind == "late" else {kind: 1}
    )
    assert port.tally[kind] >= 1 and robot.clients == 1


def test_a_lost_answer_is_asked_for_again_at_once(robot: Robot, port: ModbusPort) -> None:
    """Not after the time-out: the robot answers within a millisecond otherwise."""
    robot.once[READ].append("lost")
    begun = time.monotonic()
    port.read_words(FIRST)
    assert time.monotonic() - begun < 0.5 * TIMEOUT
    assert begun < port.sent, "the sample is as old as the question that was answered"


def test_a_busy_robot_is_left_alone_for_a_moment(robot: Robot, port: ModbusPort) -> None:
    """It is not asked as fast as it can answer."""
    robot.once[READ].extend(["busy"] * 10)
    begun = time.monotonic()
    port.read_words(FIRST)
    assert time.monotonic() - begun > 10 * BUSY_PAUSE


@pytest.mark.parametrize("timeout", [SHORT])
def test_a_robot_that_is_only_busy_is_lost_with_exception_and_count(
    robot: Robot, port: ModbusPort
) -> None:
    """After the time-out, no sooner."""
    robot.fault = "busy"
    begun = time.monotonic()
    with pytest.raises(LinkLostError, match=r"busy \(exception 6\) \(\d+ times\)"):
        port.read_words(FIRST)
    assert time.monotonic() - begun > SHORT


@pytest.mark.parametrize("timeout", [SHORT])
def test_nothing_is_asked_behind_a_part_of_an_answer(robot: Robot, port: ModbusPort) -> None:
    """The next answer would be taken for its rest: the connection ends instead."""
    robot.once[READ].append("part")
    asked = len(robot.asked)
    with pytest.raises(LinkLostError, match="a part of an answer"):
        port.read_words(FIRST)
    assert len(robot.asked) == asked + 1
    with pytest.raises(LinkLostError, match="closed"):
        port.read_words(FIRST)


class TimedPort(ModbusPort):
    """Has a time of its own, and a line on which answers take as long as ``takes`` says."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__("", 0, LAYOUT.device_id, SHORT)
        self.now, self.takes = 0.0, deque[float]()
        self._coming: list[tuple[float, int]] = []
        for module in (connection_io, port_io):
            monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: self.now))

    def _send(self, frame: bytes) -> None:
        takes = self.takes.popleft() if self.takes else 0.001
        self._coming.append((self.now + takes, *struct.unpack_from(">H", frame)))

    def _next(self, until: float, by: float) -> tuple[int, bytes] | None:
        at, number = min(self._coming, default=(math.inf, 0))
        self.now = max(self.now, min(at, until))
        if at > until:
            return None
        self._coming.remove((at, number))
        return number, bytes([READ, 4, 0, 3, 0, 4])


def test_doubt_leaves_time_for_two_lost_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Late answers make the port patient; what is lost then is still asked for a third time."""
    port = TimedPort(monkeypatch)
    for _ in range(20):
        port.read_words(SECOND)
    for _ in range(4):
        port.takes.append(LATE)
        port.read_words(SECOND)
        port.now += LATE
        port.read_words(SECOND)
    port.takes.extend([math.inf] * 2)
    begun = port.now
    assert port.read_words(SECOND) == [3, 4] and port.tally["lost"] == 2
    assert port.now - begun < 0.8 * SHORT


def test_a_slow_robot_is_not_asked_twice(robot: Robot, port: ModbusPort) -> None:
    """How long an answer takes is learned."""
    robot.delay = 1.5 * WAIT
    for _ in range(6):
        port.read_words(FIRST)
    asked, repeated = len(robot.asked), port.tally.total()
    for _ in range(6):
        port.read_words(FIRST)
    assert len(robot.asked) == asked + 6 and port.tally.total() == repeated


class Owner:
    """Hears of a link, and counts its losses."""

    def __init__(self) -> None:
        self.samples, self.lost, self.rejects = 0, list[str](), list[str]()

    def sampled(self, *_: object) -> None:
        """Count a sample."""
        self.samples += 1

    def link(self, port: int, timeout: float = TIMEOUT) -> ModbusLink:
        """Return a link that tells this owner."""
        return ModbusLink(
            ModbusSettings("127.0.0.1", port, timeout=timeout),
            LAYOUT,
            ROBOT,
            self.sampled,
            lambda up, why: None if up else self.lost.append(why),
            lambda *_: None,
            self.rejects.append,
        )


def edges(levels: Sequence[int]) -> int:
    """Return how often a coil was switched on that was off; in the end it is off."""
    assert not levels[-1], levels
    return sum(bool(after and not before) for before, after in pairwise([0, *levels]))


@pytest.mark.parametrize("fault", ["busy", "acknowledge", "lost", "late", "doubled"])
def test_a_pulse_with_bad_answers_is_one_edge_and_ends(robot: Robot, fault: str) -> None:
    """RSR, too, must start once: a coil that is on is switched on again, and off again."""
    owner = Owner()
    with owner.link(robot.port) as link:
        wait_until(lambda: link.connected)
        robot.once[COIL].extend([fault, "", fault])
        link.send(Pulse("cstopi"))
        wait_until(lambda: robot.writes(STOP)[-1:] == [(0,)])
    assert edges([level for (level,) in robot.writes(STOP)]) == 1
    assert owner.lost == [] and owner.rejects == []


@pytest.mark.parametrize("fault", ["busy", "lost"])
def test_heartbeats_go_on_while_a_command_is_not_confirmed(robot: Robot, fault: str) -> None:
    """The robot's watchdog would stop it for a busy signal."""
    owner = Owner()
    with owner.link(robot.port) as link:
        wait_until(lambda: link.connected)
        beats = len(robot.writes(HEARTBEAT))
        robot.once[COIL].extend([fault] * 8)
        link.send(Pulse("cstopi"))
        wait_until(lambda: not robot.once[COIL])
        assert len(robot.writes(HEARTBEAT)) > beats
    assert (0xFF00,) in robot.writes(STOP) and owner.lost == []


def test_what_is_left_at_the_end_is_written_in_spite_of_a_busy_robot(robot: Robot) -> None:
    """The stop, the end of its pulse and the farewell."""
    owner = Owner()
    with owner.link(robot.port) as link:
        wait_until(lambda: link.connected)
        link.send(Pulse("cstopi"))
        robot.once[COIL].extend(["busy", "lost"] * 3)
        robot.once[REGISTERS].extend(["busy"] * 5)
    assert robot.writes(STOP)[-1] == (0,) and (0xFF00,) in robot.writes(STOP)
    assert robot.written[-1] == (REGISTERS, HEARTBEAT, (0,))


def test_a_command_that_is_never_taken_ends_the_link_with_the_reason(robot: Robot) -> None:
    """Though all else is answered: nobody may think that the stop was given."""
    owner, robot.echoes = Owner(), True
    with owner.link(robot.port, SHORT) as link:
        wait_until(lambda: link.connected)
        robot.once[COIL].extend(["busy"] * 10_000)
        link.send(Pulse("cstopi"))
        wait_until(lambda: owner.lost)
    assert "busy (exception 6) (" in owner.lost[0]


def point(q: float, at: float) -> StreamReal:
    """Return a set point that is to be written at ``at``."""
    return StreamReal(RobotSetpoint((q,)), 50.0, at)


def test_of_set_points_that_are_not_confirmed_only_the_newest_is_written_again() -> None:
    """And none that was dropped meanwhile."""
    box, now = Outbox(), time.monotonic()
    old, new = point(0.0, now - 0.02), point(1.0, now - 0.01)
    box.put_back(old, None, [])
    box.put_setpoint(new)
    assert box.take(now) == (new, None, [])
    box.put_setpoint(point(2.0, now - 0.015))
    box.put_back(new, None, [])
    assert box.take(now)[0] == point(2.0, now - 0.015), "a newer decision for then or sooner"
    box.drop_setpoints()
    box.put_back(new, StreamAhead((RobotSetpoint((0.0,), 1, 0),), 1, 50.0), [])
    assert box.take(now) == (None, None, [])


def test_commands_that_are_not_confirmed_keep_their_order() -> None:
    """Before those that came later, and set points ahead are not lost with them."""
    box = Outbox()
    first, second, third = (Command(name, True, False) for name in ("hold", "cstopi", "rsr1"))
    older, newer = (StreamAhead((RobotSetpoint((k,), k, 0),), k, 50.0) for k in (1, 2))
    box.put(third)
    box.put_ahead(newer)
    box.put_back(None, older, [first, second])
    setpoint, ahead, commands = box.take(0.0)
    assert (setpoint, commands) == (None, [first, second, third])
    assert ahead is not None and [p.number for p in ahead.points] == [1, 2] and ahead.newest == 2


@pytest.mark.usefixtures("patient")
def test_a_port_that_does_not_repeat_says_so(robot: Robot) -> None:
    """The writer decides what is asked next."""
    port = ModbusPort("127.0.0.1", robot.port, LAYOUT.device_id, TIMEOUT, repeats=False)
    port.open()
    robot.once[COIL].append("busy")
    with pytest.raises(UnansweredError, match="busy"):
        port.write_coil(STOP, True)
    port.write_coil(STOP, True)
    port.close()
    assert robot.writes(STOP) == [(0xFF00,)]


class Other:
    """The server of pymodbus: busy now and then, and it keeps what it was told by each write."""

    def __init__(self, busy: float) -> None:
        self._random, self._busy = Random(1), busy
        self.refused = 0
        self.written: deque[tuple[int, int, tuple[int, ...]]] = deque()

    async def act(
        self, function: int, first: int, address: int, _: int, table: list[int], words: Any
    ) -> ExcCodes | None:
        """Be busy, or take a write and show the time."""
        if self._random.random() < self._busy:
            self.refused += 1
            return ExcCodes.DEVICE_BUSY
        if words is not None:
            self.written.append((function, address, tuple(words)))
        elif function == READ:
            high, low = divmod(time.monotonic_ns() // 1_000_000 % 2**31, 2**16)
            table[CLOCK - first], table[CLOCK + 1 - first] = low, high
        return None


@contextmanager
def served(other: Other) -> Iterator[int]:
    """Run it in a thread; yield its port."""
    words = [0] * 419
    words[36] = words[61] = words[38] = 1
    words[22], words[23] = struct.unpack("<2H", struct.pack("<f", -160.0))
    bits = [SimData(0, values=[False] * 7000, datatype=DataType.BITS)]
    registers = [SimData(10982, values=words, datatype=DataType.REGISTERS)]
    device = SimDevice(
        LAYOUT.device_id, simdata=(bits, bits, registers, registers), action=other.act
    )
    port, loop, ready = free_port(), asyncio.new_event_loop(), threading.Event()

    async def serve() -> None:
        server = ModbusTcpServer(device, address=("127.0.0.1", port))
        await server.listen()
        ready.set()
        await stop.wait()
        await server.shutdown()

    stop = asyncio.Event()
    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    assert ready.wait(5.0)
    try:
        yield port
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join()
        loop.close()


def test_no_link_is_lost_to_the_bad_answers_of_another_server() -> None:
    """Ten times as many as a bad robot gives; nothing is lost, started twice or left on."""
    owner, other = Owner(), Other(busy=0.1)
    kinds = ("late", "late", "drop", "duplicate")
    fault = Sometimes(Random(2), 0.2, kinds)
    with served(other) as port, Proxy(port, modbus_units) as line:
        line.fault = fault
        with owner.link(line.port) as link:
            wait_until(lambda: link.connected)
            for _ in range(10):
                link.send(Pulse("fault_reset"))
                wait_until(lambda seen=owner.samples: owner.samples > seen + 20)
            counters = link.counters
    assert owner.lost == [] and counters.losses == 0 and counters.connects == 1
    assert 0 < counters.busy_answers <= other.refused
    assert counters.late_answers + counters.lost_answers > 0 and counters.doubled_answers > 0
    assert fault.report["drop"] > 0
    reset = LAYOUT.coils["fault_reset"].offset
    assert edges([words[0] for _, at, words in other.written if at == reset]) == 10
    beats = [words[0] for _, at, words in other.written if at == HEARTBEAT and len(words) == 1]
    assert beats[-1] == 0, "the farewell, perhaps twice"
    assert list(filter(None, beats)) == sorted(filter(None, beats))


def test_one_request_writes_as_much_as_another_server_takes() -> None:
    """And a word more is too much for it."""
    with served(Other(busy=0.0)) as port, ModbusTcpClient("127.0.0.1", port=port) as client:
        for count in (MOST_WRITTEN, MOST_WRITTEN + 1):
            answer = client.write_registers(10982, [0] * count, device_id=LAYOUT.device_id)
            assert answer.isError() == (count > MOST_WRITTEN)
