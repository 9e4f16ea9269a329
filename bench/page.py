"""Write what the bench found: results.json, tables.txt, and the blocks of figures in pages."""

from __future__ import annotations

import functools
import importlib.metadata
import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from twin_experiments.workspace_io import PROCESSORS, UNKNOWN, commit_of, processor_of

from bench.demo_tables import demo_table, virtual_table
from bench.draw_table import draw_table
from bench.goal_table import goal_table
from bench.history import changed_files, in_doubt, is_whole
from bench.many_cells.table import farm_table
from bench.plant_tables import tables
from bench.readme import with_blocks, with_figures
from bench.second_world.table import lines_of, missed_lines, what_if_table
from bench.wear.table import health_blocks

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PAGE, TABLES = (
    ROOT / "bench" / "results.json",
    ROOT / "docs" / "benchmarks.md",
    ROOT / "bench" / "tables.txt",
)
README, HEALTH = ROOT / "README.md", ROOT / "docs" / "operating" / "health.md"
VIRTUAL = ROOT / "tests" / "virtual_time" / "baseline.json"
OURS = (
    "numpy",
    "scipy",
    "pybullet",
    "pymodbus",
    "websockets",
    "websocket-client",
    "rosbags",
    "msgspec",
)


def machine() -> dict[str, str]:
    """Say what the figures were measured on and with."""
    memory = int(Path("/proc/meminfo").read_text().split()[1]) / 2**20
    release = platform.freedesktop_os_release()["PRETTY_NAME"]
    return {
        "date": time.strftime("%Y-%m-%d"),
        "machine": f"{processor_of(PROCESSORS)}, {os.cpu_count()} cores, {memory:.0f} GB, "
        f"{release}, Linux {platform.release()}",
        "versions": ", ".join(f"{name} {importlib.metadata.version(name)}" for name in OURS)
        + f", Python {platform.python_version()}",
        "peers": ", ".join(
            line.replace("==", " ")
            for line in (ROOT / "bench" / "requirements.txt").read_text().splitlines()
            if "==" in line and not line.startswith(("#", "numpy"))
        ),
    }


def commit() -> str:
    """Return the commit that is measured, with a plus if files differ; empty outside a clone.

    The pages of figures do not count: what was measured before has written them.
    """
    told = commit_of(ROOT)
    if told.endswith("+") and not changed():
        told = told[:-1]
    return "" if told == UNKNOWN else told


@functools.cache
def begun_at() -> str:
    """Return the commit with which this process began to measure: asked before anything is."""
    return commit()


def changed() -> list[str]:
    """Return the files that differ from the commit, without the pages of figures."""
    found = changed_files(ROOT) - {RESULTS, PAGE, TABLES, README, HEALTH}
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


def measured(row: dict[str, Any], load: float) -> dict[str, Any]:
    """Add to a row when, where and on what it was measured: rows may be of different days."""
    here, told = machine(), commit()
    if told != begun_at():
        # Somebody has committed meanwhile: part of it may have run with the files of either.
        told = f"{begun_at().rstrip('+')}+"
    return {
        **row,
        "date": here["date"],
        "machine": here["machine"],
        "commit": told,
        "load_before": round(load, 2),
    }


def measure_parts(
    key: str, parts: Mapping[str, Callable[..., Sequence[Any]]], wanted: Sequence[str], *given: Any
) -> list[Any]:
    """Measure parts; keep the figures under ``key`` and write the pages, after each part anew.

    Args:
        key: Of results.json.
        parts: By name, in the order of the page.
        wanted: Some of them: the others stay as they were measured last; all if empty.
        given: To each part; the first is its amount: a share below 1 is shown and not kept.

    Returns:
        The rows.
    """
    rows = []
    for name, measure in parts.items():
        if wanted and name not in wanted:
            continue
        load, begun = os.getloadavg()[0], time.monotonic()
        figures = measure(*given)
        rows += [figure.row() for figure in figures]
        if given[0] < 1.0:
            continue
        told = {"part": name, "seconds": round(time.monotonic() - begun, 1)}
        told["figures"] = [figure.record() for figure in figures]
        known = {each["part"]: each for each in so_far().get(key, ())}
        known[name] = measured(told, load)
        write({**so_far(), key: [known[each] for each in parts if each in known]})
    return rows


def document(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what goes into results.json; what is no row of the table stays as it was."""
    here = machine()
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    own = {"versions": here["versions"], "peers": here["peers"], "rows": list(rows)}
    others = ("demos", "plants", "draws", "scaras", "what_if", "farm", "health", "first_start")
    return {**{key: kept[key] for key in others if key in kept}, **own}


def merged(rows: Sequence[dict[str, Any]], order: Sequence[str]) -> list[dict[str, Any]]:
    """Put newly measured rows among those of the last run, in the order of the table."""
    known: dict[str, dict[str, Any]] = {}
    if RESULTS.is_file():
        before = json.loads(RESULTS.read_text(encoding="utf-8"))
        # A file of the form before had date and machine once for all rows.
        shared = {key: before[key] for key in ("date", "machine", "load_before") if key in before}
        known = {row["id"]: {**shared, **row} for row in before["rows"]}
    known.update({row["id"]: row for row in rows})
    return [known[name] for name in order if name in known]


def so_far() -> dict[str, Any]:
    """Return what was measured so far, with the versions that were measured."""
    before = json.loads(RESULTS.read_text(encoding="utf-8"))
    return {**before, "rows": merged([], [row["id"] for row in before["rows"]])}


def write(content: dict[str, Any]) -> None:
    """Write results.json, tables.txt, and the figures of benchmarks.md, health.md and README.md.

    What the history says of the figures is kept with them: the page is of that moment.
    """
    if is_whole(ROOT):
        content = {**content, "in_doubt": in_doubt(content, ROOT)}
    RESULTS.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    TABLES.write_text(all_tables(content), encoding="utf-8")
    PAGE.write_text(page(content, PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    blocks = health_blocks(content.get("health", ()))
    text = with_blocks(HEALTH.read_text(encoding="utf-8"), blocks, HEALTH.name)
    HEALTH.write_text(text, encoding="utf-8")
    README.write_text(with_figures(README.read_text(encoding="utf-8"), content), encoding="utf-8")


def page(content: Mapping[str, Any], text: str) -> str:
    """Return docs/benchmarks.md with its blocks of figures written anew; the rest is a person's.

    Args:
        content: As in results.json.
        text: The page as it is.

    Raises:
        ValueError: A block is missing.
    """
    rows, doubt = content["rows"], content.get("in_doubt", {})
    kept = [row for row in rows if row["holds"]]
    missed = [row for row in rows if not row["holds"]]
    parts = [part for key in ("what_if", "farm") for part in content.get(key, ())]
    worn = [figure for part in content.get("health", ()) for figure in part["figures"]]
    short = sum(not figure["holds"] for figure in worn)  # the page of wear shows them in bold
    wear = f"\nWear: {short} figures, bold in [health](operating/health.md)."
    drawn = []
    if "draws" in content:
        drawn = [*draw_table(content["draws"], content.get("scaras")), ""]
    blocks = {
        "goals": "\n".join([*goal_table(content), *drawn, *_labels(content)]).strip(),
        "rows": f"{len(kept)} of {len(rows)} rows hold. {_measured(rows)}",
        "missed": "\n".join(
            [_table(missed, doubt, beside=False), *missed_lines(parts), *([wear] if short else [])]
        ),
    }
    return with_blocks(text, blocks, PAGE.name)


def _labels(content: Mapping[str, Any]) -> list[str]:
    """Say what the goals' figures were measured on: a label is part of a figure."""
    told = [("in virtual time", content["plants"])] if "plants" in content else []
    told += [(f"demos {each['series']}", each) for each in content.get("demos", ())]
    names: dict[str, list[str]] = {}
    for name, figures in told:
        names.setdefault(f"{figures['date']}, commit {figures['commit']}", []).append(name)
    return [f"- {', '.join(of_it)}: {at}." for at, of_it in names.items()]


def _measured(rows: Sequence[dict[str, Any]]) -> str:
    """Say in one sentence when, at which commits and where rows were measured."""
    places = {
        (row["date"], row.get("commit", ""), ", ".join(row["machine"].split(", ")[:3]))
        for row in rows
    }
    told = "; ".join(
        f"{date}, commit {version}, {where}" for date, version, where in sorted(places)
    )
    return f"Measured {told}."


def all_tables(content: Mapping[str, Any]) -> str:
    """Return bench/tables.txt: every figure with its label.

    Args:
        content: As in results.json.
    """
    rows, doubt = content["rows"], content.get("in_doubt", {})
    seconds = sum(row["seconds"] for row in rows)
    head = (
        "# Tables of ./cell bench, written by it from bench/results.json\n\n"
        f"Measuring the rows took {seconds / 60.0:.0f} min.\n\n{_occasions(rows)}\n"
        f"Ours: {content['versions']}. Peers: {content['peers']}.\n"
    )
    virtual = virtual_table(json.loads(VIRTUAL.read_text(encoding="utf-8")))
    demos = [*demo_table(content["demos"]), ""] if "demos" in content else []
    parts = [head, *_doubts(doubt), _table(rows, doubt)]
    parts += ["## The article's two experiments", "", *demos, *virtual, ""]
    if goals := goal_table(content):
        parts += ["## What the plants shall reach", "", *goals]
    parts += tables(content["plants"]) if "plants" in content else []
    parts += what_if_table(content["what_if"]) if content.get("what_if") else []
    parts += farm_table(content["farm"]) if content.get("farm") else []
    if health := content.get("health"):
        parts += lines_of("Robots that wear", "--health", health)
    parts += ["## What each row compares\n", *(_entry(row) for row in rows)]
    return "\n".join(parts).rstrip() + "\n"


def _occasions(rows: Sequence[dict[str, Any]]) -> str:
    """Return when and where the rows were measured, one line for each date, machine and commit."""
    found: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        found.setdefault((row["date"], row["machine"], row.get("commit", "")), []).append(row)
    lines = ["| measured | rows | machine | load before |", "|---|---|---|---|"]
    for (date, where, version), of_it in found.items():
        names = "all" if len(found) == 1 else ", ".join(row["id"] for row in of_it)
        at = f", commit {version}" if version else ""
        loads = max(row["load_before"] for row in of_it)
        lines.append(f"| {date}{at} | {names} | {where} | at most {loads:.1f} |")
    return "\n".join(lines) + "\n"


def _doubts(doubt: Mapping[str, str]) -> list[str]:
    """Name the figures that may have changed since, one line for each reason."""
    if not doubt:
        return []
    names: dict[str, list[str]] = {}
    for name, why in doubt.items():
        names.setdefault(why, []).append(name)
    lines = ["Measure these again before you rely on them:", ""]
    lines += [f"- {', '.join(of_it)}: {why}." for why, of_it in names.items()]
    return ["\n".join(lines) + "\n"]


def _table(rows: Sequence[dict[str, Any]], doubt: Mapping[str, str], *, beside: bool = True) -> str:
    """Lay rows out; with the figures beside each, if wanted."""
    lines = [
        "| row | ours | baseline | unit | ratio | goal | holds |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            _line(
                row["id"],
                row["ours"],
                row["baseline"],
                row["unit"],
                row["ratio"],
                row["goal"],
                row["holds"],
                doubt.get(row["id"], ""),
            )
        )
        for figure in row["beside"] if beside else ():
            lines.append(
                _line(
                    f"- {figure['what']}",
                    figure["value"],
                    None,
                    figure["unit"],
                    None,
                    figure["goal"],
                    figure["holds"],
                )
            )
    return "\n".join(lines) + "\n"


def _line(
    what: str,
    ours: Any,
    baseline: Any,
    unit: str,
    ratio: Any,
    goal: str,
    holds: bool | None,
    doubt: str = "",
) -> str:
    verdict = {True: "yes", False: "**no**", None: ""}[holds]
    if doubt:
        verdict += ", old" if doubt.startswith("old") else ", in doubt"
    limits = goal.replace("<=", "≤").replace(">=", "≥")
    cells = (what, number(ours), number(baseline), unit, number(ratio), limits, verdict)
    return f"| {' | '.join(cells)} |"


def number(value: float | None) -> str:
    """Return a figure with three digits; what was not measured is a dash."""
    if value is None:
        return "-"
    return (
        f"{value:.3g}"
        if 1e-3 <= abs(value) < 1e3
        else f"{value:.0f}"
        if 1e3 <= abs(value) < 1e7
        else f"{value:.1e}"
        if value
        else "0"
    )


def _entry(row: dict[str, Any]) -> str:
    """Say in a few lines what a row is."""
    rounds = f"{row['rounds']} rounds" if row["rounds"] > 1 else "one run"
    lines = [f"**{row['id']}** ({row['statistic']} of {rounds}, {row['seconds']:.0f} s)"]
    if row["measured"]:
        lines.append(
            f"ours: {row['measured']}{_tail(row['ours_p99'], row['spread_percent'], row['unit'])}"
        )
    if row["against"] not in ("", "none"):
        lines.append(
            f"baseline: {row['against']}"
            + _tail(row["baseline_p99"], row["baseline_spread_percent"], row["unit"])
        )
    if row["note"]:
        lines.append(row["note"])
    return "  \n".join(lines) + "\n"


def _tail(p99: float | None, spread: float | None, unit: str) -> str:
    parts = [] if p99 is None else [f"p99 {number(p99)} {unit}"]
    parts += [] if spread is None else [f"spread of the rounds {spread:.0f} %"]
    return f" ({', '.join(parts)})" if parts else ""
