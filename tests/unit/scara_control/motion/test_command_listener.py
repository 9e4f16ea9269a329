"""Who moves the twin of a stopped pair is named, once in a stop; nobody else is."""

from __future__ import annotations

from types import SimpleNamespace

from scara_control.motion.command_listener_node import OWN, Movers
from scara_control.motion.commands import STOPPED_AGAIN

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
