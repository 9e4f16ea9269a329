"""What a page shows of a robot of the field agrees with itself, and with the report of the run.

Each time on the cell of test_operator_page.py, in a run without a report.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import rosbag
from harness.live_cell import LiveCell, read_json
from harness.page.acts import TOKEN, cell_with_pages
from harness.page.samples import judge_samples, listen, today
from harness.processes import wait_until
from harness.wires.browser import chromium
from harness.yaml_files import copy_configuration
from playwright.sync_api import Page

pytestmark = [pytest.mark.system, pytest.mark.thorough]

COUNT = 1000  # samples
LARGEST_MM = 0.2  # between the largest distance on the page and in the report


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[tuple[LiveCell, int]]:
    """Give a cell with a robot of the field, its programs at full speed, and its page's port."""
    config = copy_configuration(tmp_path / "changed")
    program = config / "programs" / "ARTICLE.LS"
    slow = program.read_text(encoding="utf-8")
    program.write_text(slow.replace("] 50%", "] 100%"), encoding="utf-8")
    without = ("--without", "camera", "--without", "what_if")
    env = {"SCARA_CONFIG_DIR": str(config), "SCARA_PLANT": "field"}
    with cell_with_pages(tmp_path, *without, env=env) as (made, _, port):
        yield made, port


def test_all_that_the_page_shows_agrees(cell: tuple[LiveCell, int], tmp_path: Path) -> None:
    """Joints, tools, picture and chart in each sample; its largest distance with the report's.

    Virtual time holds the latter to the digit in each run: tests/virtual_time/plants/test_peak.py.
    """
    made, port = cell
    output = tmp_path / f"measured_{len(list(tmp_path.glob('measured_*')))}"  # again: another one
    with chromium(tmp_path) as browser:
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")
        page.wait_for_function("() => window.panel?.live.open")
        listen(page)
        words = ("real_leads", "--repeat", f"{1 + COUNT // 250}", "--output", str(output))
        command = ("rosrun", "twin_experiments", "run_experiment", *words)
        run = made.stage.start(*command, env=made.environment)
        wait_until(lambda: run.poll() is not None or worked(page), 300.0, "the runs")
        assert (output / "report.json").is_file(), run.tail()
        shown, worst = judge_samples(page, at_least=COUNT), today(page)
    report(made, output)
    reported = max(
        experiment["path_error_max_mm"]
        for found in tmp_path.glob("measured_*/readings/report.json")  # the page remembers them all
        for experiment in read_json(found)["experiments"]
    )
    print(f"largest: page {shown}, today {worst}, report {reported:.3f} mm")
    assert worst == pytest.approx(reported, abs=LARGEST_MM)
    assert shown <= worst  # what is shown ten times a second may miss a peak, never exceed it


def report(cell: LiveCell, output: Path) -> None:
    """Make the report as at a real robot: of its readings, for nobody there knows the truth."""
    readings = output / "readings"
    readings.mkdir()
    with (
        rosbag.Bag(str(output / "run.bag")) as bag,
        rosbag.Bag(str(readings / "run.bag"), "w") as copy,
    ):
        for topic, message, time, header in bag.read_messages(return_connection_header=True):
            if topic != "/real/ground_truth":
                copy.write(topic, message, time, connection_header=header)
    cell.tool("rosrun", "twin_experiments", "report", str(readings / "run.bag"))


def worked(page: Page) -> bool:
    """Let the page work for a moment; that alone is no end."""
    page.wait_for_timeout(100)
    return False
