"""The course's exercise: a line while one is under way, which opens onto its task and hints."""

from __future__ import annotations

import time
from pathlib import Path

import msgspec
from cell_recorder.journal.course_results_io import RESULTS, STARTED, signed_results
from cell_recorder.journal.entries import CourseStarted
from nicegui import run, ui
from scara_ros.page.page_library_io import plain

from operator_panel.view.course import CourseCard, course_card

REFRESH_S = 3.0
"""As often as the list of recordings."""
SHOWN_S = 12.0 * 3600.0
"""Our choice: an exercise that nobody has touched for so long is not under way."""


def build_course(runs: Path) -> None:
    """Build the card; nothing is seen of it while no exercise is under way."""
    _Course(runs)


class _Course:
    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._shown: CourseCard | None = None
        with ui.element("details").classes("card fold-card course-card") as self._card:
            with ui.element("summary").classes("fold-line"):
                self._line = ui.label("").classes("course-words")
            with ui.element("div").classes("fold-all course-all"):
                self._facts = ui.element("div").classes("course-facts")
                self._task = ui.element("div").classes("course-task")
        self._card.set_visibility(False)
        ui.timer(REFRESH_S, self._look)
        ui.timer(0.1, self._look, once=True)

    async def _look(self) -> None:
        found = await run.io_bound(read_course, self._runs, time.time())
        if found == self._shown:
            return
        before, self._shown = self._shown, found
        self._card.set_visibility(found is not None)
        if found is None:
            return
        self._line.set_text(found.line)
        self._card.props(f'data-is="{found.tone}"')
        self._facts.clear()
        with self._facts:
            for fact in found.facts:
                plain(fact, "", "p")
        # Left alone while it is read: hints that were opened stay open.
        if before is None or (before.task, before.hints) != (found.task, found.hints):
            self._task.clear()
            with self._task:
                _markdown(found.task)
                for number, hint in enumerate(found.hints, 1):
                    with ui.element("details").classes("listing hint-fold"):
                        plain(f"Hint {number} of {len(found.hints)}", "", "summary")
                        _markdown(hint)


def read_course(runs: Path, now: float) -> CourseCard | None:
    """Return the exercise that was started last in this folder of runs; None: none is under way.

    Args:
        runs: The folder.
        now: Unix time [s].
    """
    results = runs / RESULTS
    begun = {path.stat().st_mtime: path for path in results.parent.glob(f"*/{STARTED}")}
    if not begun:
        return None
    path = begun[max(begun)]
    try:
        started = msgspec.json.decode(path.read_bytes(), type=CourseStarted)
        place = path.with_name(Path(started.exercise).name)
        text = (place / "card.md").read_text(encoding="utf-8")
        written = place / "answers.yaml"
        answers = written.read_text(encoding="utf-8") if written.exists() else ""
        lines = signed_results(results.read_bytes()) if results.exists() else []
    except (OSError, ValueError):
        return None  # what is wrong with its files the course itself says
    touched = [*begun, *(each.time for each in lines)]
    touched += [written.stat().st_mtime] if answers else []
    if now - max(touched) > SHOWN_S:
        return None
    return course_card(path.parent.name, started, text, answers, lines)


def _markdown(text: str) -> None:
    """Show a text of a file: what is HTML in it is shown as it stands, and nothing is loaded."""
    # Slow to load, and seldom needed.
    from markdown_it import MarkdownIt

    rules = MarkdownIt("commonmark", {"html": False}).enable("table").disable(["image", "link"])
    ui.html(rules.render(text), sanitize=True)
