"""What the page shows of a real judge, in a real browser: the ghost, the gate's modes, an alarm."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from harness.page.acts import GHOST, preview_of
from harness.page.stand_in import StandIn
from harness.page.watched import Watched
from harness.ros import Ros
from harness.second_world.played_robot import NAMES
from harness.wires.browser import kept_chromium
from playwright.sync_api import expect

SAMPLES = 300
"""As many as the page asks for."""
NEAR_RAD = 5e-3

Open = Callable[..., Watched]


@pytest.fixture
def watched(ros: Ros, tmp_path: Path) -> Iterator[Open]:
    """Give what opens the page; ``draws``: its browser draws the model."""
    with ExitStack() as stack:
        stack.callback(StandIn(ros).close)

        def open_page(draws: bool = False, **gate: object) -> Watched:
            browser = stack.enter_context(kept_chromium(draws))
            changes = {tuple(key.split("__")): value for key, value in gate.items()}
            made = Watched(ros, tmp_path / "config", browser.new_page(), changes)
            stack.callback(made.close)
            return made

        yield open_page


@pytest.mark.thorough
def test_preview_plays_what_the_judge_has_tried(watched: Open, ros: Ros) -> None:
    """ARTICLE from where the twin stands: the sentence, the time line, both curves, the ghost.

    The ghost stands where the judge says that joint 1 is at the time of the slider.
    """
    from scara_msgs.srv import JudgeMotion

    made = watched(draws=True)
    page = made.page
    judge = ros.service("what_if/judge", JudgeMotion)
    told = judge(motion="PROGRAM", program="ARTICLE", samples=SAMPLES)
    assert told.verdict == "OK", told.message
    made.open("Programs")
    page.get_by_role("button", name="Preview ARTICLE").click()
    preview_of(page, re.compile(r"Program ARTICLE: OK: takes \d+\.\d+ s, nearest \d+ mm between"))
    at, slider = page.locator("[data-motion-at]"), page.locator("[data-motion-range]")
    expect(at).to_have_text(re.compile(rf"^\d+\.\d\d of {told.sample_times[-1]:.2f} s$"))
    # It goes by itself.
    page.wait_for_function("() => Number(document.querySelector('[data-motion-range]').value) > 1")
    page.wait_for_function(f"() => ({GHOST})() !== null")
    for curve in ("clearance", "speed"):
        drawing = page.locator(f"[data-motion-curve={curve}] path").get_attribute("d")
        assert drawing is not None and drawing.count("L") == SAMPLES - 1
    joint_1 = np.array(told.sample_positions)[:: len(NAMES)]
    for share in (0.2, 0.5, 0.9):
        time = share * told.sample_times[-1]
        slider.fill(f"{time:.4f}")
        expect(at).to_have_text(re.compile(rf"^{time:.2f} of"))
        expected = float(np.interp(time, told.sample_times, joint_1))
        page.wait_for_function(f"() => Math.abs(({GHOST})() - {expected}) < {NEAR_RAD}")
        speed = 1e3 * float(np.interp(time, told.sample_times, told.sample_speed))
        shown = page.locator("[data-motion-now=speed]").inner_text()
        assert float(shown.split()[0]) == pytest.approx(speed, abs=2.0)
    page.locator("[data-motion-close]").click()
    page.wait_for_function(f"() => ({GHOST})() === null")


@pytest.mark.thorough
def test_gate_that_warns_lets_run_what_is_refused_and_says_so(watched: Open, ros: Ros) -> None:
    """The line tells the mode; the verdict stands in the question, and beside the command."""
    from scara_msgs.msg import Audit

    made = watched(gate="warn")
    page, told = made.page, ros.collect("what_if/gate", Audit)
    made.open("Programs")
    gate = page.locator("[data-panel=Programs] .gate-line")
    expect(gate).to_have_text("Judge runs. Gate warns: what is REFUSED begins all the same.")
    row = page.locator(".row-line").filter(has=page.get_by_role("button", name="Preview LOW"))
    row.get_by_role("button", name="Run", exact=True).click()
    dialog = page.get_by_role("dialog")
    expect(dialog.locator(".verdict")).to_contain_text("REFUSED at")
    dialog.get_by_role("button", name="Run LOW").click()
    said = ros.wait_until(lambda: told, 20.0, "what the gate tells")[0]
    assert said.success and said.outcome.startswith("moved all the same (gate: warn): REFUSED at")
