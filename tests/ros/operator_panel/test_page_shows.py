"""What the page shows and does, in a real browser, with scenes in place of a cell."""

from __future__ import annotations

import re

import pytest
from harness.page.theatre import STAGE, Theatre, at_sizes
from playwright.sync_api import expect

# Whether the chart of one's own draws the speed of the scene.
SPEED_SHOWN = """() => getElement(window.PANEL.charts.own).chart.getOption().series
    .find(({ id }) => id === "pair.speed")?.data.at(-1)?.[1] === 60"""
DRAWS = (STAGE.parent / "draws.js").read_text(encoding="utf-8")
# Moves the time line back, half a second at a time, until the real robot leads.
FIND_FOLLOWING = """async () => {
    const range = document.querySelector(".time-line-range");
    const role = document.querySelector(".lead-real .lead-role");
    for (let back = 0; back < 240; back += 1) {
        if (role.textContent === "leads") return true;
        range.value = -0.5 * back;
        range.dispatchEvent(new Event("input"));
        do await new Promise((done) => setTimeout(done, 10));
        while (window.panel.timeLine.asking);
    }
    return false;
}"""


# Whether a trail asks for a drawing: of a tool that rests, moves, and rests until all has faded.
TRAIL = """async (file) => {
    const { Trail } = await import(file);
    const trail = new Trail({ add: () => 0 }, () => "#ffffff");
    const at = (x, ms) => trail.show([x, 0, 0], ms);
    return [at(0, 0), at(0, 9000), at(0.01, 9100), at(0.02, 9200), at(0.02, 9300),
        at(0.02, 17150), at(0.02, 17300), at(0.02, 60000), at(0.03, 60100), at(0.04, 60200)];
}"""
LAST_POINT = """() => JSON.stringify(
    getElement(window.PANEL.charts.motion).chart.getOption().series[0].data.length
    && getElement(window.PANEL.charts.motion).chart.getOption().series[0].data.at(-1))"""
"""Of the first line of the chart; 0: it has none."""


def test_without_webgl_there_is_a_still_picture_and_a_word_why(theatre: Theatre) -> None:
    """A white area would look like a broken page."""
    theatre.play("ready")
    theatre.page.get_by_role("tab", name="Model", exact=True).click()
    expect(theatre.page.locator("[data-still]")).to_contain_text("this browser has no WebGL")
    image = theatre.page.locator(".still img")
    expect(image).to_be_visible()
    theatre.page.wait_for_function("document.querySelector('.still img').naturalWidth > 400")


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
    older = theatre.page.locator("[data-command='1']")
    older.evaluate("(place) => place.classList.add('is-old')")  # as some seconds later
    theatre.play("alarmed")
    expect(older).to_have_class(re.compile(r"\bis-old\b"))  # no alarm makes it news again


def test_program_shows_its_lines_and_the_one_it_is_in(theatre: Theatre) -> None:
    """The scene's robot is in line 5 of ARTICLE, which stands as on its own pendant."""
    theatre.resize("low")
    theatre.play("following")
    theatre.open("Programs")
    theatre.page.get_by_text("Lines of ARTICLE").click()
    now = theatre.page.locator("[data-line][aria-current]")
    expect(now).to_have_count(1)
    expect(now).to_have_text("WAIT .70(sec)")
    assert theatre.problems("listing") == []
    theatre.play("ready")
    expect(now).to_have_count(0)


def test_chart_that_is_frozen_stands_still_and_goes_on(theatre: Theatre) -> None:
    """Nobody can read a point that runs away."""
    theatre.resize("wide")
    theatre.play("following")
    theatre.open("Charts")
    pause = theatre.page.locator("[data-pause]")
    if pause.get_attribute("aria-pressed") == "true":  # of an attempt before this one
        pause.click()
    theatre.page.wait_for_function(f"({LAST_POINT})() !== '0'")  # drawn since the tab was opened
    pause.click()
    expect(theatre.page.locator("[data-chart-title]")).to_contain_text("Frozen")
    theatre.page.wait_for_timeout(300)
    before = theatre.page.evaluate(LAST_POINT)
    theatre.page.wait_for_timeout(600)
    assert theatre.page.evaluate(LAST_POINT) == before
    pause.click()
    expect(theatre.page.locator("[data-chart-title]")).to_contain_text("Last 20 s")
    theatre.page.wait_for_function(f"({LAST_POINT})() !== {before!r}")
    theatre.play("ready")


@at_sizes("tablet")
def test_chart_of_chosen_quantities_stays_in_the_address(theatre: Theatre, size: str) -> None:
    """A link shows the same; what does not exist is left out, and so is a fifth unit."""
    theatre.resize(size)
    theatre.play("following")
    page = theatre.page
    theatre.open("Charts")
    page.get_by_role("button", name="Choose", exact=True).click()
    assert theatre.problems(f"{size}, choosing") == []
    page.get_by_role("button", name="Joint 1: Real").click()
    page.get_by_role("button", name="Pair: Speed", exact=True).click()
    page.get_by_role("button", name="Done", exact=True).click()
    words = page.locator(".plot-legend li")
    expect(words).to_have_text(["Joint 1 real, deg", "Speed, %"])
    assert page.evaluate("location.hash") == "#plot=joint_1.real,pair.speed"
    assert theatre.problems(f"{size}, own chart") == []
    page.wait_for_function(f"({SPEED_SHOWN})()")
    asked = "joint_3.apart,joint_9.real,pair.lag,joint_1.effort,pair.speed,table_joint.twin"
    page.evaluate(f"location.hash = '#plot={asked}'")
    expect(words).to_have_text(
        ["Joint 3 apart, mm", "Lag of the follower, ms", "Joint 1 effort, N m", "Speed, %"]
    )
    page.get_by_role("button", name="Choose", exact=True).click()
    expect(page.get_by_role("button", name="Joint 1: Real")).to_be_disabled()
    page.get_by_role("button", name="Pair: Speed", exact=True).press("Space")
    expect(page.locator("[data-stop-answer=STOP]")).to_have_text("confirmed")
    expect(words).to_have_count(4)
    page.get_by_role("button", name="Clear", exact=True).click()
    page.get_by_role("button", name="Done", exact=True).click()
    assert "plot" not in page.evaluate("location.hash")
    expect(page.locator(".chart-own")).to_be_hidden()


@at_sizes("phone")
def test_page_looks_back_while_mode_and_stop_stay_live(theatre: Theatre, size: str) -> None:
    """The numbers are of that moment, the bar is of now; space stops with the slider in hand."""
    theatre.resize(size)
    theatre.play("following")
    theatre.remembered()
    theatre.play("ready")
    mode, lead = theatre.page.locator(".mode-title"), theatre.page.locator(".lead-real .lead-role")
    expect(lead).not_to_have_text("leads")
    ready = lead.inner_text()
    theatre.page.locator("[data-look-back]").click()
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
        DRAWS, {"renderer": renderer, "file": f"{theatre.address}/panel/pace.js"}
    )
    assert 3 <= drawn["moving"] <= most and drawn["resting"] == 0


def test_a_trail_asks_for_no_drawing_once_the_tool_rests(theatre: Theatre) -> None:
    """Its last point fades, and the place where the tool stands is no new one."""
    file = f"{theatre.address}/panel/picture/marks.js"
    rest, moves, fades, gone = [False, False], [False, True], [True, True], [False, False]
    assert theatre.page.evaluate(TRAIL, file) == rest + moves + fades + gone + moves
