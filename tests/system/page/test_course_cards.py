"""Cards of the course whose evidence is a recording, followed word by word on a whole cell.

Page, pendant and shell are used as the card says, with the numbers that stand on it; the check of
the recording then passes. Nothing is done that the card does not say.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell
from harness.page.acts import (
    cell_with_pages,
    is_mode,
    make_ready,
    patient_configuration,
    press,
    shown,
)
from harness.processes import ROSRUN, Process, wait_until
from harness.wires.browser import LOAD_MS, chromium
from harness.workspace import ROOT
from playwright.sync_api import Page, expect
from scara_course.exercises_io import load_exercises

pytestmark = [pytest.mark.system, pytest.mark.thorough]

CARDS = {
    each.task.number: each.card for each in load_exercises(ROOT / "src/scara_course/exercises")
}
RUN_MS = 120_000
"""For a program, on a machine that does other things too."""
MOVES_DEG = 5.0
LOOKS_S = 1.0
"""So long a person looks at what stands."""
TEACH = '[data-panel="Teach"]'


class Learner:
    """Somebody with a cell, both pages beside each other, and a shell."""

    def __init__(self, cell: LiveCell, page: Page, pendant: Page) -> None:
        """Sit down."""
        self.cell, self.page, self.pendant = cell, page, pendant

    def begin(self, number: int) -> None:
        """Start an exercise; its card is shown. The pair is ready, whatever was before."""
        make_ready(self.page)
        said = self.course("start", str(number))
        assert said.wait(60.0) == 0, said.output

    def course(self, *words: str) -> Process:
        """Type a line of the course."""
        where = ("--learner", "anna", "--runs", str(self.cell.folder))
        return self.cell.stage.start(ROSRUN, "scara_course", "course", *words, *where)

    def check(self, number: int) -> None:
        """Have it marked: it has passed."""
        marked = self.course("check", str(number))
        code = marked.wait(120.0)
        print(marked.output)
        assert code == 0, marked.output

    def tab(self, name: str) -> None:
        """Open a tab."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def record(self, button: str) -> None:
        """Press Start or Stop in the tab Recordings."""
        self.tab("Recordings")
        place = self.page.locator('[data-panel="Recordings"]')
        place.get_by_role("button", name=button, exact=True).click()
        word = "Recorder: " + ("recording" if button == "Start" else "not recording")
        expect(place).to_contain_text(word)

    def at_pendant(self, key: str) -> None:
        """Press a key of the pendant."""
        self.pendant.get_by_role("button", name=key, exact=True).click()

    def article_moves(self) -> None:
        """Press ARTICLE on the pendant, and wait until both move."""
        self.at_pendant("ARTICLE")
        is_mode(self.page, "Real robot leads")
        for side in ("real", "twin"):
            start = shown(self.page, f"joint_2.{side}")
            wait_until(
                lambda side=side, start=start: (
                    abs(shown(self.page, f"joint_2.{side}") - start) > MOVES_DEG
                ),
                20.0,
                f"motion of {side}",
            )

    def ready(self) -> None:
        """Wait until the page says that the pair is ready."""
        is_mode(self.page, "Ready", RUN_MS)

    def stands(self, mode: str) -> None:
        """Wait until both stand in this mode, and a second longer, as somebody does who looks."""
        is_mode(self.page, mode)
        expect(self.page.locator('[data-live="motion"]')).to_have_text("both stand still")
        time.sleep(LOOKS_S)

    def align(self) -> None:
        """Press Align, and wait until the pair is ready."""
        press(self.page, "Align")
        self.ready()

    def payload(self, service: str, request: str) -> None:
        """Type a line of the shell while nobody is in control: the robot goes with the twin."""
        nobody = self.page.locator(".control-text")
        expect(nobody).to_have_text("Nobody is in control", timeout=RUN_MS)
        assert self.cell.call(service, request)["success"]
        time.sleep(LOOKS_S)
        self.ready()

    def article(self) -> None:
        """Let ARTICLE run to its end."""
        self.article_moves()
        self.ready()

    def run_listed(self, program: str) -> None:
        """Press Run beside a program in the tab Programs, confirm, and wait for its end."""
        self.tab("Programs")
        row = self.page.locator('[data-panel="Programs"] .row-line', has_text=program)
        row.get_by_role("button", name="Run", exact=True).click()
        self.page.get_by_role("button", name=f"Run {program}", exact=True).click()
        is_mode(self.page, "Real robot leads")
        self.ready()

    def saved(self) -> None:
        """Press Judge all, which refuses nothing, and Save."""
        teach = self.page.locator(TEACH)
        teach.get_by_role("button", name="Judge all", exact=False).click()
        expect(teach.locator("[data-teach-line] .verdict").first).to_be_visible(timeout=RUN_MS)
        assert teach.locator(".verdict.bad").count() == 0
        press(self.page, "Save")
        expect(teach.locator(".teach-said")).to_contain_text("saved")


@pytest.fixture(scope="module")
def learner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Learner]:
    """Start a cell as `./cell up` does, and open both addresses that it prints."""
    folder = tmp_path_factory.mktemp("cell")
    config = patient_configuration(folder / "patient")
    with (
        cell_with_pages(folder, env={"SCARA_CONFIG_DIR": str(config)}) as (cell, started, _),
        chromium(tmp_path_factory.mktemp("browser")) as browser,
    ):
        addresses = re.findall(r"http://127\.0\.0\.1:\d+/\?token=[\w-]+", started.output)
        pages = []
        for address in addresses[:2]:
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.goto(address, timeout=LOAD_MS)
            pages.append(page)
        expect(pages[0].locator("[data-panel].shown")).to_be_visible(timeout=LOAD_MS)
        is_mode(pages[0], "Ready", RUN_MS)
        made = Learner(cell, *pages)
        made.at_pendant("100 %")
        yield made


def test_stop_and_recover(learner: Learner) -> None:
    """Exercise 6: STOP, Align, E-STOP, Reset, Align, and a whole run."""
    learner.begin(6)
    learner.record("Start")
    learner.article_moves()
    press(learner.page, "STOP")
    learner.stands("Stopped")
    learner.align()
    learner.article_moves()
    press(learner.page, "E-STOP")
    learner.stands("Emergency stop")
    press(learner.page, "Reset")
    is_mode(learner.page, "Stopped")
    learner.align()
    learner.article()
    learner.record("Stop")
    learner.check(6)


def test_teach_a_pallet(learner: Learner) -> None:
    """Exercise 9: the numbers of the card's table are typed as they stand there."""
    learner.begin(9)
    rows = re.findall(r"^\| \d \| (.*?) \| (.*?) \|$", CARDS[9], re.MULTILINE)
    assert len(rows) == 3
    page, teach = learner.page, learner.page.locator(TEACH)
    learner.tab("Robot")
    press(page, "Put back")
    page.locator(".q-dialog").get_by_role("button", name="Put back", exact=True).click()
    learner.tab("Teach")
    for button, places in zip(("Pick", "Place"), zip(*rows)):
        teach.get_by_label("Places", exact=True).fill("\n".join(places))
        press(page, button)
        expect(teach.locator(".teach-said")).to_have_text("Places used: 3")
    teach.get_by_label("Program", exact=True).fill("MINE")
    press(page, "Rename")
    learner.saved()
    learner.record("Start")
    learner.run_listed("MINE")
    learner.record("Stop")
    learner.check(9)


def test_shorten_a_cycle(learner: Learner) -> None:
    """Exercise 10: quicker joints and shorter waits, nothing else."""
    learner.begin(10)
    page, teach = learner.page, learner.page.locator(TEACH)
    learner.tab("Teach")
    with page.expect_file_chooser() as chooser:
        press(page, "Import")
    (file,) = re.findall(r"`(config/robots/\S+\.LS)`", CARDS[10])
    chooser.value.set_files(ROOT / file)
    expect(teach.locator(".teach-said")).to_contain_text("is the draft now")
    teach.get_by_label("Program", exact=True).fill("QUICK")
    press(page, "Rename")
    lines = teach.locator("[data-teach-line]")
    count = lines.count()
    for k in range(count):
        text = lines.nth(k).inner_text()
        if "J P" in text:
            lines.nth(k).click()
            teach.get_by_label("Speed J", exact=True).fill("70")
            press(page, "Set speed")
            expect(lines.nth(k)).to_contain_text("70%")
        elif "WAIT" in text:
            lines.nth(k).click()
            teach.get_by_label("Seconds", exact=True).fill("0.2")
            press(page, "Wait")
            expect(lines).to_have_count(count + 1)
            lines.nth(k).click()
            press(page, "Delete")
            expect(lines).to_have_count(count)
    learner.saved()
    learner.record("Start")
    learner.run_listed("ARTICLE")
    learner.run_listed("QUICK")
    learner.record("Stop")
    learner.check(10)


def test_a_wrong_payload(learner: Learner) -> None:
    """Exercise 11: the shell's lines as they are printed, before each run."""
    learner.begin(11)
    lines = re.findall(r"`rosservice call (/twin/payload/\w+) \"(.*?)\"`", CARDS[11])
    assert [name.rsplit("/")[-1] for name, _ in lines] == ["mount", "set", "set", "set"]
    mount, tell, wrong, right = lines
    learner.record("Start")
    learner.payload(*mount)
    learner.payload(*tell)
    learner.article()
    learner.payload(*wrong)
    learner.at_pendant("ARTICLE")
    is_mode(learner.page, "Real robot leads")
    mode = learner.page.locator('[data-live="mode"]')
    expect(mode).to_have_text(re.compile("Ready|Fault"), timeout=RUN_MS)
    if mode.inner_text() == "Ready":
        learner.payload(*right)
    else:
        assert learner.cell.call(*right)["success"]
        press(learner.page, "Reset")
        is_mode(learner.page, "Stopped")
        learner.align()
    learner.article()
    learner.record("Stop")
    learner.check(11)
