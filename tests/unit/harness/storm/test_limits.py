"""The storm's rules of limits, on literal histories."""

from __future__ import annotations

import dataclasses

import pytest
from harness.storm.rules.history import Decided, Deed, Servo, Strike
from harness.storm.rules.limits import above_eighty, beyond_limits
from harness.storm.rules.literal import DEG, JOINTS, history, motion, moving
from harness.storm.rules.servo import fastest
from harness.storm.servos import joints_of
from harness.workspace import ROOT
from scara_config import load_robot

LED = [
    Decided(1.0, "IDLE", "MOVE", "OPERATOR_LEADS", "operator"),
    Decided(4.0, "OPERATOR_LEADS", "AT_REST", "IDLE", ""),
]


@pytest.mark.parametrize("side", ["real", "twin"])
def test_joint_within_its_limits_keeps_the_rule(side: str) -> None:
    """At its full speed."""
    assert not list(beyond_limits(history(**{side: moving((1.0, 1.25, 400.0))})))


@pytest.mark.parametrize("side", ["real", "twin"])
def test_joint_beyond_its_speed_is_found(side: str) -> None:
    """Once for each time, with the worst of it."""
    fast = moving((1.0, 1.1, 440.0), (3.0, 3.1, -480.0))
    found = list(beyond_limits(history(**{side: fast})))
    assert [f.rule for f in found] == 2 * ["a joint beyond its speed"]
    assert side in found[0].evidence and "110.0 %" in found[0].evidence


def test_jump_is_a_speed_even_if_the_joint_says_otherwise() -> None:
    """A simulator that stood still for 0.1 s and jumped."""
    jumps = [
        (at, (q[0] + (60.0 * DEG if at >= 5.0 else 0.0), *q[1:]), qdot)
        for at, q, qdot in moving()
        if not 4.9 < at < 5.0
    ]
    (found,) = beyond_limits(history(twin=jumps))
    assert found.rule == "a joint beyond its speed" and "twin: joint_1 goes at" in found.evidence


def test_joint_beyond_its_range_is_found() -> None:
    """By more than what a servo settles."""
    far = moving((1.0, 2.0, 115.0))
    (found,) = beyond_limits(history(far))
    assert found.rule == "a joint beyond its range" and "0.41" in found.evidence
    assert not list(beyond_limits(history(moving((1.0, 2.0, 114.5)))))


def test_robot_that_follows_at_eighty_percent_keeps_the_rule() -> None:
    """And 1 % for measuring."""
    assert not list(above_eighty(history(moving((2.0, 2.2, 323.0)), decisions=LED)))


def test_robot_that_follows_above_eighty_percent_is_found() -> None:
    """However short."""
    (found,) = above_eighty(history(moving((2.0, 2.02, 328.0)), decisions=LED))
    assert "82.0 %" in found.evidence


STRONG = Servo(100.0, 0.8, 0.6, 1800.0 * DEG, 2000.0 * DEG)
WEAK = dataclasses.replace(STRONG, servo_acceleration=1750.0 * DEG)
"""Its drive takes more as command than its motor has."""


@pytest.mark.parametrize(
    ("servo", "percent", "found"), [(STRONG, 82, 1), (WEAK, 87, 0), (WEAK, 92, 1)]
)
def test_robot_may_overshoot_as_its_own_drive_does(
    servo: Servo, percent: float, found: int
) -> None:
    """It is told 80 %; what its drive makes of that is known, and anything above is found."""
    joints = tuple(dataclasses.replace(joint, servo=servo) for joint in JOINTS)
    known = history(moving((2.0, 2.02, 4.0 * percent)), decisions=LED)
    assert len(list(above_eighty(dataclasses.replace(known, joints=joints)))) == found


@pytest.mark.parametrize(("turned", "found"), [(2.0, 0), (1.0, 1)])
def test_robot_that_has_just_gone_the_other_way_overshoots_more(turned: float, found: int) -> None:
    """The drive falls behind over both speeds; a turn that is long ago does not count."""
    joints = tuple(dataclasses.replace(joint, servo=WEAK) for joint in JOINTS)
    assert fastest(joints[0], 0.8) < 0.90 < fastest(joints[0], 0.8, -0.8)
    there = moving((turned - 0.1, turned, -316.0), (2.0, 2.02, 368.0))
    known = dataclasses.replace(history(there, decisions=LED), joints=joints)
    assert len(list(above_eighty(known))) == found


@pytest.mark.parametrize(
    ("seed", "joint", "percent"), [(1502, 3, 86.5), (1502, 0, 80.0), (1500, 3, 80.0)]
)
def test_model_of_a_drive_shows_what_a_storm_has_measured(
    seed: int, joint: int, percent: float
) -> None:
    """The table of draw 1502 went at 86.5 %; those whose motors have enough stay at 80 %."""
    played = joints_of(load_robot(ROOT / "config"), f"field:{seed}")[joint]
    assert 100.0 * fastest(played, 0.8) == pytest.approx(percent, abs=0.5)


def test_robot_that_leads_may_use_its_full_speed() -> None:
    """Its own program, as soon as it was started on the pendant."""
    fast = moving((2.0, 2.2, 390.0))
    leads = [Decided(1.0, "IDLE", "REAL_MOVED", "REAL_LEADS", "real")]
    assert not list(above_eighty(history(fast, decisions=leads)))
    program = Deed("pendant program", "motion", 1.9, 1.9, sides=("real",))
    assert not list(above_eighty(history(fast, decisions=LED, deeds=[program])))
    assert list(above_eighty(history(fast, decisions=LED, deeds=[motion(1.9)])))


def test_controller_that_is_gone_leads_nobody() -> None:
    """Its last decision says nothing any more."""
    killed = Strike("kill twin_controller 0.2", 1.9, 2.1, {})
    assert not list(
        above_eighty(history(moving((2.0, 2.2, 390.0)), decisions=LED, strikes=[killed]))
    )
