"""What is held moves while whoever holds it may; a stop, another mode or a lost page ends it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import pytest
from operator_panel.control.desk_io import PageDesk
from unit.operator_panel.control.conftest import LET_GO_S, ROBOT, Clock, Door, signs, stop

# A press lives for a quarter of a second: not of this machine's time.
pytestmark = pytest.mark.usefixtures("clock")


def hold(desk: PageDesk, press: int = 1, joint: str = "joint_1") -> str:
    """Hold a jog button of page a until the twin controller knows and the joint may move."""
    desk.hold("a", press, joint, 1, 3.0)
    signs(desk)
    return desk.hold("a", press, joint, 1, 3.0)


def test_jog_is_a_command_at_each_of_its_signs(desk: PageDesk, door: Door, clock: Clock) -> None:
    """It takes what is free, and keeps it while a button is held."""
    door.holder = ""
    assert hold(desk) == ""
    assert door.asked[-1] == ("operator 1", "TAKE", True) and door.holder == "operator 1"
    signs(desk)
    for _ in range(200):
        clock.now += 0.2
        assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert door.holder == "operator 1"


def test_stop_is_sent_before_anything_else_is_tried(desk: PageDesk, door: Door) -> None:
    """A jog that cannot be ended, a log that cannot be written: the STOP is out, and answered."""

    def fail(_: Mapping[str, float]) -> None:
        raise OSError("no space left on device")

    hold(desk)
    door.jog = fail  # type: ignore[assignment]
    assert stop(desk, "v").success and door.commands == ["STOP"]


@pytest.mark.parametrize(
    "end",
    [
        lambda desk: stop(desk, "b"),  # its zero does not wait for the answer
        lambda desk: desk.left("a"),  # a closed tab, a torn cable
        lambda desk: desk.let_go("a", 1),
    ],
)
def test_end_of_a_held_jog_is_a_zero(
    desk: PageDesk, door: Door, end: Callable[[PageDesk], object]
) -> None:
    """At once, and only one."""
    assert hold(desk) == "" and desk.jog_tick()
    end(desk)
    assert not desk.jog_tick()
    assert door.jogs[1:] == [{"joint_1": 0.0}]


@pytest.mark.parametrize(
    ("page", "mode", "why"),
    [
        ("b", "IDLE", "operator 1 holds control"),
        ("v", "IDLE", "only watches"),
        ("a", "ESTOP", "stand ready"),
    ],
)
def test_jog_is_refused_to_others_and_in_other_modes(
    desk: PageDesk, door: Door, page: str, mode: str, why: str
) -> None:
    """Nothing is sent."""
    door.mode = mode
    assert why in desk.hold(page, 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert door.jogs == []


def test_a_press_wakes_who_sends_and_keeps_it_awake_until_the_release(desk: PageDesk) -> None:
    """While no button is held nothing has to be sent; the wait ends with the press."""
    assert not desk.jog_tick()
    hold(desk)
    begun = time.perf_counter()  # the clock of the press is not this machine's
    desk.wait_for_press(60.0)
    assert time.perf_counter() - begun < 30.0
    assert desk.jog_tick()
    assert desk.jog_tick()
    desk.let_go("a", 1)
    assert not desk.jog_tick()


def test_mode_that_changes_under_a_held_button_releases_it(desk: PageDesk, door: Door) -> None:
    """An emergency stop on the other side, for example."""
    hold(desk)
    door.mode = "ESTOP"
    assert desk.hold("a", 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert door.jogs == [{"joint_1": 0.0}]
    door.mode = "IDLE"
    assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    desk.jog_tick()
    assert door.jogs == [{"joint_1": 0.0}], "the same press must not start again"


def test_nothing_jogs_before_the_twin_controller_knows_whose_motion_it_is(
    desk: PageDesk, door: Door
) -> None:
    """What it does not know it would stop."""
    assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    desk.jog_tick()
    assert door.jogs == []
    signs(desk)
    assert door.asked[-1] == ("operator 1", "KEEP", True)
    desk.hold("a", 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert len(door.jogs) == 1


def test_wrong_jog_of_a_browser_is_answered_in_words(desk: PageDesk) -> None:
    """Not by an exception in the server."""
    assert "unknown joint" in hold(desk, joint="joint_9")


def test_held_tool_moves_by_the_rule_of_the_held_joint(desk: PageDesk, door: Door) -> None:
    """Once the twin controller knows whose motion it is; a stop of anybody ends it for good."""
    names = tuple(joint.name for joint in ROBOT.twin_joints)
    door.position = dict(zip(names, (20.0, 60.0, -50.0, 0.0)))

    def sign(press: int) -> str:
        return desk.hold_tool("a", press, "x", "world", 1, False)

    assert sign(1) == "" and not desk.jog_tick() and door.jogs == []
    signs(desk)
    assert sign(1) == "" and desk.jog_tick()
    assert set(door.jogs[-1]) == {"joint_1", "joint_2", "joint_3"}
    stop(desk, "v")
    assert door.jogs[-1] == dict.fromkeys(door.jogs[-1], 0.0)
    sent = len(door.jogs)
    assert sign(1) == "" and not desk.jog_tick() and len(door.jogs) == sent
    assert desk.hold_tool("b", 1, "x", "world", 1, False) == "operator 1 holds control"


def test_tool_is_not_jogged_from_an_unknown_place(desk: PageDesk, door: Door) -> None:
    """The reason comes with the next sign."""
    desk.hold_tool("a", 1, "x", "world", 1, False)
    signs(desk)
    desk.hold_tool("a", 1, "x", "world", 1, False)
    assert not desk.jog_tick() and not any(any(each.values()) for each in door.jogs)
    assert "where joint_1 is, is not known" in desk.hold_tool("a", 1, "x", "world", 1, False)
