"""The operator's page in a real browser, on a whole cell.

What an operator does, sees and is refused.
"""

from __future__ import annotations

import contextlib
import re
import signal
from collections.abc import Callable, Iterator

import pytest
from harness.live_cell import LiveCell
from harness.processes import Process, free_port, wait_until
from harness.wires.browser import chromium
from harness.yaml_files import changed_yaml, copy_configuration
from playwright.sync_api import Browser, Locator, Page, expect

pytestmark = pytest.mark.system

TOKEN = "token-of-the-tests"
LONG_MS = 30_000  # a program of the robot, on a machine that does other things too
expect.set_options(timeout=15_000)


# On a machine that does other things too a process may wait for its turn longer than the shipped
# values allow. These tests are about the page, so the cell may be patient; what it does when it is
# late is tested elsewhere.
PATIENCE: list[tuple[str, list[str | int], float]] = [
    ("emulator.yaml", ["heartbeat_timeout_ms"], 3000),
    ("twin_controller.yaml", ["real", "timeout_ms"], 800.0),
    ("twin_controller.yaml", ["real", "stale_ms"], 3000.0),
    ("twin_controller.yaml", ["twin", "stale_ms"], 3000.0),
    (
        "twin_controller.yaml",
        ["twin", "stop_quiet_ms"],
        1200.0,
    ),  # the twin takes no stream after a stop until follow.timeout
    ("twin_controller.yaml", ["limit", "source_age_ms"], 1500.0),
    ("twin_controller.yaml", ["divergence", "path_mm"], 200.0),
    ("twin_controller.yaml", ["divergence", "rest_mm"], 50.0),
    ("motion.yaml", ["follow", "timeout"], 1.0),
    ("motion.yaml", ["jog", "timeout"], 1.0),
    ("operator_panel.yaml", ["jog", "dead_man_ms"], 1000.0),
    ("operator_panel.yaml", ["silent_ms"], 5000.0),
    ("twin_controller.yaml", ["control", "keep_ms"], 3000.0),
    ("operator_panel.yaml", ["call_timeout_s"], 15.0),
    ("operator_panel.yaml", ["program_timeout_s"], 40.0),
]


@pytest.fixture(scope="module")
def patient_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell with patient time-outs and gains of its own to change."""
    cell = LiveCell(tmp_path_factory.mktemp("cell"))
    config = copy_configuration(cell.folder / "patient")
    for file, path, value in PATIENCE:
        changed_yaml(config / file, config, path, value)
    try:
        # Page and controller know the same token of the person.
        env = {"SCARA_CONFIG_DIR": str(config), "OPERATOR_PANEL_TOKEN": TOKEN}
        cell.wait_ready(cell.start(env=env))
        yield cell
    finally:
        cell.close()


class Panel:
    """One operator panel on a cell."""

    def __init__(self, cell: LiveCell) -> None:
        """Choose a port."""
        self.cell, self.port = cell, free_port()
        self.process: Process | None = None

    def start(self) -> None:
        """Start the node and wait until it listens."""
        words = (
            f"_port:={self.port}",
            f"_runs_dir:={self.cell.folder / 'runs'}",
        )
        env = {
            "SCARA_CONFIG_DIR": str(self.cell.output / "config"),
            "OPERATOR_PANEL_TOKEN": TOKEN,
        }
        process = self.process = self.cell.stage.start(
            "rosrun", "operator_panel", "operator_panel", *words, env=env
        )
        wait_until(
            lambda: "to watch" in process.output or process.poll() is not None,
            30.0,
            "the operator panel",
        )
        assert process.poll() is None, process.tail()

    @contextlib.contextmanager
    def standing_still(self) -> Iterator[None]:
        """Let the node do nothing for a while, as on a machine that has stopped."""
        assert self.process is not None
        self.process.signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.process.signal(signal.SIGCONT)

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """End the node and return its exit code."""
        assert self.process is not None
        self.process.signal(number)
        return self.process.wait(20.0)


@pytest.fixture(scope="module")
def panel(patient_cell: LiveCell) -> Iterator[Panel]:
    """Give a running panel."""
    made = Panel(patient_cell)
    made.start()
    yield made
    if made.process is not None and made.process.poll() is None:
        assert made.stop() == 0


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Give one browser to all tests of this file."""
    with chromium(tmp_path_factory.mktemp("browser")) as started:
        yield started


@pytest.fixture
def open_page(browser: Browser, panel: Panel) -> Iterator[Callable[..., Page]]:
    """Give a function that opens the page in a browser of its own.

    Nothing may be asked of another machine.
    """
    contexts = []

    def open_one(token: str = TOKEN) -> Page:
        context = browser.new_context(viewport={"width": 1280, "height": 720})
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda request: asked.add(request.url.split("/")[2]))
        page.goto(f"http://127.0.0.1:{panel.port}/" + (f"?token={token}" if token else ""))
        expect(page.locator("[data-panel].shown")).to_be_visible()
        return page

    asked: set[str] = set()
    yield open_one
    for context in contexts:
        for page in context.pages:
            print(page.locator("body").inner_text())  # pytest shows it where a test failed
        context.close()
    assert asked == {f"127.0.0.1:{panel.port}"}


@pytest.fixture
def operator(open_page: Callable[..., Page]) -> Page:
    """Give the page of an operator in control, with the pair ready."""
    page = open_page()
    expect(page.locator(".control-text")).to_have_text(re.compile(r"Operator \d+: in control"))
    make_ready(page)
    return page


def make_ready(page: Page) -> None:
    """Bring the pair to rest and agreement, whatever the test before left."""
    mode = page.locator('[data-live="mode"]')
    expect(mode).to_have_text(
        re.compile("Ready|Stopped|Fault|Emergency stop|Paused"), timeout=LONG_MS
    )
    for state, button in (
        ("Paused", "STOP"),
        ("Fault", "Reset"),
        ("Emergency stop", "Reset"),
        ("Stopped", "Align"),
    ):
        if mode.inner_text() == state:
            press(page, button)
            expect(mode).not_to_have_text(state)
    expect(mode).to_have_text("Ready", timeout=LONG_MS)


def press(page: Page, name: str) -> None:
    """Press a button once it is enabled."""
    button = page.get_by_role("button", name=name, exact=True)
    expect(button).to_be_enabled()
    button.click()


def shown(page: Page, key: str) -> float:
    """Return a number of the page; not a number while it shows a dash."""
    text = page.locator(f'[data-live="{key}"]').first.inner_text()
    return float("nan") if text == "\N{EN DASH}" else float(text.replace("\N{MINUS SIGN}", "-"))


def is_mode(page: Page, mode: str, timeout: float = 15_000) -> None:
    """Wait for a mode."""
    expect(page.locator('[data-live="mode"]')).to_have_text(mode, timeout=timeout)


def hold_until(page: Page, button: Locator, reached: Callable[[], bool]) -> None:
    """Hold a jog button.

    Where its signs came too late and the joint stopped, press again as a person would.
    """
    for _ in range(10):
        button.hover()
        page.mouse.down()
        with contextlib.suppress(AssertionError):
            wait_until(reached, 3.0)
            return
        page.mouse.up()
    raise AssertionError("the joint did not get there in ten presses")


def run_program(page: Page, override: str) -> None:
    """Start the article's program on the robot's pendant, through the page."""
    page.get_by_role("tab", name="Programs").click()
    panel = page.locator('[data-panel="Programs"]')
    panel.locator("input").fill(override)
    panel.get_by_role("button", name="Set").click()
    told = page.locator("[data-command]", has_text="Override of the robot").first
    expect(told).to_contain_text(f"override {override} %", ignore_case=True)
    expect(told).to_contain_text("done")
    panel.locator(".row-line", has_text="ARTICLE").get_by_role("button", name="Run").click()
    page.get_by_role("button", name="Run ARTICLE", exact=True).click()
    is_mode(page, "Real robot leads")


def test_page_follows_a_run_of_the_real_robot(operator: Page, panel: Panel) -> None:
    """Mode, leader, why and both robots' joints move with the program.

    At its end the pair is ready again.
    """

    def scene() -> None:
        run_program(operator, "100")
        expect(operator.locator('[data-live="leader"]')).to_have_text(
            "real robot, the twin follows"
        )
        wait_until(
            lambda: (
                shown(operator, "joint_2.real") > 30.0 and shown(operator, "joint_2.twin") > 30.0
            ),
            20.0,
            "both elbows",
        )
        # The head of the page and the list of programs both show it.
        for shown_program in operator.locator('[data-live="robot.program"]').all():
            expect(shown_program).to_contain_text("ARTICLE")
        is_mode(operator, "Ready", LONG_MS)
        assert abs(shown(operator, "joint_1.deviation")) <= 0.05
        operator.get_by_role("tab", name="Events").click()
        ended = operator.locator(".event", has_text="Real robot leads \N{RIGHTWARDS ARROW} Ready")
        expect(ended.first).to_be_visible()

    panel.cell.beside_lost_links(scene)


def test_stop_by_the_keyboard_ends_a_move_and_emergency_stop_needs_reset_and_align(
    operator: Page, panel: Panel
) -> None:
    """Escape in the middle of a program; then the whole way back from an emergency stop."""

    def scene() -> None:
        run_program(operator, "40")
        wait_until(lambda: shown(operator, "joint_2.real") > 10.0, 20.0, "motion")
        operator.keyboard.press("Escape")
        is_mode(operator, "Stopped")
        expect(operator.locator('[data-live="motion"]')).to_have_text("both stand still")
        operator.get_by_role("button", name="E-STOP").click()
        is_mode(operator, "Emergency stop")
        expect(operator.locator(".alarm").first).to_contain_text("RESET")
        expect(operator.get_by_role("button", name="Home", exact=True)).to_be_disabled()
        press(operator, "Reset")
        is_mode(operator, "Stopped")
        press(operator, "Align")
        is_mode(operator, "Ready", LONG_MS)

    panel.cell.beside_lost_links(scene)


def test_jog_moves_while_held_and_stops_by_release_and_by_a_lost_page(
    operator: Page, open_page: Callable[..., Page]
) -> None:
    """The dead-man rule: nothing moves without a hand.

    The real robot follows the twin meanwhile.
    """
    watcher = open_page("")
    operator.get_by_role("tab", name="Jog").click()
    before = shown(operator, "table_joint.twin")
    button = operator.get_by_role("button", name="Jog Table +")
    expect(button).to_be_enabled()
    for end in (operator.mouse.up, operator.close):
        hold_until(
            operator,
            button,
            lambda before=before: shown(watcher, "table_joint.twin") > before + 3.0,
        )
        end()
        expect(watcher.locator('[data-live="motion"]')).to_have_text("both stand still")
        is_mode(watcher, "Ready", LONG_MS)
        stopped = shown(watcher, "table_joint.twin")
        assert abs(shown(watcher, "table_joint.real") - stopped) <= 0.1
        before = stopped


def test_unreachable_target_is_refused_before_it_is_sent_and_a_good_one_is_reached(
    operator: Page, panel: Panel
) -> None:
    """The preview says why not; a field says what is wrong with it; Move goes there with both."""

    def scene() -> None:
        operator.get_by_role("tab", name="Target").click()
        operator.get_by_role("button", name="P2", exact=True).click()
        expect(operator.locator(".preview.good")).to_contain_text("Reachable, righty")
        operator.get_by_label("X", exact=True).fill("900")
        expect(operator.locator(".preview.bad")).to_contain_text("Not reachable")
        operator.get_by_label("Y", exact=True).fill("0,1")
        expect(operator.get_by_text("write the decimal with a point")).to_be_visible()
        operator.get_by_label("X", exact=True).fill("510")
        operator.get_by_label("Y", exact=True).fill("160")
        expect(operator.locator(".preview.good")).to_be_visible()
        press(operator, "Move")
        told = operator.locator("[data-command]", has_text="Move to x 510").first
        expect(told).to_have_attribute("data-outcome", "running")
        expect(operator.locator('[data-live="tool.real"]')).to_have_text(
            "x 510.0  y 160.0  z 100.0 mm", timeout=LONG_MS
        )
        is_mode(operator, "Ready", LONG_MS)
        expect(told).to_have_attribute("data-outcome", "done")
        expect(told).to_contain_text("target reached", ignore_case=True)

    panel.cell.beside_lost_links(scene)


def test_changed_gain_is_in_force_and_written_back_and_can_be_undone(
    operator: Page, panel: Panel
) -> None:
    """The article's tuning: the file holds what was set on the page.

    A typing error stays on the page.
    """
    file = panel.cell.output / "config" / "pid_gains.yaml"
    before = file.read_text()
    operator.get_by_role("tab", name="Tuning").click()
    operator.get_by_label("Joint", exact=True).click()
    operator.get_by_role("option", name="Table").click()
    field = operator.get_by_label("position d", exact=True)
    expect(field).to_have_value("22.96")
    field.fill("x")
    press(operator, "Set gains")
    expect(operator.get_by_text("'x' is no number")).to_be_visible()
    field.fill("23.5")
    press(operator, "Preview step")
    expect(operator.get_by_text("Typed gains: overshoot")).to_be_visible()
    press(operator, "Set gains")
    wait_until(lambda: "d: 23.5" in file.read_text(), 20.0, "the gain in the file")
    press(operator, "Undo")
    wait_until(lambda: file.read_text() == before, 20.0, "the old gain")
    expect(field).to_have_value("22.96")


def test_gain_changed_and_changed_back_before_the_panel_looked_is_shown(
    operator: Page, panel: Panel
) -> None:
    """The panel hears of the last values only, which are those that it showed.

    What is typed is in force for nobody.
    """
    operator.get_by_role("tab", name="Tuning").click()
    field = operator.get_by_label("position d", exact=True)
    expect(field).not_to_have_value("")
    in_force = field.input_value()
    field.fill("270")
    press(operator, "Preview step")
    expect(operator.get_by_text("Typed gains: overshoot")).to_be_visible()
    with panel.standing_still():
        changed = "{config: {doubles: [{name: position_d, value: 270.0}]}}"
        panel.cell.call("/twin/pid/joint_1/set_parameters", changed)
        assert panel.cell.call("/twin/pid/undo")["success"]
    expect(field).to_have_value(in_force)


def test_viewer_sees_everything_and_begins_no_motion(open_page: Callable[..., Page]) -> None:
    """Buttons are dead, and what is sent past them is refused by the server; STOP is alive."""
    viewer = open_page("")
    expect(viewer.get_by_text("Watching only")).to_be_visible()
    for name in ("Home", "Align", "Set"):
        expect(viewer.get_by_role("button", name=name, exact=True).first).to_be_disabled()
    viewer.evaluate("window.panel.live.send({hold: 1, joint: 'joint_1', direction: 1, percent: 3})")
    expect(viewer.locator("[data-command='0']")).to_contain_text("only watches")
    press(viewer, "STOP")
    expect(viewer.locator('[data-stop-answer="STOP"]')).to_have_text("confirmed")


def test_second_operator_asks_and_the_first_hands_over(
    operator: Page, open_page: Callable[..., Page]
) -> None:
    """One holds control; until it answers the other may only stop."""
    second = open_page()
    expect(second.get_by_role("button", name="Home", exact=True)).to_be_disabled()
    expect(second.get_by_role("button", name="STOP", exact=True)).to_be_enabled()
    second.get_by_role("button", name="Ask for control").click()
    expect(operator.get_by_text("asks for control")).to_be_visible()
    operator.get_by_role("button", name="Hand over").click()
    expect(second.get_by_role("button", name="Home", exact=True)).to_be_enabled()
    expect(operator.get_by_role("button", name="Home", exact=True)).to_be_disabled()


def test_camera_is_seen_by_whoever_watches_and_its_end_is_said(
    open_page: Callable[..., Page], patient_cell: LiveCell
) -> None:
    """Beside the model; a picture that is not current is not shown as if it were."""
    viewer = open_page("")
    viewer.get_by_role("tab", name="Both").click()
    caption, picture = viewer.locator("[data-camera-text]"), viewer.locator("[data-camera]")
    expect(caption).to_contain_text("No picture comes")
    # Ended however the scene ends: a second attempt begins without a camera, too.
    with patient_cell.stage.start("rosrun", "scara_simulation", "camera") as camera:
        expect(caption).to_have_text("Camera", timeout=LONG_MS)
        size = picture.evaluate("image => [image.naturalWidth, image.naturalHeight]")
        assert size == [480, 360]
        camera.signal(signal.SIGINT)
        assert camera.wait(20.0) == 0
    expect(caption).to_contain_text("No picture comes")


def test_pair_as_data_is_what_the_page_shows(open_page: Callable[..., Page], panel: Panel) -> None:
    """Now, and a while ago."""
    viewer = open_page("")
    for query in ("", "?time=-1"):
        answer = viewer.request.get(f"http://127.0.0.1:{panel.port}/api/twin{query}")
        assert answer.ok, answer.text()
        pair = answer.json()
        assert pair["units"]["joint_1"] == "deg"
        position = pair["real"]["position"]["joint_1"]
        assert position == pytest.approx(shown(viewer, "joint_1.real"), abs=0.05)


def test_page_greys_out_when_its_server_is_killed_and_comes_back_by_itself(
    operator: Page, panel: Panel
) -> None:
    """Since when is said; the new server finds the operator still to be one."""
    panel.stop(signal.SIGKILL)
    expect(operator.locator("body.is-lost .lost-text")).to_contain_text(
        re.compile(r"since \d\d:\d\d:\d\d")
    )
    assert (
        operator.locator(".grid").evaluate("element => getComputedStyle(element).filter")
        == "grayscale(1)"
    )
    panel.start()
    expect(operator.locator("body:not(.is-lost)")).to_be_visible(timeout=LONG_MS)
    expect(operator.locator(".control-text")).to_have_text(re.compile(r"Operator \d+: in control"))
    is_mode(operator, "Ready", LONG_MS)
