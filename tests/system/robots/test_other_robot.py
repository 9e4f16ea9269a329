"""A robot that is neither a SCARA nor a Fanuc, by its profile alone: both experiments, pendant, doctor, a replay."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from harness.live_cell import LiveCell, read_json
from harness.processes import Process
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml
from scara_bringup.io.configuration import copy_with_ports
from scara_config.profile import CHOICE

pytestmark = pytest.mark.system

ROBOT = "articulated_six"
# A busy machine is no failure here: time-outs that stop the pair for good are made patient, the shipped ones have tests.
PATIENCE: list[tuple[str, list[str | int], Any]] = [
    ("emulator.yaml", ["heartbeat_timeout_ms"], 3000),
    ("twin_controller.yaml", ["real", "timeout_ms"], 800.0),
    ("twin_controller.yaml", ["real", "stale_ms"], 3000.0),
    ("twin_controller.yaml", ["twin", "stale_ms"], 3000.0),
    ("twin_controller.yaml", ["limit", "source_age_ms"], 1500.0),
    ("twin_controller.yaml", ["divergence", "path_mm"], 300.0),
    ("experiments.yaml", ["deadlines_s", "service"], 60.0),
]


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[LiveCell, Process]]:
    """Run its demo once, to its own end."""
    cell = LiveCell(tmp_path_factory.mktemp("other"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CHOICE, ROBOT)
        config = copy_with_ports(ROOT / "config", cell.folder / "patient", None, None)
    for file, path, value in PATIENCE:
        changed_yaml(config / file, config, path, value)
    try:
        bringup = cell.start("demo", "--robot", ROBOT, env={"SCARA_CONFIG_DIR": str(config)})
        bringup.wait(240.0)
        yield cell, bringup
    finally:
        cell.close()


def test_both_experiments_run_to_their_end_at_all_positions(demo: tuple[LiveCell, Process]) -> None:
    """Six joints, another map, numeric kinematics; real and twin stand at each set position together."""
    cell, bringup = demo
    assert "articulated_six" in (cell.output / "report.html").read_text(encoding="utf-8"), bringup.output
    experiments = read_json(cell.output / "report.json")["experiments"]
    assert [experiment["name"] for experiment in experiments] == ["real_leads", "twin_leads"]
    for experiment in experiments:
        assert experiment["held"] == ["P1", "P2", "P3", "P1", "P2", "P3", "P1"], experiment["reasons"]
        assert experiment["positioning_error_max_percent"] <= 0.2
        assert experiment["path_error_max_mm"] == pytest.approx(6.0 * experiment["path_error_max_percent"], rel=0.01)


def test_its_decisions_replay_without_a_difference(demo: tuple[LiveCell, Process]) -> None:
    """The controller's core is the same code, fed with six joints."""
    cell, _ = demo
    output = cell.tool("rosrun", "twin_experiments", "replay_decisions", str(cell.output / "run.bag"), timeout=120.0)
    assert "0 differences" in output, output
