"""The list of runs on the disk."""

from __future__ import annotations

import json
import os
from pathlib import Path

from operator_panel.io.run_folders import file_of, list_runs


def made(folder: Path, name: str, when: float, report: bool) -> Path:
    """Make a run."""
    run = folder / name
    run.mkdir()
    (run / "run.bag").write_bytes(b"x" * 2048)
    if report:
        (run / "report.html").write_text("<p>")
        (run / "report.json").write_text(
            json.dumps(
                {"experiments": [{"name": "e", "verdict": "passed", "path_error_max_percent": 1}]}
            )
        )
    os.utime(run, (when, when))
    return run


def test_newest_run_comes_first_and_the_link_to_it_is_not_listed_twice(tmp_path: Path) -> None:
    """`latest` is a link."""
    made(tmp_path, "one", 1000.0, False)
    made(tmp_path, "two", 2000.0, True)
    (tmp_path / "latest").symlink_to("two")
    runs = list_runs(tmp_path)
    assert [(run.name, run.has_report, run.size) for run in runs] == [
        ("two", True, "2 kB"),
        ("one", False, "2 kB"),
    ]
    assert runs[0].verdict == "e: passed, path error 1.00 % of reach"


def test_missing_folder_is_an_empty_list(tmp_path: Path) -> None:
    """Nothing was recorded yet."""
    assert list_runs(tmp_path / "none") == []


def test_broken_report_is_listed_without_a_verdict(tmp_path: Path) -> None:
    """One bad file hides no other."""
    run = made(tmp_path, "one", 1000.0, True)
    (run / "report.json").write_text("{")
    assert list_runs(tmp_path)[0].verdict == ""


def test_only_files_directly_in_a_run_are_served(tmp_path: Path) -> None:
    """No way to the token, by name or by link."""
    run = made(tmp_path, "one", 1000.0, True)
    (run / "ros_home").mkdir()
    (run / "ros_home" / "operator_token").write_text("secret")
    (run / "sly.html").symlink_to(run / "ros_home" / "operator_token")
    assert file_of(tmp_path, "one", "report.html") == run / "report.html"
    for file in ("ros_home/operator_token", "../one/report.html", "sly.html", "missing.html"):
        assert file_of(tmp_path, "one", file) is None
