"""ModbusLink against a robot that can misbehave."""

from __future__ import annotations

import itertools
import math
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import pytest
from harness.opponents.modbus_robot import COMMAND, HEARTBEAT, Robot
from harness.processes import free_port, wait_until
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.modbus.poll_times import UNREAD, PollTimes
from twin_controller.modbus.port_io import ModbusPort
from twin_controller.robot.signals import Pulse, Signal

if TYPE_CHECKING:
    from conftest import Owner

CONFIG = Path(__file__).resolve().parents[4] / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)
UP, DOWN = True, False
MACHINE_S = 0.15
"""What a busy machine may add to a silence that is found within a tenth of a second."""
pytestmark = pytest.mark.usefixtures("patient")


def test_samples_come_with_the_times_of_their_request_and_answer(
    robot: Robot, owner: Owner
) -> None:
    """The owner can form round-trip mid-points: sent <= received, in order."""
    with owner.link(robot.port) as link:
        wait_until(lambda: len(owner.samples) >= 20)
        assert link.connected
    assert owner.changes[0] == (True, f"connected to 127.0.0.1:{robot.port}")
    times = [(sent, received) for _, sent, received in owner.samples]
    assert all(sent <= received for sent, received in times)
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(times))
    assert owner.samples[0][0].motion.q[2] == pytest.approx(-0.160)
    assert owner.samples[0][0].outputs == {"cmdenbl", "sysrdy"}


def test_heartbeat_changes_each_cycle_and_the_end_disarms(robot: Robot, owner: Owner) -> None:
    """The robot's watchdog sees a counter that never repeats, and 0 as a farewell."""
    with owner.link(robot.port):
        wait_until(lambda: len(robot.writes(11069)) >= 10)
    beats = [values[0] for values in robot.writes(11069)]
    assert beats[-1] == 0
    assert beats[:-1] == list(range(1, len(beats)))


def test_an_owner_that_hangs_gets_no_heartbeat(robot: Robot, owner: Owner) -> None:
    """A thread that beats for a controller that hangs would keep the robot's watchdog quiet."""
    alive = threading.Event()
    alive.set()
    with owner.link(robot.port, alive=alive.is_set):
        wait_until(lambda: len(robot.writes(11069)) >= 3)
        alive.clear()
        seen = len(owner.samples)
        wait_until(lambda: len(owner.samples) > seen + 2)
        beats = len(robot.writes(11069))
        wait_until(lambda: len(owner.samples) > seen + 12)
        assert len(robot.writes(11069)) == beats


def test_close_without_disarm_leaves_the_watchdog_armed(robot: Robot, owner: Owner) -> None:
    """The robot then stops by itself."""
    with owner.link(robot.port) as link:
        wait_until(lambda: robot.writes(11069))
        link.close(disarm=False)
    assert robot.writes(11069)[-1] != (0,)


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("silent", "did not answer in time"),
        ("short", "answered 65 words instead of 66"),
        ("busy", r"answered busy \(exception 6\) \(\d+ times\)"),
        ("exception", r"refused to read (10983|6001): exception 2"),
        ("transaction", "did not answer in time"),
        ("device", "did not answer in time"),
        ("close", "closed|was lost"),
    ],
)
def test_nothing_but_wrong_answers_ends_the_link_and_it_comes_back(
    robot: Robot, owner: Owner, fault: str, text: str
) -> None:
    """For the time-out; when the robot is well again the link is too, and says so once.

    The time-out is longer than as delivered, so that this machine's own delays end no link.
    """
    with owner.link(robot.port, timeout=0.3) as link:
        # The status blocks are read right after the link is up.
        wait_until(lambda: owner.statuses)
        robot.fault = fault
        owner.wait_for(UP, DOWN)
        assert re.search(text, owner.changes[1][1]), owner.changes
        assert link.counters.losses == 1
        robot.fault = ""
        owner.wait_for(UP, DOWN, UP)
        assert len(owner.changes) == 3


def test_a_silent_robot_is_found_within_a_tenth_of_a_second(robot: Robot, owner: Owner) -> None:
    """A half-open connection: the last good sample is at most a poll period and a time-out old.

    The quickest of three counts: what this machine adds by itself is no property of the link.
    """
    shipped = ModbusSettings("", 1)
    assert shipped.poll_period + shipped.timeout < 0.1

    def find_silence() -> float:
        wait_until(lambda: owner.changes and owner.changes[-1][0] is UP)
        begun, robot.fault = time.monotonic(), "silent"
        wait_until(lambda: owner.changes[-1][0] is DOWN, period=0.001)
        took, robot.fault = time.monotonic() - begun, ""
        return took

    with owner.link(robot.port, timeout=shipped.timeout):
        assert min(find_silence() for _ in range(3)) < 0.1 + MACHINE_S


def test_nobody_listening_is_told_once_and_start_order_does_not_matter(owner: Owner) -> None:
    """The link waits for the robot; a back-off bounds the attempts."""
    port = free_port()
    with owner.link(port):
        owner.wait_for(DOWN)
        assert owner.changes[0][1] == f"no robot at 127.0.0.1:{port}"
        robot = Robot(port)
        owner.wait_for(DOWN, UP)
        robot.close()


def test_a_sample_that_is_not_believed_is_counted_and_kept_out(
    robot: Robot, owner: Owner, link: ModbusLink
) -> None:
    """NaN in a position: no sample, a reason, the link stays."""
    robot.put_float(11000, math.nan)
    wait_until(lambda: owner.rejects)
    assert "joint_1 = nan deg" in owner.rejects[0]
    assert link.connected and link.counters.rejected >= 1
    assert all(math.isfinite(sample.motion.q[0]) for sample, _, _ in owner.samples)


def test_status_is_read_at_first_and_when_its_signals_change(robot: Robot, owner: Owner) -> None:
    """FAULT brings the alarm at once, not after a second."""
    with owner.link(robot.port, status_period=1000.0):
        wait_until(lambda: owner.statuses)
        robot.words[11300], robot.words[11301], robot.words[11311] = 11, 37, 0x4142
        robot.signals |= 1 << 5
        wait_until(lambda: len(owner.statuses) == 2)
    assert owner.statuses[0][1].text == ""
    assert (owner.statuses[1][1].facility, owner.statuses[1][1].message) == (11, "AB")


STOPPING = msgspec.structs.replace(ROBOT.stopping, uop="simple", tried={"hold": "127.0.0.1"})
# Its program and alarm tell what its outputs do not.
FEW_OUTPUTS = msgspec.structs.replace(ROBOT, stopping=STOPPING)


def test_a_robot_without_all_outputs_tells_by_its_program(robot: Robot, owner: Owner) -> None:
    """The block of the program is read in each cycle then, and before the state."""
    robot.signals = 0

    def shown() -> frozenset[str]:
        return owner.samples[-1][0].outputs if owner.samples else frozenset()

    with owner.link(robot.port, profile=FEW_OUTPUTS, status_period=1000.0):
        for state, name in ((2, "progrun"), (1, "paused"), (2, "progrun")):
            robot.words[11209] = state
            wait_until(lambda name=name: shown() == {"sysrdy", name})


@pytest.mark.parametrize("first", [0, 7])
def test_no_sample_counts_while_nobody_knows_whether_a_program_runs(
    robot: Robot, owner: Owner, first: int
) -> None:
    """What the block told before may have ended; before the first good one the drives look off."""
    robot.signals, robot.words[11209] = 0, first
    with owner.link(robot.port, profile=FEW_OUTPUTS) as link:
        wait_until(lambda: owner.samples or owner.rejects)
        robot.words[11209] = 7
        wait_until(lambda: owner.rejects)
        seen, polls = len(owner.samples), link.counters.polls
        wait_until(lambda: link.counters.polls >= polls + 3)
        assert len(owner.samples) == seen and re.match("status: 7 is not", owner.rejects[-1])
        robot.words[11209] = 2
        wait_until(lambda: len(owner.samples) > seen)
    assert owner.samples[-1][0].outputs == {"sysrdy", "progrun"}


def test_an_error_of_the_owner_ends_the_link_and_is_kept(
    robot: Robot, owner: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bug in a callback is never swallowed."""
    monkeypatch.setattr(threading, "excepthook", lambda arguments: None)

    def fail(*_: object) -> None:
        raise RuntimeError("a bug")

    with owner.link(robot.port, on_sample=fail) as link:
        owner.wait_for(UP, DOWN)
    assert isinstance(link.failure, RuntimeError)
    assert "the link died" in owner.changes[1][1]


def test_nothing_is_asked_between_the_state_and_the_sample(robot: Robot, owner: Owner) -> None:
    """Signals (function 2) come before the state (3): the follower does not wait for them."""
    last: list[int] = []

    def take(*_: object) -> None:
        last.append(next(each for each in reversed(robot.asked) if each in (2, 3)))

    with owner.link(robot.port, on_sample=take):
        wait_until(lambda: len(last) >= 10)
    assert set(last) == {3} and 2 in robot.asked


def test_the_next_poll_is_placed_by_the_stamps_that_were_believed(
    robot: Robot, owner: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the times of their questions; a wrong stamp places none."""
    seen: list[tuple[int | None, float, float]] = []
    polled = PollTimes.polled

    def take(times: PollTimes, clock_ms: int | None, sent: float, received: float) -> bool:
        seen.append((clock_ms, sent, received))
        return polled(times, clock_ms, sent, received)

    monkeypatch.setattr(PollTimes, "polled", take)
    with owner.link(robot.port):
        wait_until(lambda: len(owner.samples) >= 10)
        robot.put_float(11000, math.nan)
        wait_until(lambda: len(owner.rejects) >= 3)
    believed = [(sample.clock_ms, sent, received) for sample, sent, received in owner.samples]
    assert [each for each in seen if each[0] is not None] == believed
    assert sum(each[0] is None for each in seen) >= 2


@pytest.mark.parametrize(("delay", "first", "share"), [(0.0, 0, 1.0), (0.03, 1, 1.0 / UNREAD)])
def test_on_a_slow_line_the_signals_are_read_behind_each_third_state(
    robot: Robot, owner: Owner, delay: float, first: int, share: float
) -> None:
    """Two answers of 30 ms make no cycle of 40 ms; the first state needs both. Heartbeats go on."""
    robot.delay = delay
    with owner.link(robot.port, poll_period=0.04, status_period=60.0):
        wait_until(lambda: len(owner.samples) >= 16, 20.0, "16 samples")
    states, signals = robot.asked.count(3) - 2, robot.asked.count(2)
    assert signals == pytest.approx(first + share * states, rel=0.2)
    beats = [beat for (beat,) in robot.writes(LAYOUT.holding_registers["heartbeat"].offset) if beat]
    assert len(beats) > 4 and beats == list(range(1, len(beats) + 1)), "each one is another"


@pytest.fixture
def other(robot: Robot) -> Iterator[ModbusPort]:
    """Give the port of another master."""
    port = ModbusPort("127.0.0.1", robot.port, LAYOUT.device_id, 1.0)
    port.open()
    yield port
    port.close()


def interrupt(other: ModbusPort, owner: Owner) -> float:
    """Write the heartbeat, too, until the link is lost; return when the last write began [s].

    One value may be overwritten unseen.
    """
    values, begun = itertools.count(20000), 0.0

    def lost() -> bool:
        nonlocal begun
        if len(owner.changes) > 1:
            return True
        begun = time.monotonic()
        other.write_words(HEARTBEAT, [next(values)])
        return False

    wait_until(lost)
    return begun


def test_a_heartbeat_of_somebody_else_ends_the_link_and_a_stop_still_gets_through(
    robot: Robot, owner: Owner, other: ModbusPort
) -> None:
    """The other master would keep the robot's watchdog quiet, so the stop must be written.

    No heartbeat is, as long as the other one writes it.
    """
    robot.echoes = True
    with owner.link(robot.port, alone=3600.0) as link:
        wait_until(lambda: len(robot.writes(HEARTBEAT)) >= 20)
        assert [up for up, _ in owner.changes] == [True]
        interrupt(other, owner)
        assert re.match(r"somebody else writes R\[1\]: 20\d{3} is no", owner.changes[-1][1])
        link.send(Pulse("cstopi"))
        wait_until(lambda: robot.writes(LAYOUT.coils["cstopi"].offset) == [(0xFF00,), (0,)])
        beats = len(robot.writes(HEARTBEAT))
        for value in range(21001, 21011):
            other.write_words(HEARTBEAT, [value])
            time.sleep(0.02)
        assert len(robot.writes(HEARTBEAT)) == beats + 10, "only the other one writes it"
    assert [up for up, _ in owner.changes] == [UP, DOWN]


def test_each_numbered_command_counts_while_somebody_else_writes_the_heartbeat(
    robot: Robot, owner: Owner, other: ModbusPort
) -> None:
    """The robot shows the number of each, and ignores one under the number of the one before."""
    robot.echoes = True
    with owner.link(robot.port, numbered=True, alone=3600.0) as link:
        wait_until(lambda: len(robot.writes(HEARTBEAT)) >= 20)
        interrupt(other, owner)
        link.send(Signal("hold", False), Signal("imstp", False), Pulse("cstopi"))
        wait_until(lambda: len(robot.writes(COMMAND)) == 3)
        assert robot.writes(COMMAND) == [(1, 1), (3, 3), (10, 5)]
    assert owner.rejects == []


def test_the_link_is_used_again_once_the_other_master_has_been_quiet(
    robot: Robot, owner: Owner, other: ModbusPort
) -> None:
    """No sooner, however long it has written, and with a heartbeat."""
    robot.echoes = True
    with owner.link(robot.port, alone=1.0):
        wait_until(lambda: len(robot.writes(HEARTBEAT)) >= 5)
        last = begun = interrupt(other, owner)
        for value in itertools.count(21001):
            if last > begun + 1.2:
                break
            last = time.monotonic()
            other.write_words(HEARTBEAT, [value])
            time.sleep(0.05)
        beats = len(robot.writes(HEARTBEAT))
        owner.wait_for(UP, DOWN, UP)
        assert time.monotonic() > last + 1.0
        wait_until(lambda: len(robot.writes(HEARTBEAT)) > beats + 20)
    assert [up for up, _ in owner.changes] == [UP, DOWN, UP]


def test_the_end_of_a_link_does_not_disarm_the_robot_for_somebody_else(
    robot: Robot, owner: Owner, other: ModbusPort
) -> None:
    """The heartbeat is no longer ours then."""
    robot.echoes = True
    with owner.link(robot.port):
        wait_until(lambda: len(robot.writes(HEARTBEAT)) >= 5)
        interrupt(other, owner)
    assert (0,) not in robot.writes(HEARTBEAT)
