"""No wrong value gets through in silence: thousands of lies of a robot and of a twin."""

from __future__ import annotations

from harness.faults.rows import check
from harness.faults.value_faults import robot_lies, twin_lies
from harness.running.thorough import examples

LIES = examples(2_000, 10_000)
"""Of some thirty kinds."""


def test_no_lie_of_the_robot_is_taken_for_a_sample() -> None:
    """Wrong transaction, unit, count, NaN, infinities, 65535, signs, ranges, clocks.

    What is physically possible is bounded.
    """
    check(lambda: robot_lies(seed=1, count=LIES))


def test_no_lie_of_the_twin_is_taken_for_a_joint_state() -> None:
    """NaN, null, text, signs, ranges, counts, names, stamps, broken JSON."""
    check(lambda: twin_lies(seed=1, count=LIES))
