"""What a person does at the operator's page of a whole cell, and the node that serves it."""

from __future__ import annotations

import contextlib
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

from playwright.sync_api import Locator, Page, expect

from harness.live_cell import LiveCell
from harness.processes import Process, free_port, wait_until
from harness.wires.operator_page import TOKEN, VARIABLE, wait_until_served
from harness.yaml_files import changed_values, copy_configuration

LONG_MS = 30_000  # a program of the robot, on a machine that does other things too
PATIENCE: dict[str, dict[str, float]] = {
    "emulator.yaml": {"heartbeat_timeout_ms": 3000},
    "twin_controller.yaml": {
        "desk.real_timeout_ms": 800.0,
        "desk.real_stale_ms": 3000.0,
        "desk.twin_stale_ms": 3000.0,
        # The twin takes no stream after a stop until follow.timeout.
        "twin.stop_quiet_ms": 1200.0,
        "limit.source_age_ms": 1000.0,
        "control.keep_ms": 3000.0,
        "divergence.path_mm": 200.0,
        "divergence.rest_mm": 50.0,
    },
    "motion.yaml": {"follow.timeout": 1.0, "jog.timeout": 1.0},
    "operator_panel.yaml": {
        "jog.dead_man_ms": 1000.0,
        "silent_ms": 5000.0,
        "call_timeout_s": 15.0,
        "program_timeout_s": 40.0,
    },
}
"""On a machine that does other things too, a browser above all, a process may wait for its turn
longer than the shipped values allow. Who is about the page has a patient cell; what a cell does
when it is late is tested elsewhere."""
expect.set_options(timeout=15_000)


def patient_configuration(folder: Path) -> Path:
    """Write the shipped configuration with PATIENCE into ``folder``; return the folder."""
    config = copy_configuration(folder)
    for file, values in PATIENCE.items():
        changed_values(config / file, config, values)
    return config


@contextlib.contextmanager
def cell_with_pages(
    folder: Path, *words: str, env: dict[str, str] | None = None
) -> Iterator[tuple[LiveCell, Process, int]]:
    """Give a ready cell as ``./cell up`` starts it, what it prints, and its page's port.

    Args:
        folder: Of the cell.
        words: Further arguments of the bring-up.
        env: Beside the environment of the cell.
    """
    port = free_port()
    pages = ("--no-browser", "--panel-port", f"{port}", "--pendant-port", f"{free_port()}")
    env = {VARIABLE: TOKEN, **(env or {})}
    with LiveCell(folder).ready(*pages, *words, env=env, people=True, timeout=90.0) as cell:
        yield cell, cell.bringup, port


class Panel:
    """One operator panel on a cell."""

    def __init__(self, cell: LiveCell) -> None:
        """Choose a port."""
        self.cell, self.port = cell, free_port()
        self.process: Process | None = None

    def start(self) -> None:
        """Start the node and wait until it listens."""
        words = (f"_port:={self.port}", f"_runs_dir:={self.cell.folder / 'runs'}")
        self.cell.arguments["operator_panel"] = words
        self.process = self.cell.start_node("operator_panel", env={VARIABLE: TOKEN})
        wait_until_served(self.process)

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """End the node and return its exit code."""
        assert self.process is not None
        self.process.signal(number)
        return self.process.wait(20.0)


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


def take_control(page: Page) -> None:
    """Give a command that moves nothing: the page holds control by it.

    Press again as a person would where the page is loaded anew meanwhile: NiceGUI does so where a
    browser was late.
    """
    in_control = re.compile(r"Operator \d+: in control")
    for patience_ms in (5_000, 5_000, 15_000):
        page.get_by_role("button", name="Set", exact=True).first.click()
        with contextlib.suppress(AssertionError):
            expect(page.locator(".control-text")).to_have_text(in_control, timeout=patience_ms)
            return
    expect(page.locator(".control-text")).to_have_text(in_control)


def press(page: Page, name: str) -> None:
    """Press a button once it is enabled."""
    button = page.get_by_role("button", name=name, exact=True)
    expect(button).to_be_enabled()
    button.click()


def shown(page: Page, key: str) -> float:
    """Return a number of the page; not a number while it shows a dash."""
    text = page.locator(f'[data-live="{key}"]').first.inner_text()
    # Nothing stands there while the page is being loaded anew.
    return float("nan") if text in ("", "\N{EN DASH}") else number(text)


def number(text: str) -> float:
    """Return the first number of a text of the page, whose minus sign is a true one."""
    return float(text.replace("\N{MINUS SIGN}", "-").split()[0])


def is_mode(page: Page, mode: str, timeout: float = 15_000) -> None:
    """Wait for a mode."""
    expect(page.locator('[data-live="mode"]')).to_have_text(mode, timeout=timeout)


def hold_until(
    page: Page, button: Locator, reached: Callable[[], bool], period: float = 0.02
) -> None:
    """Hold a jog button.

    Where its signs came too late and the joint stopped, press again as a person would.
    """
    for _ in range(10):
        button.hover()
        page.mouse.down()
        with contextlib.suppress(AssertionError):
            wait_until(reached, 3.0, period=period)
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


# Joint 1 of the ghost in the picture [rad]; null while it is not drawn, or taken away.
GHOST = """() => {
    const { scene } = window.panel;
    const { root, joint_1 } = scene.told.joints.preview;
    if (!scene.mesh(root.id)?.visible || !scene.mesh(joint_1.id)) return null;
    return scene.mesh(joint_1.id).rotation.z;
}"""


def preview_of(page: Page, text: str | re.Pattern[str]) -> None:
    """Wait until the preview says something, and has something to play."""
    expect(page.locator("[data-motion-words]")).to_contain_text(text, timeout=LONG_MS)
    expect(page.locator("[data-motion-play]")).to_be_visible()
