"""Take the pictures of the documents again.

Operator page, pendant page, camera, RViz with both robots and with a recording.

    source env.sh; .venv/bin/python docs/pictures.py [FOLDER] [--pages | --film | --teach]

FOLDER is docs/images unless it is named.

--pages takes the pages and the camera only, which needs no RViz and two minutes less. --film takes
the moving picture of the README only: the real robot leads, then the twin. --teach takes that of
tab Teach only.

A cell of its own on free ports. Browser and RViz draw in software here, which keeps two processors
busy, so the cell is patient. RViz pictures need rviz, Xvfb and import (ImageMagick), and are left
out without them.

A picture of a cell that is not healthy is refused (picture_health.py): take them again on a machine
that does less.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import moving_picture  # noqa: E402
import picture_health  # noqa: E402
from harness.live_cell import ROSRUN  # noqa: E402
from harness.page.acts import patient_configuration  # noqa: E402
from harness.page.taught_pallet import PANEL, Actions, teach_pallet  # noqa: E402
from harness.processes import Stage, free_port, wait_until  # noqa: E402
from harness.wires.browser import CHROMIUM  # noqa: E402
from harness.workspace import workspace_environment  # noqa: E402
from PIL import Image  # noqa: E402
from playwright.sync_api import Browser, Page, expect, sync_playwright  # noqa: E402

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
LOW, WIDE, TABLET, PHONE = (1280, 720), (1920, 1080), (768, 1024), (390, 844)
RVIZ_SIZE = "1280x800"
PATIENCE_MS = 120_000
OVER_THE_PICTURE = ".lead-card, .deviation-card, .scene-head, .views"
PENDANT = ("rosrun", "fanuc_emulator", "pendant")
FILM_TARGET = (0.30, -0.40, 0.10)
FILM_LEADS_S, FILM_STEP_MS = 8.0, 200.0
ABORT_S = 20.0
FILM_PERCENT = 25  # slow enough for a browser that draws without a graphics card
FILMS = 5
TEACH_BYTES = 1_500_000
TEACH_STEP_MS, TEACH_PLAY_S = 400.0, 9.0  # each action is seen; then the first part goes its way
MOTION_S = 9.0  # so long after its start a played recording is in the middle of the motion


class Cell:
    """A living cell with page, camera and the real robot's model."""

    def __init__(self, folder: Path) -> None:
        """Start it and wait until it is ready."""
        config = patient_configuration(folder / "patient")
        self.folder, self.panel, self.pendant_page = folder, free_port(), free_port()
        master = f"http://127.0.0.1:{free_port()}"
        self.stage = Stage(
            folder / "log",
            {**workspace_environment(), "ROS_MASTER_URI": master, "SCARA_CONFIG_DIR": str(config)},
        )
        words = [f"--{name}-port={free_port()}" for name in ("modbus", "gateway")]
        words += [
            "--no-browser",
            f"--pendant-port={self.pendant_page}",
            f"--master-port={master.rsplit(':', 1)[1]}",
            f"--panel-port={self.panel}",
            f"--output={folder / 'output'}",
            f"--runs={folder}",
        ]
        self._up = self.stage.start(ROSRUN, "scara_bringup", "cell", "up", *words)
        wait_until(
            lambda: "cell: ready after" in self._up.output or self._up.poll() is not None,
            120.0,
            "a ready cell",
        )
        assert self._up.poll() is None, self._up.tail()
        self.env = {"SCARA_CONFIG_DIR": str(self.folder / "output" / "config")}
        self.address = self._address(self.panel)
        self.pendant_address = self._address(self.pendant_page)

    def _address(self, port: int) -> str:
        """Return the address of a page, with its token, as the bring-up says it."""
        pattern = rf"http://127\.0\.0\.1:{port}/\?token=[\w-]+"
        (found,) = re.findall(pattern, self._up.output)
        return str(found)

    def tool(self, *words: str) -> None:
        """Run a command to its end."""
        process = self.stage.start(*words, env=self.env)
        assert process.wait(60.0) == 0, process.tail()

    def run_program(self, override: int, name: str = "ARTICLE") -> None:
        """Start a program on the robot's pendant; one that still runs is ended."""
        self.tool("rosrun", "fanuc_emulator", "pendant", "abort")
        self.tool("rosrun", "fanuc_emulator", "pendant", "override", str(override))
        self.tool("rosrun", "fanuc_emulator", "pendant", "run", name)

    def close(self) -> None:
        """End everything."""
        self.stage.close(grace=20.0)


def step_back() -> None:
    """Let what is started from now on, the browser above all, have the time that the cell leaves.

    Where each session has a share of its own (autogroup), nice counts within a session only.
    """
    os.nice(10)
    with suppress(OSError):
        Path("/proc/self/autogroup").write_text("10")


@contextmanager
def opened(browser: Browser, address: str, size: tuple[int, int], colours: str) -> Iterator[Page]:
    """Open a page."""
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=colours
    )  # type: ignore[arg-type]
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    yield page
    context.close()


def choose(page: Page, show: str, tab: str) -> None:
    """Choose what the picture shows, and a tab."""
    page.get_by_role("tab", name=show, exact=True).click()
    page.get_by_role("tab", name=tab, exact=True).click()
    if show != "Model":
        expect(page.locator("[data-camera-text]")).to_have_text("Camera", timeout=60_000)


def follows(page: Page) -> None:
    """Wait until the twin follows in the middle of a program."""
    expect(page.locator('[data-live="mode"]')).to_have_text("Real robot leads", timeout=60_000)
    expect(page.locator('[data-live="motion"]')).to_have_text("both move", timeout=60_000)
    moved = page.locator('[data-live="robot.program"]').first
    expect(moved).to_have_text(re.compile("line [4-8] running"), timeout=60_000)


def take_still(page: Page) -> None:
    """Take what a browser without WebGL shows in place of the model."""
    page.wait_for_timeout(3000)  # the model comes in many small pieces
    page.add_style_tag(content=f"{OVER_THE_PICTURE} {{ visibility: hidden; }}")
    still = ROOT / "src" / "operator_panel" / "web" / "still.jpg"
    page.locator(".scene-body").screenshot(path=still, type="jpeg", quality=80)
    page.reload()


def take_pages(cell: Cell, browser: Browser, out: Path) -> None:
    """Take the operator's page in four forms, and the pendant page."""
    mode = '[data-live="mode"]'
    with opened(browser, cell.address, LOW, "light") as page:
        choose(page, "Model", "Programs")
        take_still(page)
        choose(page, "Both", "Programs")
        cell.run_program(25)
        follows(page)
        picture_health.take(page, out / "operator_light.png")
        expect(page.locator(mode)).not_to_have_text("Real robot leads", timeout=120_000)
    with opened(browser, cell.address, WIDE, "dark") as page:
        choose(page, "Model", "Target")
        page.get_by_role("button", name="P3", exact=True).click()
        expect(page.locator(".preview.good")).to_be_visible(timeout=60_000)
        page.get_by_role("button", name="Move", exact=True).click()
        done = page.locator("[data-command='0'][data-outcome=done]", has_text="Move")
        expect(done).to_be_visible(timeout=60_000)
        picture_health.take(page, out / "operator_dark.png")
    with opened(browser, cell.address, TABLET, "light") as page:
        choose(page, "Camera", "Jog")
        cell.run_program(25)
        follows(page)
        picture_health.take(page, out / "operator_tablet.png")
        expect(page.locator(mode)).not_to_have_text("Real robot leads", timeout=120_000)
    with opened(browser, cell.address, PHONE, "dark") as page:
        choose(page, "Model", "Jog")
        cell.run_program(25)
        follows(page)
        page.evaluate("window.scrollTo(0, 48)")
        picture_health.take(page, out / "operator_phone.png")
        expect(page.locator(mode)).not_to_have_text("Real robot leads", timeout=120_000)
    cell.run_program(20)
    with opened(browser, cell.pendant_address, WIDE, "light") as page:
        page.wait_for_timeout(3000)
        page.screenshot(path=out / "pendant_page.png")


def take_course(cell: Cell, browser: Browser, out: Path) -> None:
    """Take an exercise on the operator's page, a wrong answer marked."""
    words = ("rosrun", "scara_course", "course")
    own = ("--learner", "ada", "--runs", str(cell.folder))
    cell.tool(*words, "start", "1", *own)
    answers = next(cell.folder.glob("course/ada/e01*/answers.yaml"))
    answers.write_text(re.sub(r"(?m)(_mm:)\s*$", r"\1 400", answers.read_text("utf-8")), "utf-8")
    assert cell.stage.start(*words, "check", *own, env=cell.env).wait(60.0) == 1, "a wrong answer"
    with opened(browser, cell.address, LOW, "light") as page:
        choose(page, "Model", "Programs")
        page.locator(".course-card .fold-line").click()
        expect(page.locator(".course-card")).to_contain_text("Not yet")
        picture_health.take(page, out / "course.png")


def film_until(film: moving_picture.Film, page: Page, is_so: Callable[[], bool]) -> None:
    """Film until something is so.

    Raises:
        UnhealthyError: The page did not show a healthy cell meanwhile.
    """
    while not is_so():
        film.wait(FILM_STEP_MS)
        picture_health.check(page.evaluate(picture_health.SAID))


def film_command(film: moving_picture.Film, page: Page, cell: Cell, *words: str) -> None:
    """Film while a command runs to its end."""
    process = cell.stage.start(*words, env=cell.env)
    film_until(film, page, lambda: process.poll() is not None)
    assert process.poll() == 0 and "success: False" not in process.output, process.tail()


def play(film: moving_picture.Film, page: Page, cell: Cell) -> None:
    """Let the real robot lead, and then the twin, as in the demo."""
    mode = page.locator('[data-live="mode"]')
    film_command(film, page, cell, *PENDANT, "override", str(FILM_PERCENT))
    film_command(film, page, cell, *PENDANT, "run", "ARTICLE")
    until = time.monotonic() + FILM_LEADS_S
    film_until(film, page, lambda: time.monotonic() > until)
    film_command(film, page, cell, *PENDANT, "abort")
    film_until(film, page, lambda: mode.inner_text() == "Ready")
    x, y, z = FILM_TARGET
    target = f"{{x: {x}, y: {y}, z: {z}, speed_percent: {FILM_PERCENT}}}"
    film_command(film, page, cell, "rosservice", "call", "move_to", target)


def take_film(cell: Cell, browser: Browser, out: Path) -> None:
    """Film the page while the real robot leads, and then the twin, as in the demo.

    The first time is not kept: until the twin controller knows how late the robot follows, it lets
    the twin lead slowly. A film with an alarm in it is not kept either.
    """
    with opened(browser, cell.address, LOW, "light") as page:
        choose(page, "Model", "Programs")
        for attempt in range(FILMS):
            try:
                with moving_picture.Film(page) as film:
                    play(film, page, cell)
            except picture_health.UnhealthyError as error:
                print(f"film {attempt}: {error}")
                # It may have ended while the program ran; without one there is nothing to abort.
                cell.stage.start(*PENDANT, "abort", env=cell.env).wait(ABORT_S)
                until_healthy(page)
                continue
            if attempt > 0:
                moving_picture.write_gif(film.frames, out / "cell.gif")
                return
    raise picture_health.UnhealthyError(f"no film of {FILMS} shows a healthy cell all along")


def take_teaching(cell: Cell, browser: Browser, out: Path) -> None:
    """Film how a pallet is taught and judged; the film ends with the first part on its way."""
    with opened(browser, cell.address, LOW, "light") as page:
        choose(page, "Model", "Jog")
        until_healthy(page)
        page.wait_for_timeout(5000)  # the model comes in many small pieces
        with moving_picture.Film(page) as film:
            teach_pallet(Actions(page, lambda: film.wait(TEACH_STEP_MS)), page)
            page.locator(PANEL).get_by_role("button", name="Judge all of the draft").click()
            expect(page.locator(".teach-said")).to_contain_text("OK: takes", timeout=60_000)
            page.locator('[data-teach-line="1"]').scroll_into_view_if_needed()
            film.wait(TEACH_STEP_MS)
            page.locator(PANEL).get_by_role("button", name="Preview of the draft").click()
            expect(page.locator("[data-motion-play]")).to_be_visible(timeout=60_000)
            page.locator("[data-motion-play]").click()
            until = time.monotonic() + TEACH_PLAY_S
            film_until(film, page, lambda: time.monotonic() > until)
        moving_picture.write_gif(film.frames, out / "teach.gif", TEACH_BYTES)


def until_healthy(page: Page) -> None:
    """Wait until the page shows a healthy cell at rest."""
    expect(page.locator('[data-live="mode"]')).to_have_text("Ready", timeout=60_000)
    expect(page.locator("[data-alarms]")).to_have_text("No alarm", timeout=60_000)


def take_camera(cell: Cell, out: Path) -> None:
    """Save what the camera sees."""
    with urllib.request.urlopen(
        f"http://127.0.0.1:{cell.panel}/camera.jpg", timeout=20.0
    ) as answer:
        Image.open(answer).save(out / "camera.png")


@contextmanager
def rviz(stage: Stage) -> Iterator[str]:
    """Open RViz with the cell's view on a screen of its own; give the screen's name."""
    screen = ":87"
    env = {"DISPLAY": screen, "LIBGL_ALWAYS_SOFTWARE": "1", "QT_X11_NO_MITSHM": "1"}
    display = stage.start("Xvfb", screen, "-screen", "0", f"{RVIZ_SIZE}x24")
    time.sleep(1.0)
    window = stage.start(
        "rviz", "-d", str(ROOT / "src" / "scara_description" / "rviz" / "cell.rviz"), env=env
    )
    time.sleep(12.0)
    yield screen
    window.stop(2.0)
    display.stop(2.0)


def take_rviz(cell: Cell, out: Path) -> None:
    """Take RViz with both robots apart.

    The twin's time stands still meanwhile and the real robot goes on.
    """
    with rviz(cell.stage) as screen:
        cell.run_program(40)
        time.sleep(2.0)
        cell.tool("rosservice", "call", "/pause_physics")
        time.sleep(1.5)
        cell.tool("import", "-display", screen, "-window", "root", str(out / "rviz.png"))
        cell.tool("rosservice", "call", "/unpause_physics")


def record(cell: Cell) -> Path:
    """Record a program and return the bag."""
    bag = cell.folder / "run.bag"
    cell.tool("rosservice", "call", "/recorder/start", f"path: {bag}")
    cell.run_program(60, "PALLETISE")
    time.sleep(20.0)
    cell.tool("rosservice", "call", "/recorder/stop")
    return bag


def take_recording(bag: Path, folder: Path, out: Path) -> None:
    """Take RViz while a recording drives it; nothing of a cell runs."""
    master = f"http://127.0.0.1:{free_port()}"
    stage = Stage(folder / "play", {**workspace_environment(), "ROS_MASTER_URI": master})
    try:
        stage.start("rosmaster", "--core", "-p", master.rsplit(":", 1)[1])
        time.sleep(3.0)
        assert stage.start("rosparam", "set", "use_sim_time", "true").wait(30.0) == 0
        stage.start("rosrun", "scara_description", "robot_state_publisher")
        stage.start("rosrun", "scara_simulation", "camera")
        with rviz(stage) as screen:
            stage.start("rosbag", "play", "--clock", "--start", "2", str(bag))
            time.sleep(MOTION_S)
            assert (
                stage.start(
                    "import", "-display", screen, "-window", "root", str(out / "rviz_bag.png")
                ).wait(20.0)
                == 0
            )
    finally:
        stage.close(grace=8.0)


def main() -> None:
    """Take all pictures, or those of the pages."""
    words = [word for word in sys.argv[1:] if word not in ("--pages", "--film", "--teach")]
    only_film, only_teach = "--film" in sys.argv[1:], "--teach" in sys.argv[1:]
    only_pages = only_film or only_teach or "--pages" in sys.argv[1:]
    out = Path(words[0] if words else ROOT / "docs" / "images")
    out.mkdir(parents=True, exist_ok=True)
    with_rviz = not only_pages and all(shutil.which(name) for name in ("rviz", "Xvfb", "import"))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        cell = Cell(folder)
        step_back()
        try:
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
                if not only_film and not only_teach:
                    take_pages(cell, browser, out)
                    take_course(cell, browser, out)
                if not only_teach:
                    take_film(cell, browser, out)
                if not only_film:
                    take_teaching(cell, browser, out)
                browser.close()
            if not only_film and not only_teach:
                take_camera(cell, out)
            if with_rviz:
                take_rviz(cell, out)
                bag = record(cell)
        finally:
            cell.close()
        if with_rviz:
            take_recording(bag, folder, out)
    print(f"pictures: {out}" + ("" if with_rviz else "; those of RViz were left out"))


if __name__ == "__main__":
    main()
