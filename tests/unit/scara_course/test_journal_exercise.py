"""Exercise 12: what `./cell why` tells of the morning answers it; other answers are refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from cell_recorder.journal.why_node import app as why
from harness.course import LEARNER, exercise, handed_in, marked, material, robot
from scara_course.exercises_io import ANSWERS, start
from typer.testing import CliRunner


def said(folder: Path, *words: str) -> str:
    """Ask ./cell why."""
    done = CliRunner().invoke(why, ["--runs", str(folder), "--since", "1", *words])
    assert done.exit_code == 0, done.output
    return done.output


def by_card(folder: Path, learner: str = LEARNER) -> dict[str, Any]:
    """Follow the card: what the commands print is all that is used."""
    for name, text in material(12, learner).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    stops = said(folder, "--stops")
    count = re.search(r"(\d+) stops? in", stops)
    assert count is not None
    waits = [
        int(minutes or 0) * 60 + float(seconds)
        for minutes, seconds in re.findall(r"went on after (?:(\d+) min )?([\d.]+) s", said(folder))
    ]
    people = re.findall(r"\(asked by (\w+)\)[^\n]*went on", said(folder))
    cycles = [json.loads(line) for line in said(folder, "--kind", "cycle", "--json").splitlines()]
    audit = [json.loads(line) for line in said(folder, "--kind", "audit", "--json").splitlines()]
    alarm = re.search(r"after ([\d.]+) s", said(folder, "--kind", "alarm"))
    assert alarm is not None
    return {
        "stops": int(count[1]),
        "first_stopped_by": people[0],
        "longest_stop_s": max(waits),
        "refused": sum(not each["success"] for each in audit),
        "alarm_s": float(alarm[1]),
        "parts_placed": sum(each["parts_placed"] for each in cycles),
        "worst_mm": max(each["worst_error_mm"] for each in cycles),
    }


@pytest.mark.parametrize("learner", [LEARNER, *(f"learner_{k}" for k in range(12))])
def test_the_commands_on_the_card_answer_it(learner: str, tmp_path: Path) -> None:
    """For many learners' mornings."""
    answers = {"journal": by_card(tmp_path, learner)}
    mark = marked(12, handed_in(12, answers, learner), learner)
    assert mark.passed, mark.reason


def test_the_folder_on_the_card_holds_the_journal(tmp_path: Path) -> None:
    """FOLDER is where `start` writes the answers."""
    written = start(exercise(12), LEARNER, robot(), tmp_path, anew=False)
    (answers,) = (path for path in written if path.name == ANSWERS)
    assert re.search(r"\d+ stops? in", said(answers.parent, "--stops"))
    card = " ".join(exercise(12).card.split())
    assert f"for FOLDER write the folder of your {ANSWERS}" in card


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return one learner's right answers."""
    return by_card(tmp_path_factory.mktemp("journal"))


@pytest.fixture(scope="module")
def held() -> list[dict[str, Any]]:
    """Return the entries of that learner's journal."""
    (text,) = material(12).values()
    return [json.loads(line) for line in text.splitlines()]


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        (
            "stops",
            lambda e, a: sum(x.get("event") == "STOP" for x in e),
            "a pause and a lost link",
        ),
        ("stops", lambda e, a: sum(x["kind"] == "decision" for x in e), "not every decision"),
        ("stops", lambda e, a: a["stops"] + 1, "journal: stops = "),
        (
            "first_stopped_by",
            lambda e, a: "li" if a["first_stopped_by"] != "li" else "maria",
            "first_stopped_by = ",
        ),
        ("longest_stop_s", lambda e, a: a["longest_stop_s"] / 60.0, "seconds, not minutes"),
        ("longest_stop_s", lambda e, a: a["longest_stop_s"] + 2.0, "longest_stop_s = "),
        ("refused", lambda e, a: sum(x["kind"] == "audit" for x in e), "what was obeyed"),
        (
            "parts_placed",
            lambda e, a: sum(
                x["parts_placed"] + x["parts_dropped"] for x in e if x["kind"] == "cycle"
            ),
            "dropped parts",
        ),
        (
            "parts_placed",
            lambda e, a: sum(
                x["parts_placed"] for x in e if x["kind"] == "cycle" and x["outcome"] == "done"
            ),
            "those that were stopped too",
        ),
        (
            "worst_mm",
            lambda e, a: [x for x in e if x["kind"] == "cycle"][-1]["worst_error_mm"],
            "not the last one's",
        ),
        ("alarm_s", lambda e, a: 0.0, "alarm_s = 0 is not within"),
        ("alarm_s", lambda e, a: "long", "alarm_s = 'long' is no number"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_other_answers_are_refused(
    name: str, change: Any, reason: str, held: list[dict[str, Any]], right: dict[str, Any]
) -> None:
    """Each for its own reason."""
    answers = {**right, name: change(held, right)}
    mark = marked(12, handed_in(12, {"journal": answers}))
    assert not mark.passed and re.search(reason, mark.reason), mark.reason
