"""Exercise 11: right, wrong and right again, and it shows; a recording without that is refused."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import pytest
from harness.course import JOINTS, exercise, robot
from scara_course.marking import ExerciseMark
from scara_course.recorded import CourseRecording, ModeDecision
from twin_experiments.metrics.series import Motion
from twin_experiments.report.record import Run

LONG_S = 5.0


class Phase(NamedTuple):
    """One motion: told and mounted mass [kg], how far the twin hangs low [mm], how long [s]."""

    told: float
    mounted: float
    low: float
    lasts: float = 3.0
    twin_moves: bool = True


RIGHT, WRONG = Phase(6.0, 6.0, 0.03), Phase(0.0, 6.0, 1.3)


def judged(*phases: Phase, late: float = -1.0, end: str = "IDLE") -> ExerciseMark:
    """Mark a recording of some motions; ``late`` [s] into each the payload is told."""
    times = np.arange(0.0, LONG_S * len(phases), 0.01)
    q, qdot = np.zeros((len(times), 4)), np.zeros((len(times), 4))
    low, still = np.zeros(len(times)), np.zeros(len(times), dtype=bool)
    changes, payloads = [], []
    for k, phase in enumerate(phases):
        start = LONG_S * k + 1.0
        inside = (times >= start) & (times < start + phase.lasts)
        qdot[inside, 0] = 0.2
        low[inside] = phase.low * 1e-3
        still |= inside & (not phase.twin_moves)
        payloads.append((max(0.0, start + late), (phase.told, phase.mounted)))
        after = "IDLE" if k + 1 < len(phases) else end
        changes += [
            ModeDecision(start, "IDLE", "REAL_MOVED", "REAL_LEADS"),
            ModeDecision(start + phase.lasts, "REAL_LEADS", "AT_REST", after),
        ]
    q[:, 0] = np.cumsum(qdot[:, 0]) * 0.01
    q[:, 2] = -0.1
    hangs, stays = q.copy(), qdot.copy()
    hangs[:, 2] -= low
    stays[still] = 0.0
    run = Run(
        "run.bag",
        0.0,
        float(times[-1]),
        False,
        JOINTS,
        (),
        Motion("real", times, q, qdot),
        Motion("twin", times, hangs, stays),
    )
    recorded = CourseRecording(run, tuple(changes), payloads=tuple(payloads))
    mark: ExerciseMark = exercise(11).check.mark(recorded, robot())
    return mark


@pytest.mark.parametrize(
    "phases",
    [
        (RIGHT, WRONG, RIGHT),
        (Phase(0.0, 0.0, 0.03), RIGHT, RIGHT, WRONG, WRONG, RIGHT),
        (WRONG, RIGHT, WRONG, RIGHT),
        (Phase(3.0, 3.0, 0.03), Phase(6.0, 3.0, -0.7), Phase(3.0, 3.0, 0.03)),
    ],
    ids=["as the card says", "with an empty run, and twice", "wrong at first", "told too much"],
)
def test_right_wrong_right_passes(phases: tuple[Phase, ...]) -> None:
    """Other motions before and between do no harm."""
    mark = judged(*phases)
    assert mark.passed and "mm apart" in mark.reason, mark.reason


@pytest.mark.parametrize(
    ("phases", "how", "reason"),
    [
        pytest.param((), {}, "holds no payload", id="nothing recorded"),
        pytest.param((RIGHT,), {}, "no motion with the payload told wrong", id="never wrong"),
        pytest.param((WRONG,), {}, "no motion with 3 kg or more told right", id="never right"),
        pytest.param(
            (Phase(0.0, 0.0, 0.03), Phase(6.0, 0.0, 1.3), Phase(0.0, 0.0, 0.03)),
            {},
            "3 kg or more told right .none with a heavy",
            id="nothing mounted",
        ),
        pytest.param(
            (Phase(0.05, 0.05, 0.0), Phase(0.0, 0.05, 0.01), Phase(0.05, 0.05, 0.0)),
            {},
            "none with a heavy payload",
            id="a part only",
        ),
        pytest.param((WRONG, RIGHT), {}, "first right, then wrong", id="the other way round"),
        pytest.param(
            (RIGHT, WRONG), {}, "no motion after the payload was put right", id="not put right"
        ),
        pytest.param(
            (RIGHT, Phase(0.0, 6.0, 0.05), RIGHT),
            {},
            "did not show: joint_3 was 0.03",
            id="no effect",
        ),
        pytest.param(
            (RIGHT, WRONG, Phase(6.0, 6.0, 1.2)), {}, "did not show", id="worse for another cause"
        ),
        pytest.param(
            (RIGHT, WRONG, RIGHT),
            {"late": 1.0},
            "was changed in the motion",
            id="changed on the way",
        ),
        pytest.param(
            (RIGHT, Phase(0.0, 6.0, 1.3, 0.5), RIGHT), {}, "told wrong .right.", id="too short"
        ),
        pytest.param(
            (RIGHT, WRONG._replace(twin_moves=False), RIGHT), {}, "told wrong", id="the twin stood"
        ),
        pytest.param((RIGHT, WRONG, RIGHT), {"end": "FAULT"}, "ends in FAULT", id="not ready"),
    ],
)
def test_what_is_missing_is_named(
    phases: tuple[Phase, ...], how: dict[str, object], reason: str
) -> None:
    """Each for its own reason."""
    mark = judged(*phases, **how) if phases else empty()  # type: ignore[arg-type]
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def empty() -> ExerciseMark:
    """Mark a recording of a cell that tells no payload."""
    still = Motion("real", np.array([0.0, 1.0]), np.zeros((2, 4)), np.zeros((2, 4)))
    run = Run("run.bag", 0.0, 1.0, False, JOINTS, (), still, still)
    mark: ExerciseMark = exercise(11).check.mark(CourseRecording(run, ()), robot())
    return mark
