"""The link to the twin against a small web-socket server: commands repeated, readings checked."""

from __future__ import annotations

import copy
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import pytest
from harness.opponents.lying_twin import true_message
from harness.pair import ROBOT, SETUP
from harness.processes import wait_until
from rosbridge_gateway.config import load_gateway_config
from twin_controller.core.actions import Command, MoveTwin, SendTwin
from twin_controller.core.events import AnyEvent, TwinMeasured, TwinMotion
from twin_controller.core.setup import Setup
from twin_controller.twin.twin_link_io import TwinLink
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

BOOT = 1_700_000_000.0
TWIN = msgspec.structs.replace(SETUP.config.twin, stale_ms=5000.0)
PATIENT = Setup(ROBOT, msgspec.structs.replace(SETUP.config, twin=TWIN))
"""The twin runs in this process, which may stand still for longer than the shipped 220 ms."""


class Twin:
    """Reports the state of its pose controller at 50 Hz; hears commands once ``listens`` is set."""

    def __init__(self) -> None:
        self.listens = True
        self.heard: list[int] = []
        self.sent: list[int] = []
        self.calls: dict[str, float] = {}
        self.readings: list[dict[str, Any]] = []
        self.reports = 0
        self._server = serve(self._attend, "127.0.0.1", 0, compression=None, ping_interval=None)
        self.url = f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

    def serve(self) -> None:
        """Serve until closed."""
        self._server.serve_forever()

    def close(self) -> None:
        """End."""
        self._server.shutdown()

    def wait_for_reports(self, count: int) -> None:
        """Let it report so often; 50 times a second."""
        until = self.reports + count
        wait_until(lambda: self.reports >= until, 5.0, f"{count} reports")

    def _attend(self, line: ServerConnection) -> None:
        try:
            while True:
                self._take(line)
                self._say(line, "joint_pose_controller/state", self._state())
                self.reports += 1
                while self.readings:
                    self._say(line, "twin/joint_states", self.readings.pop(0))
        except ConnectionClosed:
            return

    def _take(self, line: ServerConnection) -> None:
        due = time.monotonic() + 0.02
        while (left := due - time.monotonic()) > 0.0:
            try:
                packet = json.loads(line.recv(timeout=left))
            except TimeoutError:
                return
            if packet["op"] == "call_service":
                self.calls[packet["service"]] = packet["timeout"]
            if packet["op"] == "publish" and packet["topic"] == "motion_command":
                self.sent.append(packet["msg"]["id"])
                self.heard += [packet["msg"]["id"]] if self.listens else []

    def _state(self) -> dict[str, Any]:
        numbers = dict.fromkeys(
            (
                "speed_requested_percent",
                "peak_percent",
                "speed_applied_percent",
                "speed_limit_percent",
            ),
            100.0,
        )
        last = self.heard[-1] if self.heard else 0
        return {
            "state": "idle",
            "last_command_id": last,
            "standing_still": True,
            "message": "",
            "target": [],
            **numbers,
        }

    def _say(self, line: ServerConnection, topic: str, message: dict[str, Any]) -> None:
        line.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))


@pytest.fixture
def twin() -> Iterator[Twin]:
    """Run a twin."""
    running = Twin()
    thread = threading.Thread(target=running.serve, daemon=True)
    thread.start()
    yield running
    running.close()
    thread.join(5.0)


@contextmanager
def linked(twin: Twin, **options: Any) -> Iterator[tuple[TwinLink, list[bool]]]:
    """Give a link that is up, and what it told of that."""
    ups: list[bool] = []
    changed = lambda side, up, why: ups.append(up)  # noqa: E731
    with TwinLink(PATIENT, lambda event: None, changed, twin.url, **options) as link:
        wait_until(lambda: ups and ups[-1], 5.0, "a link")
        yield link, ups


def test_command_is_sent_until_the_twin_reports_it(twin: Twin) -> None:
    """Right after a reconnect a topic has no listeners: what is published then is lost silently."""
    with linked(twin) as (link, _):
        twin.listens = False
        link.perform(SendTwin(Command.STOP_TWIN, "both are stopped", 7), BOOT, True)
        wait_until(lambda: len(twin.sent) >= 3, 5.0, "repetitions")
        twin.listens = True
        wait_until(lambda: twin.heard, 5.0, "a command that is heard")
        twin.wait_for_reports(5)
        sent = len(twin.sent)
        twin.wait_for_reports(20)
    assert set(twin.sent) == {7}
    assert len(twin.sent) == sent, "once it is reported nobody repeats it"


def test_newer_command_replaces_one_that_was_not_heard(twin: Twin) -> None:
    """An old command must not come after a newer one."""
    with linked(twin) as (link, _):
        twin.listens = False
        link.perform(SendTwin(Command.PAUSE_TWIN, "", 8), BOOT, True)
        wait_until(lambda: twin.sent, 5.0, "the first one")
        twin.listens = True
        link.perform(SendTwin(Command.RESUME_TWIN, "", 9), BOOT, True)
        wait_until(lambda: 9 in twin.heard, 5.0, "the second one")
        twin.wait_for_reports(20)
    assert twin.sent[twin.sent.index(9) :] == [9] * twin.sent.count(9)


def test_the_end_of_an_older_command_is_not_that_of_a_newer_one(twin: Twin) -> None:
    """The engine may send one between two steps of the line's thread: it is repeated all the same.

    The twin does not hear it at first.
    """

    class Raced(TwinLink):
        """Sends a stop right after the line has seen that the command before it is still open."""

        kept: Any = None
        looks = -1

        def _heard(self, motion: TwinMotion) -> None:
            self.looks = 0 if motion.last_command_id == 8 else -1
            super()._heard(motion)
            self.looks = -1

        @property
        def _command(self) -> Any:
            found = self.kept
            self.looks += self.looks >= 0 and found is not None
            if self.looks == 2:
                self.looks, twin.listens = -1, False
                stop = SendTwin(Command.STOP_TWIN, "", 9)
                sender = threading.Thread(target=self.perform, args=(stop, BOOT, True))
                sender.start()
                sender.join(0.2)
            return found

        @_command.setter
        def _command(self, order: Any) -> None:
            self.kept = order

    with Raced(PATIENT, lambda event: None, lambda *_: None, twin.url) as link:
        wait_until(lambda: link.counters["connects"], 5.0, "a link")
        link.perform(SendTwin(Command.RESUME_TWIN, "", 8), BOOT, True)
        wait_until(lambda: twin.sent.count(9) >= 2, 5.0, "the stop to be repeated")


def test_readings_that_cannot_be_true_never_reach_the_core(twin: Twin) -> None:
    """A joint beyond its range, and one that leaps; good ones before and after pass."""
    events: list[AnyEvent] = []

    def say(*changes: float) -> None:
        """Tell the truth and lies right behind it: given time, a leap could be a motion."""
        message = true_message(BOOT + time.monotonic())
        told = [message]
        for change in changes:
            told.append(copy.deepcopy(message))
            told[-1]["position"][0] += change
        twin.readings.extend(told)
        twin.wait_for_reports(2)

    def believed(count: int) -> bool:
        say()
        return sum(isinstance(event, TwinMeasured) for event in events) >= count

    with TwinLink(PATIENT, events.append, lambda side, up, why: None, twin.url) as link:
        wait_until(lambda: believed(2), 10.0, "good readings")
        for change in (9.0, -1.2):
            say(change)
        wait_until(lambda: believed(4), 10.0, "good readings after the bad ones")
        assert link.counters["rejected"] >= 2
    positions = [event.motion.q[0] for event in events if isinstance(event, TwinMeasured)]
    assert all(0.0 < q < 2.6 for q in positions)


def test_a_stop_goes_past_a_line_that_is_lost_under_the_same_number(twin: Twin) -> None:
    """A twin on a trajectory of its own would go on to its end. Nothing else goes that way."""
    beside: list[Any] = []
    with linked(twin, beside=beside.append) as (link, ups):
        link.perform(SendTwin(Command.STOP_TWIN, "", 7), BOOT, True)
        assert beside == []
        link.perform(SendTwin(Command.STOP_TWIN, "the line is silent", 8), BOOT, False)
        wait_until(lambda: 8 in twin.sent, 5.0, "it is tried on the line all the same")
        twin.close()
        wait_until(lambda: ups[-1] is False, 5.0, "a lost link")
        stops = (Command.STOP_TWIN, Command.PAUSE_TWIN, Command.ESTOP_TWIN)
        others = (Command.RESUME_TWIN, Command.RESET_TWIN, Command.YIELD_TWIN, Command.RELEASE_TWIN)
        for number, command in enumerate((*stops, *others), 9):
            link.perform(SendTwin(command, "", number), BOOT, False)
    assert [packet["id"] for packet in beside] == [8, 9, 10, 11]
    assert beside[0]["reason"] == "the line is silent"


def test_a_move_is_waited_for_as_long_as_the_gateway_lets_it(twin: Twin) -> None:
    """It may be paused for some minutes, or slow; RESUME then moves what must not have failed."""
    with linked(twin) as (link, _):
        link.move(MoveTwin("MOVE", (0.5, 0.1, 0.1), 1.0, ""), lambda *_: None)
        wait_until(lambda: "move_to" in twin.calls, 5.0, "the call")
    assert twin.calls["move_to"] == load_gateway_config().service_timeout_max
