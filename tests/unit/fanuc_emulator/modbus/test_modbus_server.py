"""The Modbus server and the servo loop in real time.

What a client reads, what its writes do, what it is refused.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import PortError, RobotServer
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snapshot import Snapshot
from harness.processes import free_port, wait_until
from pymodbus.client import ModbusTcpClient
from scara_config.modbus_map import load_modbus_map

if TYPE_CHECKING:
    from conftest import Bench

CONFIG = Path(__file__).resolve().parents[4] / "config"
LAYOUT = load_modbus_map(CONFIG)


@pytest.fixture
def client(bench: Bench) -> Iterator[Any]:
    """Return a connected client of a running robot."""
    port = free_port()
    loop = ServoLoop(bench.controller, bench.config.dt, 0.0)
    with loop, RobotServer("127.0.0.1", port, LAYOUT, RegisterImage(LAYOUT, bench.robot), loop):
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=2.0, retries=0)
        assert client.connect()
        yield client
        client.close()
    assert loop.failure is None


def test_clock_and_position_go_on_while_a_program_runs(client: Any) -> None:
    """Each read returns the newest snapshot; the clock counts the robot's own milliseconds.

    Each clock was true between its question and its answer, so one offset to our clock, known to a
    servo period, fits all of them, however late this machine is.
    """
    client.write_coil(6009, True)
    readings: list[tuple[float, float, int]] = []
    positions = set()
    while len(positions) <= 50 or readings[-1][0] < readings[0][0] + 1000.0:
        sent = time.monotonic() * 1e3
        words = client.read_holding_registers(11000, count=44).registers
        received = time.monotonic() * 1e3
        clock = client.convert_from_registers(words[19:21], client.DATATYPE.INT32, "little")
        readings.append((sent, received, clock))
        positions.add(tuple(words[2:4]))
        assert sent < readings[0][0] + 20000.0, f"joint_2 took {len(positions)} positions"
    clocks = [clock for _, _, clock in readings]
    assert all(after - before >= 0 for before, after in itertools.pairwise(clocks))
    assert all(clock % 2 == clocks[0] % 2 for clock in clocks)
    latest = max(sent - clock for sent, _, clock in readings)
    assert latest <= min(received - clock for _, received, clock in readings) + 2.0


def test_every_register_can_be_read_and_gaps_are_0(client: Any) -> None:
    """Where the map names nothing the robot has no error, and keeps nothing."""
    for register in LAYOUT.holding_registers.values():
        for at in range(0, register.words, 120):
            count = min(120, register.words - at)
            words = client.read_holding_registers(register.offset + at, count=count).registers
            assert len(words) == count
    assert not client.write_registers(11092, [7]).isError()
    assert client.read_holding_registers(11092, count=1).registers == [0]
    assert client.read_holding_registers(11048, count=2).registers == [0, 0]
    assert client.read_holding_registers(0, count=1).registers == [0], "R[1], as delivered"
    assert client.read_input_registers(11000, count=1).exception_code == 2


def test_coils_start_at_their_normal_level_and_keep_what_is_written(client: Any) -> None:
    """*IMSTP, *HOLD, *SFSPD and ENBL are on at rest."""
    assert client.read_coils(6000, count=18).bits[:18] == [
        bit.normal for bit in LAYOUT.coils.values() if bit.offset < 6018
    ]
    client.write_coil(6001, False)
    assert client.read_coils(6001, count=1).bits[0] is False


def test_a_hold_is_seen_in_the_signals(client: Any) -> None:
    """UI2 off gives UO5 HELD on, within a few servo periods."""
    assert client.read_discrete_inputs(6000, count=10).bits[:5] == [True, True, False, False, False]
    client.write_coil(6001, False)
    wait_until(lambda: client.read_discrete_inputs(6004, count=1).bits[0], 2.0)


@pytest.mark.parametrize(
    ("function", "address", "value", "code"),
    [
        ("write_registers", 11000, [1, 2], 2),
        ("write_registers", 11043, [1], 2),
        ("write_registers", 11100, [0, 0], 3),
        ("write_registers", 11070, [101], 3),
        ("write_registers", 11071, [32761], 3),
        ("write_registers", 11044, [1], 2),
        ("write_register", 11018, 0, 2),
        ("write_coil", 6018, True, 2),
        ("write_coil", 5999, True, 2),
        ("write_coils", 6016, [True, False, True], 2),
    ],
)
def test_what_may_not_be_written_is_refused_by_its_exception(
    client: Any, function: str, address: int, value: object, code: int
) -> None:
    """2 for a read-only register or a coil that is not there, 3 for a value outside its range."""
    assert getattr(client, function)(address, value).exception_code == code


def test_a_write_is_read_back_and_takes_effect(client: Any) -> None:
    """The override written is the override in force."""
    client.write_registers(11100, [42, 0])
    assert client.read_holding_registers(11100, count=2).registers == [42, 0]
    wait_until(lambda: client.read_holding_registers(11043, count=1).registers == [42], 2.0)


def test_a_taken_port_is_named(bench: Bench) -> None:
    """The error says address and cause, at once."""
    port = free_port()
    loop = ServoLoop(bench.controller, bench.config.dt, 0.0)
    first, second = (
        RobotServer("127.0.0.1", port, LAYOUT, RegisterImage(LAYOUT, bench.robot), loop)
        for _ in range(2)
    )
    with first, pytest.raises(PortError, match=f"cannot listen on 127.0.0.1:{port}.*in use"):
        second.__enter__()


def test_ticks_are_due_on_a_nominal_time_axis(bench: Bench) -> None:
    """Whenever a step is computed, it is true at base + k dt of the robot's clock."""
    seen: list[tuple[Snapshot, float]] = []
    with ServoLoop(
        bench.controller, bench.config.dt, 200.0, lambda snapshot, due: seen.append((snapshot, due))
    ):
        wait_until(lambda: len(seen) >= 100)
    first = seen[0]
    for snapshot, due in seen:
        own = (snapshot.tick - first[0].tick) * bench.config.dt
        assert due - first[1] == pytest.approx(own / (1 + 200e-6), abs=1e-9)


def test_writes_keep_their_order_and_a_failing_step_is_not_swallowed(bench: Bench) -> None:
    """An error in the controller ends the loop and is kept for the node to raise."""
    order: list[int] = []
    failed = threading.Event()

    def fail(controller: Controller) -> None:
        failed.set()
        raise RuntimeError("a bug")

    loop = ServoLoop(bench.controller, bench.config.dt, 0.0)
    with loop:
        for number in range(50):
            loop.post(lambda controller, number=number: order.append(number))  # type: ignore[misc]
        loop.post(fail)
        assert failed.wait(5.0) and loop.ended.wait(5.0)
    assert order == list(range(50))
    assert isinstance(loop.failure, RuntimeError)


def test_whoever_reads_sees_the_tick_that_is_due_now(bench: Bench) -> None:
    """The loop's own thread sleeps between: nobody reads what is older than a tick."""
    period = bench.config.dt
    ages: list[float] = []
    newest = [0.0]
    with ServoLoop(
        bench.controller, period, 0.0, lambda _, due: newest.__setitem__(0, due)
    ) as loop:
        for _ in range(200):
            asked = time.monotonic()
            assert loop.snapshot is not None
            ages.append(asked - newest[0])
            time.sleep(0.0007)
    assert max(ages[5:]) < period


def test_ticks_are_the_same_whoever_computes_them(bench: Bench) -> None:
    """Eight readers and the loop's own thread: each tick once, in its order, at its own time."""
    seen: list[tuple[int, float]] = []
    with ServoLoop(
        bench.controller, bench.config.dt, 0.0, lambda shown, due: seen.append((shown.tick, due))
    ) as loop:
        ended = threading.Event()

        def read() -> None:
            while not ended.is_set():
                assert loop.snapshot is not None

        readers = [threading.Thread(target=read) for _ in range(8)]
        for reader in readers:
            reader.start()
        wait_until(lambda: len(seen) >= 200, 10.0)
        ended.set()
        for reader in readers:
            reader.join(5.0)
    assert [tick for tick, _ in seen] == list(range(seen[0][0], seen[0][0] + len(seen)))
    for (_, before), (_, after) in itertools.pairwise(seen):
        assert after - before == pytest.approx(bench.config.dt, abs=1e-9)


def test_a_write_counts_from_the_tick_after_its_arrival_however_late_that_is_computed(
    bench: Bench,
) -> None:
    """Nobody reads for several ticks; then the write is found where it belongs in time."""
    loop, clock = ServoLoop(bench.controller, bench.config.dt, 0.0), [0.0]
    shown: list[tuple[float, int]] = []
    loop._observe = lambda snapshot, due: shown.append((due, snapshot.general_override))
    loop._base = clock[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fanuc_emulator.drives.servo_loop_io.time.monotonic", lambda: clock[0])
        clock[0] = 2.5 * bench.config.dt
        loop.post(lambda controller: controller.write_override(37))
        clock[0] = 6.5 * bench.config.dt
        assert loop.snapshot.general_override == 37
    written = [override == 37 for _, override in shown]
    assert written == [False, False, True, True, True, True]


def test_a_failing_step_ends_the_loop_also_where_a_reader_computed_it(bench: Bench) -> None:
    """The reader keeps the last snapshot; the node hears of the error."""
    loop = ServoLoop(bench.controller, bench.config.dt, 0.0)

    def fail(controller: Controller) -> None:
        raise RuntimeError("a bug")

    with loop:
        loop.post(fail)
        wait_until(lambda: loop.snapshot is not None and loop.failure is not None, 5.0)
        tick = loop.snapshot.tick
        assert loop.ended.wait(5.0)
        assert loop.snapshot.tick == tick
    assert isinstance(loop.failure, RuntimeError)
