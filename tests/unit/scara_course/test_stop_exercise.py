"""Exercise 6: a recording with both stops and both ways back passes; others lack something."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest
from harness.course import Scene, exercise, robot, write_scene
from scara_config import Robot
from scara_course.evidence_io import mark_bag
from scara_course.marking import ExerciseMark
from scara_course.recorded import CourseRecording

LEADS = (1.0, "IDLE", "REAL_MOVED", "REAL_LEADS")
MODEL = Scene(
    real=((1.0, 2.1), (5.0, 6.1), (10.0, 12.0)),
    twin=((1.02, 2.1), (5.02, 6.1), (10.02, 12.0)),
    decisions=(
        LEADS,
        (2.0, "REAL_LEADS", "STOP", "STOPPED"),
        (4.0, "STOPPED", "ALIGN", "ALIGNING"),
        (4.5, "ALIGNING", "ALIGNED", "IDLE"),
        (5.0, "IDLE", "REAL_MOVED", "REAL_LEADS"),
        (6.0, "REAL_LEADS", "ESTOP", "ESTOP"),
        (8.0, "ESTOP", "RESET", "ESTOP"),
        (8.5, "ESTOP", "RESET_DONE", "STOPPED"),
        (9.0, "STOPPED", "ALIGN", "ALIGNING"),
        (9.4, "ALIGNING", "ALIGNED", "IDLE"),
        (10.0, "IDLE", "REAL_MOVED", "REAL_LEADS"),
        (12.5, "REAL_LEADS", "AT_REST", "IDLE"),
    ),
    end=13.0,
)


def judged(scene: Scene, folder: Path) -> ExerciseMark:
    """Mark a scene."""
    return mark_bag(exercise(6), write_scene(scene, folder / "run.bag"), robot())


def without(*events: str) -> Callable[[Scene], Scene]:
    """Leave out decisions by their triggers."""
    return lambda scene: scene._replace(
        decisions=tuple(each for each in scene.decisions if each[2] not in events)
    )


def until(end: float) -> Callable[[Scene], Scene]:
    """End the recording early."""
    return lambda scene: scene._replace(
        decisions=tuple(each for each in scene.decisions if each[0] < end), end=end
    )


def turned(number: int, *decision: str) -> Callable[[Scene], Scene]:
    """Change what a decision is, not when."""

    def change(scene: Scene) -> Scene:
        held = list(scene.decisions)
        held[number] = (held[number][0], *decision)  # type: ignore[assignment]
        return scene._replace(decisions=tuple(held))

    return change


def stops_swapped(scene: Scene) -> Scene:
    """Press E-STOP first, and STOP the second time."""
    modes = {"STOP": ("ESTOP", "ESTOP"), "ESTOP": ("STOP", "STOPPED")}
    held = [
        (at, before, *modes.get(event, (event, mode)))
        for at, before, event, mode in scene.decisions
    ]
    return scene._replace(decisions=tuple(held))


def test_the_model_recording_passes(tmp_path: Path) -> None:
    """And the verdict says when the stops were."""
    mark = judged(MODEL, tmp_path)
    assert mark.passed and "STOP at 2.0 s, E-STOP at 6.0 s" in mark.reason, mark.reason


def test_a_stop_may_take_a_second(tmp_path: Path) -> None:
    """Steel has mass: what stands within 1.5 s was stopped."""
    late = MODEL._replace(real=((1.0, 3.4), *MODEL.real[1:]))
    assert judged(late, tmp_path).passed


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        pytest.param(without("STOP"), "no STOP while", id="no STOP"),
        pytest.param(turned(1, "IDLE", "STOP", "STOPPED"), "no STOP while", id="STOP at rest"),
        pytest.param(
            turned(2, "STOPPED", "MOVE_UNALIGNED", "ALIGNING"), "no Align after STOP", id="no Align"
        ),
        pytest.param(
            turned(3, "ALIGNING", "ALIGN_FAILED", "FAULT"), "not ready after the Align", id="failed"
        ),
        pytest.param(stops_swapped, "no E-STOP|no STOP|no Align", id="the stops swapped"),
        pytest.param(without("ESTOP"), "no E-STOP", id="no E-STOP"),
        pytest.param(without("RESET_DONE"), "no Reset after", id="no Reset"),
        pytest.param(until(9.8), "nobody moved after the emergency stop", id="too short"),
        pytest.param(until(11.5), "did not come to rest", id="cut"),
        pytest.param(
            lambda s: s._replace(real=((1.0, 4.0), *s.real[1:])),
            "STOP at 2.0 s: real still moved",
            id="the robot does not obey",
        ),
        pytest.param(
            lambda s: s._replace(real=((1.0, 3.6), *s.real[1:])),
            "STOP at 2.0 s: real still moved after 1.5 s",
            id="the robot stops too late",
        ),
        pytest.param(
            lambda s: s._replace(twin=(s.twin[0], (5.0, 8.4), s.twin[2])),
            "E-STOP at 6.0 s: twin still moved",
            id="the twin does not obey",
        ),
        pytest.param(
            lambda s: s._replace(twin=s.twin[:2]), "twin did not move in the last", id="alone"
        ),
        pytest.param(
            lambda s: s._replace(real=s.real[1:], twin=s.twin[1:]),
            "nothing moved when STOP came",
            id="stopped a robot that stood",
        ),
        pytest.param(
            lambda s: s._replace(decisions=(*s.decisions, (12.9, "IDLE", "STOP", "STOPPED"))),
            "ends in STOPPED",
            id="not ready at the end",
        ),
    ],
)
def test_a_recording_that_lacks_something_is_refused(
    change: Callable[[Scene], Scene], reason: str, tmp_path: Path
) -> None:
    """The sentence names the step that is missing, or who still moved."""
    mark = judged(change(MODEL), tmp_path)
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_what_is_no_recording_is_a_verdict_too(tmp_path: Path) -> None:
    """Whatever file is given, the answer is a sentence."""
    path = tmp_path / "run.bag"
    path.write_bytes(b"#ROSBAG V2.0\nnothing")
    assert "cannot be marked" in mark_bag(exercise(6), path, robot()).reason


@pytest.mark.parametrize("twin_from", [0.0, 30.0])
def test_a_recording_whose_motions_cannot_be_compared_is_a_verdict_too(
    twin_from: float, tmp_path: Path
) -> None:
    """Exercises 10 and 11 look at both tools: a side may not be recorded there, or the other."""

    def mark(recorded: CourseRecording, robot: Robot) -> ExerciseMark:
        twin = recorded.run.twin
        late = dataclasses.replace(twin, stamps=twin.stamps + twin_from)
        run = dataclasses.replace(recorded.run, twin=late)
        begin, end = (0.0, 60.0) if twin_from else (50.0, 51.0)
        msgspec.structs.replace(recorded, run=run).seen(robot, begin, end)
        raise AssertionError("it was compared")

    looks = dataclasses.replace(exercise(6), check=SimpleNamespace(mark=mark))
    verdict = mark_bag(looks, write_scene(MODEL, tmp_path / "run.bag"), robot())
    assert not verdict.passed and "the recording cannot be marked: " in verdict.reason
