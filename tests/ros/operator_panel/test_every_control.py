"""Every control of the page, used by mouse in a real browser: each one does what it says.

The browser notes what is shown and what is used: a new control that nobody uses here fails.
"""

from __future__ import annotations

import re
import shutil

import pytest
from harness.page.acts import take_control
from harness.page.hand import Hand
from harness.page.recorded import write_recording
from harness.page.teaching import teach
from harness.page.theatre import SLOW_MS, Theatre, begin_exercise
from harness.running.thorough import thorough
from playwright.sync_api import expect
from scara_config import load_robot


@pytest.fixture(scope="module")
def theatre(theatre: Theatre, tmp_path_factory: pytest.TempPathFactory) -> Theatre:
    """Give a page with a recording and an exercise; its browser need not draw the model."""
    bag = write_recording(tmp_path_factory.mktemp("recording") / "run.bag", load_robot())
    shutil.copy(bag, theatre.runs / "to_be_renamed" / "run.bag")
    begin_exercise(theatre.runs)
    return theatre


def new_hand(theatre: Theatre) -> Hand:
    """Return a hand at a page in control that nobody has used."""
    if theatre.page.evaluate("() => 'controls' in window"):
        theatre.page.reload()
        expect(theatre.page.locator("[data-panel].shown")).to_be_visible()
    take_control(theatre.page)
    return Hand(theatre)


@pytest.mark.parametrize(
    ("size", "colours"),
    [
        ("phone", "light"),
        *thorough(
            *[("phone", "dark"), ("tablet", "light"), ("tablet", "dark"), ("low", "light")],
            *[("low", "dark"), ("wide", "light"), ("wide", "dark")],
        ),
    ],
)
def test_every_control_does_something_that_can_be_seen(
    theatre: Theatre, size: str, colours: str
) -> None:
    """At each size, light and dark; what is left over at the end is a control without a use.

    The views of the model, which this browser does not draw, are used in test_picture.py.
    """
    hand = new_hand(theatre)
    theatre.resize(size)
    theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
    (theatre.runs / "to_go").mkdir(exist_ok=True)
    (theatre.runs / "to_go" / "run.bag").write_bytes(b"x" * 2048)
    tabs = (charts, jog, target, programs, teach, robot, tuning, recordings, events)
    for use in (bar, picture, *tabs):
        theatre.play("ready")
        use(hand)
    commands(hand)
    exercise(hand)
    left = hand.left()
    assert not left, "\n".join(left)


def bar(hand: Hand) -> None:
    """Colours, what all alarms and links say, control and both stops."""
    theme = hand.page.locator(".theme")
    for words in ("light", "dark", "as the browser"):
        theme.click()
        expect(theme).to_have_attribute("aria-label", f"Colours: {words}")
    hand.look()
    for folded in (False, True):
        hand.page.locator(".alarms-line").click()
        expect(hand.page.locator(".alarms-all")).to_be_visible(visible=not folded)
    for stop in ("STOP", "ESTOP"):
        hand.page.locator(f"[data-stop={stop}]").click()
        expect(hand.page.locator(f"[data-stop-answer={stop}]")).to_have_text("confirmed")
    for answer in ("Keep", "Hand over"):
        hand.theatre.play("asked")
        banner = hand.page.locator(".banner-ask")
        expect(banner).to_be_visible()
        hand.look()
        hand.button(answer, banner).click()
        expect(banner).to_be_hidden()
        hand.theatre.play("ready")


def picture(hand: Hand) -> None:
    """Camera, and the time line."""
    hand.look()
    for shown in ("Both", "Camera", "Model"):
        tab = hand.page.get_by_role("tab", name=shown, exact=True)
        if tab.is_visible():
            hand.choose(tab)
    hand.theatre.remembered()
    hand.page.locator("[data-look-back]").click()
    text, line = hand.page.locator("[data-past-text]"), hand.page.locator("[data-time-line]")
    expect(text).to_contain_text("Past: ")
    hand.look()
    line.locator("[data-past-range]").click(position={"x": 10, "y": 10})
    moment = "() => window.panel.timeLine.at"
    for step in ("\N{MINUS SIGN}10 s", "\N{MINUS SIGN}1 s", "+1 s", "+10 s"):
        if not hand.button(step, line).is_visible():  # a low screen has room for some only
            continue
        hand.button(step, line).click()
        hand.page.wait_for_function("() => !window.panel.timeLine.asking")
    assert hand.page.evaluate(moment) is not None
    line.get_by_label("Time of day").fill("25:00")
    hand.button("Go", line).click()
    expect(hand.page.locator("[data-past-wrong]")).to_have_text(re.compile("is no time of day"))
    hand.button("Live").click()
    expect(line).to_be_hidden()


def charts(hand: Hand) -> None:
    """Which joint, which loop, which quantities, and a chart that stands still."""
    page = hand.page
    hand.choose(page.get_by_role("tab", name="Charts", exact=True))
    head = page.locator(".charts-head")
    hand.look()
    hand.switch(page.locator("[data-pause]"))
    for choice in head.get_by_role("tab").locator("visible=true").all():
        hand.choose(choice)
    hand.button("Choose", head).click()
    hand.look()
    place = page.locator("[data-plot-choice]")
    first, *others = place.locator("[data-plot]").all()
    hand.switch(first)
    for pick in others:  # more than fit into a chart: a further one takes the place of none
        if pick.is_disabled():
            hand.button("Clear", place).click()
        pick.click()
        expect(pick).to_have_attribute("aria-pressed", "true")
    hand.button("Clear", place).click()
    expect(place.locator("[aria-pressed=true]")).to_have_count(0)
    hand.button("Done", place).click()
    expect(place).to_be_hidden()


def jog(hand: Hand) -> None:
    """Held buttons move while they are held; steps are sent, or only shown."""
    panel = hand.panel("Jog")
    for way in ("Hold joint", "Hold tool"):
        hand.choose(panel.get_by_role("tab", name=way, exact=True))
        shown = panel.locator(".jog-way.shown")
        for tab in shown.get_by_role("tab").all():
            hand.choose(tab)
        for held in shown.locator(".jog-button:enabled").all():
            held.hover()
            hand.page.mouse.down()
            expect(held).to_have_class(re.compile(r"\bheld\b"))
            hand.page.mouse.up()
    hand.choose(panel.get_by_role("tab", name="Hold joint", exact=True))
    hand.slide(panel.locator("[data-jog-speed]"), panel.locator(".jog-speed-value"))
    for way in ("Step joint", "Step tool"):
        hand.choose(panel.get_by_role("tab", name=way, exact=True))
        shown = panel.locator(".jog-way.shown")
        for tab in shown.get_by_role("tab").all():
            hand.choose(tab)
        for step in shown.locator(".jog-button:enabled").all():
            words = str(step.get_attribute("aria-label"))
            hand.command(step, f"{words[:-1]}{words[-1]}10")
        only = shown.get_by_role("switch", name="Only preview")
        only.click()
        expect(only).to_have_attribute("aria-checked", "true")
        shown.locator(".jog-button").first.click()
        hand.judged()
        only.click()
    for way in ("Hold tool", "Step tool"):
        hand.choose(panel.get_by_role("tab", name=way, exact=True))
        shown = panel.locator(".jog-way.shown")
        turn = shown.get_by_role("button", name=re.compile(r"\bTurn Z"))
        if turn.first.is_disabled():
            expect(shown.locator(".jog-why")).to_contain_text("its twin has no joint_4")


def target(hand: Hand) -> None:
    """A position typed or picked, seen before it is sent; the gripper."""
    panel = hand.panel("Target")
    field = panel.get_by_label("X", exact=True)
    for pick in panel.locator(".target-picks button").all():
        pick.click()
        if pick.inner_text() == "Clear":
            expect(field).to_have_value("")
        else:
            expect(field).not_to_have_value("")
    panel.get_by_label("Speed", exact=True).fill("40")
    panel.get_by_label("Elbow").click()
    hand.page.get_by_role("option", name="Lefty").click()
    expect(panel.get_by_label("Elbow")).to_have_value("Lefty")
    for label, name in (("Way", "Line"), ("Frame", "1 pallet"), ("Tool", "1 suction cup")):
        panel.get_by_label(label, exact=True).click()
        hand.page.get_by_role("option", name=name, exact=True).click()
        expect(panel.get_by_label(label, exact=True)).to_have_value(name)
    panel.get_by_label("Tool speed", exact=True).fill("150")
    # The last field completes the point: no answer that is still on its way closes a preview.
    for axis in "XYZ":
        panel.get_by_label(axis, exact=True).fill("200")
    expect(panel.locator(".preview")).to_contain_text("Reachable")
    for name in ("Preview Move", "Preview Home"):
        hand.button(name, panel).click()
        hand.judged(plays=True)
    title = "Move in a line to x 200 y 200 z 200 mm in user frame 1 for tool frame 1"
    hand.command(hand.button("Move", panel), title, "done")
    for name in ("Grip", "Let go"):
        hand.command(hand.button(name, panel), name, "done")


def programs(hand: Hand) -> None:
    """Each program's lines, its preview, and Run after a question; the override."""
    panel = hand.panel("Programs")
    for row in panel.locator(".row-line", has=hand.page.locator(".row-name")).all():
        name = row.locator(".row-name").inner_text()
        hand.page.get_by_text(f"Lines of {name}", exact=True).click()
        expect(panel.locator(f'[data-program="{name}"]')).to_be_visible()
        hand.button(f"Preview {name}", row).click()
        hand.judged()
        question = hand.page.locator(".confirm")
        for answer in ("Cancel", f"Run {name}"):
            hand.button("Run", row).click()
            expect(question.locator(".verdict")).not_to_have_text("Judging ...")
            hand.look()
            if hand.button(answer, question).count():  # the gate refuses it: no button to run it
                hand.button(answer, question).click()
            else:
                hand.button("Cancel", question).click()
            expect(question).to_have_count(0)
    panel.locator(".q-field input").fill("60")
    hand.command(hand.button("Set", panel), "override 60")


def robot(hand: Hand) -> None:
    """Parts back after a question; registers, read and searched."""
    panel = hand.panel("Robot")
    expect(panel.locator('[data-live="status.mode"]')).to_have_text("automatic")
    question = hand.page.locator(".confirm")
    hand.button("Put back", panel).click()
    expect(question).to_be_visible()
    hand.look()
    hand.button("Cancel", question).click()
    expect(question).to_have_count(0)
    hand.button("Put back", panel).click()
    hand.command(hand.button("Put back", question), "Put parts back", "done")
    frames(hand)
    hand.button("Read", panel).click()
    registers = panel.locator(".register")
    expect(registers.nth(50)).to_be_attached()
    panel.get_by_label("Search").fill("imstp")
    expect(registers).to_have_count(2)
    expect(registers.first).to_contain_text("input signal 6001, raw 1: *IMSTP")
    assert hand.theatre.problems("registers") == []
    panel.get_by_label("Search").fill("")


def frames(hand: Hand) -> None:
    """Three points of a user frame: the stage's robot stands still, so they are refused."""
    panel = hand.panel("Robot")
    panel.get_by_text("User and tool frames").click()
    expect(panel.locator(".frame-list")).to_contain_text("user 1, pallet: X 50.0 Y -450.0 Z -40.0")
    said = panel.locator(".listing .preview")
    hand.button("Read the robot's", panel).click()
    expect(said).to_contain_text("UFRAME[1] (pallet): robot X 50 Y -450 Z -41.5; here X 50")
    hand.look()
    hand.command(hand.button("Take the robot's", panel), "allowed are 1 to 10", "refused")
    for label, name in (("Points", "User 3"), ("Number", "2")):
        panel.get_by_label(label, exact=True).click()
        hand.page.get_by_role("option", name=name, exact=True).click()
    panel.get_by_label("Name", exact=True).fill("box")
    hand.button("Record point", panel).click()
    expect(said).to_have_text("Point 2 of 3: on +x")
    hand.button("Begin again", panel).click()
    expect(said).to_have_text("Point 1 of 3: origin")
    for text in ("Point 2 of 3: on +x", "Point 3 of 3: in the plane, at +y", "the point for x is"):
        hand.button("Record point", panel).click()
        expect(said).to_contain_text(text)
    hand.command(hand.button("Save", panel), "the point for x is 0.0 mm off", "refused")
    assert hand.theatre.problems("frames") == []


def tuning(hand: Hand) -> None:
    """Another joint, other gains, what they would do, set and undone."""
    panel = hand.panel("Tuning")
    joint = panel.get_by_label("Joint", exact=True)
    form = panel.locator(".tuning")
    form.evaluate("form => { form.firstElementChild.dataset.before = ''; }")
    joint.click()
    hand.page.get_by_role("option", name="Joint 2").click()
    expect(joint).to_have_value("Joint 2")
    # The server makes the fields anew.
    expect(form.locator("[data-before]")).to_have_count(0)
    expect(form.locator(".q-field input").first).to_be_visible()
    fields = panel.locator(".tuning .q-field input")
    for field in fields.all():
        field.fill(field.input_value() + "1")
    box = panel.get_by_role("checkbox").first
    box.click()
    expect(box).to_have_attribute("aria-checked", "false")
    hand.button("Preview step", panel).click()
    expect(panel.locator(".preview").last).to_contain_text("Typed gains")
    for name, told in (("Set gains", "set"), ("Undo", "undone")):
        hand.button(name, panel).click()
        expect(panel.locator(".preview").last).to_have_text(told)


def recordings(hand: Hand) -> None:
    """Make one, look at it, its report, its file, its name, its end."""
    page, panel = hand.page, hand.panel("Recordings")
    panel.get_by_label("Name").fill("a_test")
    for name in ("Start", "Stop"):
        hand.command(hand.button(name, panel), "Recording")
    row = panel.locator(".run").filter(has_text="to_be_renamed")
    question = page.locator(".confirm")
    hand.button("Rename", row).click()
    hand.look()
    hand.button("Cancel", question).click()
    expect(question).to_have_count(0)
    hand.button("Rename", row).click()
    question.locator("input").fill("../out")
    hand.button("Rename", question).click()
    expect(question).to_contain_text("letters, digits")
    question.locator("input").fill("renamed")
    # The list is built again meanwhile, as while another run grows.
    with (hand.theatre.runs / "to_go" / "run.bag").open("ab") as bag:
        bag.write(b"x" * 1024)
    expect(panel.locator(".run").filter(has_text="to_go")).to_contain_text("3 kB")
    hand.button("Rename", question).click()
    row = panel.locator(".run").filter(has_text=re.compile("^renamed"))
    expect(row).to_be_visible()
    hand.button("Rename", row).click()
    question.locator("input").fill("to_be_renamed")
    hand.button("Rename", question).click()
    row = panel.locator(".run").filter(has_text="to_be_renamed")
    with page.expect_download() as download:
        row.get_by_text("Download").click()
    assert download.value.suggested_filename.endswith(".bag")
    assert download.value.path().read_bytes().startswith(b"#ROSBAG")
    other = panel.locator(".run").filter(has_text="to_go")
    expect(other).to_contain_text("3 kB")
    hand.look()
    hand.button("Make report", other).click()
    with page.expect_popup() as popup:
        other.get_by_text("Report", exact=True).click()
    expect(popup.value.locator("h1")).to_have_text("Report of the stage")
    popup.value.close()
    expect(other).to_contain_text("The recording is damaged. Not read: its end.")
    for answer in ("Cancel", "Delete for ever"):
        hand.button("Delete", other).click()
        hand.look()
        hand.button(answer, question).click()
        expect(question).to_have_count(0)
    expect(other).to_have_count(0)
    hand.button("Look back", row).click()
    expect(page.locator("[data-past-text]")).to_contain_text("after its start", timeout=SLOW_MS)
    page.locator(".past-note").get_by_role("button", name="Live").click()
    expect(page.locator("[data-past-text]")).to_be_hidden()


def events(hand: Hand) -> None:
    """Filters, acknowledgement of one and of all, the table; the last tab has no control."""
    hand.theatre.play("alarmed")
    panel = hand.panel("Events")
    rows = panel.locator(".event")
    for name in ("All", "Warnings, faults", "Not acknowledged"):
        hand.choose(panel.get_by_role("tab", name=name))
        if name != "All":
            expect(panel.locator(".event-info")).to_have_count(0)
    expect(rows.nth(1)).to_be_visible()
    one = hand.button("Acknowledge", panel).first
    number = one.get_attribute("data-acknowledge")
    one.click()
    expect(panel.locator(f'[data-acknowledge="{number}"]')).to_have_count(0)
    hand.button("Acknowledge all", panel).click()
    expect(rows).to_have_count(0)
    with hand.page.expect_download() as download:
        panel.get_by_text("Save as CSV").click()
    assert download.value.suggested_filename == "events.csv"
    table = download.value.path().read_text(encoding="utf-8")
    assert "came apart" in table and table.startswith("number,time,severity")
    hand.choose(panel.get_by_role("tab", name="All"))
    expect(panel.locator(".event-by").first).to_contain_text("Acknowledged by operator")
    parts = hand.panel("Today").locator('[data-live="today.parts"]')
    expect(parts).to_have_text("real 0, twin 0")


def commands(hand: Hand) -> None:
    """The speed cap, and the commands to the pair."""
    card = hand.page.locator(".commands-card")
    hand.slide(card.locator(".speed-slider"), card.locator(".speed-value"))
    hand.command(hand.button("Set", card), "Speed cap")
    hand.theatre.play("alarmed")  # a paused pair: all of them may be pressed
    for is_open in (True, False):
        hand.page.locator(".alarms-line").click()
        expect(hand.page.locator(".alarms-all")).to_be_visible(visible=is_open)
    for name in ("Pause", "Standstill", "Resume", "Reset", "Home", "Align", "Acknowledge"):
        hand.command(hand.button(name, card), name)
    hand.theatre.play("ready")


def exercise(hand: Hand) -> None:
    """The learner's card: a hint is offered once the one before it was opened."""
    card = hand.page.locator(".course-card")
    line = card.locator(".fold-line")
    expect(line).to_have_text(
        "Exercise 9. Teach a pallet, with <i>care</i>: not yet, 0 of 12 passed"
    )
    line.click()
    expect(card).to_contain_text("Not yet: a: x_mm = 1 is not within 0.1 of <b>the right value</b>")
    expect(card).to_contain_text('To teach is <img src="x" onerror="window.loaded = 1"> to show')
    assert card.locator("img, a, b, i").count() == 0, "what is no text of ours is shown as text"
    expect(card.locator("td")).to_have_count(3)
    for number in (1, 2):
        hint = card.locator(".hint-fold").nth(number - 1)
        expect(card.locator(".hint-fold").locator("visible=true")).to_have_count(number)
        hint.locator("summary").click()
        expect(hint.locator("li, p")).to_be_visible()
    line.click()
    expect(card.locator(".fold-all")).to_be_hidden()
