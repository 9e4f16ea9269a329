"""What one page shows at one moment agrees with itself: numbers, tools, picture and chart."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from harness.live_cell import forward
from harness.page.acts import number

JOINTS = ("joint_1", "joint_2", "joint_3", "table_joint")
AGREE = 0.02  # mm and deg
HUNDREDTH = 0.005 + 1e-9  # a number with two digits after the point is rough by that
TENTH = 0.05 + 1e-9
ROUNDED_MM = AGREE + math.radians(HUNDREDTH) * (650.0 + 300.0)
"""Joints are told in hundredths of a degree, as in the article; the tools are not rounded so."""
LISTEN = """(joints) => {
    const { live } = window.panel;
    const { frame } = live.handlers;
    const text = (key) => document.querySelector(`[data-live="${key}"]`).textContent;
    const keys = ["deviation", "today.deviation"];
    for (const side of ["real", "twin"]) keys.push(`lead.${side}`, `tool.${side}`);
    for (const joint of joints) keys.push(`${joint}.real`, `${joint}.twin`, `${joint}.deviation`);
    const listens = window.samples !== undefined;
    window.samples = [];
    if (listens) return;
    live.handlers.frame = (told) => {
        frame(told);
        const shown = Object.fromEntries(keys.map((key) => [key, text(key)]));
        const programs = document.querySelectorAll('[data-live="robot.program"]');
        shown.programs = Array.from(programs, (place) => place.textContent);
        window.samples.push({ shown, point: told.point, tool: told.tool, pose: told.pose });
    };
}"""


def listen(page: Page) -> None:
    """Let the page note what it shows, at each look that it is told."""
    page.evaluate(LISTEN, list(JOINTS))


def judge_samples(page: Page, at_least: int) -> list[dict[str, Any]]:
    """Judge what was noted since; return what each sample showed while the real robot led.

    Args:
        page: One that has listened.
        at_least: So many samples, and a fifth as many points of the charts.
    """
    samples = page.evaluate("() => window.samples")
    assert samples is not None, "the page was loaded anew, as after a line that was lost for 5 s"
    charted = sum(sample["point"] is not None for sample in samples)  # a chart has fewer points
    assert len(samples) >= at_least and charted >= at_least // 5, (len(samples), charted)
    for sample in samples:
        judge(sample)
    led = [sample["shown"] for sample in samples if sample["shown"]["lead.real"] == "leads"]
    assert led, "the real robot never led"
    return led


def judge(sample: dict[str, Any]) -> None:
    """Hold every number of one sample to every other one that says the same."""
    shown, point, pose = sample["shown"], sample["point"], sample["pose"]
    tools_mm = {side: 1e3 * np.array(place) for side, place in sample["tool"].items()}
    apart_mm = float(np.linalg.norm(tools_mm["real"] - tools_mm["twin"]))
    read = {
        side: [number(shown[f"{joint}.{side}"]) for joint in JOINTS] for side in ("real", "twin")
    }
    assert number(shown["deviation"]) == pytest.approx(apart_mm, abs=AGREE), sample
    if shown["lead.real"] == "leads":
        # At each look, not at the end: a day begins at midnight, in the middle of a run too.
        assert number(shown["deviation"]) <= number(shown["today.deviation"]), sample
    for side, values in read.items():
        drawn = [in_page_units(joint, pose[side][joint]) for joint in JOINTS]
        assert drawn == pytest.approx(values, abs=AGREE), sample
        place = [number(word) for word in re.findall(r"[xyz] (\S+)", shown[f"tool.{side}"])]
        assert place == pytest.approx(tools_mm[side], abs=TENTH), sample
    for index, joint in enumerate(JOINTS):
        difference = read["real"][index] - read["twin"][index]
        assert number(shown[f"{joint}.deviation"]) == pytest.approx(difference, abs=AGREE), sample
    if point is None:
        return
    assert point["pair"][0] == pytest.approx(apart_mm, abs=AGREE), sample
    for index, (side, values) in enumerate(read.items()):
        charted = [point[joint][index] for joint in JOINTS]
        assert charted == pytest.approx(values, abs=HUNDREDTH), sample
        closed_mm = 1e3 * np.array(forward(charted))
        assert closed_mm == pytest.approx(tools_mm[side], abs=ROUNDED_MM), sample


def in_page_units(joint: str, value: float) -> float:
    """Return rad in deg, m in mm."""
    return 1e3 * value if joint == "joint_3" else float(np.degrees(value))
