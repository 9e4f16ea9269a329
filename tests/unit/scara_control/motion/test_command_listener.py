"""Who moves the twin of a stopped pair is named, once in a stop; nobody else is.

And a stop that waits is heard first, whoever has noticed that the node stood still.
"""

from __future__ import annotations

import socket
import threading
from types import SimpleNamespace

import pytest
from scara_control.motion import command_listener_node
from scara_control.motion.command_listener_node import OWN, CommandListener, Movers
from scara_control.motion.commands import STOPPED_AGAIN
from scara_control.motion.epoch import Epoch
from scara_control.motion.wiring_node import CallbackGuard

from scara_msgs.msg import Audit, MotionCommand

JOG = "joint_vel_controller/command"
AGAIN = MotionCommand(command=MotionCommand.STOP, reason=STOPPED_AGAIN)
OTHER = MotionCommand(command=MotionCommand.STOP, reason="STOP by the operator")


def by(caller: str) -> SimpleNamespace:
    """Return a message of this caller."""
    return SimpleNamespace(_connection_header={"callerid": caller})


def named(told: list[Audit]) -> list[tuple[str, str]]:
    """Return who was named, for what."""
    return [(entry.who, entry.what) for entry in told]


def test_who_is_stopped_again_and_again_is_named_once_in_a_stop() -> None:
    """A second one is named too, and both anew after the next stop."""
    told: list[Audit] = []
    movers = Movers(told.append)
    for _ in range(3):
        movers.asked(JOG, by("/rostopic_7"))
        movers.stopped(AGAIN)
    movers.asked(JOG, by("/script"))
    movers.asked(JOG, by("/rostopic_7"))
    movers.stopped(AGAIN)
    assert named(told) == [("/rostopic_7", JOG), ("/script", JOG)]
    assert not told[0].success and told[0].outcome == STOPPED_AGAIN
    movers.stopped(OTHER)
    movers.asked(JOG, by("/script"))
    movers.stopped(AGAIN)
    assert named(told)[2:] == [("/script", JOG)]


def test_who_moved_the_twin_before_the_stop_is_not_named() -> None:
    """It was allowed to."""
    told: list[Audit] = []
    movers = Movers(told.append)
    movers.asked(JOG, by("/script"))
    movers.stopped(OTHER)
    movers.stopped(AGAIN)
    assert told == []


def test_a_node_that_only_passes_on_is_not_named() -> None:
    """Whoever asked it is named there; a message without a header names nobody."""
    told: list[Audit] = []
    movers = Movers(told.append)
    for name in OWN:
        movers.asked(JOG, by(f"/cell_2/{name}"))
    movers.asked(JOG, object())
    movers.stopped(AGAIN)
    assert told == []


@pytest.mark.parametrize(
    ("noticed_by", "before_s", "turns"),
    [("loop", 0.0, 3), ("loop", 0.02, 3), ("request", 0.0, 3), ("loop", 0.06, 0), ("", 0.0, 0)],
)
def test_a_stop_that_waited_is_heard_before_a_request(
    monkeypatch: pytest.MonkeyPatch, noticed_by: str, before_s: float, turns: int
) -> None:
    """In the wake of each gap, whichever thread ran first behind it; else nobody is kept waiting.

    The reader gets its turn in the third of ours.
    """
    clock, slept = [10.0], []
    sender, line = socket.socketpair()

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        clock[0] += seconds
        if len(slept) == 3:
            line.recv(1)

    fake = SimpleNamespace(monotonic=lambda: clock[0], sleep=sleep)
    monkeypatch.setattr(command_listener_node, "time", fake)
    wire = SimpleNamespace(impl=SimpleNamespace(connections=[SimpleNamespace(socket=line)]))
    monkeypatch.setattr(command_listener_node, "subscribe", lambda *words: wire)
    epoch = Epoch(10.0)
    listener = CommandListener(lambda stop: None, CallbackGuard(), epoch, threading.Lock())
    with sender, line:
        sender.send(b"s")
        clock[0] += 0.24 if noticed_by else 0.01
        if noticed_by == "loop":
            epoch.ran(clock[0])
        while before_s > 0.0:  # the loop goes on
            clock[0], before_s = clock[0] + 0.01, before_s - 0.01
            epoch.ran(clock[0])
        listener.hear_first()
        assert len(slept) == turns
