"""Palletising with a whole cell: one stand, the robot leads; the twin leads and a part that it drops is seen on both sides."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell
from harness.yaml_files import changed_yaml, copy_configuration
from ruamel.yaml import YAML
from scara_config.palletise import load_palletise

pytestmark = pytest.mark.system

PARTS = 3
# On a machine that does other things too a process may wait for its turn longer than the shipped values allow; what the
# cell does when it is late is tested elsewhere.
PATIENCE: list[tuple[str, list[str | int], float]] = [
    ("emulator.yaml", ["heartbeat_timeout_ms"], 3000),
    ("emulator.yaml", ["gripper_timeout_ms"], 5000),
    ("twin_controller.yaml", ["real", "timeout_ms"], 800.0),
    ("twin_controller.yaml", ["real", "stale_ms"], 3000.0),
    ("twin_controller.yaml", ["twin", "stale_ms"], 3000.0),
    ("twin_controller.yaml", ["limit", "source_age_ms"], 1500.0),
    ("twin_controller.yaml", ["limit", "step_margin"], 10.0),
    ("twin_controller.yaml", ["divergence", "path_mm"], 200.0),
    ("twin_controller.yaml", ["divergence", "rest_mm"], 50.0),
    ("palletise.yaml", ["gripper", "answer_ms"], 3000.0),
    ("palletise.yaml", ["task", "placed_s"], 10.0),
    ("palletise.yaml", ["task", "dwell_s"], 0.4),
    ("palletise.yaml", ["task", "speed_percent"], 25.0),
    ("experiments.yaml", ["limits", "path_error_percent"], 100.0),
    ("experiments.yaml", ["limits", "excluded_percent"], 100.0),
]


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready, patient cell whose work is one stand with three parts."""
    live = LiveCell(tmp_path_factory.mktemp("cell"))
    config = copy_configuration(live.folder / "one_stand")
    for file, path, value in PATIENCE:
        changed_yaml(config / file, config, path, value)
    work, program = config / "palletise.yaml", config / "programs" / "palletise.yaml"
    stand = YAML(typ="safe").load(work)["table"]["stands_mm"]["stand_1"]
    changed_yaml(work, config, ["table", "stands_mm"], {"stand_1": stand})
    lines = YAML(typ="safe").load(program)["lines"]
    longer = [line | {"wait_s": 0.3} if line["do"] == "wait" else line for line in lines[: len(lines) * PARTS // 9]]
    changed_yaml(program, program.parent, ["lines"], longer)
    try:
        live.wait_ready(live.start(env={"SCARA_CONFIG_DIR": str(config)}))
        yield live
    finally:
        live.close()


def test_three_parts_are_placed_on_both_sides_and_the_recording_replays(cell: LiveCell) -> None:
    """Each part within the goal on both sides, no collision, no drop; the gripper's decisions are made again bit for bit."""
    run = cell.output / "palletise"
    words = ("run_experiment", "palletise_real_leads", "--output", str(run), "--robot-port", str(cell.modbus_port))
    cell.tool("rosrun", "twin_experiments", *words, timeout=180.0)
    report = json.loads((run / "report.json").read_text())
    goal = load_palletise(cell.output / "config").task.tolerance_mm
    assert [entry["name"] for entry in report["experiments"]] == ["palletise_real_leads"]
    for entry in report["experiments"]:
        for side in ("real", "twin"):
            parts = entry["parts"][side]
            assert parts["placed"] == parts["of"] == PARTS, (entry["name"], side, parts)
            assert max(parts["errors_mm"].values()) <= goal
            assert parts["collisions"] == parts["drops"] == []
    replayed = cell.tool("rosrun", "twin_experiments", "replay_decisions", str(run / "run.bag"), timeout=120.0)
    assert ": 0 differences" in replayed


def test_part_let_go_in_the_air_is_seen_on_both_sides(cell: LiveCell) -> None:
    """The twin leads; it grips a part, lifts it and lets go: both sides say that it was dropped."""
    for side in ("twin", "real"):
        assert cell.call(f"{side}/put_parts_back")["success"]
    work = load_palletise(cell.output / "config")
    name, _, _, (x, y) = work.picks()[0]  # the table is still where it brought the stand to the station
    for z, speed in ((0.04, 50), (work.pick_height, 4)):
        assert cell.call("move_to", f"{{x: {x}, y: {y}, z: {z}, speed_percent: {speed}}}")["success"]
    assert cell.call("gripper", "true") == {"success": True, "message": f"holds {name}"}
    assert cell.call("move_to", f"{{x: {x}, y: {y}, z: 0.04, speed_percent: 20}}")["success"]
    assert cell.call("gripper", "false")["success"]
    for side in ("twin", "real"):
        state = cell.tool("rostopic", "echo", "-n", "1", "--filter", "m.drops == 1", f"/{side}/gripper", timeout=30.0)
        assert "drops: 1" in state and "was dropped" in state
