"""The course's exercise that is under way, as the page shows it; pure."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
from cell_recorder.journal.entries import CourseResult, CourseStarted
from scara_config.files.yaml_text import YamlTextError, parse

HINTS = "\n## Hints\n"


class CourseCard(msgspec.Struct, frozen=True):
    """What stands on the page.

    Attributes:
        line: What is seen while the card is folded.
        tone: good, warn, or empty before the first check.
        facts: Who, how far, and what the last check said; one line each.
        task: The card's text without its title and its hints, Markdown.
        hints: What is opened one at a time, Markdown.
    """

    line: str
    tone: str
    facts: tuple[str, ...]
    task: str
    hints: tuple[str, ...]


def course_card(
    learner: str,
    started: CourseStarted,
    text: str,
    answers: str,
    results: Sequence[CourseResult],
) -> CourseCard:
    """Return the card of an exercise.

    Args:
        learner: Who has started it.
        started: Which it is.
        text: Its card.md.
        answers: Its file of answers; empty: it has none.
        results: Of all learners, the oldest first.
    """
    own = [each for each in results if each.learner == learner]
    passed = len({each.exercise for each in own if each.passed})
    tries = [each for each in own if each.exercise == started.exercise]
    far = f"{passed} of {started.exercises} passed"
    verdict, tone = "not marked yet", ""
    if any(each.passed for each in tries):
        verdict, tone = "passed", "good"
    elif tries:
        verdict, tone = "not yet", "warn"
    facts = [f"{learner}: {far}", *written(answers)]
    if tries:
        last = tries[-1]
        times = "" if len(tries) == 1 else f" after {len(tries)} checks"
        facts.append(f"{'Passed' if last.passed else 'Not yet'}{times}: {last.reason}")
    task, _, hints = text.partition(HINTS)
    return CourseCard(
        f"Exercise {started.title}: {verdict}, {far}",
        tone,
        tuple(facts),
        task.partition("\n")[2].strip(),
        tuple(part.strip() for part in f"\n{hints.strip()}".split("\n- ") if part.strip()),
    )


def written(answers: str) -> list[str]:
    """Return how many answers a file of answers holds, in one line; none if it has none.

    Example:
        >>> written("answers: {a: {x_mm: 1.5, y_mm: }}")
        ['1 of 2 answers are written']
    """
    try:
        tree = parse(answers)
    except YamlTextError as error:
        # Whoever is just writing sees here what check would say.
        return [f"answers.yaml cannot be read: {error}"]
    rows = tree.get("answers") if isinstance(tree, dict) else None
    rows = rows.values() if isinstance(rows, dict) else ()
    values = [value for row in rows if isinstance(row, dict) for value in row.values()]
    there = sum(value not in (None, "") for value in values)
    return [f"{there} of {len(values)} answers are written"] if values else []
