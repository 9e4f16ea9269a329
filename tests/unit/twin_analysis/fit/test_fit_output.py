"""What a fit prints into a file follows from the recording alone."""

from __future__ import annotations

import json
import shutil
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from harness.imitated_run import BagMaker
from rich.console import Console
from scara_config import load_robot
from scara_simulation.config import load_simulation
from twin_analysis.fit import fit_twin_node as fit_twin
from twin_analysis.fit.recording_io import FOLLOW, TRUTH, read_recording
from twin_analysis.fit.search import Errors, FitResult
from twin_analysis.fit.twin_model import Choice, apply_vector
from typer.testing import CliRunner

CONFIG = Path(__file__).resolve().parents[4] / "config"


@pytest.mark.parametrize("terminal", [True, False])
def test_a_progress_bar_is_for_a_terminal(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    """Its time is another one in each run; in a file it would make the same fit another one."""
    robot = load_robot(CONFIG)
    start = SimpleNamespace(delay=0.0)
    recording = SimpleNamespace(real=np.zeros((10, len(robot.twin_joints))), delay=None)

    def found(*words: Any) -> str:
        words[-1](1.0)
        return "found"

    monkeypatch.setattr(fit_twin, "fit_twin", found)
    console = Console(file=StringIO(), force_terminal=terminal, width=100)
    words: Any = (robot, CONFIG, recording, start, None, 0.4, 10, console)
    assert fit_twin.search(*words) == "found"
    assert ("mm rms" in console.file.getvalue()) is terminal  # type: ignore[attr-defined]


def recorded_of(
    names: list[str],
    told: list[str],
    path: Path,
    begin: float = 1.2,
    silent: tuple[str, float, float] = ("", 0.0, 0.0),
    end: float = 1.5,
    ahead: tuple[float, ...] = (0.0,),
) -> Path:
    """Write some following by joints ``names`` from 1 s on, and of a robot that tells ``told``.

    The robot tells it from ``begin`` [s] on; a topic is ``silent`` between two times [s]. All ends
    at ``end`` [s]; each packet has a point for each time ``ahead`` of its stamp [s], below 1 s.
    """
    maker = BagMaker()
    point, kind = "trajectory_msgs/msg/JointTrajectoryPoint", "trajectory_msgs/msg/JointTrajectory"
    zeros, duration = np.zeros(len(names)), maker.store.types["builtin_interfaces/msg/Duration"]
    for k in range(round(100.0 * (end - 1.0))):
        points = [
            maker.store.types[point](
                zeros + at, zeros, zeros, np.zeros(0), duration(0, round(at * 1e9))
            )
            for at in ahead
        ]
        maker.add(1.0 + 0.01 * k, FOLLOW, kind, maker.header(1.0 + 0.01 * k), names, points)
    stamps = begin + 0.01 * np.arange(round(100.0 * (end - begin)))
    rows = np.zeros((len(stamps), len(told)))
    maker.joint_states(TRUTH, told, stamps, rows, rows)
    topic, since, until = silent
    maker.samples = [s for s in maker.samples if s.topic != topic or not since < s.at < until]
    return maker.write(path)


def test_positions_that_begin_after_the_stream_are_no_recording(tmp_path: Path) -> None:
    """There is nothing to hold the first packets against; the text says from when to when."""
    names = ["joint_1", "joint_2"]
    bag = recorded_of(names, names, tmp_path / "run.bag")
    text = r"ground_truth is recorded from 0.20 to 0.49 s, but the twin follows from .* on: record"
    with open_bag(bag) as opened, pytest.raises(BagError, match=text):
        read_recording(opened, names, 0.005, 0.05)


@pytest.mark.parametrize(("topic", "settles"), [(FOLLOW, 0.3), (TRUTH, 0.0)])
def test_instants_in_a_hole_are_not_fitted(tmp_path: Path, topic: str, settles: float) -> None:
    """The twin had nothing to follow there, or nobody knows where the robot was.

    Nor are those in which the twin catches up with a stream that has come back.
    """
    names = ["joint_1", "joint_2"]
    bag = recorded_of(names, names, tmp_path / "run.bag", 0.98, (topic, 1.205, 1.305), end=2.0)
    with open_bag(bag) as opened:
        found = read_recording(opened, names, 0.005, 0.05)
    steps = np.diff(found.times)
    (hole,) = steps[steps > 0.006]
    assert hole == pytest.approx(0.11 + settles, abs=0.01) and len(found.real) == len(found.times)
    assert found.times[0] == 0.0 and found.times[-1] > 0.95


def test_a_packet_has_all_its_set_points_at_their_times(tmp_path: Path) -> None:
    """The twin that was recorded had them: by the first alone it would run on otherwise."""
    names, ahead = ["joint_1", "joint_2"], (0.0, 0.02, 0.1)
    bag = recorded_of(names, names, tmp_path / "run.bag", 0.98, ahead=ahead)
    with open_bag(bag) as opened:
        found = read_recording(opened, names, 0.005, 0.05)
    last = found.packets[-1].motions
    stamp = last[0].time
    assert stamp == pytest.approx(0.49, abs=2e-4)
    assert [motion.time - stamp for motion in last] == pytest.approx(ahead)
    assert [motion.q for motion in last] == [(at, at) for at in ahead]


def test_positions_with_a_hole_where_the_stream_begins_are_no_recording(tmp_path: Path) -> None:
    """Nobody knows from where the twin has to set out."""
    names = ["joint_1", "joint_2"]
    bag = recorded_of(names, names, tmp_path / "run.bag", 0.98, (TRUTH, 0.985, 1.205))
    text = "ground_truth has a hole at 0.02 s, where the twin begins to follow: record it again"
    with open_bag(bag) as opened, pytest.raises(BagError, match=text):
        read_recording(opened, names, 0.005, 0.05)


@pytest.mark.parametrize("topic", [FOLLOW, TRUTH])
def test_joints_that_a_recording_lacks_are_named_with_those_that_it_has(
    tmp_path: Path, topic: str
) -> None:
    """Of another robot, or of one with other joints then."""
    names, fewer = ["joint_1", "joint_2"], ["joint_1", "joint_9"]
    held = (fewer, names) if topic == FOLLOW else (names, fewer)
    bag = recorded_of(*held, tmp_path / "run.bag")
    text = f"{topic} has joint_1, joint_9; the twin of this robot has joint_1, joint_2"
    with open_bag(bag) as opened, pytest.raises(BagError, match=text):
        read_recording(opened, names, 0.005, 0.05)


def test_a_recording_of_another_robot_is_refused(tmp_path: Path) -> None:
    """Its joints have the same names, and its arm is 250 mm shorter: nothing would show it."""
    robot = (CONFIG / "robots" / "fanuc_sr3ia" / "robot.yaml").read_text()
    maker = BagMaker()
    maker.text(0.0, "twin_controller/configuration", json.dumps({"robot.yaml": robot}))
    bag = maker.write(tmp_path / "run.bag")
    done = CliRunner().invoke(fit_twin.app, [str(bag), "--config-dir", str(CONFIG)])
    assert done.exit_code == 2, done.output
    assert "recorded of fanuc_sr3ia; this is fanuc_sr6ia: fit it with SCARA_ROBOT" in done.output


def test_what_a_damaged_recording_lacks_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before anything is fitted to the rest."""

    def choose(*_: Any) -> Choice:
        raise BagError("no joint of the arm moved")

    monkeypatch.setattr(fit_twin, "read_recording", lambda *_: None)
    monkeypatch.setattr(fit_twin, "choose", choose)
    bag = BagMaker().write(tmp_path / "run.bag")
    (tmp_path / "run.part0003.bag").write_bytes(b"")
    done = CliRunner().invoke(fit_twin.app, [str(bag), "--config-dir", str(CONFIG)])
    assert "Not read: run.part0002.bag: there is no such part" in done.output, done.output


@pytest.mark.parametrize(
    ("held_out_mm", "write", "said"),
    [
        (0.5, False, "nothing was written; --write does"),
        (0.5, True, "written"),
        (2.0, False, "nothing was written: on the held-out part the proposal is worse"),
        (2.0, True, "nothing was written: on the held-out part the proposal is worse"),
    ],
)
def test_what_is_worse_on_the_held_out_part_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held_out_mm: float, write: bool, said: str
) -> None:
    """It judges. The factor that is told is of the loop's speed, of which p is the square."""
    folder = tmp_path / "config"
    shutil.copytree(CONFIG, folder)
    robot = load_robot(folder)
    start, choice = fit_twin.load_model(robot, folder), Choice((0,), False)
    vector = np.array([np.log(1.5), 0.0, 0.0, 0.0])
    model, one = apply_vector(start, choice, vector), Errors(1.0, 2.0)
    after = (Errors(0.1, 0.2), Errors(held_out_mm, 2.0))
    result = FitResult(model, tuple(vector), 7, (one, one), after)
    monkeypatch.setattr(fit_twin, "read_recording", lambda *_: None)
    monkeypatch.setattr(fit_twin, "choose", lambda *_: choice)
    monkeypatch.setattr(fit_twin, "search", lambda *_: result)
    bag = BagMaker().write(tmp_path / "run.bag")
    gains = folder / "robots" / robot.name / "pid_gains.yaml"
    before = gains.read_text()
    words = [str(bag), "--config-dir", str(folder), *(["--write"] if write else [])]
    done = CliRunner().invoke(fit_twin.app, words)
    assert done.exit_code == int(write and said != "written") and said in done.output, done.output
    assert "joint_1 loop speed" in done.output and "x 1.500" in done.output
    assert model.gains[0].position.p == pytest.approx(2.25 * start.gains[0].position.p)
    assert (gains.read_text() != before) is (said == "written")


def test_what_is_fitted_to_one_robot_is_written_into_its_own_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other robots share the files above it: they know no joint_4, or have another friction."""
    folder = tmp_path / "config"
    shutil.copytree(CONFIG, folder)
    shared = (folder / "simulation.yaml").read_text()
    monkeypatch.setenv("SCARA_ROBOT", "articulated_six")
    console, about = Console(file=StringIO()), ("joint_dynamics", "joint_4")
    changes = {(*about, "damping"): 1.5, (*about, "friction"): 2.5}
    values: Any = {"simulation.yaml": changes}
    assert fit_twin.propose(console, folder, values, False) == []
    own = folder / "robots" / "articulated_six" / "simulation.yaml"
    assert not own.exists()
    assert fit_twin.propose(console, folder, values, True) == [own]
    assert load_simulation(load_robot(folder), folder).dynamics == {"joint_4": (1.5, 2.5)}
    monkeypatch.setenv("SCARA_ROBOT", "fanuc_sr6ia")
    assert load_simulation(load_robot(folder), folder).dynamics == {}
    assert (folder / "simulation.yaml").read_text() == shared
