"""Speed and separation monitoring in the whole cell, with the sensor's stand-in that is part of the product."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell
from harness.processes import wait_until
from harness.yaml_files import changed_yaml, copy_configuration

pytestmark = pytest.mark.system
FAR, NEAR = ("4", "0", "0"), ("0.3", "-0.3", "0.2")
LONG = "{x: 0.0, y: -0.35, z: 0.0, elbow: righty, speed_percent: 1}"
"""Joint 1 turns by 141 deg, which takes 32 s: time for tools that are started on a busy machine."""
SEPARATION: list[tuple[str, float | bool]] = [("enabled", True), ("stale_ms", 30_000)]
"""The sensor's stand-in is started anew for each place of the person; that it is silent meanwhile is another test's affair."""


@pytest.fixture(scope="module")
def monitored(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell that monitors separation."""
    cell = LiveCell(tmp_path_factory.mktemp("monitored"))
    config = cell.folder / "changed"
    config.mkdir()
    copy_configuration(config)
    for key, value in SEPARATION:
        changed_yaml(config / "twin_controller.yaml", config, ["separation", key], value)
    try:
        bringup = cell.start(env={"SCARA_CONFIG_DIR": str(config)})
        person(cell, *FAR)  # without a sighting the pair may not even align
        cell.wait_ready(bringup)
        yield cell
    finally:
        cell.close()


def person(cell: LiveCell, *place: str) -> None:
    """Let the one person be somewhere else from now on."""
    for process in cell.stage.processes:
        if "walking_person" in str(process):
            process.stop()
    cell.stage.start("rosrun", "twin_experiments", "walking_person", "--from", *place, "--speed", "0")


def test_a_person_who_comes_near_stops_the_pair_and_it_goes_on_when_asked(monitored: LiveCell) -> None:
    """Near: both pause, RESUME is refused. Gone: RESUME ends the move as commanded."""
    move = monitored.stage.start("rosservice", "call", "/move_to", LONG)
    wait_until(lambda: monitored.mode() == "TWIN_LEADS", 20.0, "TWIN_LEADS", period=0.1)
    person(monitored, *NEAR)
    wait_until(lambda: monitored.mode() == "PAUSED", 20.0, "PAUSED", period=0.1)
    answer = monitored.call("/twin_controller/command", "{command: RESUME}")
    assert answer["success"] is False and "mm away" in answer["message"], answer
    person(monitored, *FAR)
    wait_until(lambda: monitored.call("/twin_controller/command", "{command: RESUME}")["success"], 20.0, "a way on")
    assert move.wait(90.0) == 0 and "success: True" in move.output, move.output
    wait_until(lambda: monitored.mode() == "IDLE", 20.0, "IDLE", period=0.2)
