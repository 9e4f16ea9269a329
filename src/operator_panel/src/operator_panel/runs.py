"""Folders of recorded runs as they are listed, and which of their files may leave the machine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import msgspec

RUN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,127}")
# Logs and the folder of ROS stay inside: the operator's token is there.
SHOWN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\.(html|json|png|svg|bag)")
LATEST = "latest"
"""Link to the newest run with a report; no run may have its name."""
JOURNAL, DRAFTS, COURSE, HEALTH = "journal", "drafts", "course", "health"
"""Folders beside the runs: the cells' journals, programs that are being taught, what learners hand
in, and what the monitor of wear keeps."""

BESIDE = (LATEST, JOURNAL, DRAFTS, COURSE, HEALTH, "farm", "lab", "configuration", "bench", "storm")
"""Names that no run may have: what others keep there is not shown, renamed or deleted here."""


class Run(msgspec.Struct, frozen=True):
    """One run as it is listed.

    Attributes:
        name: Its folder.
        when: Time of day as text.
        size: Of its bags, as text.
        verdict: In words; empty without a report.
        has_report: Whether report.html is there.
        length: Of its bags, as text; empty if nobody knows it yet.
        bags: Its bags, the first part first.
        busy: Whether it is being recorded.
        missing: What its report could not read of its bags, in words; empty if nothing is missing.
    """

    name: str
    when: str
    size: str
    verdict: str
    has_report: bool
    length: str = ""
    bags: tuple[str, ...] = ()
    busy: bool = False
    missing: str = ""


def is_run_name(name: str) -> bool:
    """Return whether a folder may be a run: one name, no way out of the folder of runs."""
    return bool(RUN.fullmatch(name)) and ".." not in name and name not in BESIDE


def may_be_shown(run: str, file: str) -> bool:
    """Return whether ``file`` is a report, a picture or a bag directly in the folder ``run``."""
    return is_run_name(run) and bool(SHOWN.fullmatch(file)) and ".." not in file


def size_text(size: int) -> str:
    """Return a size in bytes for people."""
    for limit, scale, unit in ((1e3, 1.0, "B"), (1e6, 1e3, "kB"), (1e9, 1e6, "MB")):
        if size < limit:
            return f"{size / scale:.0f} {unit}"
    return f"{size / 1e9:.1f} GB"


def length_text(seconds: float) -> str:
    """Return a length of time [s] for people."""
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"


def part_number(name: str) -> int:
    """Return which part of a recording a bag is: 1 for the first."""
    found = re.search(r"\.part(\d+)\.bag\Z", name)
    return int(found[1]) if found else 1


def missing(report: Mapping[str, Any]) -> str:
    """Return what report.json says is missing of a damaged recording, in one line."""
    text = report.get("missing")
    return text if isinstance(text, str) else ""


def verdict(report: Mapping[str, Any]) -> str:
    """Return what report.json says of its experiments, in one line."""
    found = []
    for experiment in report.get("experiments", []):
        error = experiment.get("path_error_max_percent")
        words = (
            f"path error {error:.2f} % of reach"
            if isinstance(error, (int, float))
            else "no path error"
        )
        found.append(f"{experiment.get('name', '?')}: {experiment.get('verdict', '?')}, {words}")
    return "; ".join(found)
