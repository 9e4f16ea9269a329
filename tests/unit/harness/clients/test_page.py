"""The tables of docs/clients.md."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from harness.clients.page import END, MODBUS, ROSBRIDGE, TRIED, begin, table, write
from harness.workspace import ROOT

RESULTS = {
    ("b", "1"): {"connect": None, "listen": "Error: a | b\nc"},
    ("a", "2"): {"connect": None, "think": None},
}


def test_each_client_is_a_column_and_each_check_a_row() -> None:
    """What was not checked is empty, what failed tells why."""
    assert table(RESULTS).splitlines() == [
        "| check | a 2 | b 1 |",
        "|---|---|---|",
        "| connect | works | works |",
        "| think | works |  |",
        "| listen |  | fails: Error: a / b c |",
    ]


def test_table_is_written_between_its_marks(tmp_path: Path) -> None:
    """The rest stays, the other protocol's table too."""
    page = tmp_path / "clients.md"
    other = f"before\n{begin(ROSBRIDGE)}\nkept\n{END}\n"
    page.write_text(f"{other}{begin(MODBUS)}\n{END}\nafter\n", encoding="utf-8")
    write(page, RESULTS, MODBUS)
    expected = f"{other}{begin(MODBUS)}\n{table(RESULTS)}\n{END}\nafter\n"
    assert page.read_text(encoding="utf-8") == expected


def test_column_of_a_client_that_was_not_run_stays(tmp_path: Path) -> None:
    """Another version of one that was run goes, with its checks."""
    page = tmp_path / "clients.md"
    before = {("a", "1"): {"connect": "Error"}, ("by hand", "3"): {"connect": None, "drive": "No"}}
    page.write_text(f"{begin(MODBUS)}\n{table(before)}\n{END}\n", encoding="utf-8")
    write(page, RESULTS, MODBUS)
    both = table({**RESULTS, ("by hand", "3"): before["by hand", "3"]})
    assert page.read_text(encoding="utf-8") == f"{begin(MODBUS)}\n{both}\n{END}\n"


def test_the_first_row_says_when_and_where_each_column_was_run(tmp_path: Path) -> None:
    """Also one that was not run this time; one from before that row has none."""
    page = tmp_path / "clients.md"
    before = {
        ("by hand", "3"): {TRIED: "in May, works", "drive": None},
        ("older", "1"): {"x": None},
    }
    page.write_text(f"{begin(MODBUS)}\n{table(before)}\n{END}\n", encoding="utf-8")
    write(page, {("b", "1"): {TRIED: "today", "connect": "Error"}}, MODBUS)
    assert page.read_text(encoding="utf-8").splitlines()[1:4] == [
        "| check | b 1 | by hand 3 | older 1 |",
        "|---|---|---|---|",
        "| tried | today | in May, works |  |",
    ]


def test_page_without_marks_is_refused(tmp_path: Path) -> None:
    """Nothing is written anywhere."""
    page = tmp_path / "clients.md"
    page.write_text("text", encoding="utf-8")
    with pytest.raises(ValueError, match="no place for the table"):
        write(page, RESULTS, ROSBRIDGE)


def test_page_of_the_project_has_a_result_for_each_version_that_is_tried() -> None:
    """A new version, or a new check, is run before it is shipped."""
    text = (ROOT / "docs" / "clients.md").read_text(encoding="utf-8")
    heads = "".join(line for line in text.splitlines() if line.startswith("| check |"))
    for file in sorted((ROOT / "setup" / "clients").iterdir()):
        if file.suffix == ".git":
            continue  # a second opinion on ours: no client, so the page has no column for it
        content = file.read_text(encoding="utf-8")
        if file.suffix == ".json":
            pins = list(json.loads(content)["dependencies"].items())
        else:
            pins = [(n, v) for n, _, v in (line.partition("==") for line in content.split()) if v]
        (name, version), *_ = pins  # the client; what follows is what it needs
        assert f"| {name} {version} |" in heads, f"{file.name}: run ./cell test --clients"
