"""What a learner answers, and how it is marked: tables of numbers and words, and one verdict.

A table has rows; a row has named values. The end of a name is its unit, and the unit says how near
a number must be (``ALLOWED``). Words are compared without case.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import msgspec
from scara_config.files.yaml_text import YamlTextError, parse

Value: TypeAlias = float | str
Table: TypeAlias = dict[str, dict[str, Value]]

ALLOWED = {
    "_deg": 0.05,
    "_mm": 0.1,
    "_mm_s": 1.0,
    "_m": 0.001,
    "_m2": 0.001,
    "_s": 0.02,
    "_ms": 1.0,
}
"""By unit: so far a number may be from the right one. Our choice: the last digit that the robot's
display shows, and what rounding on the way to it loses."""
EXACT = 1e-9
"""For what is counted, and for what has no unit."""


class ExerciseMark(msgspec.Struct, frozen=True):
    """What came of an exercise.

    Attributes:
        passed: Whether it counts.
        reason: Why, in one sentence with numbers.
    """

    passed: bool
    reason: str


class AnswerError(ValueError):
    """The answers cannot be marked; the text says what to write where."""


def answers_text(title: str, learner: str, given: Table, blank: Table, command: str) -> str:
    """Return the file that a learner fills in.

    Args:
        title: Of the exercise.
        learner: Whose numbers these are.
        given: The numbers of the task; empty: they stand in other files.
        blank: Rows and names of the answers; their values are left out.
        command: What marks the file.
    """
    lines = [f"# {title}"]
    lines.append("# Write each answer after its colon and a space, as in NAME: -12.34")
    lines.append(f"# Save this file; then, in the folder of your clone: {command}")
    lines.append(f"learner: {_word(learner)}")
    for section, table in (("given", given), ("answers", blank)):
        if table:
            lines.append(f"{section}:")
        for row, values in table.items():
            lines.append(f"  {row}:")
            for name, value in values.items():
                lines.append(f"    {name}:" + (f" {_word(value)}" if section == "given" else ""))
    return "\n".join(lines) + "\n"


def _word(value: Value) -> str:
    """Return a value as YAML writes it: JSON is part of it."""
    return msgspec.json.encode(value).decode()


def read_answers(text: str, learner: str, given: Table, wanted: Table) -> Table:
    """Return the answers of a file that was filled in.

    Args:
        text: The file.
        learner: Whose it must be.
        given: The numbers of this learner's task; empty: the file shows none.
        wanted: Rows and names that must be there, each with a value of the same kind.

    Raises:
        AnswerError: It is no YAML, somebody else's, its task was changed, or an answer is missing
            or no such value.
    """
    try:
        tree = parse(text)
    except YamlTextError as error:
        raise AnswerError(
            f"the file cannot be read: {error}; a space stands behind each colon"
        ) from error
    if not isinstance(tree, dict) or not isinstance(tree.get("answers"), dict):
        raise AnswerError("the file has no section `answers`: start the exercise again")
    if tree.get("learner") != learner:
        raise AnswerError(f"the file is of {tree.get('learner')!r}, not of {learner!r}: use yours")
    if given and tree.get("given") != given:
        raise AnswerError("the numbers under `given` are not yours: start the exercise again")
    return {
        row: {name: _answer(tree["answers"], row, name, right) for name, right in values.items()}
        for row, values in wanted.items()
    }


def _answer(tree: Mapping[str, Any], row: str, name: str, right: Value) -> Value:
    """Return one answer as a value of the kind of the right one."""
    values = tree.get(row)
    value = values.get(name) if isinstance(values, dict) else None
    if value is None or value == "":
        raise AnswerError(f"{row}: {name} is empty: write your answer after its colon")
    if isinstance(right, str):
        return str(value)
    # To Python true is the number 1.
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise AnswerError(f"{row}: {name} = {value!r} is no number: write one like -12.34")
    return float(value)


def mark_table(answers: Table, wanted: Table, mistakes: Mapping[str, Table]) -> ExerciseMark:
    """Compare answers with the right ones.

    Args:
        answers: As :func:`read_answers` returns them.
        wanted: The right ones.
        mistakes: By what somebody did wrong, in words: the answers that come of it. The one that
            explains a wrong row is named.
    """
    wrong = list(_differences(answers, wanted))
    if not wrong:
        count = sum(len(values) for values in wanted.values())
        return ExerciseMark(True, f"all {count} answers are right")
    row, _, text = wrong[0]
    here = {name for at, name, _ in wrong if at == row}
    # What fits the whole file best explains it, if it explains the first wrong row.
    fits: list[tuple[int, int, str]] = []
    for what, table in mistakes.items():
        left = list(_differences(answers, table))
        if here.isdisjoint(name for at, name, _ in left if at == row):
            fits.append((len(left), len(fits), what))
    hint = f": {min(fits)[2]}" if fits else ""
    return ExerciseMark(False, f"{text}{hint} ({len(wrong)} wrong in all)")


def _differences(answers: Table, wanted: Table) -> Iterator[tuple[str, str, str]]:
    """Yield row, name and words for each answer that is too far from the wanted one.

    The words do not say how far: who knows that knows the answer.
    """
    for row, values in wanted.items():
        for name, right in values.items():
            given = answers.get(row, {}).get(name)
            if isinstance(right, str) or not isinstance(given, (int, float)):
                if str(given).strip().lower() != str(right).strip().lower():
                    yield row, name, f"{row}: {name} = {given} is not right"
                continue
            off, most = given - right, allowed(name)
            if name.endswith("_deg"):
                # An angle that is a whole turn more is the same direction.
                off = math.remainder(off, 360.0)
            # An answer that is off by just as much as allowed may be more by rounding; NaN fails.
            if not abs(off) <= most * (1.0 + 1e-9):
                near = f"within {most:g} of the right value" if most > EXACT else "right"
                yield row, name, f"{row}: {name} = {given:.6g} is not {near}"


def allowed(name: str) -> float:
    """Return how far a number of this name may be from the right one.

    Example:
        >>> allowed("x_mm"), allowed("stops")
        (0.1, 1e-09)
    """
    # The longest first: `_mm_s` ends in `_s` too.
    units = (unit for unit in sorted(ALLOWED, key=len, reverse=True) if name.endswith(unit))
    return ALLOWED.get(next(units, ""), EXACT)
