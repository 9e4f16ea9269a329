"""Two whole cells with the demo's experiments under one desk, which shows, counts and stops them.

With FARM_PICTURES=FOLDER the desk's page is kept there as pictures.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from harness.processes import ROSRUN, Process, Stage, free_port, wait_until
from harness.wires.browser import LOAD_MS, chromium
from harness.workspace import workspace_environment
from harness.yaml_files import copy_configuration
from playwright.sync_api import Page
from scara_ros.page.page_words import mode_title

from scara_msgs.msg import TwinControllerState

pytestmark = [pytest.mark.system, pytest.mark.thorough]

NAMES = ("milk_1", "milk_2")
TOKEN = "token-of-two-cells"
SIZES = ((1280, 800), (390, 844))
READY_S, EXPERIMENTS_S, SHOWN_S = 120.0, 240.0, 60.0
# What has no part in this; each takes processor time from two cells on two processors.
LEFT_OUT = ("camera", "operator_panel", "pendant_page", "what_if", "robot_state_publisher")


@dataclass
class Farm:
    """Two cells that run, and a desk."""

    stage: Stage
    folder: Path
    bringups: dict[str, Process]
    page_port: int
    router_port: int

    def own(self, name: str) -> dict[str, str]:
        """Return the environment in which a command meets one of the cells."""
        for file in (self.folder / "runs" / ".running").glob("*.json"):
            told = json.loads(file.read_text())
            if told["namespace"] == f"/{name}":
                config = Path(told["folder"]) / "config"
                return {
                    "ROS_MASTER_URI": told["master_uri"],
                    "ROS_NAMESPACE": f"/{name}",
                    "SCARA_CONFIG_DIR": str(config),
                }
        raise AssertionError(f"{name} does not run")

    def experiments(self, name: str) -> Process:
        """Start the article's two experiments in a cell."""
        folder = self.folder / "runs" / f"{name}_{len(self.stage.processes)}"
        words = ("real_leads", "twin_leads", "--output", str(folder))
        return self.stage.start(
            *(ROSRUN, "twin_experiments", "run_experiment", *words),
            name=f"experiments_{name}",
            env=self.own(name),
        )

    def make_ready(self) -> None:
        """Align the pairs that an attempt before this one has stopped."""
        for name in NAMES:
            words = ("rosservice", "call", "twin_controller/command", "{command: ALIGN}")
            self.stage.start(*words, name=f"align_{name}", env=self.own(name)).wait(30.0)
        ready = f"{mode_title(TwinControllerState.IDLE)} for"
        wait_until(lambda: self.ask("cells").count(ready) == len(NAMES), SHOWN_S, "two ready pairs")

    def ask(self, *words: str) -> str:
        """Return what a word of ``./cell farm`` prints."""
        history = ("--folder", str(self.folder / "farm")) if words[0] in ("sql", "events") else ()
        process = self.stage.start(sys.executable, "-m", "farm", *words, *history)
        process.wait(30.0)
        return process.output


@pytest.fixture
def farm(tmp_path: Path) -> Iterator[Farm]:
    """Start both cells and the desk; all of it is ended."""
    router, page = free_port(), free_port()
    config = tmp_path / "config"
    config.mkdir()
    file = copy_configuration(config) / "farm" / "farm.yaml"
    file.write_text(file.read_text().replace("port: 7447", f"port: {router}"))
    env = {
        **workspace_environment(),
        "CELL_ROOT": str(tmp_path),
        "SCARA_CONFIG_DIR": str(config),
        "FARM_DESK_TOKEN": TOKEN,
    }
    stage = Stage(tmp_path / "processes", env)
    left_out = [word for node in LEFT_OUT for word in ("--without", node)]
    try:
        desk = stage.start(
            *(sys.executable, "-m", "farm", "--person", "ann", "--port", str(page)),
            *("--folder", str(tmp_path / "farm")),
            name="desk",
        )
        wait_until(lambda: "?token=" in desk.output, READY_S, "the desk's page")
        bringups: dict[str, Process] = {}
        for name in NAMES:
            bringup = stage.start(
                *(ROSRUN, "scara_bringup", "cell", "up", "--name", name, "--farm", "--anyway"),
                *("--no-browser", *left_out),
                name=name,
            )
            wait_until(
                lambda b=bringup: "cell: ready after" in b.output or b.poll() is not None,
                READY_S,
                f"{name}",
            )
            assert bringup.poll() is None, bringup.output
            bringups[name] = bringup
        yield Farm(stage, tmp_path, bringups, page, router)
    finally:
        stage.close(grace=20.0)


def test_two_cells_with_their_experiments_are_seen_counted_and_stopped(
    farm: Farm, tmp_path: Path
) -> None:
    """Both within the article's limits at the same time; the desk has each cycle of each."""
    with chromium(tmp_path) as browser:
        page = browser.new_page(viewport={"width": SIZES[0][0], "height": SIZES[0][1]})
        page.goto(f"http://127.0.0.1:{farm.page_port}/?token={TOKEN}", timeout=LOAD_MS)
        page.wait_for_selector(f"text=/{NAMES[1]}/", timeout=LOAD_MS)
        farm.make_ready()
        running = {name: farm.experiments(name) for name in NAMES}

        def lead() -> bool:
            """Whether both cells are seen moving."""
            ended = [process.output for process in running.values() if process.poll() is not None]
            assert not ended, f"ended before both were seen moving:\n{ended[0]}"
            titles = page.locator(".cell-title").all_inner_texts()
            return sum("leads" in title for title in titles) == len(NAMES)

        wait_until(lead, EXPERIMENTS_S, "both cells moving")
        take(page, "two_cells_moving")
        for name, process in running.items():
            assert process.wait(EXPERIMENTS_S) == 0, f"{name}:\n{process.output}"
            print(f"{name}: {process.tail()}")

        def cycles(name: str) -> int:
            rows = farm.ask(
                "sql", f"SELECT count(*) AS n FROM events WHERE kind = 'cycle' AND cell = '{name}'"
            )
            numbers = [line.strip() for line in rows.splitlines() if line.strip().isdigit()]
            return int(numbers[0]) if numbers else 0

        for name in NAMES:
            wait_until(lambda name=name: cycles(name) >= 2, SHOWN_S, f"cycles of {name}")
        page.locator("[data-command=STOP][data-cell=all]").click()
        for name in NAMES:
            page.wait_for_selector(f".answer[data-is=good] >> text=/STOP .*{name}/")
        stopped = f"{mode_title(TwinControllerState.STOPPED)} for"
        wait_until(
            lambda: farm.ask("cells").count(stopped) == len(NAMES), SHOWN_S, "two stopped cells"
        )
        counted = farm.ask("events", "--stops", "--by-cause")
        assert "STOP" in counted, counted
        take(page, "two_cells_stopped")
    for name, bringup in farm.bringups.items():
        bringup.signal(signal.SIGINT)
        assert bringup.wait(60.0) == 128 + signal.SIGINT, (name, bringup.output)


def take(page: Page, name: str) -> None:
    """Keep pictures of the page, if somebody wants them."""
    folder = os.environ.get("FARM_PICTURES")
    if not folder:
        return
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        page.screenshot(path=f"{folder}/{name}_{width}.png", full_page=True)
    page.set_viewport_size({"width": SIZES[0][0], "height": SIZES[0][1]})
