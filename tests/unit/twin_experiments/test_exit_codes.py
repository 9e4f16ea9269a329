"""What run_experiment, report and step_response end with, and what they say then.

Also when a run and its recording end.
"""

from __future__ import annotations

import re
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest
from scara_config import load_robot
from twin_analysis.step import step_response_node as step_response
from twin_experiments.config import load_experiments
from twin_experiments.report import report_node as report
from twin_experiments.run import cell_node
from twin_experiments.run import run_experiment_node as run_experiment
from twin_experiments.run.cell_node import RunError, RunningCell

from scara_msgs.msg import RobotData
from scara_msgs.srv import StartRecordingResponse, StopRecordingResponse

MakeBag = Callable[..., Path]
CONFIG = Path(__file__).resolve().parents[3] / "config"
MISSED = {"offset": (0.0, 0.0, 0.002, 0.0)}


@pytest.fixture
def end_of(monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    """Return what runs a command in this process, without figures, and gives its exit code."""
    monkeypatch.setattr("twin_experiments.report.report_io.write_figures", lambda *_: {})
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # the tests keep their own

    def run(main: Callable[[], None], *words: object) -> object:
        monkeypatch.setattr(sys, "argv", [main.__module__.rsplit(".", 1)[1], *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code

    return run


@pytest.mark.parametrize(("options", "code"), [({}, 0), (MISSED, 1)])
def test_a_missed_limit_ends_both_commands_with_exit_code_one(
    make_bag: MakeBag,
    end_of: Callable[..., object],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    options: dict[str, tuple[float, ...]],
    code: int,
) -> None:
    """And the terminal says which."""
    recorded = make_bag(experiments=("twin_leads",), **options)
    said = "positioning error 0.308 % of reach, limit 0.2 %"
    for name in ("enter_ros", "RunningCell"):
        monkeypatch.setattr(run_experiment, name, lambda *_: None)
    monkeypatch.setattr(run_experiment, "_record", lambda *given: shutil.copy(recorded, given[6]))
    words = ("--output", tmp_path / "out", f"_config_dir:={CONFIG}")
    assert end_of(run_experiment.main, "twin_leads", *words) == code
    assert (said in capsys.readouterr().out) is bool(code)
    words = ("--output", tmp_path / "again", "--config-dir", CONFIG)
    assert end_of(report.main, recorded, *words) == code
    assert (said in capsys.readouterr().out) is bool(code)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("nobody_leads",), "unknown experiment 'nobody_leads'"),
        (("--speed", "150"), "less than or equal to 100"),
        (("_config_dir:=/nowhere",), "/nowhere"),
    ],
)
def test_wrong_arguments_end_with_exit_code_two(
    end_of: Callable[..., object],
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    text: str,
) -> None:
    """A wrong name, speed or folder is told before anything moves."""
    assert end_of(run_experiment.main, *words) == 2
    assert text in capsys.readouterr().err


def test_its_help_names_what_no_names_mean(
    end_of: Callable[..., object], capsys: pytest.CaptureFixture[str]
) -> None:
    """The experiments of the article; those with parts are asked for by name."""
    assert end_of(run_experiment.main, "--help") == 0
    shown = re.sub(r"[\s│]+", " ", capsys.readouterr().out)
    assert "default: the article's two" in shown


def test_its_usage_lines_ask_for_nothing_that_is_refused() -> None:
    """The twin palletises at its own speeds, so a line of both takes none."""
    config = load_experiments(load_robot(CONFIG), CONFIG)
    lines = re.findall(r"run_experiment ([a-z_ ]+)(.*)", str(run_experiment.__doc__))
    assert len(lines) == 2 and any("--speed" in options for _, options in lines)
    for names, options in lines:
        for experiment in config.select(names.split()).values():
            run_experiment._at_speed(experiment, 50.0 if "--speed" in options else None)


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (
            ("joint_3", "--size", "3", "--seconds", "0.6"),
            0,
            "joint_3, position loop",
        ),
        (("joint_9",), 2, "unknown joint 'joint_9': robot.yaml has joint_1"),
        (("joint_4",), 2, "joint_4 is not moved by the twin"),
        (("joint_3", "--size", "300"), 2, "joint_3: no room for a step of 300 mm at -160.00 mm"),
    ],
)
def test_a_step_is_made_in_process(
    end_of: Callable[..., object],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    words: tuple[str, ...],
    code: int,
    text: str,
) -> None:
    """The same physics; wrong arguments are named with what is allowed."""
    assert end_of(step_response.main, *words, "--output", tmp_path) == code
    said = capsys.readouterr()
    assert text in said.out + said.err
    assert bool(list(tmp_path.glob("step_joint_3*.png"))) is (code == 0)


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> RunningCell:
    """Return what sees a cell, without a master."""
    monkeypatch.setattr(cell_node, "rospy", Mock())
    robot = load_robot(CONFIG)
    config = load_experiments(robot, CONFIG)
    return RunningCell(robot, config.metrics.moving_speed_percent, config.deadlines_s)


@pytest.mark.parametrize(
    ("kind", "state", "running"),
    [
        ("program", "paused", True),
        ("program", "aborted", False),
        ("stream", "paused", False),
        ("none", "running", False),  # read before the program ended
    ],
)
def test_a_paused_program_has_not_ended(
    cell: RunningCell, kind: str, state: str, running: bool
) -> None:
    """An experiment with PAUSE and RESUME in it goes on; the stream program is none of its own."""
    said = RobotData(control_type=kind, running=False, program=f"PALLETISE line 9 {state}")
    cell._receive(said, "real/robot_data")
    assert cell.running is running


@pytest.mark.parametrize("trouble", [KeyboardInterrupt(), RunError("no answer within 10 s")])
def test_a_recording_that_may_have_begun_is_ended(
    cell: RunningCell, monkeypatch: pytest.MonkeyPatch, trouble: BaseException
) -> None:
    """Ctrl-C or a time-out while it starts leaves no recorder running; the reason stays."""
    asked = []

    def call(name: str, within: float, **fields: object) -> StopRecordingResponse:
        asked.append(name)
        if name == "recorder/start":
            raise trouble
        return StopRecordingResponse(False, "not recording", "", 0)

    monkeypatch.setattr(cell, "_call", call)
    with pytest.raises(type(trouble)) as raised:
        cell.start_recording(Path("run.bag"))
    assert raised.value is trouble
    assert asked == ["recorder/start", "recorder/stop"]


def test_a_recorder_that_refuses_is_left_alone(
    cell: RunningCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it records is somebody else's."""
    asked = []

    def call(name: str, within: float, **fields: object) -> StartRecordingResponse:
        asked.append(name)
        return StartRecordingResponse(False, "already recording", "other.bag")

    monkeypatch.setattr(cell, "_call", call)
    with pytest.raises(RunError, match="already recording"):
        cell.start_recording(Path("run.bag"))
    assert asked == ["recorder/start"]
