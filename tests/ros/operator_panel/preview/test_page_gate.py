"""A program that the second world refuses is not started from the page, however fast one is."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.page.acts import preview_of
from harness.page.stand_in import StandIn
from harness.page.watched import Watched
from harness.ros import Ros
from harness.wires.browser import kept_chromium
from playwright.sync_api import expect


@pytest.fixture
def watched(ros_module: Ros, stand_in: StandIn, tmp_path: Path) -> Iterator[Watched]:
    """Give the page."""
    with kept_chromium() as browser:
        made = Watched(ros_module, tmp_path / "config", browser.new_page())
        yield made
        made.close()


def test_refused_program_has_no_button_and_the_gate_refuses_who_is_faster(watched: Watched) -> None:
    """The question shows the verdict; who confirms before it is there meets the gate."""
    watched.open("Programs")
    page = watched.page
    gate = page.locator("[data-panel=Programs] .gate-line")
    expect(gate).to_have_text("Judge runs. Gate on: what is REFUSED does not begin.")
    page.get_by_role("button", name="Preview LOW").click()
    preview_of(page, re.compile(r"Program LOW: REFUSED at .*line 2 of LOW: the nozzle would hit"))
    page.locator("[data-motion-close]").click()
    row = page.locator(".row-line").filter(has=page.get_by_role("button", name="Preview LOW"))
    dialog = page.get_by_role("dialog")
    row.get_by_role("button", name="Run", exact=True).click()
    expect(dialog.locator(".verdict")).to_contain_text("REFUSED at")
    expect(dialog.get_by_role("button", name="Run LOW")).to_have_count(0)
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)

    watched.judge.signal(signal.SIGSTOP)
    row.get_by_role("button", name="Run", exact=True).click()
    expect(dialog.locator(".verdict")).to_have_text("Judging ...")
    dialog.get_by_role("button", name="Run LOW").click()
    told = page.locator("[data-command='0']")
    expect(told).to_contain_text("Program LOW")
    watched.judge.signal(signal.SIGCONT)
    expect(told).to_have_attribute("data-outcome", "refused")
    expect(told).to_contain_text("would hit part_")

    watched.judge.signal(signal.SIGKILL)
    watched.judge.wait(10.0)
    expect(gate).to_have_text("No judge runs: motions begin unjudged.")
    preview = page.get_by_role("button", name="Preview LOW")
    expect(preview).to_be_disabled()
    expect(preview).to_have_attribute("title", re.compile("To start one: .*rosrun what_if what_if"))
