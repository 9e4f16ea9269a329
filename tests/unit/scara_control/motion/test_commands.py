"""Commands are obeyed once; a joint that was taken is noticed."""

from __future__ import annotations

import pytest
from scara_control.motion.commands import Command, CommandInbox, Ownership, parse_modes, taken_text


@pytest.mark.parametrize(
    ("before", "command", "fresh"),
    [
        ([], ("controller", 7, 0.0), True),
        ([("controller", 7, 0.0)], ("controller", 7, 0.1), False),
        ([("controller", 7, 0.0)], ("operator", 7, 0.1), True),
        ([("controller", 7, 0.0)], ("controller", 8, 0.1), True),
        ([("controller", 7, 0.0), ("controller", 8, 0.1)], ("controller", 7, 0.2), False),
        ([("controller", 7, 0.0)], ("controller", 7, 2.1), True),
        ([("controller", 7, 0.0), ("controller", 7, 1.9)], ("controller", 7, 3.0), False),
        ([("", 0, 0.0)], ("", 0, 0.01), True),
    ],
)
def test_a_command_is_obeyed_once_per_sender_and_id(before, command, fresh):
    """Repeats are not, until the memory's time is over; id 0 always is."""
    inbox = CommandInbox(memory=2.0)
    for sender, number, now in before:
        inbox.accept(sender, number, now)
    assert inbox.accept(*command) is fresh
    assert inbox.last_id == command[1]


def test_commands_have_the_numbers_of_the_message():
    """The core's enum and scara_msgs/MotionCommand are one list."""
    from scara_msgs.msg import MotionCommand

    assert {command.name: int(command) for command in Command} == {
        name: getattr(MotionCommand, name)
        for name in ("STOP", "PAUSE", "RESUME", "ESTOP", "RESET", "YIELD")
    }


def test_a_command_tells_its_reason():
    """The text ends up in the aborted move."""
    assert Command.STOP.text("door open") == "STOP: door open"
    assert Command.ESTOP.text("") == "ESTOP"


def test_a_joint_is_lost_only_after_it_was_ours():
    """An earlier motion's mode does not end a new one, unseen by the simulator so far."""
    ownership = Ownership("trajectory")
    ownership.update({"joint_1": "velocity", "joint_2": "trajectory"})
    ownership.begin(["joint_1", "joint_2"])
    assert ownership.update({"joint_1": "position", "joint_2": "trajectory"}) == {}
    assert ownership.foreign("joint_1") == "position" and ownership.foreign("joint_2") == ""
    assert ownership.update({"joint_1": "trajectory", "joint_2": "trajectory"}) == {}
    lost = ownership.update({"joint_1": "velocity", "joint_2": "trajectory"})
    assert taken_text(lost) == "joint_1 was taken by its velocity controller"
    assert ownership.update({"joint_1": "velocity", "joint_2": "trajectory"}) == {}


def test_modes_are_read_from_their_text():
    """Words that are no pair are left out."""
    assert parse_modes("joint_1:trajectory  table_joint:velocity ?") == {
        "joint_1": "trajectory",
        "table_joint": "velocity",
    }
