"""The demo: one command to a measured run, within the limits that the project promises."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.live_cell import LiveCell, read_json
from harness.processes import Process
from harness.running.repeats import played
from harness.running.thorough import thorough
from harness.yaml_files import copy_configuration

pytestmark = pytest.mark.system

ONE_ROUND = "one round"
FIELDS = {
    "name",
    "leader",
    "samples",
    "duration_s",
    "lag_s",
    "path_error_max_mm",
    "path_error_max_percent",
    "path_error_rms_percent",
    "positioning_error_max_mm",
    "positioning_error_max_percent",
    "verdict",
}


def one_round(folder: Path) -> dict[str, str]:
    """Return the environment of a configuration whose experiments make one round instead of two.

    Its robot brakes late: it begins slowly beside the zone below its home.
    """
    config = copy_configuration(folder)
    for file, shipped, other in (
        ("programs/ARTICLE.LS", "=1 TO 2", "=1 TO 1"),
        ("experiments.yaml", "P1, P2, P3, P1]", "P1]"),
        ("robot.yaml", "braking_delay_ms: 50 ", "braking_delay_ms: 100 "),
    ):
        text = (config / file).read_text(encoding="utf-8")
        assert shipped in text
        (config / file).write_text(text.replace(shipped, other), encoding="utf-8")
    return {"SCARA_CONFIG_DIR": str(config)}


@pytest.fixture(scope="module", params=[ONE_ROUND, *thorough("as shipped")])
def demo(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[LiveCell, Process]]:
    """Run the demo to its own end, as `./cell demo` does.

    Into runs/ of the workspace (here: of a folder of its own).

    A machine that stands still for 40 ms costs many millimetres at full speed; then, and only then,
    it is run again.
    """
    cells: list[LiveCell] = []

    def run() -> Process:
        for ended in cells:
            ended.close()
        cell = LiveCell(tmp_path_factory.mktemp("demo"))
        cells.append(cell)
        changed = one_round(cell.folder / "config") if request.param == ONE_ROUND else {}
        env = {"CELL_ROOT": str(cell.folder), **changed}
        bringup = cell.start("demo", env=env, choose_output=False)
        assert bringup.wait(300.0) == 0, bringup.output
        return bringup

    try:
        bringup = played(run)
        cell = cells[-1]
        (cell.output,) = (
            folder
            for folder in (cell.folder / "runs").iterdir()
            if folder.is_dir() and not folder.is_symlink() and folder.name != "journal"
        )
        yield cell, bringup
    finally:
        for cell in cells:
            cell.close()


def test_demo_ends_by_itself_without_error_and_leaves_no_process(
    demo: tuple[LiveCell, Process],
) -> None:
    """The exit code is the experiments'."""
    cell, bringup = demo
    assert bringup.poll() == 0, bringup.output
    sentence, address = bringup.output.splitlines()[-2:]
    assert sentence.startswith("Good: all 2 experiments passed. While moving, ")
    assert address == f"report: {(cell.output / 'report.html').as_uri()}"
    assert cell.stage.left_over() == []


def test_report_holds_both_experiments_with_every_field(demo: tuple[LiveCell, Process]) -> None:
    """The fields of report.json are the design's, exactly; runs/latest leads to it."""
    cell, _ = demo
    report = read_json(cell.output.parent / "latest" / "report.json")
    assert [(e["name"], e["leader"]) for e in report["experiments"]] == [
        ("real_leads", "real"),
        ("twin_leads", "twin"),
    ]
    assert all(set(experiment) >= FIELDS for experiment in report["experiments"])
    assert report["paper"] == {"path_error_percent": 5.0, "positioning_error_percent": 2.0}


@pytest.mark.parametrize("number", [0, 1], ids=["real_leads", "twin_leads"])
def test_errors_are_within_the_promise(demo: tuple[LiveCell, Process], number: int) -> None:
    """Path error at most 2 % of reach, positioning error at most 0.2 %, by ground truth."""
    cell, _ = demo
    experiment = read_json(cell.output / "report.json")["experiments"][number]
    assert 0.0 < experiment["path_error_max_percent"] <= 2.0, experiment
    assert 0.0 <= experiment["positioning_error_max_percent"] <= 0.2, experiment
    assert experiment["samples"] > 500 and experiment["duration_s"] > 2.5


def test_percent_is_of_the_reach(demo: tuple[LiveCell, Process]) -> None:
    """650 mm are 100 %."""
    cell, _ = demo
    for experiment in read_json(cell.output / "report.json")["experiments"]:
        assert experiment["path_error_max_percent"] == pytest.approx(
            experiment["path_error_max_mm"] / 6.5, rel=0.01
        )


def test_rosbag_info_reads_the_bag(demo: tuple[LiveCell, Process]) -> None:
    """A standard tool finds both sides in it."""
    cell, _ = demo
    (bag,) = cell.output.glob("*.bag")
    text = cell.tool("rosbag", "info", str(bag))
    for topic in (
        "/twin/joint_states",
        "/real/joint_states",
        "/real/ground_truth",
        "/twin_controller/state",
    ):
        assert topic in text


def test_page_of_the_report_is_there(demo: tuple[LiveCell, Process]) -> None:
    """report.html with its figures, complete in the folder."""
    cell, _ = demo
    page = (cell.output / "report.html").read_text(encoding="utf-8")
    assert "real_leads" in page and "twin_leads" in page
