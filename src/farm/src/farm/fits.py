"""What was fitted to a cell's recordings of a day, and the figures of it that may drift; pure."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence
from datetime import date, datetime, time, tzinfo

import msgspec


class Fitted(msgspec.Struct, frozen=True):
    """What ``fit_twin --json`` prints.

    Attributes:
        friction: Of each joint that moved [N m], prismatic [N].
        units: Of each of them.
        rms_mm: Error of the twin's tool on the part that was not fitted, before and after.
        delay_ms: From a position until the robot's register shows it; None: cannot be seen.
    """

    friction: dict[str, float]
    units: dict[str, str]
    rms_mm: tuple[float, float]
    delay_ms: float | None = None


class DayFit(msgspec.Struct, frozen=True):
    """What was fitted to the recordings of a cell of one day.

    Attributes:
        machine, cell: Whose.
        day: As 2026-11-22, of the machine that has fitted.
        recordings: How many.
        figures: Name with unit, and the median of all recordings.
    """

    machine: str
    cell: str
    day: str
    recordings: int
    figures: dict[str, float]


def of_day(machine: str, cell: str, day: date, fits: Sequence[Fitted]) -> DayFit:
    """Return the medians of a cell's fits of a day.

    Example:
        >>> fit = Fitted({"joint_2": 0.5}, {"joint_2": "N m"}, (1.0, 0.5))
        >>> of_day("pc", "milk", date(2026, 11, 22), [fit]).figures
        {'error before the fit [mm]': 1.0, 'fitted friction joint_2 [N m]': 0.5}
    """
    values: dict[str, list[float]] = {}
    for fit in fits:
        figures_of_it = {
            f"fitted friction {joint} [{fit.units[joint]}]": value
            for joint, value in fit.friction.items()
        }
        figures_of_it["error before the fit [mm]"] = fit.rms_mm[0]
        if fit.delay_ms is not None:
            figures_of_it["fitted delay [ms]"] = fit.delay_ms
        for name, value in figures_of_it.items():
            values.setdefault(name, []).append(value)
    figures = {name: statistics.median(found) for name, found in sorted(values.items())}
    return DayFit(machine, cell, day.isoformat(), len(fits), figures)


def chosen(
    listed: Mapping[str, tuple[float, int]], day: date, zone: tzinfo | None, most: int, largest: int
) -> list[str]:
    """Return the recordings of a day that are fitted: the newest, and none that is too long.

    Args:
        listed: Name, with when it was changed last [s since 1970] and its size [bytes].
        day: Which.
        zone: In which days are counted; None: this machine's.
        most: So many at most.
        largest: Larger ones are left out [bytes].
    """
    of_it = [
        (changed, name)
        for name, (changed, size) in listed.items()
        if size <= largest and datetime.fromtimestamp(changed, zone).date() == day
    ]
    return [name for _, name in sorted(of_it, reverse=True)[:most]]


def points(fits: Iterable[DayFit]) -> list[tuple[str, str, float, float]]:
    """Return all figures as (MACHINE/CELL, figure, noon of the day [s since 1970], value)."""
    return [
        (f"{fit.machine}/{fit.cell}", figure, noon_of(fit.day), value)
        for fit in fits
        for figure, value in fit.figures.items()
    ]


def noon_of(day: str) -> float:
    """Return the noon of a day in this machine's zone [s since 1970]."""
    return datetime.combine(date.fromisoformat(day), time(12)).timestamp()
