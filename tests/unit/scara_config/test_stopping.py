"""How a robot is stopped is part of its profile; what was not tried there leads nobody."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, shipped
from scara_config import ConfigError, load_robot
from scara_config.stopping import ALLOCATED, Stopping

HERE, ELSEWHERE = "127.0.0.1", "192.0.2.1"
ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")


def stops(**changes: Any) -> dict[str, Any]:
    """Return what a profile may say of stopping, with changes."""
    return {"uop": "full", "tried": {}, "braking_delay_ms": 50.0, **changes}


@pytest.mark.parametrize("name", ROBOTS)
def test_a_shipped_profile_leads_its_stand_in_and_no_other_robot(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody has connected a real one."""
    monkeypatch.setenv("SCARA_ROBOT", name)
    robot = load_robot(ROOT / "config")
    assert robot.only_followed(HERE) == ""
    said = robot.only_followed(ELSEWHERE)
    assert said.startswith(f"robot.yaml: stopping.tried names nothing that stopped {ELSEWHERE}: ")
    assert f"rosrun robot_doctor doctor --robot {name} --stops" in said


@pytest.mark.parametrize("means", ["hold", "cstopi", "imstp"])
def test_one_means_that_was_tried_is_enough(means: Any) -> None:
    """Whatever it is, it was seen to stop this robot."""
    stopping = Stopping(**stops(tried={means: ELSEWHERE}))
    assert stopping.only_followed(ELSEWHERE, "mine") == ""
    assert stopping.cuts_drives(ELSEWHERE) == (means == "imstp")
    assert not stopping.cuts_drives(HERE)  # another address is another robot


@pytest.mark.parametrize(
    ("uop", "said"),
    [("simple", "no RSR starts its stream program"), ("none", "no signal reaches the robot")],
)
def test_a_robot_without_all_signals_is_only_followed(uop: Any, said: str) -> None:
    """The text names the key and the robot's own screen."""
    tried = dict.fromkeys(ALLOCATED[uop], HERE)
    why = Stopping(**stops(uop=uop, tried=tried)).only_followed(HERE, "mine")
    assert why.startswith(f"robot.yaml: stopping.uop is {uop}: {said}") and "I/O > UOP" in why


@pytest.mark.parametrize(
    ("stopping", "said"),
    [
        (stops(uop="simple", tried={"imstp": HERE}), "tried.imstp: uop is simple"),
        (stops(uop="none", tried={"hold": HERE}), "it allocates nothing"),
        (stops(uop="half"), "stopping.uop"),
        (stops(tried={"brake": HERE}), "stopping.tried"),
        (stops(tried={"hold": ""}), "stopping.tried"),
        (stops(braking_delay_ms=0), "stopping.braking_delay_ms = 0"),
        (stops(braking_delay_ms=501), "stopping.braking_delay_ms = 501"),
    ],
)
def test_a_profile_that_contradicts_itself_is_refused(
    stopping: dict[str, Any], said: str, tmp_path: Path
) -> None:
    """File, key and what is allowed are named."""
    folder = changed_yaml(shipped("robot.yaml"), tmp_path, ("stopping",), stopping)
    with pytest.raises(ConfigError, match=r"robot\.yaml") as error:
        load_robot(folder)
    assert said in str(error.value)
