"""The page for hands and eyes: what can be touched, read and relied on to stay where it is.

In a real browser, at four sizes, light and dark, with scenes in place of a cell.
"""

from __future__ import annotations

import re
import sys
import time
import urllib.request
from collections.abc import Iterator
from typing import Any

import pytest
from harness.processes import Stage, free_port, wait_until
from harness.wires.browser import chromium
from harness.workspace import ROOT, workspace_environment
from playwright.sync_api import Locator, Page, expect

STAGE = ROOT / "tests" / "harness" / "page" / "stage.py"
MEASURE = (STAGE.parent / "measure.js").read_text(encoding="utf-8")
DRAWS = (STAGE.parent / "draws.js").read_text(encoding="utf-8")
TOKEN = "token-of-the-stage"
SIZES = {"phone": (390, 844), "tablet": (768, 1024), "low": (1280, 720), "wide": (1920, 1080)}
WAYS = ("Step joint", "World", "Tool", "Hold")
ALARMS = 4
TABS = ("Jog", "Target", "Programs", "Robot", "Tuning", "Recordings", "Events", "Today")
expect.set_options(timeout=15_000)
# All that must stand still while alarms, commands and troubles come and go.
PLACES = """() => [...document.querySelectorAll(
    ".card, .strip, .bar, .bar-stop button, .theme, .commands button, .tabs button, " +
    ".jog button, .scene-choice button, .views button, [data-pause]")]
    .filter((place) => place.checkVisibility())
    .map((place) => { const box = place.getBoundingClientRect();
        const button = place.matches("button") && place.innerText.trim();
        const words = place.getAttribute("aria-label") || button || place.className;
        return [words, box.left, box.top + scrollY, box.width, box.height]; })"""

# Moves the time line back, half a second at a time, until the real robot leads.
FIND_FOLLOWING = """async () => {
    const range = document.querySelector(".time-line-range");
    const role = document.querySelector(".lead-real .lead-role");
    for (let back = 0; back < 240; back += 1) {
        if (role.textContent === "leads") return true;
        range.value = -0.5 * back;
        range.dispatchEvent(new Event("input"));
        await new Promise((done) => setTimeout(done, 25));
    }
    return false;
}"""


class Theatre:
    """The page of a stage whose scenes can be chosen."""

    def __init__(self, page: Page, address: str) -> None:
        """Open it as an operator."""
        self.page, self.address = page, address
        page.goto(f"{address}/?token={TOKEN}")
        expect(page.locator("[data-panel].shown")).to_be_visible(timeout=30_000)
        expect(page.locator(".control-text")).to_have_text(re.compile("in control"))

    def play(self, scene: str) -> None:
        """Choose a scene, and wait until the page shows it."""
        with urllib.request.urlopen(f"{self.address}/scene/{scene}", timeout=10.0):
            pass
        expect(self.page.locator('[data-live="jog"]')).to_have_text(scene)
        alarms = self.page.locator(".alarm.warn, .alarm.error")
        expect(alarms).to_have_count(ALARMS if scene == "alarmed" else 0)

    def remembered(self) -> None:
        """Wait until the page's server has kept a moment of what is shown now."""
        now = time.time()

        def newest() -> float:
            answer = self.page.request.get(f"{self.address}/past.json?at={now}")
            return float(answer.json()["last"])

        wait_until(lambda: newest() > now, 10.0, "a moment of this scene")

    def resize(self, size: str) -> None:
        """Choose a size; it is drawn when two frames have passed."""
        width, height = SIZES[size]
        self.page.set_viewport_size({"width": width, "height": height})
        self.settle()

    def settle(self) -> None:
        """Go to the upper end, and wait until transitions are over."""
        self.page.evaluate("window.scrollTo(0, 0)")
        self.page.evaluate(
            "() => Promise.all(document.getAnimations().map((a) => a.finished.catch(() => 0)))"
            ".then(() => new Promise(requestAnimationFrame))"
        )

    def problems(self, where: str) -> list[str]:
        """Return what is wrong with the page as it is now."""
        self.settle()
        found: list[str] = self.page.evaluate(MEASURE)
        return [f"{where}: {text}" for text in found]

    def places(self) -> dict[Any, list[Any]]:
        """Return where everything stands."""
        found: list[list[Any]] = self.page.evaluate(PLACES)
        return {(index, row[0]): row[1:] for index, row in enumerate(found)}

    def open(self, tab: str) -> None:
        """Choose a tab."""
        self.page.get_by_role("tab", name=tab, exact=True).click()


@pytest.fixture(scope="module")
def theatre(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Theatre]:
    """Give one page for all tests of this file."""
    folder = tmp_path_factory.mktemp("stage")
    for name in ("a_recording_with_quite_a_long_name_2026-03-01", "to_be_renamed", "to_go"):
        (folder / "runs" / name).mkdir(parents=True)
        (folder / "runs" / name / "run.bag").write_bytes(b"x" * 2048)
    stage = Stage(folder / "log", workspace_environment())
    port = free_port()
    try:
        process = stage.start(sys.executable, str(STAGE), str(port), str(folder / "runs"))
        address = f"http://127.0.0.1:{port}"
        wait_until(lambda: answers(address) or process.poll() is not None, 30.0, "the stage")
        assert process.poll() is None, process.tail()
        with chromium(folder) as browser:
            yield Theatre(browser.new_page(), address)
    finally:
        stage.close()


def answers(address: str) -> bool:
    """Return whether a server answers there."""
    try:
        with urllib.request.urlopen(f"{address}/events.csv", timeout=5.0):
            return True
    except OSError:
        return False


@pytest.mark.parametrize("size", SIZES)
def test_everything_can_be_touched_and_read_at_each_size_light_and_dark(
    theatre: Theatre, size: str
) -> None:
    """44 px to touch, 60 for STOP and jog, 14 px to read, nothing cut or covered, WCAG AA."""
    theatre.resize(size)
    theatre.play("following")
    found = []
    for tab in TABS:
        theatre.open(tab)
        for colours in ("light", "dark"):
            theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            found += theatre.problems(f"{size}, {colours}, {tab}")
    # The buttons of the views stand on a picture that this browser cannot draw.
    theatre.page.evaluate("document.querySelector('.stage').classList.remove('no-webgl')")
    expect(theatre.page.get_by_role("button", name="Side", exact=True)).to_be_visible()
    found += theatre.problems(f"{size}, views")
    theatre.page.evaluate("document.querySelector('.stage').classList.add('no-webgl')")
    theatre.open("Jog")
    for way in WAYS:
        theatre.open(way)
        found += theatre.problems(f"{size}, {way}")
    for scene in ("asked", "alarmed"):
        theatre.play(scene)
        for colours in ("light", "dark"):
            theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            found += theatre.problems(f"{size}, {colours}, {scene}")
    assert found == []


@pytest.mark.parametrize("size", SIZES)
def test_nothing_moves_when_alarms_commands_and_troubles_come(theatre: Theatre, size: str) -> None:
    """0 px: who presses a button presses the one that he saw."""
    theatre.resize(size)
    theatre.open("Jog")
    theatre.play("ready")
    theatre.settle()
    before = theatre.places()
    for scene in ("alarmed", "no_stop", "asked", "stopped", "aligning"):
        theatre.play(scene)
        theatre.settle()
        moved = {
            name: (before.get(name), place)
            for name, place in theatre.places().items()
            if before.get(name) != place
        }
        assert moved == {}, f"{scene}: (left, top, width, height) before and after"


def test_measure_finds_what_it_looks_for(theatre: Theatre) -> None:
    """A page that is bad in each way is told so: the test above can fail."""
    theatre.resize("low")
    theatre.page.emulate_media(color_scheme="light")
    theatre.play("ready")
    bad = """
        .commands .button.q-btn { min-height: 30px !important; }
        .stop-button { min-height: 50px !important; }
        .mode-motion { font-size: 12px !important; }
        .card-title, .joint-name { color: #b8c0c8 !important; }
        .bar-mode { width: 80px !important; overflow: hidden !important; white-space: nowrap; }
        .link-figures { position: relative; top: -14px; }
    """
    style = theatre.page.add_style_tag(content=bad)
    found = theatre.problems("bad")
    style.evaluate("element => element.remove()")
    for kind in ("touch", "small", "cut", "contrast", "overlap"):
        assert any(text.startswith(f"bad: {kind}") for text in found), (kind, found)


def test_without_webgl_there_is_a_still_picture_and_a_word_why(theatre: Theatre) -> None:
    """A white area would look like a broken page."""
    theatre.play("ready")
    theatre.page.get_by_role("tab", name="Model", exact=True).click()
    expect(theatre.page.locator("[data-still]")).to_contain_text("this browser has no WebGL")
    image = theatre.page.locator(".still img")
    expect(image).to_be_visible()
    assert image.evaluate("image => image.naturalWidth") > 400


def test_command_stays_until_its_end_and_a_refused_one_is_not_green(theatre: Theatre) -> None:
    """With its outcome and its reason, in words."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.page.get_by_role("button", name="Home", exact=True).click()
    line = theatre.page.locator("[data-command='0']")
    expect(line).to_contain_text("Home")
    expect(line).to_have_attribute("data-outcome", "done")
    expect(line).to_contain_text("both stand still")
    theatre.page.keyboard.press("Escape")
    expect(line).to_contain_text("Stop")
    expect(line).to_have_attribute("data-is", "warn")
    shown = theatre.page.locator("[data-command]").all_inner_texts()
    assert any("Home" in text for text in shown), "what became of it stays"


def test_events_are_filtered_acknowledged_and_saved(theatre: Theatre) -> None:
    """Whoever comes back from lunch sees what has happened."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.play("alarmed")
    theatre.open("Events")
    events = theatre.page.locator(".event")
    expect(events.first).to_be_visible()
    theatre.page.get_by_role("tab", name="Warnings, faults").click()
    expect(theatre.page.locator(".event-info")).to_have_count(0)
    theatre.page.get_by_role("tab", name=re.compile("Not acknowledged")).click()
    theatre.page.get_by_role("button", name="Acknowledge all").click()
    expect(events).to_have_count(0)
    theatre.page.get_by_role("tab", name="All", exact=True).click()
    expect(theatre.page.locator(".event-by").first).to_contain_text("Acknowledged by operator")
    table = theatre.page.request.get(f"{theatre.address}/events.csv")
    assert table.headers["content-type"].startswith("text/csv")
    assert "came apart" in table.text() and table.text().startswith("number,time,severity")


def test_recording_gets_a_report_another_name_and_an_end(theatre: Theatre) -> None:
    """Made here, looked at here; deleted only after a question."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.open("Recordings")

    def row(name: str) -> Locator:
        return theatre.page.locator(".run").filter(has_text=name)

    expect(row("to_be_renamed")).to_contain_text("2 kB")
    download = row("to_be_renamed").get_by_text("Download")
    assert (
        theatre.page.request.get(
            f"{theatre.address}{download.locator('xpath=..').get_attribute('href')}"
        ).body()
        == b"x" * 2048
    )
    row("to_be_renamed").get_by_role("button", name="Rename").click()
    question = theatre.page.locator(".confirm")
    question.locator("input").fill("../out")
    question.get_by_role("button", name="Rename").click()
    expect(question).to_contain_text("letters, digits")
    question.locator("input").fill("a_better_name")
    question.get_by_role("button", name="Rename").click()
    expect(row("a_better_name")).to_be_visible()
    expect(row("to_be_renamed")).to_have_count(0)
    row("a_better_name").get_by_role("button", name="Make report").click()
    row("a_better_name").get_by_role("button", name="Report", exact=True).click()
    report = theatre.page.frame_locator(".report-frame").locator("h1")
    expect(report).to_have_text("Report of the stage")
    theatre.page.get_by_role("button", name="Close").click()
    row("to_go").get_by_role("button", name="Delete").click()
    question.get_by_role("button", name="Cancel").click()
    expect(question).to_have_count(0)
    expect(row("to_go")).to_be_visible()
    row("to_go").get_by_role("button", name="Delete").click()
    question.get_by_role("button", name="Delete for ever").click()
    expect(row("to_go")).to_have_count(0)


def test_program_shows_its_lines_and_the_one_it_is_in(theatre: Theatre) -> None:
    """The scene's robot is in line 5 of ARTICLE: the second wait of the loop."""
    theatre.resize("low")
    theatre.play("following")
    theatre.open("Programs")
    theatre.page.get_by_text("Lines of ARTICLE").click()
    now = theatre.page.locator("[data-line][aria-current]")
    expect(now).to_have_count(1)
    expect(now).to_have_text("Wait 0.7 s")
    assert theatre.problems("listing") == []
    theatre.play("ready")
    expect(now).to_have_count(0)


def test_robot_says_its_mode_and_parts_go_back_after_a_question(theatre: Theatre) -> None:
    """Its words, not numbers; nothing is put back by one touch."""
    theatre.resize("low")
    theatre.play("ready")
    theatre.open("Robot")
    expect(theatre.page.locator('[data-live="status.mode"]')).to_have_text("automatic")
    theatre.page.get_by_role("button", name="Put back").click()
    theatre.page.locator(".confirm").get_by_role("button", name="Put back").click()
    line = theatre.page.locator("[data-command='0']")
    expect(line).to_contain_text("Put parts back")
    expect(line).to_have_attribute("data-outcome", "done")
    theatre.page.get_by_role("button", name="Read", exact=True).click()
    registers = theatre.page.locator(".register")
    expect(registers.nth(50)).to_be_attached()
    theatre.page.get_by_label("Search").fill("imstp")
    expect(registers).to_have_count(2)
    expect(registers.first).to_contain_text("input signal 6001, raw 1: *IMSTP")
    assert theatre.problems("registers") == []
    theatre.open("Today")
    expect(theatre.page.locator('[data-live="today.parts"]')).to_have_text("real 0, twin 0")


def test_chart_that_is_frozen_stands_still_and_goes_on(theatre: Theatre) -> None:
    """Nobody can read a point that runs away."""
    theatre.resize("wide")
    theatre.play("following")
    pause = theatre.page.locator("[data-pause]")
    pause.click()
    expect(theatre.page.locator("[data-chart-title]")).to_contain_text("Frozen")
    drawn = """() => JSON.stringify(getElement(window.PANEL.charts.motion).chart.getOption()
        .series[0].data.length && getElement(window.PANEL.charts.motion).chart.getOption()
        .series[0].data.at(-1))"""
    theatre.page.wait_for_timeout(300)
    before = theatre.page.evaluate(drawn)
    theatre.page.wait_for_timeout(600)
    assert theatre.page.evaluate(drawn) == before
    pause.click()
    expect(theatre.page.locator("[data-chart-title]")).to_contain_text("Last 20 s")
    theatre.page.wait_for_function(f"({drawn})() !== {before!r}")
    theatre.play("ready")


@pytest.mark.parametrize("size", SIZES)
def test_page_looks_back_while_mode_and_stop_stay_live(theatre: Theatre, size: str) -> None:
    """The numbers are of that moment, the bar is of now; space stops with the slider in hand."""
    theatre.resize(size)
    theatre.play("following")
    theatre.remembered()
    theatre.play("ready")
    mode, lead = theatre.page.locator(".mode-title"), theatre.page.locator(".lead-real .lead-role")
    expect(lead).not_to_have_text("leads")
    ready = lead.inner_text()
    theatre.page.get_by_role("button", name="Look back").click()
    text = theatre.page.locator("[data-past-text]")
    expect(text).to_contain_text("Past: ")
    assert theatre.problems(f"{size}, looking back") == []
    assert theatre.page.evaluate(FIND_FOLLOWING), "a moment at which the real robot led"
    expect(lead).to_have_text("leads")
    expect(mode).to_have_text("Ready")
    theatre.page.locator(".time-line-range").press("Space")
    expect(theatre.page.locator("[data-stop-answer=STOP]")).to_have_text("confirmed")
    theatre.page.get_by_role("button", name="+1 s", exact=True).click()
    theatre.page.get_by_role("button", name="Live", exact=True).click()
    expect(text).to_be_hidden()
    expect(lead).to_have_text(ready)
    answer = theatre.page.request.get(f"{theatre.address}/past.json?at=noon")
    assert answer.status == 400 and "no number of seconds" in answer.text()


@pytest.mark.parametrize(
    ("renderer", "most"),
    [
        ("ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device), SwiftShader driver)", 11),
        ("ANGLE (NVIDIA, NVIDIA GeForce RTX 3060, OpenGL 4.5)", 26),
    ],
)
def test_picture_is_drawn_on_change_only_and_no_more_often_than_the_graphics_bear(
    theatre: Theatre, renderer: str, most: int
) -> None:
    """10 frames a second where the processor draws, 25 with a graphics card; none at rest."""
    drawn = theatre.page.evaluate(
        DRAWS,
        {"renderer": renderer, "file": f"{theatre.address}/panel/pace.js"},
    )
    assert 3 <= drawn["moving"] <= most and drawn["resting"] == 0
