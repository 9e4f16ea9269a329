"""What a night tests, and its report: ``./cell test --nightly`` writes docs/nightly.md.

    python -m harness.running.nightly begin
    python -m harness.running.nightly write --tests 0 --clients 0 --mutants 1 [--page FILE]

``begin`` prints whose turn it is, then seed and rooms of tonight's mutants, as words for
harness.mutants. ``write`` is told how the three commands ended. What they found it reads from the
files that they left in build/.
"""

from __future__ import annotations

import ast
import os
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime, timezone
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from ruamel.yaml import YAML
from twin_experiments.workspace_io import PROCESSORS, commit_of, processor_of

from harness.mutants import summary
from harness.running.changed import changed_files
from harness.running.lanes import PARTS
from harness.running.thorough import TURN, turn_of
from harness.workspace import ROOT

BUILD = ROOT / "build"
NIGHT = BUILD / "nightly.json"
REPORTS = BUILD / "night"
"""What ``begin`` keeps for ``write``, and where pytest's reports are kept of a night."""
PAGE = ROOT / "docs" / "nightly.md"
CLIENTS = "clients"
WEEK = 7
REASON_LETTERS = 200


class Night(msgspec.Struct, frozen=True):
    """When and with what a night began; ``changed`` names files that differ from the commit."""

    begun: datetime
    commit: str
    machine: str
    changed: tuple[str, ...] = ()


class Part(msgspec.Struct, frozen=True):
    """What one run of pytest found; tests and what they said, by name, where they did not pass."""

    seconds: float
    passed: int
    failed: tuple[tuple[str, str], ...] = ()
    skipped: tuple[tuple[str, str], ...] = ()


def rooms_of(day: date, rooms: Sequence[str]) -> list[str]:
    """Return the rooms of a day: so many that all of them come by in any seven days.

    Example:
        >>> [rooms_of(date(2026, 1, day), "abcdefgh") for day in (1, 2, 3)]
        [['e', 'f'], ['g', 'h'], ['a', 'b']]
    """
    each = -(-len(rooms) // WEEK)
    first = day.toordinal() * each
    return [rooms[(first + k) % len(rooms)] for k in range(each)]


def read_part(file: Path) -> Part | None:
    """Return what pytest's report says; None without one: pytest did not come to its end."""
    if not file.is_file():
        return None
    suites = list(ElementTree.parse(file).getroot().iter("testsuite"))
    cases = [case for suite in suites for case in suite.iter("testcase")]
    failed, skipped, passed = [], [], 0
    for case in cases:
        name = ".".join(filter(None, (case.get("classname"), case.get("name"))))
        if (wrong := _first(case, "failure", "error")) is not None:
            failed.append((name, _one_line(wrong.get("message") or wrong.text or "")))
        elif (why := case.find("skipped")) is not None:
            skipped.append((name, _one_line(_reason(why))))
        else:
            passed += 1
    seconds = sum(float(suite.get("time", "0")) for suite in suites)
    return Part(seconds, passed, tuple(failed), tuple(skipped))


def _first(case: ElementTree.Element, *names: str) -> ElementTree.Element | None:
    return next((found for name in names if (found := case.find(name)) is not None), None)


def _reason(why: ElementTree.Element) -> str:
    """Return why a test is skipped; a skipped file has it in a tuple with path and line."""
    message, text = why.get("message", ""), why.text or ""
    if message != "collection skipped":
        return message
    return str(ast.literal_eval(text)[-1]).removeprefix("Skipped: ")


def _one_line(text: str) -> str:
    """Return a text as a cell of a table, without the path of this workspace."""
    words = " ".join(text.replace(f"{ROOT}/", "").replace("|", "/").split())
    return words if len(words) <= REASON_LETTERS else f"{words[:REASON_LETTERS]} ..."


def page(
    night: Night,
    codes: Mapping[str, int],
    parts: Mapping[str, Part | None],
    mutants: summary.Summary | None,
    words: str = "",
) -> str:
    """Return the report.

    Args:
        night: When and with what it began.
        codes: Exit code of each command.
        parts: What each run of pytest found.
        mutants: What became of the mutants; None if nothing tells.
        words: That chose a part of all this; empty: it is all of it.
    """
    ended = [part for part in parts.values() if part]
    skipped = [test for part in ended for test in part.skipped]
    failed = [test for part in ended for test in part.failed]
    return "\n".join(
        [
            "# The last night",
            "Written by `.ci/nightly`, which runs `./cell test --nightly`: all tests, with a half "
            "of the longer scenes and new examples in a half of the files, by turns (this night's: "
            f"`{TURN}={turn_of(night.begun.date())}`), other people's programs with "
            "rosbridge_server beside the gateway, and mutants of the rooms whose turn it is.",
            "",
            f"Begun {night.begun:%Y-%m-%d %H:%M} UTC at commit {night.commit} on {night.machine}.",
            *([f"Only what these words choose: `{words}`."] if words else []),
            _verdict(codes),
            *([f"Not committed: {', '.join(night.changed)}."] if night.changed else []),
            "",
            *_part_rows(parts),
            *_tests("Skipped", "| file | tests | why |", _skipped(skipped)),
            *_tests("Failed", "| test | why |", _failed(failed)),
            *_mutant_rows(mutants),
            "",
        ]
    )


def _verdict(codes: Mapping[str, int]) -> str:
    failed = [f"{name} (exit code {code})" for name, code in codes.items() if code]
    return f"**Failed: {', '.join(failed)}.**" if failed else "All of it passed."


def _part_rows(parts: Mapping[str, Part | None]) -> Iterator[str]:
    yield from ("| part | took | passed | failed | skipped |", "|---|---|---|---|---|")
    for name, part in parts.items():
        if part is None:
            yield f"| {name} | did not end | | | |"
        else:
            counts = f"{part.passed} | {len(part.failed)} | {len(part.skipped)}"
            yield f"| {name} | {_took(part.seconds)} | {counts} |"


def _tests(title: str, head: str, rows: Sequence[str]) -> Iterator[str]:
    yield from ("", f"## {title}")
    if not rows:
        yield "No test."
        return
    yield from (head, "|---" * head.count(" | ") + "|---|")
    yield from rows


def _skipped(tests: Sequence[tuple[str, str]]) -> list[str]:
    """Return how many tests of a file are skipped for one reason, a row each."""
    found = Counter((name.partition("[")[0].rpartition(".")[0], why) for name, why in tests)
    return [f"| `{file}` | {count} | {why} |" for (file, why), count in found.items()]


def _failed(tests: Sequence[tuple[str, str]]) -> list[str]:
    return [f"| `{name.replace('|', '/')}` | {why} |" for name, why in tests]


def _mutant_rows(found: summary.Summary | None) -> Iterator[str]:
    yield from ("", "## Mutants")
    if found is None:
        yield "Their run did not end."
        return
    words = f"--mutants {found.mutants} --seed {found.seed}"
    yield f"Seed {found.seed}. The same ones again, at the same commit and behind all tests:"
    yield from ("```", f"./cell test --thorough {words} {' '.join(found.rooms)}", "```", "")
    yield "| room | took | tried | killed | survived | equivalent |"
    yield "|---|---|---|---|---|---|"
    for name, room in found.rooms.items():
        counts = f"{room.tried} | {room.killed} | {len(room.survivors)} | {room.equivalent}"
        wrong = "" if room.sound else ", its tests fail without a mutant"
        yield f"| {name}{wrong} | {_took(room.seconds)} | {counts} |"
    survivors = [text for room in found.rooms.values() for text in room.survivors]
    if survivors:
        yield from ("", "Survivors:", "```", *survivors, "```")


def _took(seconds: float) -> str:
    """Return a time as hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"


def _report_of(part: str, folder: Path) -> Path:
    return folder / f"test_{part}.xml"


def all_rooms() -> list[str]:
    """Return the rooms in which mutants are made, in the order of their file."""
    return list(YAML(typ="safe").load(ROOT / "tests" / "mutants" / "rooms.yaml"))


def begin() -> None:
    """Keep what the report has to know; print whose turn it is, and the words for the mutants."""
    now = datetime.now(timezone.utc)
    machine = f"{processor_of(PROCESSORS)}, {os.cpu_count()} cores"
    night = Night(now, commit_of(ROOT), machine, tuple(changed_files("HEAD")))
    REPORTS.mkdir(parents=True, exist_ok=True)
    reports = (_report_of(part, at) for part in (*PARTS, CLIENTS) for at in (BUILD, REPORTS))
    for left in (summary.FILE, *reports):
        left.unlink(missing_ok=True)
    NIGHT.write_bytes(msgspec.json.encode(night))
    rooms = rooms_of(now.date(), all_rooms())
    seed = f"{now:%Y%m%d}"
    print(
        f"night: commit {night.commit}, mutants of {', '.join(rooms)}, seed {seed}", file=sys.stderr
    )
    print(turn_of(now.date()), "--seed", seed, *rooms)


def write(
    tests: Annotated[int, typer.Option(help="Exit code of the tests.")],
    clients: Annotated[int, typer.Option(help="Exit code of other people's programs.")],
    mutants: Annotated[int, typer.Option(help="Exit code of the mutants.")],
    file: Annotated[Path, typer.Option("--page", help="Where the report goes.")] = PAGE,
    words: Annotated[str, typer.Option(help="That chose a part of it all.")] = "",
) -> None:
    """Write the report; end with 1 if anything failed."""
    night = msgspec.json.decode(NIGHT.read_bytes(), type=Night)
    codes = {"tests": tests, CLIENTS: clients, "mutants": mutants}
    parts = {name: read_part(_report_of(name, REPORTS)) for name in (*PARTS, CLIENTS)}
    found = None
    if summary.FILE.is_file():
        found = msgspec.json.decode(summary.FILE.read_bytes(), type=summary.Summary)
    file.write_text(page(night, codes, parts, found, words), encoding="utf-8")
    print(f"night: {_verdict(codes)} The report: {file}")
    raise typer.Exit(1 if any(codes.values()) else 0)


if __name__ == "__main__":
    app = typer.Typer(add_completion=False)
    app.command()(begin)
    app.command()(write)
    app()
