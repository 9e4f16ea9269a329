"""The operator's page in a real browser, on a whole cell.

What an operator does, sees and is refused.
"""

from __future__ import annotations

import json
import re
import signal
import urllib.request
from typing import Any

import pytest
from harness.live_cell import LiveCell
from harness.page.acts import (
    LONG_MS,
    Panel,
    hold_until,
    is_mode,
    number,
    press,
    run_program,
    shown,
)
from harness.page.samples import judge_samples, listen
from harness.processes import wait_until
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.system
SAMPLES = 50
"""Of a run of some seconds; ten looks a second."""
HOLD = """() => new Promise((told) => {
    const {live} = window.panel;
    live.handlers = {...live.handlers, refused: ({why}) => told(why)};
    const say = () =>
        live.send({hold: 1, joint: "joint_1", direction: 1, percent: 3}) || setTimeout(say, 100);
    say();
})"""
"""Hold a button past the page that has it greyed out; what the server says to that."""


def test_page_follows_a_run_of_the_real_robot(operator: Page, panel: Panel) -> None:
    """Mode, leader, why and both robots' joints move with the program.

    At its end the pair is ready again. What the page shows at one moment agrees with itself.
    """

    def scene() -> None:
        listen(operator)
        run_program(operator, "100")
        is_mode(operator, "Ready", LONG_MS)
        assert abs(shown(operator, "joint_1.deviation")) <= 0.05
        # What the page itself noted: a look from here may come after the end of a short program.
        led = judge_samples(operator, at_least=SAMPLES)
        elbows = [(number(told["joint_2.real"]), number(told["joint_2.twin"])) for told in led]
        assert any(min(both) > 30.0 for both in elbows), elbows
        assert any(told["lead.twin"] == "follows" for told in led), led[-1]
        # The head of the page and the list of programs both show it.
        named = [[place for place in told["programs"] if "ARTICLE" in place] for told in led]
        assert any(len(places) >= 2 for places in named), led[-1]
        operator.get_by_role("tab", name="Events").click()
        ended = operator.locator(".event", has_text="Real robot leads \N{RIGHTWARDS ARROW} Ready")
        expect(ended.first).to_be_visible()

    panel.cell.beside_lost_links(scene)


def test_stop_by_the_keyboard_ends_a_move_and_emergency_stop_needs_reset_and_align(
    operator: Page, panel: Panel
) -> None:
    """Escape in the middle of a program; then the whole way back from an emergency stop."""

    def scene() -> None:
        run_program(operator, "20")  # slow enough that the key comes before its end
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


@pytest.mark.thorough
def test_jog_moves_while_held_and_stops_by_release_and_by_a_lost_page(
    operator: Page, panel: Panel
) -> None:
    """The dead-man rule: nothing moves without a hand.

    The real robot follows the twin meanwhile.
    """
    operator.get_by_role("tab", name="Jog").click()
    operator.get_by_role("tab", name="Hold joint").click()
    button = operator.get_by_role("button", name="Jog Table +")
    expect(button).to_be_enabled()
    for end in (operator.mouse.up, operator.close):
        before = table(panel, "twin")
        hold_until(
            operator, button, lambda before=before: table(panel, "twin") > before + 3.0, period=0.1
        )
        end()
        wait_until(lambda: at_rest(panel), 30.0, "a ready pair that stands", period=0.1)
        assert abs(table(panel, "real") - table(panel, "twin")) <= 0.1


def pair(panel: Panel) -> dict[str, Any]:
    """Return the pair as data, as the panel gives it to programs."""
    with urllib.request.urlopen(f"http://127.0.0.1:{panel.port}/api/twin", timeout=10.0) as answer:
        told: dict[str, Any] = json.load(answer)
    return told


def table(panel: Panel, side: str) -> float:
    """Return where the table of a side is [deg]."""
    return float(pair(panel)[side]["position"]["table_joint"])


def at_rest(panel: Panel) -> bool:
    """Return whether both sides stand, and the pair is ready."""
    told = pair(panel)
    stand = all(told[side]["standing_still"] for side in ("real", "twin"))
    return stand and told["authority"]["mode"] == "IDLE"


def tool_of(page: Page, side: str) -> list[float]:
    """Return where a side's tool is [mm]."""
    text = page.locator(f'[data-live="tool.{side}"]').inner_text()
    return [number(word) for word in re.findall(r"[xyz] (\S+)", text)]


@pytest.mark.thorough
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
        # To the other side of where the pair stands, slowly: the way takes some seconds.
        y = -160 if tool_of(operator, "real")[1] > 0.0 else 160
        operator.get_by_label("X", exact=True).fill("510")
        operator.get_by_label("Y", exact=True).fill(str(y))
        operator.get_by_role("textbox", name="Speed", exact=True).fill("3")
        expect(operator.locator(".preview.good")).to_be_visible()
        press(operator, "Move")
        told = operator.locator("[data-command]", has_text="Move to x 510").first
        expect(told).to_have_attribute("data-outcome", "running")
        expect(operator.locator('[data-live="tool.real"]')).to_have_text(
            f"x 510.0  y {y:.1f}  z 100.0 mm".replace("-", "\N{MINUS SIGN}"), timeout=LONG_MS
        )
        is_mode(operator, "Ready", LONG_MS)
        expect(told).to_have_attribute("data-outcome", "done")
        expect(told).to_contain_text("target reached", ignore_case=True)

    panel.cell.beside_lost_links(scene)


@pytest.mark.thorough
def test_taught_draft_leads_both_robots_to_its_end_and_a_stop_ends_it(
    operator: Page, panel: Panel
) -> None:
    """Two places are typed, nothing is recorded by a motion; both robots go there by Run."""
    tab, dialog = operator.locator('[data-panel="Teach"]'), operator.locator(".confirm")
    said = tab.locator(".teach-said")

    def run() -> None:
        press(operator, "Run")
        dialog.get_by_role("button", name="Run the draft").click()
        is_mode(operator, "Operator leads")

    def scene() -> None:
        operator.get_by_role("tab", name="Teach").click()
        tab.locator('[data-teach-line="0"]').click()
        # So slow that a browser of low priority sees the motion, and its STOP comes before the end.
        tab.get_by_label("Speed J", exact=True).fill("2")
        tab.get_by_label("Places", exact=True).fill("510 160 100\n510 -160 100")
        tab.get_by_role("button", name="Record J", exact=True).click()
        expect(said).to_have_text("Places used: 2")
        run()
        expect(said).to_contain_text("has ended", timeout=LONG_MS)
        is_mode(operator, "Ready", LONG_MS)
        for side in ("real", "twin"):
            x, y, z = tool_of(operator, side)[:3]
            assert max(abs(x - 510.0), abs(y + 160.0), abs(z - 100.0)) < 0.3, side
        run()
        wait_until(lambda: tool_of(operator, "real")[1] > -120.0, 20.0, "motion")
        operator.keyboard.press("Escape")
        is_mode(operator, "Stopped")
        expect(said).to_contain_text(re.compile(r"Run: line \d+: J P\[R\[52\]\] 2% FINE"))
        expect(operator.locator('[data-live="motion"]')).to_have_text("both stand still")
        assert tool_of(operator, "real")[1] < 150.0

    panel.cell.beside_lost_links(scene)


@pytest.mark.thorough
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


@pytest.mark.thorough
def test_viewer_sees_everything_and_begins_no_motion(viewer: Page) -> None:
    """Buttons are dead, and what is sent past them is refused by the server; STOP is alive."""
    expect(viewer.get_by_text("Watching only")).to_be_visible()
    for name in ("Home", "Align", "Set"):
        expect(viewer.get_by_role("button", name=name, exact=True).first).to_be_disabled()
    last = viewer.locator("[data-command='0']")
    before = last.inner_text()
    assert "only watches" in viewer.evaluate(HOLD), "told to this page alone: it is no event"
    expect(last).to_have_text(before)
    press(viewer, "STOP")
    expect(viewer.locator('[data-stop-answer="STOP"]')).to_have_text("confirmed")


@pytest.mark.thorough
def test_camera_is_seen_by_whoever_watches_and_its_end_is_said(
    viewer: Page, patient_cell: LiveCell
) -> None:
    """Beside the model; a picture that is not current is not shown as if it were."""
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


@pytest.mark.thorough
def test_pair_as_data_is_what_the_page_shows(viewer: Page, panel: Panel) -> None:
    """Now, and a while ago."""
    for query in ("", "?time=-1"):
        answer = viewer.request.get(f"http://127.0.0.1:{panel.port}/api/twin{query}")
        assert answer.ok, answer.text()
        pair = answer.json()
        assert pair["units"]["joint_1"] == "deg"
        position = pair["real"]["position"]["joint_1"]
        assert position == pytest.approx(shown(viewer, "joint_1.real"), abs=0.05)
