"""Which steps are made, and the shipped gains judged by them."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest
from matplotlib.image import imread
from scara_config import load_robot
from twin_analysis.step.figures_io import write_trial
from twin_analysis.step.offline_io import OfflineBench
from twin_analysis.step.response import StepFigures, StepResponseError
from twin_analysis.step.trial import plan_trial, reasons, summary

CONFIG = Path(__file__).parents[4] / "config"
ROBOT = load_robot(CONFIG)
GOOD = StepFigures(0.05, 1.9, 0.1, 0.0, 10.0, False)


@pytest.mark.parametrize(
    ("joint", "position_mm_deg", "size", "targets"),
    [
        ("joint_1", 0.0, None, (5.0, 0.0)),
        ("joint_1", 147.0, None, (142.0, 147.0)),
        ("joint_3", -160.0, None, (-140.0, -160.0)),
        ("joint_3", 0.0, 3.0, (-3.0, 0.0)),
        ("table_joint", 10.0, 10.0, (20.0, 10.0)),
    ],
)
def test_position_steps_go_there_and_back_where_there_is_room(
    joint, position_mm_deg, size, targets
):
    """Up first unless the limit is near; the second step ends where the first began."""
    chosen = ROBOT.joint(joint)
    trial = plan_trial(chosen, "position", position_mm_deg * chosen.scale, size, None)
    assert [target / chosen.scale for target in trial.targets] == pytest.approx(targets)


@pytest.mark.parametrize(
    ("joint", "position_mm_deg", "targets"),
    [
        ("joint_1", 0.0, (44.0, -44.0)),
        ("joint_3", -160.0, (200.0, -200.0)),
        ("joint_3", -50.0, (-200.0, 200.0)),
    ],
)
def test_velocity_steps_need_room_on_one_side(joint, position_mm_deg, targets):
    """By default half a second at a tenth of the speed: 100 mm of joint_3, and back again."""
    chosen = ROBOT.joint(joint)
    trial = plan_trial(chosen, "velocity", position_mm_deg * chosen.scale, None, None)
    assert [target / chosen.scale for target in trial.targets] == pytest.approx(targets)


@pytest.mark.parametrize(
    ("joint", "kind", "position", "size", "seconds", "text"),
    [
        (
            "joint_3",
            "position",
            -0.1,
            150.0,
            None,
            r"no room .*150 mm at -100\.00 mm.* -210 to 0",
        ),
        (
            "joint_1",
            "velocity",
            0.0,
            500.0,
            0.3,
            r"no room .*500 deg/s during 0\.3 s.* 440 deg/s",
        ),
        ("joint_3", "velocity", -0.01, 100.0, 2.5, r"no room for 100 mm/s .* at -10\.00 mm"),
        ("joint_1", "position", 0.0, 0.0, None, "a step of 0.0 and 1.5 s is none"),
        ("joint_1", "position", 0.0, 5.0, 0.1, "a step of 5.0 and 0.1 s is none"),
    ],
)
def test_step_without_room_is_refused_with_joint_value_and_limits(
    joint, kind, position, size, seconds, text
):
    """Nothing moves then."""
    with pytest.raises(StepResponseError, match=f"{joint}: {text}"):
        plan_trial(ROBOT.joint(joint), kind, position, size, seconds)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"overshoot_percent": 2.0}, "overshoot 2.00 % is not below 2 %"),
        ({"steady_state_error": -0.011e-3}, "steady-state error 0.0110 mm is not below 0.01 mm"),
        ({"settling_time": None}, "it is never within 2 % of the step for good"),
        ({"saturated": True}, "the effort reached its limit of 400 N"),
    ],
)
def test_each_broken_limit_is_a_reason(changes, text):
    """The verdict says what is wrong with which value."""
    trial = plan_trial(ROBOT.joint("joint_3"), "position", -0.1, None, None)
    assert reasons(trial, GOOD) == []
    assert reasons(trial, msgspec.structs.replace(GOOD, **changes)) == [text]


@pytest.mark.parametrize(
    ("joint", "size"), [("joint_1", 0.3), ("joint_2", 5.0), ("joint_3", 3.0), ("table_joint", 10.0)]
)
def test_shipped_gains_keep_the_limits_in_both_directions(joint, size):
    """Overshoot below 2 %, less than 0.01 deg or mm left.

    The effort stays below its limit, for small steps as well.
    """
    bench = OfflineBench(ROBOT, CONFIG, plain=False)
    trial = plan_trial(ROBOT.joint(joint), "position", bench.position(joint), size, 0.8)
    document = summary(trial, bench.run(trial), {"simulator": "offline"})
    assert document["verdict"] == "pass", document["steps"]
    assert [row["direction"] for row in document["steps"]] == ["up", "down"]
    assert all(row["settling_time_s"] < 0.5 for row in document["steps"])


def test_plain_pid_of_joint_3_hangs_low_and_is_judged_so():
    """Without feed-forward the weight is more than the integral's clamp.

    The verdict is no decoration.
    """
    bench = OfflineBench(ROBOT, CONFIG, plain=True)
    trial = plan_trial(ROBOT.joint("joint_3"), "position", bench.position("joint_3"), 10.0, 0.8)
    document = summary(trial, bench.run(trial), {})
    assert document["verdict"] == "FAIL"
    assert all("steady-state error" in " ".join(row["reasons"]) for row in document["steps"])


def test_figures_and_numbers_are_written_for_both_directions(tmp_path):
    """One JSON file, one picture each; velocity steps too."""
    bench = OfflineBench(ROBOT, CONFIG, plain=False)
    trial = plan_trial(
        ROBOT.joint("table_joint"), "velocity", bench.position("table_joint"), 30.0, 0.4
    )
    steps = bench.run(trial)
    document = summary(trial, steps, {"title": "table"})
    written = write_trial(trial, steps, document, tmp_path / "new", "table_velocity")
    assert [file.name for file in written] == [
        f"step_table_velocity{end}" for end in (".json", "_up.png", "_down.png")
    ]
    assert json.loads(written[0].read_text())["steps"][1]["target"] == pytest.approx(-30.0)
    for file in written[1:]:
        assert imread(file).std() > 0.05
