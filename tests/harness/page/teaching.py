"""Every control of the Teach tab, used by mouse: lines, places, files and both ways to run."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, expect

from harness.page.hand import Hand


def teach(hand: Hand) -> None:
    """Lines are added, changed, tried, taken away as a file and brought in again."""
    page, panel = hand.page, hand.panel("Teach")
    lines, said = panel.locator("[data-teach-line]"), panel.locator(".teach-said")
    page.request.get(f"{hand.theatre.address}/begin")
    expect(lines).to_have_count(count := 1)
    typed = {"Speed J": "40", "Speed L": "150", "CNT": "50", "Seconds": "0.1", "Rounds": "2"}
    for label, text in {**typed, "From line": str(count), "Program": "MINE"}.items():
        panel.get_by_label(label, exact=True).fill(text)
    for name in ("Rename", "Record J", "Record L", "Add grip", "Add let go", "Wait", "Loop"):
        before = panel.locator(".teach-lines").inner_html()
        hand.button(name, panel).click()
        if name == "Rename":
            expect(panel.get_by_label("Program", exact=True)).to_have_value("MINE")
        else:
            expect(lines).not_to_have_count(count)
            _until_changed(hand, before)
    _palletise(hand, panel)
    panel.get_by_label("Name or remark", exact=True).fill("begin")
    lines.first.click()
    for name in ("Note", "Down", "Up", "Delete", "Undo", "Redo"):
        before = panel.locator(".teach-lines").inner_html()
        hand.button(name, panel).click()
        _until_changed(hand, before)
        hand.look()
        if name == "Note":
            lines.nth(1).click()
            expect(lines.nth(1)).to_have_attribute("aria-pressed", "true")
    motion_line = lines.filter(has_text=" P[").first
    motion_line.click()
    for name in ("Touch up", "Set speed"):
        hand.button(name, panel).click()
        expect(said).not_to_contain_text("no line")
    hand.command(hand.button("Go to line", panel), "of MINE", "done", "running")
    for name in ("Step", "Step back"):
        hand.command(hand.button(name, panel), "of MINE", "done", "running")
    hand.button("Judge all of the draft", panel).click()
    expect(lines.locator(".verdict").first).to_be_visible()
    hand.button("Preview of the draft", panel).click()
    hand.judged()
    with page.expect_download() as download:
        panel.get_by_text("Export", exact=True).click()
    assert download.value.suggested_filename == "MINE.LS"
    file = hand.theatre.runs.parent / "MINE.LS"
    download.value.save_as(file)
    panel.get_by_label("Positions").click()
    page.get_by_role("option", name="Joints", exact=True).click()
    with page.expect_download() as other:
        hand.button("Export as", panel).click()
    assert other.value.suggested_filename == "MINE.LS"
    expect(said).to_contain_text("MINE.LS was handed out. P[1] stays in joints")
    with page.expect_file_chooser() as chooser:
        hand.button("Import", panel).click()
    chooser.value.set_files(file)
    expect(said).to_contain_text("is the draft now")
    question = page.locator(".confirm")
    for answer in ("", "Cancel", "Replace"):
        hand.button("Save", panel).click()
        if answer:
            hand.look()
            hand.button(answer, question).click()
            expect(question).to_have_count(0)
        else:
            expect(said).to_contain_text(re.compile(r"^MINE\.LS: saved, RSR\d"))
    row = page.locator('[data-panel="Programs"] .row-name').filter(has_text="MINE")
    expect(row).to_have_count(1)
    for answer in ("Cancel", "Run the draft"):
        hand.button("Run", panel).click()
        expect(question.locator(".verdict")).to_contain_text("OK")
        hand.look()
        hand.button(answer, question).click()
        expect(question).to_have_count(0)
    expect(said).to_contain_text(re.compile("not so within|only the robot"), timeout=20_000)


def _palletise(hand: Hand, panel: Locator) -> None:
    """Places are taken and typed, a grid spans two of them, lines go through them."""
    places, said = panel.get_by_label("Places", exact=True), panel.locator(".teach-said")
    for name in ("Take twin", "Take real"):
        hand.button(name, panel).click()
    expect(places).to_have_value(re.compile(r".+\n.+"))
    hand.button("In picture", panel).click()
    expect(said).to_contain_text("this browser does not draw the picture")
    hand.button("Clear", panel).click()
    expect(places).to_have_value("")
    columns = {"Rows": "1", "Columns": "2", "Pitch x": "30", "Pitch y": "0", "Above": "20"}
    for label, text in columns.items():
        panel.get_by_label(label, exact=True).fill(text)
    for name in ("Pick", "Place"):
        places.fill("-100 400 50")
        hand.button("Grid", panel).click()
        expect(said).to_have_text("2 places, all within reach.")
        hand.look()
        hand.button(name, panel).click()
        expect(said).to_have_text("Places used: 2")
    hand.button("Record J", panel).click()
    expect(said).to_contain_text("Recorded where")
    # The lines are drawn anew with the page's next look, behind what is said.
    chosen = panel.locator('[data-teach-line][aria-pressed="true"]')
    expect(chosen).to_have_text(re.compile(r"J P\[\d+"))
    line = chosen.get_attribute("data-teach-line")
    panel.get_by_label("From line", exact=True).fill(str(line))
    places.fill("0 0 0\n900 0 0")
    hand.button("Repeat", panel).click()
    expect(said).to_contain_text("Repeat: P[")
    places.fill("0 0 0\n30 0 0")
    hand.button("Repeat", panel).click()
    expect(said).to_have_text("Places used: 2")


def _until_changed(hand: Hand, before: str) -> None:
    """Wait until the lines of the draft are others than before."""
    hand.page.wait_for_function(
        "before => document.querySelector('.teach-lines').innerHTML !== before", arg=before
    )
