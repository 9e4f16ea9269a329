"""A recording on the page's time line, in a real browser, while a live cell goes on."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Iterator
from datetime import datetime

import pytest
from harness.page import recorded
from harness.page.theatre import SLOW_MS, TOKEN, Theatre, at_sizes, kept_theatre, until
from harness.wires.browser import LOAD_MS
from harness.workspace import ROOT
from playwright.sync_api import expect
from scara_config import load_robot

RUN = "a_recording_with_quite_a_long_name_2026-03-01"
MOVE_TO = """(after) => {
    const range = document.querySelector(".time-line-range");
    range.value = after;
    range.dispatchEvent(new Event("input"));
}"""
# Where joint 1 of the twin stands in the picture [rad], and where the newest point of the chart is.
POSE = "() => window.panel.scene.poses.twin?.joint_1"
CHART = """() => getElement(window.PANEL.charts.motion).chart.getOption().series
    .find(({ id }) => id === "real").data.at(-1)?.[1]"""

# Which robots stand in the picture, and how many people.
SHOWN_THERE = """(wanted) => {
    const { scene } = window.panel;
    const isShown = ({ id }) => scene.mesh(id)?.visible;
    const stands = (side) => Object.values(scene.told.joints[side]).every(isShown);
    return `${["real", "twin"].filter(stands)} ${scene.people.bodies.length}` === wanted;
}"""
STILL = ROOT / "src" / "operator_panel" / "web" / "still.jpg"
FREEZE_AND_GO_ON = """() => {
    const pause = document.querySelector("[data-pause]");
    pause.click();
    pause.click();
}"""


@pytest.fixture(scope="module")
def theatre(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Theatre]:
    """Give a page whose browser draws the model, with a recording among its runs."""
    bag = recorded.write_recording(tmp_path_factory.mktemp("look_back") / "run.bag", load_robot())
    with kept_theatre(draws=True) as made:
        shutil.copy(bag, made.runs / RUN / "run.bag")
        yield made


def open_recording(theatre: Theatre) -> None:
    """Open the recording, and wait until it is read."""
    theatre.open("Recordings")
    row = theatre.page.locator(".run").filter(has_text=RUN)
    row.get_by_role("button", name="Look back").click()
    told = theatre.page.locator("[data-past-text]")
    expect(told).to_contain_text("after its start", timeout=SLOW_MS)
    expect(told).not_to_contain_text("read", timeout=SLOW_MS)


@at_sizes("phone")
def test_recording_is_looked_at_on_the_page_while_stop_stays_live(
    theatre: Theatre, size: str
) -> None:
    """Robots, chart, decision and parts of its moment; the page says all the time what it shows."""
    page = theatre.page
    theatre.resize(size)
    theatre.play("ready")
    lead = page.locator(".lead-real .lead-role")
    expect(lead).not_to_have_text("leads")
    ready = lead.inner_text()
    open_recording(theatre)
    note = page.locator("[data-past-text]")
    expect(note).to_be_visible()
    expect(note).to_have_text(re.compile(f"^Not now. Recording {RUN}: "))
    page.evaluate(MOVE_TO, 6.0)
    expect(lead).to_have_text("leads")
    expect(page.locator('[data-live="joint_1.real"]')).to_have_text(re.compile(r"^(19\.5|20\.0)0$"))
    expect(page.locator(".mode-title")).to_have_text("Ready")
    page.wait_for_function(f"({POSE})() > 0.33 && ({POSE})() < 0.36")
    if size in ("wide", "low"):
        theatre.open("Charts")
        page.wait_for_function(f"Math.abs(({CHART})() - 20) < 1.1")
        page.evaluate(FREEZE_AND_GO_ON)
        page.wait_for_timeout(1000)  # some drawings later
        assert abs(page.evaluate(f"({CHART})()") - 20) < 1.1, "the chart is not of now"
        page.route(
            "**/camera.jpg*", lambda asked: asked.fulfill(path=STILL, headers={"X-Stamp": "1"})
        )
        page.get_by_role("tab", name="Camera", exact=True).click()
        expect(page.locator("[data-camera-text]")).to_have_text("Camera: now")
        page.get_by_role("tab", name="Model", exact=True).click()
        page.unroute("**/camera.jpg*")
    theatre.open("Events")
    events = page.locator(".event")
    expect(events.filter(has_text="the twin follows")).to_have_count(1)
    expect(events.filter(has_text=recorded.REASON[1:])).to_have_count(0)
    expect(page.locator("[data-acknowledge]:visible")).to_have_count(0)
    assert theatre.problems(f"{size}, a recording") == []
    page.evaluate(MOVE_TO, 9.0)
    expect(events.filter(has_text=recorded.REASON[1:])).to_have_count(2)
    page.locator(".time-line-range").press("Space")
    expect(page.locator("[data-stop-answer=STOP]")).to_have_text("confirmed")
    expect(page.locator("[data-command='0']")).to_contain_text("Stop")
    page.locator(".past-note").get_by_role("button", name="Live").click()
    expect(note).to_be_hidden()
    expect(lead).to_have_text(ready)
    expect(events.filter(has_text=recorded.REASON[1:])).to_have_count(0)


CLOCK = """(after) => new Date(1000 * (window.panel.timeLine.look.first + after))
    .toLocaleTimeString("en-GB")"""
SINCE_FIRST = "() => { const { last, first } = window.panel.timeLine.look; return last - first; }"
MOMENT = "() => window.panel.timeLine.at"
ASK = "(at) => window.panel.timeLine.ask(at)"


@at_sizes("low")
def test_typed_time_of_day_leads_there_and_one_outside_says_what_there_is(
    theatre: Theatre, size: str
) -> None:
    """With seconds or without; a wrong one changes neither the moment nor a place of the page."""
    page = theatre.page
    theatre.resize(size)
    theatre.play("ready")
    open_recording(theatre)
    field, wrong = page.get_by_label("Time of day"), page.locator("[data-past-wrong]")
    told = page.locator("[data-past-text]")
    first, last, there = (page.evaluate(CLOCK, after) for after in (0.0, 12.0, 7.0))
    field.fill(there)
    page.get_by_role("button", name="Go", exact=True).click()
    expect(told).to_contain_text(f"{there}, 7 s after its start")
    expect(page.locator(".lead-real .lead-role")).to_have_text("leads")
    expect(wrong).to_have_text("")
    field.fill(first[:-3])  # the minute in which it begins
    field.press("Enter")
    expect(told).to_contain_text(f"{first}, 0 s after its start")
    theatre.settle()
    before, moment = theatre.places(), page.evaluate(MOMENT)
    stood = field.bounding_box()
    for typed, why in (
        ("13:59", f"13:59 is outside {first} to {last}."),
        ("2 pm", '"2 pm" is no time of day: write 14:03 or 14:03:20.'),
        ("24:00", '"24:00" is no time of day: write 14:03 or 14:03:20.'),
        ("", "No time of day: write 14:03 or 14:03:20."),
    ):
        field.fill(typed)
        field.press("Enter")
        expect(wrong).to_have_text(why)
        theatre.settle()
        assert theatre.places() == before
        assert field.bounding_box() == stood
        assert page.evaluate(MOMENT) == moment
        assert theatre.problems(f"{size}, {typed!r}") == []
    page.locator(".past-note").get_by_role("button", name="Live").click()


SHOWN = """() => [window.panel.timeLine.look?.last, window.panel.timeLine.at,
    document.querySelector("[data-past-text]").textContent]"""


@pytest.mark.thorough
@pytest.mark.parametrize("zone", ["Pacific/Honolulu", "Asia/Tokyo"])
def test_phone_whose_clock_and_zone_differ_looks_back_by_the_cells_clock(
    theatre: Theatre, zone: str
) -> None:
    """The newest moment is there, and no event from behind a moment is shown with it."""
    theatre.play("ready")
    browser = theatre.page.context.browser
    assert browser is not None
    page = browser.new_page(timezone_id=zone, viewport={"width": 1280, "height": 720})
    page.clock.install(time=time.time() - 300.0)
    page.goto(f"{theatre.address}/?token={TOKEN}", timeout=LOAD_MS)
    page.get_by_role("tab", name="Events", exact=True).click()
    theatre.remembered()
    begun = time.time()
    theatre.play("alarmed")
    events = page.locator(".event")
    expect(events.first).to_be_visible()
    page.locator("[data-look-back]").click()
    page.wait_for_function("() => window.panel.timeLine.look")
    last, at, told = page.evaluate(SHOWN)
    assert last == at and abs(last - time.time()) < 5.0
    clock = datetime.fromtimestamp(at).strftime("%H:%M:%S")
    assert told.startswith(f"Not now. Past: {clock}, ") and "min" not in told
    expect(events.first).to_be_visible()
    page.evaluate(ASK, begun - 3.0)
    page.wait_for_function("(last) => window.panel.timeLine.look.at < last", arg=last)
    # The server keeps no moment while it builds this page: the nearest one may lie behind the wish.
    _, found, _ = page.evaluate(SHOWN)
    assert found < begun
    behind = [datetime.fromtimestamp(found + k).strftime("%H:%M:%S") for k in range(1, 8)]
    assert not set(behind) & set(page.locator(".event time").all_inner_texts())
    page.get_by_label("Time of day").fill(clock)
    page.get_by_role("button", name="Go", exact=True).click()
    expect(page.locator("[data-past-text]")).to_contain_text(f"Past: {clock}, ")
    page.close()


def test_typed_time_of_day_leads_through_the_last_ten_minutes(theatre: Theatre) -> None:
    """What the page's server remembers, up to now."""
    page = theatre.page
    theatre.resize("low")
    theatre.play("ready")
    theatre.remembered()
    page.locator("[data-look-back]").click()
    expect(page.locator("[data-past-text]")).to_contain_text("Past: ")
    page.wait_for_function("() => window.panel.timeLine.look")
    # Not at its beginning: while the stage built its first page it kept no moment.
    first = page.evaluate(CLOCK, page.evaluate(SINCE_FIRST) - 2.0)
    page.get_by_label("Time of day").fill(first)
    page.get_by_role("button", name="Go", exact=True).click()
    expect(page.locator("[data-past-text]")).to_contain_text(f"Past: {first}")
    hour = int(first[:2])
    other = f"{(hour + 12) % 24:02}:30"
    page.get_by_label("Time of day").fill(other)
    page.get_by_role("button", name="Go", exact=True).click()
    expect(page.locator("[data-past-wrong]")).to_contain_text(f"{other} is outside ")
    expect(page.locator("[data-past-text]")).to_contain_text(f"Past: {first}")
    page.locator(".past-note").get_by_role("button", name="Live").click()


def test_moment_at_which_nobody_was_heard_says_so_and_shows_no_number_of_now(
    theatre: Theatre,
) -> None:
    """The page knew nothing then: empty violet frames, no robot, and the bar says why.

    Who stood beside the robot at another moment is in the picture of that one.
    """
    page = theatre.page
    theatre.resize("low")
    moments = []
    for scene in ("stopped", "no_master"):
        page.request.get(f"{theatre.address}/scene/{scene}")
        theatre.remembered()
        found = page.request.get(f"{theatre.address}/past.json?at={time.time()}").json()
        moments.append(found["last"])
    beside, unheard = moments
    theatre.play("ready")
    theatre.remembered()
    number, told = page.locator('[data-live="joint_1.real"]'), page.locator("[data-past-text]")
    place = page.locator("[data-bar=joint_1] > *").first
    page.locator("[data-look-back]").click()
    page.wait_for_function("() => window.panel.timeLine.look")
    expect(number).to_have_text(re.compile(r"\d"))
    expect(place).not_to_have_attribute("hidden", "")
    expect(told).not_to_contain_text("ROS master")
    until(page, SHOWN_THERE, "real,twin 0")
    page.evaluate(ASK, unheard)
    expect(told).to_contain_text(" ago. No ROS master answers.")
    expect(number).to_have_text("")
    expect(place).to_have_attribute("hidden", "")
    until(page, SHOWN_THERE, " 0")
    page.evaluate(ASK, beside)
    until(page, SHOWN_THERE, "real,twin 1")
    page.locator(".past-note").get_by_role("button", name="Live").click()
    expect(number).to_have_text(re.compile(r"\d"))
    until(page, SHOWN_THERE, "real,twin 0")


def test_recording_that_cannot_be_shown_says_why_on_the_time_line(theatre: Theatre) -> None:
    """And Live still leads back."""
    theatre.resize("low")
    theatre.open("Recordings")
    row = theatre.page.locator(".run").filter(has_text="to_be_renamed")
    row.get_by_role("button", name="Look back").click()
    told = theatre.page.locator("[data-past-text]")
    expect(told).to_contain_text("no readable bag", timeout=SLOW_MS)
    theatre.page.locator(".past-note").get_by_role("button", name="Live").click()
    expect(theatre.page.locator("[data-past-text]")).to_be_hidden()
    answer = theatre.page.request.get(f"{theatre.address}/past.json?at=0&run=../runs")
    assert answer.status == 404 and "there is no recording" in answer.text()
