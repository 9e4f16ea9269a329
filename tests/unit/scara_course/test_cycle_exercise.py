"""Exercise 10: a quicker program that keeps to the points passes; what it lacks is named."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from harness.course import JOINTS, exercise, robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_course.marking import ExerciseMark
from scara_course.recorded import CourseRecording, ModeDecision
from twin_experiments.metrics.series import Motion
from twin_experiments.report.record import Run

ARM = ArmKinematics(robot())
POINTS = {name: ARM.inverse(*place).chosen.q for name, place in robot().positions_m.items()}
ROUND = ("P1", "P2", "P3", "P1", "P2", "P3", "P1")


def visit(
    names: tuple[str, ...], move: float, wait: float, off: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Go from point to point, ``move`` [s] each with a ``wait`` [s]: times, positions, speeds.

    ``off`` [rad]: so far the first joint stays away from the points.
    """
    times = np.arange(0.0, (len(names) - 1) * (move + wait) + 1.0, 0.01)
    q, qdot = np.tile(POINTS[names[0]], (len(times), 1)), np.zeros((len(times), 3))
    for k, (here, there) in enumerate(pairwise(names)):
        way = np.subtract(POINTS[there], POINTS[here])
        u = np.clip((times - 0.5 - k * (move + wait)) / move, 0.0, 1.0)[:, None]
        q = q + way * (10 * u**3 - 15 * u**4 + 6 * u**5)
        qdot = qdot + way * (30 * u**2 - 60 * u**3 + 30 * u**4) / move
    q[:, 0] += off * np.clip((times - 0.5) / move, 0.0, 1.0)
    return times, q, qdot


def judged(
    *,
    first: str = "ARTICLE",
    second: str = "QUICK",
    move: float = 0.4,
    wait: float = 0.2,
    names: tuple[str, ...] = ROUND,
    off: float = 0.0,
    lag: float = 0.004,
    overrides: tuple[float, float] = (100.0, 100.0),
    twin_stays: bool = False,
) -> ExerciseMark:
    """Mark a recording with two runs of programs."""
    runs = visit(ROUND, 0.6, 0.7), visit(names, move, wait, off)
    gap = runs[0][0][-1] + 1.0
    times = np.concatenate((runs[0][0], runs[1][0] + gap))
    q, qdot = (np.insert(np.concatenate((runs[0][k], runs[1][k])), 3, 0.0, axis=1) for k in (1, 2))
    twin = Motion("twin", times + lag, q, qdot)
    if twin_stays:
        twin = Motion("twin", times, np.tile(q[0], (len(times), 1)), np.zeros_like(q))
    end = float(times[-1])
    changes = tuple(
        ModeDecision(at, *words)
        for at, words in (
            (0.5, ("IDLE", "REAL_MOVED", "REAL_LEADS")),
            (gap - 1.0, ("REAL_LEADS", "AT_REST", "IDLE")),
            (gap + 0.5, ("IDLE", "REAL_MOVED", "REAL_LEADS")),
            (end, ("REAL_LEADS", "AT_REST", "IDLE")),
        )
    )
    run = Run("run.bag", 0.0, end, False, JOINTS, (), Motion("real", times, q, qdot), twin)
    recorded = CourseRecording(
        run,
        changes,
        ((0.4, first), (gap - 1.0, ""), (gap + 0.6, second), (end, "")),
        overrides=((0.0, overrides[0]), (gap, overrides[1])),
    )
    mark: ExerciseMark = exercise(10).check.mark(recorded, robot())
    return mark


def test_a_quicker_program_passes() -> None:
    """And the verdict tells both times: six moves of 0.6 s and five waits of 0.7 s at first."""
    mark = judged()
    found = re.search(r"ARTICLE took ([\d.]+) s, QUICK ([\d.]+) s, (\d+) % less", mark.reason)
    assert mark.passed and found is not None, mark.reason
    assert float(found[1]) == pytest.approx(7.1, abs=0.1)
    assert float(found[2]) == pytest.approx(3.4, abs=0.1)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        pytest.param({"first": "OTHER"}, "no run of ARTICLE", id="nothing to compare with"),
        pytest.param({"second": "ARTICLE"}, "no run of a program of yours", id="ARTICLE twice"),
        pytest.param({"second": "PALLETISE"}, "no run of a program of yours", id="another shipped"),
        pytest.param({"move": 0.6, "wait": 0.7}, "0 % .*15 % less are needed", id="as slow"),
        pytest.param({"move": 0.6, "wait": 0.6}, "% less: 15 % less are needed", id="hardly"),
        pytest.param({"move": 0.9, "wait": 0.7}, "% more: 15 %", id="slower"),
        pytest.param(
            {"names": ("P1", "P2", "P1", "P2", "P3", "P1")}, "point 5 of 7, P2", id="one left out"
        ),
        pytest.param({"names": ("P1", "P3", "P2", "P1")}, "point 3 of 7, P3", id="the other way"),
        pytest.param({"names": ("P1", "P2", "P3", "P1")}, "point 5 of 7, P2", id="once only"),
        pytest.param({"off": 0.02}, r"P\d, was never nearer than 3 mm", id="beside the points"),
        pytest.param(
            {"overrides": (50.0, 100.0)}, "50 %, then 100 %: it must be the same", id="override"
        ),
        pytest.param({"lag": 0.03}, "mm apart, .* of reach", id="too quick for the twin"),
        pytest.param({"twin_stays": True}, "mm apart", id="the twin stays"),
    ],
)
def test_what_a_program_lacks_is_named(changed: dict[str, object], reason: str) -> None:
    """Each for its own reason."""
    mark = judged(**changed)  # type: ignore[arg-type]
    assert not mark.passed and re.search(reason, mark.reason), mark.reason
