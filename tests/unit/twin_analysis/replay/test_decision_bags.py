"""Replays from bags as the recorder leaves them."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from harness.pair import Pair
from harness.recording import Recording, eventful
from harness.workspace import ROOT
from scara_config import ConfigError, files_in_force
from scara_control.joint_motion import JointMotion
from twin_analysis.replay.decision_reader_io import (
    INPUTS,
    read_decisions,
    read_inputs,
    read_setups,
)
from twin_analysis.replay.decisions import ReplayResult, replay
from twin_analysis.replay.history import shadow_at
from twin_analysis.replay.reader_io import read_real
from twin_analysis.replay.replay_decisions_node import app
from twin_controller.core.events import RealMeasured
from twin_controller.reporting.snapshots import encode_events
from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.record import RecordError
from typer.testing import CliRunner

Change = Callable[[Any], None]
Write = Callable[..., Path]


def configuration() -> dict[str, str]:
    """Return the shipped files by name."""
    return {name: path.read_text() for name, path in files_in_force(ROOT / "config").items()}


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Record an eventful run once."""
    return eventful(Pair())


@pytest.fixture
def write(bag_maker: Any, tmp_path: Path, recording: Recording) -> Write:
    """Return what writes the recording as a bag, with other files, or changed."""
    return partial(write_recording, bag_maker, tmp_path, recording)


def write_recording(
    bag_maker: Any,
    folder: Path,
    recording: Recording,
    files: dict[str, str] | None = None,
    change: Change = lambda maker: None,
) -> Path:
    """Write a recording as a bag."""
    maker = bag_maker("/cell")
    maker.text(
        0.0,
        "twin_controller/configuration",
        json.dumps(configuration() if files is None else files),
    )
    first = recording.inputs[0].stamp_ns
    decided = {key[0]: decision for key, decision in recording.decisions.items()}
    for message in recording.inputs:
        at = message.at
        header = maker.header(0.0)
        header.__dict__["stamp"] = maker.stamp((message.stamp_ns - first) * 1e-9)
        data, state = np.frombuffer(message.data, np.uint8), np.frombuffer(message.state, np.uint8)
        maker.add(
            at,
            "twin_controller/inputs",
            "scara_msgs/msg/CoreInput",
            header,
            message.seq,
            data,
            state,
        )
        if message.stamp_ns in decided:
            d = decided[message.stamp_ns]
            onsets = (d.onset_real, d.onset_twin, d.onset_uncertainty)
            fields = (
                d.seq,
                d.mode_before,
                d.event,
                d.mode_after,
                d.leader,
                list(d.actions),
                d.why,
                *onsets,
                d.who,
            )
            maker.add(at, "twin_controller/decisions", "scara_msgs/msg/Decision", header, *fields)
    change(maker)
    return maker.write(folder / "run.bag")


def replayed(bag: Path) -> ReplayResult:
    """Replay a bag."""
    with open_bag(bag) as opened:
        return replay(
            read_setups(opened),
            read_inputs(opened),
            read_decisions(opened),
            opened.end - opened.start,
        )


@pytest.mark.thorough
def test_a_bag_replays_without_a_difference(write: Write, recording: Recording) -> None:
    """From the bag alone, in whatever namespace the cell was.

    The command says how many and ends with 0.
    """
    bag = write()
    result = replayed(bag)
    assert result.exact and result.decisions == len(recording.decisions)
    said = CliRunner().invoke(app, [str(bag)])
    assert said.exit_code == 0, said.output
    assert (
        f"{len(recording.decisions)} decisions and {result.snapshots} states compared: 0 "
        "differences" in said.output
    )


def test_the_recorded_configuration_is_in_force(write: Write, recording: Recording) -> None:
    """With other numbers in the bag the same inputs lead elsewhere.

    The command shows the first difference and ends with 1.
    """
    files = configuration()
    files["twin_controller.yaml"] = files["twin_controller.yaml"].replace(
        "still_time_ms: 150", "still_time_ms: 300"
    )
    said = CliRunner().invoke(app, [str(write(files))])
    assert said.exit_code == 1
    assert "first difference: " in said.output


def test_an_unfinished_bag_replays_as_far_as_it_goes(write: Write, recording: Recording) -> None:
    """What a crash left is exact."""
    bag = write()
    bag.write_bytes(bag.read_bytes()[: bag.stat().st_size // 2])
    result = replayed(bag)
    assert 0 < result.messages < len(recording.inputs)
    assert result.differences == [] and result.lost == []


def test_lost_messages_are_named_and_fail(write: Write, recording: Recording) -> None:
    """Exit code 1: what cannot be shown to be the same is not."""

    def lose(maker: Any) -> None:
        inputs = [sample for sample in maker.samples if sample.topic.endswith("inputs")]
        maker.samples.remove(inputs[100])

    said = CliRunner().invoke(app, [str(write(change=lose))])
    assert said.exit_code == 1
    assert "1 messages of inputs are lost (between 100 and 102)" in said.output


@pytest.mark.parametrize(
    ("files", "error", "text"),
    [
        ({}, BagError, "twin_controller/configuration lacks robot.yaml, twin_controller.yaml"),
        ({**configuration(), "robot.yaml": "name: x"}, ConfigError, "in the bag: robot.yaml: "),
    ],
)
def test_a_configuration_that_is_not_there_or_wrong_is_named(
    write: Write, files: dict[str, str], error: type[Exception], text: str
) -> None:
    """File and key, as when a node starts."""
    with pytest.raises(error, match=text):
        replayed(write(files))


def test_a_bag_without_inputs_or_states_cannot_be_replayed(
    write: Write, recording: Recording
) -> None:
    """Missing topics are named with what the bag has; exit code 3."""

    def drop(maker: Any) -> None:
        maker.samples = [sample for sample in maker.samples if not sample.topic.endswith("inputs")]

    bag = write(change=drop)
    with pytest.raises(
        BagError,
        match="no message of twin_controller/inputs; the bag holds "
        "/cell/twin_controller/configuration",
    ):
        replayed(bag)
    assert CliRunner().invoke(app, [str(bag)]).exit_code == 3


def test_the_pair_at_any_recorded_time(write: Write, recording: Recording) -> None:
    """By seconds from the start, before the end, or in ROS time.

    The mode is the one that the decisions say.
    """
    with open_bag(write()) as opened:
        setups, inputs, origin = read_setups(opened), list(read_inputs(opened)), opened.start
    lead = next(
        key for key, decision in recording.decisions.items() if decision.mode_after == "REAL_LEADS"
    )
    at = next(message.at for message in recording.inputs if message.stamp_ns == lead[0])
    assert shadow_at(setups, inputs, at - 0.05).authority.mode == "IDLE"
    found = shadow_at(setups, inputs, at + 0.05)
    assert found.authority.mode == "REAL_LEADS"
    assert shadow_at(setups, inputs, found.stamp).stamp == found.stamp
    assert found.stamp == pytest.approx(origin + at + 0.05, abs=0.1)
    assert shadow_at(setups, inputs, -0.001).stamp >= shadow_at(setups, inputs, 0.0).stamp + 5.0


def test_a_time_before_the_first_state_is_refused(write: Write, recording: Recording) -> None:
    """The text says from when on something is known."""
    with open_bag(write()) as opened:
        setups, inputs = read_setups(opened), list(read_inputs(opened))[10:]
    with pytest.raises(RecordError, match="no state before it; the first one is at"):
        shadow_at(setups, inputs, inputs[0].at)
    with pytest.raises(RecordError, match="no state of the controller was recorded"):
        shadow_at(setups, inputs[:5], 0.0)
    broken = [*inputs[30:60], *inputs[65:70]]
    with pytest.raises(RecordError, match="messages of inputs are lost"):
        shadow_at(setups, broken, -0.0001)


FOREIGN = Mechanism(("a", "b"), None, (), None)


def answered(at: float, clock: float, tells_speeds: bool = True) -> RealMeasured:
    """Return an answer of a robot whose first joint turns at 1 rad/s by its own clock [s].

    Its program runs from 5.1 s of that clock on.
    """
    motion = JointMotion((clock, 0.0), (1.0, 0.0) if tells_speeds else (), ())
    clock_ms, running = round(1e3 * clock), clock > 5.095
    return RealMeasured(at, at - 1e-3, at, clock_ms, motion, own_program=running)


def write_answers(maker: Any, path: Path, answers: list[RealMeasured]) -> Path:
    """Write a bag of inputs, one answer in each."""
    kind, none = "scara_msgs/msg/CoreInput", np.zeros(0, np.uint8)
    for number, answer in enumerate(answers):
        data = np.frombuffer(encode_events([answer]), np.uint8)
        maker.add(answer.now, INPUTS, kind, maker.header(answer.now), number, data, none)
    return maker.write(path)


@pytest.mark.parametrize("tells_speeds", [True, False])
def test_what_the_robot_answered_is_read_again(
    bag_maker: Any, tmp_path: Path, tells_speeds: bool
) -> None:
    """Positions by its own clock, velocities or their slope, and when a program ran."""
    steps = 0.01 * np.arange(20)
    answers = [answered(1.0 + step, 5.0 + step, tells_speeds) for step in steps.tolist()]
    bag = write_answers(bag_maker(), tmp_path / "run.bag", answers)
    real, running, source = read_real(bag, FOREIGN, None)
    assert source == INPUTS
    assert real.stamps == pytest.approx(steps, abs=1e-6)
    assert real.positions[:, 0] == pytest.approx(5.0 + steps)
    assert real.velocities[:, 0] == pytest.approx(1.0)
    assert running is not None and running.tolist() == [False] * 10 + [True] * 10


@pytest.mark.parametrize(
    ("went", "passed", "text"),
    [
        (15.0, 15.0, None),
        (-0.5, 0.01, None),
        (-5.09, 4.0, "the robot's clock went by -5.09 s in 4.00 s: it was started anew"),
        (-1.5, 0.01, "the robot's clock went by -1.50 s in 0.01 s"),
        (20.0, 1.0, "at 1.09 s the robot's clock went by 20.00 s in 1.00 s"),
    ],
)
def test_a_silence_can_be_played_and_a_robot_started_anew_cannot(
    bag_maker: Any, tmp_path: Path, went: float, passed: float, text: str | None
) -> None:
    """Its clock is held against what passed here, however long both were apart."""
    steps = (0.01 * np.arange(10)).tolist()
    answers = [answered(1.0 + step, 5.0 + step) for step in steps]
    answers += [answered(1.09 + passed + step, 5.09 + went + step) for step in steps]
    bag = write_answers(bag_maker(), tmp_path / "run.bag", answers)
    if text is not None:
        with pytest.raises(RecordError, match=text):
            read_real(bag, FOREIGN, None)
        return
    real, running, _ = read_real(bag, FOREIGN, None)
    assert running is not None and len(running) == len(real.stamps)
    assert np.diff(real.stamps).max() == pytest.approx(max(went, 0.01), abs=1e-6)
