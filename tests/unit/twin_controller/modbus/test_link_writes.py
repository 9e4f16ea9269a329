"""What ModbusLink writes, and what it never does."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

import pytest
from harness.opponents.modbus_robot import COMMAND, Robot
from harness.processes import free_port, wait_until
from twin_controller.modbus import robot_link_io
from twin_controller.modbus.link_io import ModbusLink, NotWritableError
from twin_controller.robot.signals import Number, Pulse, Signal

if TYPE_CHECKING:
    from conftest import Owner

UP, DOWN = True, False
pytestmark = pytest.mark.usefixtures("patient")


@pytest.mark.parametrize("disarm", [True, False])
def test_what_was_left_before_the_end_is_written_before_the_farewell(
    robot: Robot, owner: Owner, disarm: bool
) -> None:
    """A stop that was asked for last reaches the robot, its pulse ends, then the watchdog rests."""
    with owner.link(robot.port) as link:
        owner.wait_for(UP)
        link.send(Pulse("cstopi"))
        link.send(Number("setpoint_valid", 0))
        link.send(Signal("hold", True))
        link.close(disarm)
    written = [(at, values) for _, at, values in robot.written]
    assert [each for each in written if each[0] != 11069][-4:] == [
        (6003, (0xFF00,)),
        (11068, (0,)),
        (6001, (0xFF00,)),
        (6003, (0,)),
    ]
    assert ((11069, (0,)) in written) is disarm


@pytest.mark.parametrize("disarm", [True, False])
def test_numbered_commands_that_were_left_before_the_end_are_written_before_the_farewell(
    robot: Robot, owner: Owner, disarm: bool
) -> None:
    """The robot is still asked which it has taken: the next one waits for that."""
    robot.echoes = True
    with owner.link(robot.port, numbered=True) as link:
        owner.wait_for(UP)
        link.send(Signal("hold", False), Pulse("cstopi"), Signal("hold", True))
        link.close(disarm)
    assert robot.writes(COMMAND) == [(3, 1), (10, 3), (4, 5)] and owner.rejects == []
    assert ((16, 11069, (0,)) in robot.written) is disarm


def test_the_end_does_not_wait_for_a_robot_that_confirms_nothing(
    robot: Robot, owner: Owner
) -> None:
    """What it has not taken is told."""
    with owner.link(robot.port, numbered=True, command_retry=0.02) as link:
        owner.wait_for(UP)
        link.send(Signal("hold", False))
    assert owner.rejects == ["hold: the robot did not confirm command 3 in 5 attempts"]
    assert robot.written[-1] == (16, 11069, (0,))


def test_the_end_names_the_commands_that_it_does_not_wait_for(
    robot: Robot, owner: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody sends them any more: whoever reads the log learns which signals are not set."""
    monkeypatch.setattr(robot_link_io, "END_WAIT", 0.1)
    with owner.link(robot.port, numbered=True) as link:
        owner.wait_for(UP)
        link.send(Signal("hold", False), Pulse("cstopi"), Signal("hold", True))
    told = ["the link has ended, not sent or not confirmed: hold, cstopi, hold"]
    assert owner.rejects == told


def test_a_set_point_goes_out_in_one_request_with_the_heartbeat(robot: Robot, owner: Owner) -> None:
    """PR[1] in deg and mm, valid, R[1], R[2]; joint_4, which the twin lacks, stays where it is."""
    robot.put_float(11006, 33.0)
    with owner.link(robot.port) as link:
        owner.wait_for(UP)
        link.write_now((math.pi / 2, 0.0, -0.1, 0.5), 50.0)
        (words,) = wait_until(lambda: robot.writes(11050))
    axes = struct.unpack("<9f", struct.pack("<18H", *words[:18]))
    assert axes == pytest.approx(
        (90.0, 0.0, -100.0, 33.0, math.degrees(0.5), 0.0, 0.0, 0.0, 0.0), rel=1e-6
    )
    assert words[18] == 1 and words[19] > 0
    assert words[20] == 50, "R[2] is the speed that is allowed: the robot is no faster"
    beats = [values[0] for _, at, values in robot.written if at == 11069] + [words[19]]
    assert len(set(beats)) == len(beats)


def test_an_axis_that_robot_yaml_does_not_name_stays_where_it_is(
    robot: Robot, owner: Owner
) -> None:
    """0 is a place like any other: the first set point would send it there."""
    robot.put_float(11010, -98.26)
    with owner.link(robot.port) as link:
        owner.wait_for(UP)
        link.write_now((0.0, 0.0, -0.1, 0.0), 50.0)
        assert wait_until(lambda: robot.writes(11050))[-1][10:12] == _words(-98.26)


def test_the_latest_set_point_wins(robot: Robot, owner: Owner, link: ModbusLink) -> None:
    """A slow wire never makes a queue of old set points."""
    for k in range(200):
        link.write_now((0.001 * k, 0.0, 0.0, 0.0), 50.0)
    wait_until(
        lambda: robot.writes(11050) and robot.writes(11050)[-1][0:2] == _words(math.degrees(0.199))
    )
    assert len(robot.writes(11050)) < 200


def _words(value: float) -> tuple[int, ...]:
    """Return a float32 low word first."""
    return struct.unpack("<2H", struct.pack("<f", value))


@pytest.mark.parametrize(
    ("positions", "speed", "text"),
    [
        ((0.0, 0.0, 0.0), 50.0, "3 positions for 4 joints of the twin"),
        ((math.nan, 0.0, 0.0, 0.0), 50.0, "joint_1 = nan rad is outside"),
        ((9.0, 0.0, 0.0, 0.0), 50.0, "joint_1 = 9.0 rad is outside"),
        ((0.0, 0.0, 0.0, 0.0), 0.0, "speed_percent = 0.0 is outside"),
    ],
)
def test_a_bad_set_point_never_reaches_the_wire(
    robot: Robot,
    owner: Owner,
    link: ModbusLink,
    positions: tuple[float, ...],
    speed: float,
    text: str,
) -> None:
    """It is told and counted; the link goes on."""
    link.write_now(positions, speed)
    wait_until(lambda: owner.rejects)
    assert text in owner.rejects[0] and link.counters.refused == 1
    seen = len(owner.samples)
    wait_until(lambda: len(owner.samples) > seen + 2)
    assert robot.writes(11050) == []


def test_signals_pulses_and_integers_are_written_in_order(
    robot: Robot, owner: Owner, link: ModbusLink
) -> None:
    """A pulse is on, then off; commands keep their order."""
    link.send(Signal("hold", False))
    link.send(Pulse("fault_reset"))
    link.send(Number("override", 80))
    link.send(Number("setpoint_valid", 0))
    wait_until(lambda: (5, 6004, (0,)) in robot.written)
    commands = [entry for entry in robot.written if entry[1] != 11069]
    assert commands == [
        (5, 6001, (0,)),
        (5, 6004, (0xFF00,)),
        (16, 11100, (80, 0)),
        (16, 11068, (0,)),
        (5, 6004, (0,)),
    ]


@pytest.mark.parametrize(
    "step",
    [
        *(Signal(name, True) for name in ("sfspd", "nonsense")),
        *(Pulse(name) for name in ("rsr2", "override")),
        *(Number(name, 1) for name in ("position_valid", "imstp", "setpoint")),
    ],
    ids=lambda step: step.name,
)
def test_what_the_map_does_not_mark_is_never_written(
    owner: Owner, step: Signal | Pulse | Number
) -> None:
    """Refused before the wire, with the name."""
    with pytest.raises(NotWritableError, match=step.name):
        owner.link(free_port()).send(step)


def test_nothing_is_replayed_after_a_reconnect(robot: Robot, owner: Owner) -> None:
    """Writes that wait while there is no link are dropped, counted and told."""
    with owner.link(robot.port, retry_first=0.3, retry_last=0.3, timeout=0.3) as link:
        owner.wait_for(UP)
        robot.fault = "silent"
        owner.wait_for(UP, DOWN)
        link.write_now((0.1, 0.0, 0.0, 0.0), 50.0)
        link.send(Pulse("rsr1"))
        robot.fault = ""
        owner.wait_for(UP, DOWN, UP)
        assert link.counters.dropped == 2
        assert owner.rejects == ["2 writes dropped: there was no link"]
    assert robot.writes(11050) == [] and robot.writes(6008) == []


def test_a_refused_write_is_told_and_the_link_stays(robot: Robot, owner: Owner) -> None:
    """Exception 2 to a write is the robot's right."""
    with owner.link(robot.port, heartbeat=False) as link:
        owner.wait_for(UP)
        robot.fault = "refuse_writes"
        link.send(Signal("hold", False))
        wait_until(lambda: owner.rejects)
        assert owner.rejects == ["the robot refused to write 6002: exception 2"]
        assert link.connected and link.counters.refused == 1


@pytest.mark.parametrize(
    ("fault", "signal"),
    [
        *((f"write_{what}", False) for what in ("address", "count", "function", "refusal")),
        *((f"write_{what}", True) for what in ("address", "level", "function", "refusal")),
    ],
)
def test_a_write_that_is_confirmed_wrongly_ends_the_link(
    robot: Robot, owner: Owner, fault: str, signal: bool
) -> None:
    """A STOP that was not understood is not given; the heartbeat at 11070 shows it of registers."""
    with owner.link(robot.port, heartbeat=not signal) as link:
        owner.wait_for(UP)
        robot.fault = fault
        if signal:
            link.send(Signal("hold", False))
        owner.wait_for(UP, DOWN)
        where = "coil at 6002" if signal else "registers at 11070"
        assert f"confirmed another write than {where}" in owner.changes[1][1], owner.changes
        robot.fault = ""
        owner.wait_for(UP, DOWN, UP)
