"""Rows modbus_read, loop_jitter.

The twin controller's side of the Modbus line, on the robot's stand-in.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from itertools import pairwise

import pymodbus
from pymodbus.client import AsyncModbusTcpClient, ModbusTcpClient
from scara_config.modbus_map import ModbusMap, load_modbus_map
from twin_controller.config import load_twin_controller
from twin_controller.modbus.link_io import ModbusLink
from twin_controller.modbus.port_io import ModbusPort, ModbusSettings
from twin_controller.registers import RegisterCodec

from bench.record import Beside, Goal, Record, Rounds, interleaved, median, of_rounds
from bench.room import Room
from bench.timing import timed

READ_ROUNDS, READS = 9, 300
LOOP_ROUNDS, LOOP_S, PERIOD = 5, 3.0, 0.01


def _checked(port: ModbusPort, codec: RegisterCodec) -> Callable[[], object]:
    """Return our read of everything that the link polls.

    Each answer checked and turned into typed values.
    """

    def read() -> object:
        sample = codec.decode_sample(port.read_words(codec.state), port.read_signals(codec.outputs))
        program = codec.decode_program(port.read_words(codec.program))
        return sample, program, codec.decode_alarm(port.read_words(codec.alarm))

    return read


def _bare(client: ModbusTcpClient, codec: RegisterCodec, layout: ModbusMap) -> Callable[[], object]:
    """Return the same four requests by pymodbus alone; nothing is looked at."""

    def read() -> object:
        device = layout.device_id
        words = getattr(client, f"read_{codec.state.table}")(
            codec.state.offset, count=codec.state.count, device_id=device
        )
        signals = client.read_discrete_inputs(
            codec.outputs.offset, count=codec.outputs.count, device_id=device
        )
        program = getattr(client, f"read_{codec.program.table}")(
            codec.program.offset, count=codec.program.count, device_id=device
        )
        alarm = getattr(client, f"read_{codec.alarm.table}")(
            codec.alarm.offset, count=codec.alarm.count, device_id=device
        )
        return words.registers, signals.bits, program.registers, alarm.registers

    return read


def modbus_read(room: Room) -> Record:
    """One read of all registers, checked and decoded, against as many raw registers."""
    layout = load_modbus_map(None)
    codec = RegisterCodec(layout, room.robot)
    with room.robot_stand_in() as port:
        ours, bare = (
            ModbusPort("127.0.0.1", port, layout.device_id, 1.0),
            ModbusTcpClient("127.0.0.1", port=port, retries=0),
        )
        ours.open()
        bare.connect()
        checked, raw = _checked(ours, codec), _bare(bare, codec, layout)
        samples = interleaved(READ_ROUNDS, lambda: timed(checked, READS), lambda: timed(raw, READS))
        ours.close()
        bare.close()
    value, tail, spread = of_rounds(samples[0], median, 1e6)
    other, other_tail, other_spread = of_rounds(samples[1], median, 1e6)
    words = codec.state.count + codec.program.count + codec.alarm.count
    return Record(
        "modbus_read",
        value,
        other,
        "us",
        (Goal("ratio", 1.2),),
        measured=f"state, program and alarm blocks ({words} registers) and {codec.outputs.count} "
        "signals in 4 requests, "
        "counted, range-checked and decoded",
        against=f"pymodbus {pymodbus.__version__} synchronous client, the same 4 requests, nothing "
        "looked at",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=READ_ROUNDS,
    )


def _polling(room: Room, port: int) -> list[float]:
    """Let the link poll for some seconds and return the error of each period [s]."""
    sent: list[float] = []
    real = load_twin_controller(room.robot).real
    settings = ModbusSettings(
        "127.0.0.1", port, poll_period=PERIOD, timeout=real.timeout_ms * 1e-3, heartbeat=False
    )
    with ModbusLink(
        settings,
        load_modbus_map(None),
        room.robot,
        lambda _, begun, __: sent.append(begun),
        lambda *_: None,
    ):
        time.sleep(LOOP_S)
    return _errors(sent)


def _errors(stamps: list[float]) -> list[float]:
    """Return the errors of the periods.

    The first ones, while the connection is made, are left out.
    """
    kept = stamps[20:]
    return [abs(after - before - PERIOD) for before, after in pairwise(kept)]


def _asyncio_loop(
    port: int, layout: ModbusMap, codec: RegisterCodec, absolute: bool
) -> list[float]:
    """Poll the same registers by asyncio for some seconds.

    Sleeping a period after each poll, or to absolute deadlines.
    """
    stamps: list[float] = []

    async def run() -> None:
        client, device = AsyncModbusTcpClient("127.0.0.1", port=port, retries=0), layout.device_id
        await client.connect()
        due = begun = time.monotonic()
        while due < begun + LOOP_S and len(stamps) < LOOP_S / PERIOD:
            stamps.append(time.monotonic())
            await getattr(client, f"read_{codec.state.table}")(
                codec.state.offset, count=codec.state.count, device_id=device
            )
            await client.read_discrete_inputs(
                codec.outputs.offset, count=codec.outputs.count, device_id=device
            )
            due += PERIOD
            await asyncio.sleep(max(0.0, due - time.monotonic()) if absolute else PERIOD)
        client.close()

    asyncio.run(run())
    return _errors(stamps)


def loop_jitter(room: Room) -> Record:
    """By how much the periods of the 100 Hz loop miss their length."""
    layout = load_modbus_map(None)
    codec = RegisterCodec(layout, room.robot)
    with room.robot_stand_in() as port:
        ours, plain, absolute = interleaved(
            LOOP_ROUNDS,
            lambda: _polling(room, port),
            lambda: _asyncio_loop(port, layout, codec, absolute=False),
            lambda: _asyncio_loop(port, layout, codec, absolute=True),
        )
    return _jitter_record(ours, plain, absolute)


def _jitter_record(ours: Rounds, plain: Rounds, absolute: Rounds) -> Record:
    value, tail, spread = of_rounds(ours, median, 1e6)
    other, other_tail, other_spread = of_rounds(plain, median, 1e6)
    return Record(
        "loop_jitter",
        value,
        other,
        "us",
        (Goal("ratio", 0.05),),
        measured="ModbusLink polling at 100 Hz: |period - 10 ms| between the instants at which "
        "requests are sent",
        against="pymodbus' asyncio client reading the same registers, then asyncio.sleep(0.01), "
        "again and again",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=LOOP_ROUNDS,
        beside=(
            Beside(
                "ours / the same by asyncio with absolute deadlines",
                median(ours) / median(absolute),
                "",
            ),
        ),
        note="sleeping a period after the work makes every period too long by the work; asyncio "
        "also rounds its waits up to 1 ms",
    )
