"""The benchmark's own arithmetic, and what it does with a row that cannot be measured."""

from __future__ import annotations

import inspect
import io
import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from harness.workspace import ROOT
from rich.console import Console

if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from bench import demos, farm, page, run, variations
from bench.__main__ import main
from bench.cells import cell_run
from bench.demo_tables import demo_table, p95
from bench.goal_table import SYNC_RATIOS, goal_table
from bench.record import Beside, Goal, Record, interleaved, median, p99, spread_percent
from bench.rows import GROUPS, names
from bench.wear.table import BLOCKS

README_BLOCKS, PAGE_BLOCKS, HEALTH_BLOCKS = (
    "".join(f"<!-- {name}: x -->\n<!-- end of {name} -->\n" for name in names_)
    for names_ in (("figures", "first start"), ("goals", "rows", "missed"), BLOCKS)
)
PAGES = {"PAGE": "page.md", "README": "README.md", "HEALTH": "health.md"}


@pytest.mark.parametrize(
    ("goals", "beside", "holds"),
    [
        ((Goal("ratio", 0.5),), (), True),
        ((Goal("ratio", 0.4),), (), False),
        ((Goal("ratio", 0.5, at_least=True),), (), True),
        ((Goal("ours", 1.0), Goal("ratio", 0.4)), (), False),
        ((Goal("ours", 1.0),), (Beside("speed", 3.0, "x", ">= 5", False),), False),
        ((Goal("ours", 1.0),), (Beside("speed", 3.0, "x"),), True),
    ],
)
def test_row_holds_if_all_its_goals_do(
    goals: tuple[Goal, ...], beside: tuple[Beside, ...], holds: bool
) -> None:
    """Those of the figures beside count too; a figure without a goal does not."""
    record = Record("row", 1.0, 2.0, "s", goals, beside=beside)
    assert record.ratio == 0.5 and record.holds is holds
    assert record.document()["holds"] is holds


def test_row_without_figures_never_holds() -> None:
    """What was not measured keeps no goal, not even an empty list of them."""
    assert not Record("row", None, None, "").holds
    assert not Record("row", 1.0, None, "s", (Goal("ratio", 1.0),)).holds


def test_sides_take_turns_and_none_is_always_first() -> None:
    """Each round begins with another side."""
    order: list[str] = []
    sides = [lambda name=name: order.append(name) or [1.0] for name in "ab"]  # type: ignore[misc, func-returns-value]
    assert interleaved(3, *sides) == [[[1.0]] * 3] * 2
    assert order == ["a", "b", "b", "a", "a", "b"]


def test_statistics_of_rounds() -> None:
    """Median of the rounds' medians, 99th percentile of all samples, spread of the rounds."""
    rounds = [[1.0, 2.0, 3.0], [4.0, 4.0, 4.0], [3.0, 3.0, 90.0]]
    assert (median(rounds), p99(rounds), spread_percent(rounds)) == (
        3.0,
        90.0,
        pytest.approx(200.0 / 3.0),
    )


def test_row_that_fails_says_why_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Results and page are written all the same."""

    def broken(room: object) -> Record:
        raise OSError("the line is cut")

    rows = {
        "first": broken,
        "second": lambda room: Record("second", 1.0, 2.0, "s", (Goal("ratio", 1.0),)),
    }
    monkeypatch.setattr(run, "names", lambda: list(rows))
    monkeypatch.setattr(run, "row", rows.get)
    files = {"RESULTS": "results.json", "TABLES": "tables.txt"}
    for name, file in (files | PAGES).items():
        monkeypatch.setattr(page, name, tmp_path / file)
    page.README.write_text(README_BLOCKS)
    page.PAGE.write_text(PAGE_BLOCKS)
    page.HEALTH.write_text(HEALTH_BLOCKS)
    monkeypatch.setattr(page, "changed_files", lambda root: set())
    assert not run.measure([], tmp_path, Console(file=io.StringIO()), as_json=False)
    written = json.loads((tmp_path / "results.json").read_text())["rows"]
    assert [(row["id"], row["holds"]) for row in written] == [("first", False), ("second", True)]
    assert written[0]["note"] == "not measured: OSError: the line is cut"
    assert "| second | 1 | 2 | s | 0.5 | ratio ≤ 1 | yes |" in (tmp_path / "tables.txt").read_text()
    told = (tmp_path / "page.md").read_text()
    assert "1 of 2 rows hold. Measured" in told and "| first | - | - |" in told


def test_tables_show_all_rows_that_results_hold() -> None:
    """The shipped tables were made from the shipped results, and every row is known."""
    rows = json.loads(page.RESULTS.read_text())["rows"]
    assert {row["id"] for row in rows} <= set(names())
    text = page.TABLES.read_text()
    assert [row["id"] for row in rows if f"\n| {row['id']} |" not in text] == []
    assert len(names()) == len(set(names())) == sum(map(len, GROUPS.values()))


def test_a_figure_has_one_goal_on_all_pages() -> None:
    """The first table and the rows do not contradict each other."""
    rows = {row["id"]: row for row in json.loads(page.RESULTS.read_text())["rows"]}
    told = {name: (rows[name]["goal"], rows[name]["holds"]) for name in SYNC_RATIOS}
    goals = {name: Goal("ratio", limit) for name, limit in SYNC_RATIOS.items()}
    assert told == {
        name: (goal.text, goal.holds(None, rows[name]["ratio"])) for name, goal in goals.items()
    }


def test_page_is_what_its_script_writes() -> None:
    """One source: whoever changes a table, or what it says of a figure, writes both again."""
    content, text = page.so_far(), page.PAGE.read_text()
    assert page.page(content, text) == text
    assert page.all_tables(content) == page.TABLES.read_text()


def test_every_row_that_is_not_reached_has_its_reason() -> None:
    """A figure beyond its goal without a word why leaves the reader alone."""
    rows = json.loads(page.RESULTS.read_text())["rows"]
    reasons = re.findall(r"^- \*\*(.+?):\*\*", page.PAGE.read_text(), re.MULTILINE)
    named = {name for reason in reasons for name in reason.split(", ")}
    assert sorted({row["id"] for row in rows if not row["holds"]} - named) == []


IDEAL = {"name": "ideal", "description": "a perfect robot", "payload_kg": 0.0}


def test_demos_take_their_label_from_their_reports() -> None:
    """What the bag says of robot and plant, not what somebody once wrote down."""
    made_with = {"robot": "a robot", "plant": IDEAL}
    expected = {"robot": "a robot", "plant": "plant ideal: a perfect robot"}
    assert demos.label([made_with, made_with]) == expected
    assert demos.label([{"robot": "r", "plant": None}])["plant"] == "plant not recorded"


@pytest.mark.parametrize(
    ("made_with", "text"),
    [
        ([], "no demo ended with a report"),
        (
            [{"robot": "r", "plant": IDEAL}, {"robot": "r", "plant": None}],
            "their reports say r with plant ideal: a perfect robot, r with plant not recorded",
        ),
    ],
)
def test_demos_of_two_plants_are_not_mixed(made_with: list[Any], text: str) -> None:
    """A figure of two plants has no label."""
    with pytest.raises(ValueError, match=text):
        demos.label(made_with)


def test_a_series_without_a_report_is_told_and_not_left_out() -> None:
    """A robot that is stopped each time has no figure; that is a result too."""
    told = {"date": "2026-01-02", "commit": "abc1234", "machine": "a machine"}
    entry = {"robot": "a robot", "plant": "plant field: rough", "asked_percent": 100.0, **told}
    text = "\n".join(demo_table([entry | {"failed": 3, "runs": []}]))
    assert "plant field, 100 % asked for: the twin leads | none of 3 runs ended" in text
    assert "0 runs of `./cell demo` in a row, 3 more ended without a report" in text


@pytest.mark.parametrize(("count", "place"), [(1, 1), (3, 3), (19, 19), (20, 19), (100, 95)])
def test_p95_is_a_value_that_was_measured(count: int, place: int) -> None:
    """The smallest that 95 of 100 do not exceed: of few runs the worst."""
    assert p95([float(k) for k in range(count, 0, -1)]) == place


def test_each_part_of_the_farm_can_be_asked_for_by_its_name() -> None:
    """The help names them all."""
    told = str(inspect.signature(main).parameters["farm"].annotation)
    assert " ".join(farm.PARTS) in told.replace('" "', "").replace("' '", "")


def test_an_attempt_that_left_no_report_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fault that is measured may have ended it."""

    def attempt(cell: Any, folder: Path, name: str, repeat: int) -> str:
        folder.mkdir()
        if folder.name == "run_1":
            (folder / "report.json").write_text('{"experiments": []}')
            (folder / "run.bag").touch()
        return "run_experiment ended with 3: STOPPED"

    monkeypatch.setattr(cell_run, "_attempt", attempt)
    monkeypatch.setattr(cell_run, "recover", lambda cell: None)
    cell: Any = None
    outcome = cell_run.run_experiments(cell, tmp_path / "run", "twin_leads", 1)
    assert outcome.ended == ("run_experiment ended with 3: STOPPED",)


PERFECT = {"variant": "as it is", "leader": "real_leads", "robot": "fanuc_sr6ia", "ended": ""}
PERFECT |= {"speed_percent": 50.0, "path_percent": 0.2, "rest_percent": 0.01}


@pytest.mark.parametrize(
    ("change", "path", "rest"),
    [
        ({}, "0.2 % (fanuc_sr6ia, 100 %)", "0.01 % (fanuc_sr6ia, 50 %)"),
        (
            {"ended": "FAULT: x", "path_percent": None, "rest_percent": None},
            "**no figure (fanuc_sr6ia, 100 %: ended)**",
            "**no figure (fanuc_sr6ia, 100 %: ended)**",
        ),
        (
            {"rest_percent": None},
            "0.2 % (fanuc_sr6ia, 100 %)",
            "**no figure (fanuc_sr6ia, 100 %)**",
        ),
    ],
)
def test_a_trial_that_came_to_nothing_is_the_worst_of_all(
    change: dict[str, Any], path: str, rest: str
) -> None:
    """Who ends does not make the largest of all smaller."""
    other = {**PERFECT, "speed_percent": 100.0, "path_percent": 0.201} | change
    told = goal_table({"plants": {"trials": [PERFECT, other]}})
    assert f"| path, real leads | 0.3 % | {path} | 1 % | not measured |" in told
    assert f"| 0.02 % | {rest} | 0.2 % | not measured |" in "\n".join(told)


def test_demos_without_a_report_are_among_the_twenty() -> None:
    """And the worst of them."""
    led = {"path_percent": 1.0, "true_percent": 0.01}
    runs = [{"real_leads": led, "twin_leads": led}] * 18
    series = {"series": "kit_drawn_50", "asked_percent": 50.0, "failed": 2, "runs": runs}
    told = "\n".join(goal_table({"demos": [series]}))
    assert "| demo, path, worst of 20 |  |  | 5 % | **no figure (2 of 20 ended without a" in told
    whole = {**series, "failed": 0, "runs": [*runs, *runs]}
    assert "| 5 % | 1 % (real leads, 50 %) |" in "\n".join(goal_table({"demos": [whole]}))


def test_what_ended_without_a_report_holds_in_no_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does what could not be compared, nor a demo that hangs."""
    silent = Console(file=io.StringIO())
    entry = {"name": "real_leads", "path_error_max_percent": None}
    report = {"experiments": [{**entry, "positioning_error_max_percent": None}]}
    for made, count in ((None, 1), (report, 2)):
        monkeypatch.setattr(variations, "_report", lambda *_, made=made: made)
        rows = variations.run(tmp_path, silent)
        assert len(rows) == count * len(variations.VARIATIONS)
        assert not any(row.holds for row in rows)

    def hangs(command: object, **_: object) -> None:
        raise subprocess.TimeoutExpired("demo", 300.0)

    monkeypatch.setattr(subprocess, "run", hangs)
    figures = {"path_percent": None, "undisturbed_percent": None, "positioning_percent": None}
    figures |= {"true_percent": None, "speed_percent": 50.0}
    label = {"robot": "a robot", "plant": "plant ideal", "asked_percent": 50.0}
    kept: list[Any] = []
    monkeypatch.setattr(page, "commit", lambda: "abc1234")
    monkeypatch.setattr(page, "write", kept.append)
    rows = demos.run(1, 0, ["kit_ideal_50"], tmp_path, silent)
    assert [row.measured for row in rows] == [1.0, *[math.inf] * 4]
    assert kept[-1]["demos"][0]["failed"] == 1
    series = {**label, "failed": 0, "runs": [{"real_leads": figures}]}
    told = {"date": "2026-01-02", "commit": "abc1234", "machine": "a machine"}
    assert "| inf % | inf % | inf % | not known |" in "\n".join(demo_table([{**series, **told}]))
