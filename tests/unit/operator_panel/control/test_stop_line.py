"""A STOP of the page finds its own way: without the master, past hanging calls, within its time.

Each failure of the machine beside it is a test: real sockets, no ROS.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import pytest
from harness.processes import wait_until
from harness.wires.command_service import CommandService
from nicegui import run
from operator_panel.control.stop_line_io import ANSWER_S, MOST_WAITING, StopLine
from operator_panel.door import Answer
from scara_ros.services.service_connection_io import ServiceError

from scara_msgs.srv import TwinCommand

DEADLINE = 10.0
SOON_S = 3.0  # less than anything here hangs; a busy machine may be slow
PERIOD_S = 0.02


class Master:
    """What the page asks where the twin controller is."""

    def __init__(self) -> None:
        self.known = ""
        self.alive = True
        self.hangs = threading.Event()
        self.asked = 0

    def find(self) -> tuple[str, str]:
        """Return the service's name and address."""
        self.asked += 1
        if self.hangs.is_set():
            wait_until(lambda: not self.hangs.is_set(), DEADLINE)
        if not self.alive or not self.known:
            raise ServiceError("roscore does not answer" if not self.alive else "no such service")
        return "/twin_controller/command", self.known


@pytest.fixture
def master() -> Iterator[Master]:
    """Give a master that knows nothing yet."""
    made = Master()
    yield made
    made.hangs.clear()


@pytest.fixture
def begin(master: Master) -> Iterator[Callable[[], CommandService]]:
    """Start twin controllers; the master knows the last one."""
    made: list[CommandService] = []

    def start() -> CommandService:
        made.append(CommandService())
        master.known = made[-1].uri
        return made[-1]

    yield start
    for service in made:
        service.close()


@pytest.fixture
def line(master: Master) -> Iterator[StopLine]:
    """Give a line whose keeper runs."""
    made, ended = StopLine(TwinCommand, "/panel", master.find, PERIOD_S), threading.Event()
    keeper = threading.Thread(target=made.keep, args=(ended,))
    keeper.start()
    yield made
    master.hangs.clear()
    ended.set()
    keeper.join(DEADLINE)
    assert not keeper.is_alive()


def confirmed(answer: Future[Answer], within: float = SOON_S) -> bool:
    """Return whether a press is confirmed while what hangs beside it still hangs."""
    return answer.result(within).values["confirmed"] is True


def ready(line: StopLine) -> None:
    """Wait until the line has tested itself well."""
    wait_until(lambda: not line.trouble(), DEADLINE, "a tested line", period=0.005)


@pytest.fixture
def controller(line: StopLine, begin: Callable[[], CommandService]) -> CommandService:
    """Give a twin controller to which a tested line is open."""
    made = begin()
    ready(line)
    return made


def test_connection_is_open_before_anybody_presses(
    line: StopLine, controller: CommandService
) -> None:
    """The press only sends: it asks nobody where the controller is."""
    assert controller.connections >= 1 and controller.heard == []
    assert line.send("STOP").result(SOON_S) == Answer(True, "STOP was heard", {"confirmed": True})


@pytest.mark.parametrize("how", ["dead", "hanging"])
def test_first_stop_needs_no_master(
    line: StopLine, controller: CommandService, master: Master, how: str
) -> None:
    """Neither a roscore that is gone nor one that stands still holds a STOP up."""
    master.alive = False
    if how == "hanging":
        master.hangs.set()
    assert confirmed(line.send("STOP"))
    controller.break_lines()
    assert confirmed(line.send("ESTOP")), "a new connection to the known address needs no master"
    assert controller.heard == ["STOP", "ESTOP"]


def test_full_thread_pool_holds_no_stop_up(line: StopLine, controller: CommandService) -> None:
    """Previews that hang take the pool's threads; a STOP has its own."""
    free = threading.Event()
    waiting = [run.thread_pool.submit(free.wait) for _ in range(64)]
    try:
        assert confirmed(line.send("STOP"))
    finally:
        free.set()
    assert all(one.result(DEADLINE) for one in waiting)


def test_stop_waits_for_no_earlier_press(line: StopLine, controller: CommandService) -> None:
    """An unanswered STOP does not stand before the next one, nor before an E-STOP."""
    controller.answers.clear()
    presses = [line.send(command) for command in ("STOP", "STOP", "ESTOP")]
    wait_until(lambda: sorted(controller.heard) == ["ESTOP", "STOP", "STOP"], DEADLINE)
    assert not any(press.done() for press in presses)
    controller.answers.set()
    assert all(confirmed(press, DEADLINE) for press in presses)


def test_late_answer_is_told_with_its_time(line: StopLine, controller: CommandService) -> None:
    """Whoever pressed sees that it was obeyed after all."""
    controller.answers.clear()
    begun = time.monotonic()
    press = line.send("STOP")
    wait_until(lambda: controller.heard, DEADLINE)
    heard = time.monotonic()
    with pytest.raises(TimeoutError):
        press.result(ANSWER_S)
    waited = time.monotonic() - heard
    controller.answers.set()
    message = press.result(DEADLINE).message
    took = time.monotonic() - begun
    told = re.search(r" \(after (\d+\.\d) s\)$", message)
    assert told and waited - 0.05 <= float(told[1]) <= took + 0.05, message


def test_page_that_no_longer_waits_does_not_take_its_stop_back(
    line: StopLine, controller: CommandService
) -> None:
    """A closed tab is no reason to move on."""
    controller.answers.clear()
    press = line.send("STOP")
    assert not press.cancel()
    controller.answers.set()
    assert confirmed(press, DEADLINE)


def test_unanswered_presses_are_bounded_for_each_command(
    line: StopLine, controller: CommandService
) -> None:
    """A page that presses without end takes no thread from the E-STOP of another."""
    controller.answers.clear()
    presses = [line.send("STOP") for _ in range(MOST_WAITING)]
    refused = line.send("STOP").result(0.0)
    assert not refused.values["confirmed"] and "not answered yet" in refused.message
    emergency = line.send("ESTOP")
    wait_until(lambda: "ESTOP" in controller.heard, DEADLINE)
    controller.answers.set()
    assert all(confirmed(press, DEADLINE) for press in (*presses, emergency))


def test_controller_that_was_started_anew_is_found_again(
    line: StopLine, begin: Callable[[], CommandService]
) -> None:
    """By the press itself, however short before it the restart was."""
    old = begin()
    ready(line)
    old.close()
    new = begin()
    assert confirmed(line.send("STOP")) and new.heard == ["STOP"]


def test_trouble_is_known_before_a_press(
    line: StopLine, begin: Callable[[], CommandService], master: Master
) -> None:
    """No controller, no master, one that greets nobody: each is said, and its end too."""
    assert "has been found" in line.trouble() or "no such service" in line.trouble()
    controller = begin()
    ready(line)
    controller.greets.clear()
    wait_until(lambda: "did not answer" in line.trouble(), DEADLINE)
    controller.greets.set()
    ready(line)
    master.alive = False
    controller.close()
    wait_until(line.trouble, DEADLINE)
    assert not line.send("STOP").result(DEADLINE).values["confirmed"]


def test_stop_to_a_controller_that_stands_still_waits_in_its_line(
    line: StopLine, controller: CommandService
) -> None:
    """It is sent over the connection that was open before, so it acts as soon as that goes on."""
    controller.greets.clear()
    controller.answers.clear()
    wait_until(line.trouble, DEADLINE)
    press = line.send("STOP")
    wait_until(lambda: controller.heard == ["STOP"], DEADLINE)
    assert not press.done()
    controller.answers.set()
    assert confirmed(press, DEADLINE)


def test_living_connection_asks_no_master(
    line: StopLine, controller: CommandService, begin: Callable[[], CommandService], master: Master
) -> None:
    """Who takes the service's name meanwhile gets no STOP."""
    impostor = begin()
    tested = controller.connections
    wait_until(lambda: controller.connections >= tested + 2, DEADLINE)
    assert confirmed(line.send("STOP"))
    assert (controller.heard, impostor.heard, master.known) == (["STOP"], [], impostor.uri)


def test_keeper_that_hangs_is_told(
    line: StopLine, controller: CommandService, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A test that is old proves nothing."""
    now = time.monotonic()
    monkeypatch.setattr("operator_panel.control.stop_line_io.time.monotonic", lambda: now + 60.0)
    assert "was not tested" in line.trouble()
