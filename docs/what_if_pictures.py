"""Take the pictures of docs/what_if.md again: its two programs, judged and previewed.

    source env.sh; .venv/bin/python docs/what_if_pictures.py [FOLDER]

FOLDER is docs/images/what_if unless it is named. The programs are those that the page itself shows.
The judge draws its own pictures; those of the operator's page are taken beside a real judge and a
real simulator, with a stand-in of the twin controller: nothing moves. Takes a minute.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from harness.workspace import enter_workspace, workspace_environment  # noqa: E402

enter_workspace()

import rospy  # noqa: E402
from harness.page.acts import GHOST, preview_of  # noqa: E402
from harness.page.stand_in import StandIn  # noqa: E402
from harness.ros import Master, Ros  # noqa: E402
from harness.second_world.followed_page import programs  # noqa: E402
from harness.wires.browser import chromium  # noqa: E402
from harness.wires.operator_page import TOKEN, Panel  # noqa: E402
from harness.yaml_files import add_program, copy_configuration  # noqa: E402
from playwright.sync_api import Page, expect  # noqa: E402
from what_if.cell_files_io import find_program, resting_cell  # noqa: E402
from what_if.judging import judge  # noqa: E402
from what_if.showing.moment import worst_moment  # noqa: E402
from what_if.showing.moment_picture_io import picture_of  # noqa: E402
from what_if.text import caption_of  # noqa: E402

SIZE, PATIENCE_MS = {"width": 900, "height": 1200}, 120_000
LOADED_MS = 4000
"""The model comes in many small pieces."""
DRAWN = f"() => ({GHOST})() !== null"


def draw_moments(config: Path, out: Path) -> dict[str, float]:
    """Write the judge's picture of each program; return when its worst moment is [s]."""
    times = {}
    with resting_cell(config) as (world, _):
        for file in programs():
            name = file.removesuffix(".LS").lower()
            motion = find_program(world.cell, name, config)
            verdict = judge(world, motion)
            moment = worst_moment(world, motion, verdict)
            assert moment is not None, verdict.sentence
            (out / f"{name}.png").write_bytes(picture_of(moment, caption_of(verdict), config))
            times[name] = moment.time
    return times


def take_previews(page: Page, times: dict[str, float], out: Path) -> None:
    """Take the operator's page while it previews each program, at its worst moment."""
    page.get_by_role("tab", name="Model", exact=True).click()
    page.get_by_role("tab", name="Programs", exact=True).click()
    page.wait_for_timeout(LOADED_MS)
    for name, time in times.items():
        page.get_by_role("button", name=f"Preview {name.upper()}", exact=True).click()
        preview_of(page, f"Program {name.upper()}: ")
        page.locator("[data-motion-range]").fill(f"{time:.4f}")
        expect(page.locator("[data-motion-at]")).to_contain_text(f"{time:.2f} of")
        page.wait_for_function(DRAWN)
        page.wait_for_timeout(LOADED_MS)
        page.evaluate("window.scrollTo(0, 0)")
        page.screenshot(path=out / f"{name}_preview.png")  # the verdict stands below the picture
        page.locator("[data-motion-close]").click()


def main() -> None:
    """Take all pictures."""
    out = Path(sys.argv[1]) if sys.argv[1:] else ROOT / "docs" / "images" / "what_if"
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        config = copy_configuration(folder / "config")
        for text in programs().values():
            add_program(config, text)
        times = draw_moments(config, out)
        master = Master(folder / "master", workspace_environment())
        names = ("ROS_MASTER_URI", "ROS_HOME", "ROS_LOG_DIR")
        os.environ.update({name: master.env[name] for name in names})
        rospy.init_node("pictures", disable_signals=True)
        ros = Ros(master, folder / "nodes", "pictures")
        stand_in = StandIn(ros)
        stand_in.state.real_position = stand_in.state.twin_position = [0.0, 0.0, -160.0, 0.0]
        try:
            ros.run("scara_simulation", "simulator", f"_config_dir:={config}")
            ros.run("what_if", "what_if", f"_config_dir:={config}")
            ros.wait_for_service("what_if/judge", 60.0)
            panel = Panel(ros, f"_config_dir:={config}")
            with chromium(folder, draws=True) as browser:
                page = browser.new_page(viewport=SIZE, color_scheme="light")  # type: ignore[arg-type]
                page.set_default_timeout(PATIENCE_MS)
                page.goto(f"http://127.0.0.1:{panel.port}/?token={TOKEN}")
                take_previews(page, times, out)
        finally:
            stand_in.close()
            ros.close()
            rospy.signal_shutdown("taken")
            master.close()
    print(f"pictures: {out}")


if __name__ == "__main__":
    main()
