"""Checks that what an operator types is a number; others check whether it can be done."""

from __future__ import annotations

import math
import re

from operator_panel.runs import BESIDE

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class FieldError(ValueError):
    """What was typed cannot be used; the text stands beside the field."""


def parse_number(
    text: object, what: str, unit: str, lower: float = -math.inf, upper: float = math.inf
) -> float:
    """Return the number in ``text``.

    Args:
        text: What the field holds.
        what: Name of the field, for the error.
        unit: Its unit, for the error.
        lower: Smallest allowed value.
        upper: Largest allowed value.

    Raises:
        FieldError: It is empty, no number, not finite, or out of range.
    """
    # The page shows negative numbers with a true minus sign, which comes back when one is copied.
    typed = str(text if text is not None else "").strip().replace("\N{MINUS SIGN}", "-")
    if not typed:
        raise FieldError(f"{what} is empty: a number in {unit}")
    if "," in typed:
        raise FieldError(f"{typed}: write the decimal with a point")
    try:
        value = float(typed)
    except ValueError as error:
        raise FieldError(f"{typed!r} is no number") from error
    if not math.isfinite(value):
        raise FieldError(f"{typed} is no finite number")
    if not lower <= value <= upper:
        raise FieldError(f"{typed} {unit} is outside {lower:g} to {upper:g} {unit}")
    return value


def parse_run_name(text: object) -> str:
    """Return the name of a recording; empty means that the recorder chooses one.

    Raises:
        FieldError: It could leave the folder of runs, has signs that a folder should not have, or
            is that of a folder in which others keep something.
    """
    typed = str(text if text is not None else "").strip()
    if typed and not NAME.fullmatch(typed):
        raise FieldError(
            "letters, digits, point, dash and underline only, 64 at most, a letter or digit first"
        )
    if typed in BESIDE:
        raise FieldError(f"{typed}: others keep things in that folder: choose another name")
    return typed


def error_text(check: object) -> str | None:
    """Return the text of the FieldError that calling ``check`` raises, None if it raises none."""
    try:
        check()  # type: ignore[operator]
    except FieldError as error:
        return str(error)
    return None
