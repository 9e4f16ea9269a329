"""Exercise 4: the gains that the card leads to pass; others are refused for what they do."""

from __future__ import annotations

import re

import control
import numpy as np
import pytest
from harness.course import LEARNER, exercise, filled, robot
from scara_control.pid import PidGains
from scara_course.evidence_io import mark_steps
from scara_course.exercises_io import draw
from scara_course.marking import ExerciseMark
from twin_analysis.step.offline_io import OfflineBench
from twin_analysis.step.trial import plan_trial

BY_CARD = {"p": 5100.0, "i": 51000.0, "d": 2.0 * (5100.0 * 2.3) ** 0.5, "i_clamp": 1.5}


def tuned(**changed: object) -> ExerciseMark:
    """Mark the gains of the card with some changed."""
    each, given = exercise(4), draw(exercise(4), LEARNER)
    text = filled(
        each.answers_file(LEARNER, given, robot()),
        {"gains": {**BY_CARD, **changed}},  # type: ignore[dict-item]
    )
    return mark_steps(each, text, LEARNER, given, robot())


def test_whoever_follows_the_card_passes() -> None:
    """Its four steps, with the numbers that it names."""
    mark = tuned()
    assert mark.passed and mark.reason.count("settled after") == 2, mark.reason


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        pytest.param({"p": 2000, "i": 0, "d": 20}, "overshoot is not below", id="as it began"),
        pytest.param({"p": 8285, "i": 82850, "d": 276.2}, "exceeds 180", id="as shipped"),
        pytest.param({"p": 1e6}, "exceeds 180", id="far too stiff"),
        pytest.param({"d": 40}, "overshoot is not below", id="no brake"),
        pytest.param({"d": 600}, "needs more than 150", id="creeps"),
        pytest.param({"p": 500, "i": 0, "d": 70}, "needs more than 150|never stays", id="too soft"),
        pytest.param({"i": 0}, "friction holds it", id="no i"),
        pytest.param({"i_clamp": 50}, "smaller i_clamp", id="i without a bound"),
        pytest.param({"p": 138.1, "i": 103.6, "d": 0}, "never stays", id="the velocity loop's"),
        pytest.param({"p": 0, "i": 0, "d": 0}, "never stays", id="nothing"),
        pytest.param({"d": -200}, "from 0 to 1e9", id="negative"),
        pytest.param({"p": "much"}, "is no number", id="a word"),
    ],
)
def test_other_gains_are_refused_for_what_they_do(changed: dict[str, object], reason: str) -> None:
    """The sentence names the figure that is wrong, and the way to go."""
    mark = tuned(**changed)
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_figures_are_those_of_step_info() -> None:
    """Settling time and overshoot of both steps, by python-control from the record."""
    check, joint = exercise(4).check, robot().joint("joint_1")
    bench = OfflineBench(robot(), None, plain=True, gains={"joint_1": PidGains(**BY_CARD)})
    said = tuned().reason
    for step in bench.run(plan_trial(joint, "position", 0.0, check.SIZE, check.SECONDS)):
        since = step.times >= 0.0
        share = (step.values - step.start)[since] / (step.target - step.start)
        info = control.step_info(share, T=step.times[since], yfinal=1.0)
        assert f"settled after {info['SettlingTime'] * 1e3:.0f} ms" in said
        assert f"overshoot {info['Overshoot']:.2f} %" in said
        assert f"{np.abs(step.efforts[since]).max():.1f} N m" in said
