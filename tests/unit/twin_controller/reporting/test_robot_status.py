"""The real robot in ROS-Industrial's words."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.parts import changed
from twin_controller.core.lead.modes import Mode
from twin_controller.reporting.robot_status import (
    RobotMode,
    StatusAnswers,
    Tri,
    robot_status,
    scaling_factor,
)

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)


def status(pair: Pair, pendant: bool | None = False, alarm_number: int = 0) -> StatusAnswers:
    """Return the status now."""
    return robot_status(SETUP, pair.state, pendant, alarm_number, pair.now)


def test_constants_are_those_of_the_messages() -> None:
    """Names and numbers of upstream."""
    from industrial_msgs.msg import RobotMode as ModeMessage
    from industrial_msgs.msg import TriState

    assert {tri.name: int(tri) for tri in Tri} == {
        name: getattr(TriState, name) for name in ("UNKNOWN", "FALSE", "TRUE")
    }
    assert {m.name: int(m) for m in RobotMode} == {
        name: getattr(ModeMessage, name) for name in ("UNKNOWN", "MANUAL", "AUTO")
    }


def test_everything_is_unknown_while_the_link_is_down(pair: Pair) -> None:
    """No answer is better than an old one."""
    pair.link("real", False)
    assert status(pair) == StatusAnswers()
    assert {*msgspec.structs.asdict(status(pair)).values()} == {-1, 0}


def test_a_ready_robot_at_rest(pair: Pair) -> None:
    """Drives on, no error, motion possible, none going on."""
    assert status(pair) == StatusAnswers(
        RobotMode.AUTO, Tri.FALSE, Tri.TRUE, Tri.TRUE, Tri.FALSE, Tri.FALSE, 0
    )


@pytest.mark.parametrize(
    ("pendant", "mode"),
    [(None, RobotMode.UNKNOWN), (True, RobotMode.MANUAL), (False, RobotMode.AUTO)],
)
def test_the_enabled_pendant_makes_it_manual(
    pair: Pair, pendant: bool | None, mode: RobotMode
) -> None:
    """Unknown as long as the robot has not said."""
    assert status(pair, pendant).mode is mode


@pytest.mark.parametrize(
    ("switch", "mode"),
    [("AUTO", RobotMode.AUTO), ("T1", RobotMode.MANUAL), ("T2", RobotMode.MANUAL)],
)
@pytest.mark.parametrize("pendant", [None, True, False])
def test_the_mode_switch_says_more_than_the_pendant(
    pair: Pair, pendant: bool | None, switch: str, mode: RobotMode
) -> None:
    """Where the robot tells it."""
    pair.operation_mode = switch
    pair.run(0.1)
    assert status(pair, pendant).mode is mode


def test_a_moving_robot_is_in_motion(pair: Pair) -> None:
    """By what it measures, whoever leads."""
    pair.start_program(ramp(HOME, AWAY, 1.0), run=0.5)
    assert status(pair).in_motion is Tri.TRUE
    assert status(pair).motion_possible is Tri.TRUE


def test_an_alarm_is_an_error_with_its_number(pair: Pair) -> None:
    """A fault of the robot makes motion impossible; the number need not stand in the text."""
    pair.alarm("STOP 11-042 Collision")
    pair.run(0.3)
    found = status(pair, alarm_number=42)
    assert (found.in_error, found.motion_possible, found.error_code) == (Tri.TRUE, Tri.FALSE, 42)


def test_the_emergency_stop_is_shown(pair: Pair) -> None:
    """Latched in the controller, drives off on the robot."""
    pair.operate("ESTOP")
    pair.run(0.5)
    found = status(pair)
    assert pair.mode is Mode.ESTOP
    assert (found.e_stopped, found.drives_powered, found.motion_possible) == (
        Tri.TRUE,
        Tri.FALSE,
        Tri.FALSE,
    )


def test_the_scaling_factor_is_the_applied_part_of_the_requested_speed(pair: Pair) -> None:
    """1 before anything is asked for, 0 in a pause."""
    assert scaling_factor(Pair().state) == 1.0
    slowed = changed(pair.state, orders__speeds__requested=80.0, orders__speeds__applied=20.0)
    assert scaling_factor(slowed) == 0.25
    assert scaling_factor(changed(slowed, lead__mode=Mode.PAUSED)) == 0.0
