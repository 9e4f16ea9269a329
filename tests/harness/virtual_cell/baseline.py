"""Stored figures, and what has become worse than they say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from harness.virtual_cell.experiments import Figures
from harness.workspace import ROOT

FILE = ROOT / "tests" / "virtual_time" / "baseline.json"
WORSE = 0.05
"""A figure that is larger than its baseline by this part of it is worse."""
FLOOR = {
    "lag_ms": 0.05,
    "travelled_percent": 0.005,
    "path_angle_deg": 0.0005,
    "rest_angle_deg": 0.0005,
}
FLOOR_MM = 0.0005
"""Smaller differences are rounding, not maths: another processor's last digits."""
RENEW = "./cell bench --virtual --renew"


class Baseline(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Figures by robot and experiment, when they were measured, and on which commit."""

    date: str
    commit: str
    figures: dict[str, dict[str, Figures]]


class BaselineError(RuntimeError):
    """There is no usable baseline; the text says how to write one."""


def read_baseline(path: Path = FILE) -> Baseline:
    """Read the stored figures.

    Raises:
        BaselineError: The file is missing or does not fit.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=Baseline)
    except (OSError, msgspec.MsgspecError) as error:
        raise BaselineError(f"{path}: {error}. Write it with {RENEW}") from error


def write_baseline(baseline: Baseline, path: Path = FILE) -> None:
    """Store figures, rounded to the nanometre, so that two runs give one file."""
    tree = msgspec.to_builtins(baseline)
    for experiments in tree["figures"].values():
        for values in experiments.values():
            values.update({name: round(value, 6) for name, value in values.items()})
    path.write_bytes(msgspec.json.format(msgspec.json.encode(tree), indent=2) + b"\n")


def worse(robot: str, experiment: str, new: Figures, baseline: Baseline) -> list[str]:
    """Return one line for each figure that is worse than its baseline, and what to do about it.

    Raises:
        BaselineError: The baseline does not have this experiment.
    """
    try:
        old = baseline.figures[robot][experiment]
    except KeyError as error:
        raise BaselineError(f"no baseline for {robot} {experiment}: {RENEW}") from error
    lines = [
        f"{robot} {experiment}: {name} = {now:.6g}, baseline {was:.6g} of {baseline.date}, "
        f"commit {baseline.commit}: {_change(was, now)}"
        for name, was, now in _pairs(old, new)
        if now > was * (1.0 + WORSE) and now - was > FLOOR.get(name, FLOOR_MM)
    ]
    if lines:
        lines.append(
            f"The maths of following, planning, control or the wires has changed. Find the change; "
            f"if it is meant, renew the baseline with {RENEW} and commit it with the reason."
        )
    return lines


def better(old: Mapping[str, Figures], new: Mapping[str, Figures]) -> list[str]:
    """Return one line for each figure that is better by as much: the baseline hides it."""
    return [
        f"{experiment}: {name} = {now:.6g}, baseline {was:.6g}: {_change(was, now)}"
        for experiment, figures in new.items()
        if experiment in old
        for name, was, now in _pairs(old[experiment], figures)
        if now < was * (1.0 - WORSE) and was - now > FLOOR.get(name, FLOOR_MM)
    ]


def _pairs(old: Figures, new: Figures) -> list[tuple[str, float, float]]:
    names = Figures.__struct_fields__
    return [(name, float(getattr(old, name)), float(getattr(new, name))) for name in names]


def _change(was: float, now: float) -> str:
    """Return by how much a figure has changed, in words."""
    return f"{100.0 * (now / was - 1.0):+.1f} %" if was > 0.0 else "was 0"
