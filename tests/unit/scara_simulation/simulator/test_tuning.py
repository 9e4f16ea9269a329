"""Gains changed while the loops run.

What is taken, what is refused with which text, and the way back.
"""

from __future__ import annotations

import math
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import ReconfigureRequest
from harness.yaml_files import copy_configuration
from scara_bringup.config import Ports
from scara_bringup.processes.configuration_io import copy_with_ports, link_taught
from scara_control.pid import PidGains
from scara_simulation.config import LoopGains
from scara_simulation.tuning.gains import PARAMETERS, Tuning, TuningError, value_of
from scara_simulation.tuning.stability import Plant
from scara_simulation.tuning.tuning_ports_node import TuningPorts
from std_msgs.msg import String

GAINS = LoopGains(
    position=PidGains(p=3600.0, i=36_000.0, d=120.0, i_clamp=5.0),
    velocity=PidGains(p=60.0, i=45.0, i_clamp=5.0),
)
PLANT = Plant(np.array([[[1.0, 0.0], [0.0, 1.0]]]), np.zeros(2), 1e-3)


def _runner() -> Any:
    control = SimpleNamespace(set_gains=lambda *_: None)
    return SimpleNamespace(lock=threading.Lock(), simulation=SimpleNamespace(control=control))


@pytest.fixture
def tuning():
    """Give two equal joints of 1 kg m^2 without damping."""
    return Tuning(["joint_1", "joint_2"], [GAINS, GAINS], [100.0, 40.0], PLANT)


def test_every_gain_of_both_loops_is_a_parameter():
    """Ten of them, by the names of control_toolbox after the name of the loop."""
    assert len(PARAMETERS) == 10
    assert [
        value_of(GAINS, name) for name in ("position_p", "velocity_i_clamp", "position_antiwindup")
    ] == [3600.0, 5.0, True]


def test_change_is_made_only_when_it_is_accepted(tuning):
    """A proposal says before and after; accepting it changes that joint alone."""
    change = tuning.propose("joint_2", {"position_p": 4000, "velocity_antiwindup": False})
    assert (
        change.describe() == "joint_2: position_p 3600 -> 4000, velocity_antiwindup true -> false"
    )
    assert tuning.gains("joint_2") == GAINS
    tuning.accept(change)
    assert tuning.gains("joint_2").position.p == 4000.0
    assert not tuning.gains("joint_2").velocity.antiwindup
    assert tuning.gains("joint_1") == GAINS


def test_undo_takes_changes_back_one_by_one_the_last_first(tuning):
    """Whichever joint they belong to, until nothing is left."""
    for joint, value in (("joint_1", 4000.0), ("joint_2", 4100.0), ("joint_1", 4200.0)):
        tuning.accept(tuning.propose(joint, {"position_p": value}))
    undone = [tuning.undo().describe() for _ in range(3)]
    assert undone == [
        "joint_1: position_p 4200 -> 4000",
        "joint_2: position_p 4100 -> 3600",
        "joint_1: position_p 4000 -> 3600",
    ]
    assert (tuning.gains("joint_1"), tuning.gains("joint_2")) == (GAINS, GAINS)
    with pytest.raises(TuningError, match="nothing to undo"):
        tuning.undo()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"position_p": math.nan}, r"joint_1 position_p = nan is outside \[264, 3\.759e\+06\]"),
        ({"position_p": -1.0}, r"joint_1 position_p = -1 is outside \[264, 3\.759e\+06\]"),
        ({"velocity_p": math.inf}, r"joint_1 velocity_p = inf is outside \[0, 1999\]"),
        ({"velocity_i_clamp": -0.1}, r"joint_1 velocity_i_clamp = -0\.1 is outside \[0, 100\]"),
        ({"position_i_clamp": 100.1}, r"joint_1 position_i_clamp = 100\.1 is outside \[0, 100\]"),
        (
            {"position_p": 5e6},
            (
                r"joint_1 position_p = 5000000 is outside \[264, 3\.759e\+06\]: not stable at a "
                r"physics step of 1 ms"
            ),
        ),
        (
            {"position_p": 100.0},
            r"joint_1 position_p = 100 is outside \[264, .*: not stable at a physics step of 1 ms",
        ),
        ({"position_d": 0.0}, r"joint_1 position_d = 0 is outside \[9\.901, 1998\]: not stable"),
        (
            {"velocity_p": 60.0, "velocity_i": 1e9},
            r"joint_1 velocity_i = 1000000000 is outside \[0, .*: not stable",
        ),
        ({"position_p": True}, "joint_1 position_p = True: must be a number"),
        ({"position_p": "9"}, "joint_1 position_p = '9': must be a number"),
        ({"position_antiwindup": 1.0}, "joint_1 position_antiwindup = 1.0: must be true or false"),
        ({"kp": 1.0}, "joint_1: unknown parameter 'kp': it has position_p, "),
    ],
)
def test_wrong_gain_is_refused_with_joint_key_value_and_range(tuning, values, text):
    """Nothing of the request is taken, also what would be right."""
    with pytest.raises(TuningError, match=text):
        tuning.propose("joint_1", {"velocity_i": 50.0, **values})
    assert tuning.gains("joint_1") == GAINS


def test_gains_that_only_together_are_unstable_name_each_that_could_be_changed(tuning):
    """Each named one has a range in which the others may stay as they were asked for."""
    with pytest.raises(
        TuningError,
        match=(
            r"position_p = 3900000 is outside \[.*, position_d = 500 is outside \[.*\]: "
            r"not stable"
        ),
    ):
        tuning.propose("joint_1", {"position_p": 3.9e6, "position_d": 500.0})


def test_gain_without_any_stable_value_says_so(tuning):
    """Then neither can be had with the other."""
    with pytest.raises(
        TuningError,
        match=(
            r"position_p = 100000000, of which no value is stable with the other gains, "
            r"position_d"
        ),
    ):
        tuning.propose("joint_1", {"position_p": 1e8, "position_d": 1e8})


def test_change_tells_the_ranges_of_coupled_joints_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They depend on its gains, and stay published for late listeners; their own gains stay."""
    matrix = np.array([[[1.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 1.0]]])
    joints = ["joint_1", "joint_2", "joint_3"]
    tuning = Tuning(joints, [GAINS] * 3, [100.0] * 3, Plant(matrix, np.zeros(3), 1e-3))
    told: dict[str, list[Any]] = {}

    def advertise(topic: str, *_: Any, **__: Any) -> Any:
        return SimpleNamespace(publish=told.setdefault(topic.removeprefix("twin/pid/"), []).append)

    monkeypatch.setattr(rospy, "Publisher", advertise)
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    ports = TuningPorts(joints, _runner(), tuning, copy_configuration(tmp_path))
    config = Config(doubles=[DoubleParameter("position_d", 400.0)])
    ports._set("joint_1", ReconfigureRequest(config=config))
    assert {name: len(told[f"{name}/parameter_updates"]) for name in joints} == {
        "joint_1": 2,
        "joint_2": 1,
        "joint_3": 1,
    }
    assert len(told["joint_3/parameter_descriptions"]) == 1
    before, after = (
        {each.name: each.value for each in description.max.doubles}
        for description in told["joint_2/parameter_descriptions"]
    )
    assert after["position_d"] == tuning.ranges("joint_2")["position_d"][1] != before["position_d"]


def test_joints_of_which_each_is_judged_alone_are_not_coupled() -> None:
    """With many joints two bounds of its inertia stand for the others."""
    plant = Plant(np.array([[[1.0, 0.6], [0.6, 1.0]]]), np.zeros(2), 1e-3)
    alone = msgspec.structs.replace(plant, extremes=((0.64, 1.0),) * 2)
    for each, found in ((plant, ["joint_2"]), (alone, [])):
        tuning = Tuning(["joint_1", "joint_2"], [GAINS, GAINS], [100.0, 40.0], each)
        assert tuning.coupled("joint_1") == found


@pytest.mark.parametrize(
    "name", ["position_p", "position_i", "position_d", "velocity_p", "velocity_i", "velocity_d"]
)
def test_both_ends_of_the_told_range_are_taken(tuning, name):
    """What the text allows is allowed, and a little more is not."""
    low, high = tuning.ranges("joint_1")[name]
    for value in (low, high):
        tuning.propose("joint_1", {name: value})
    with pytest.raises(TuningError, match=f"joint_1 {name} = "):
        tuning.propose("joint_1", {name: 1.01 * high})


def test_clamp_that_two_bounds_replace_cannot_be_changed():
    """i_clamp would have no effect, silently."""
    loops = msgspec.structs.replace(
        GAINS, position=PidGains(p=3600.0, d=120.0, i_clamp_min=-1.0, i_clamp_max=2.0)
    )
    tuning = Tuning(["joint_1"], [loops], [100.0], Plant(np.array([[[1.0]]]), np.zeros(1), 1e-3))
    with pytest.raises(
        TuningError,
        match=r"joint_1 position_i_clamp = 3: has no effect, i_clamp_min and i_clamp_max are given",
    ):
        tuning.propose("joint_1", {"position_i_clamp": 3.0})


def test_unstable_gains_of_the_file_are_refused_at_the_start():
    """A simulator does not start with loops that would run away."""
    wild = msgspec.structs.replace(GAINS, position=PidGains(p=1e8, d=120.0))
    with pytest.raises(
        TuningError,
        match=r"joint_2 position_p = 100000000 is outside \[0, 3\.76e\+06\]: not stable",
    ):
        Tuning(["joint_1", "joint_2"], [GAINS, wild], [100.0, 40.0], PLANT)


def test_same_value_is_no_change(tuning):
    """Nothing to write, nothing to undo."""
    assert not list(tuning.propose("joint_1", {"position_p": 3600.0}).values())


def test_gains_in_a_runs_copy_are_said_to_last_until_the_cell_ends(
    tuning: Tuning, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next start of a cell with a name or a port copies the file that is not changed."""
    said: list[Any] = []
    publisher = SimpleNamespace(publish=said.append)
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: publisher)
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    runner = _runner()

    def answer_to(p: float, folder: Path) -> str:
        ports = TuningPorts(["joint_1", "joint_2"], runner, tuning, folder)
        config = Config(doubles=[DoubleParameter("position_p", p)])
        ports._set("joint_1", ReconfigureRequest(config=config))
        return [each.data for each in said if isinstance(each, String)][-1]

    own = copy_configuration(tmp_path / "own")
    assert answer_to(4000.0, own) == "set and saved: joint_1: position_p 3600 -> 4000"
    # As for a demo with a port of its own, then as for a cell of people, who teach.
    copied = copy_with_ports(own, tmp_path / "config", Ports(gateway=19091))
    ends = "set and saved until this cell ends: joint_1: position_p"
    assert answer_to(4100.0, copied) == f"{ends} 4000 -> 4100"
    link_taught(own, copied)
    assert answer_to(4200.0, copied) == f"{ends} 4100 -> 4200"
