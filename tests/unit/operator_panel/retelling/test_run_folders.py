"""The list of runs on the disk."""

from __future__ import annotations

import json
import os
import struct
from pathlib import Path

import pytest
from operator_panel.retelling.run_folders_io import (
    RunFolderError,
    bag_of,
    delete_run,
    file_of,
    list_runs,
    rename_run,
)


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
    """`latest` is a link; the folder of the journals is no run either."""
    for name in ("journal", "health"):
        (tmp_path / name).mkdir()
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


def test_run_is_renamed_and_the_link_to_the_newest_follows(tmp_path: Path) -> None:
    """`latest` never points to nothing."""
    made(tmp_path, "one", 1000.0, True)
    (tmp_path / "latest").symlink_to("one")
    rename_run(tmp_path, "one", "first_move")
    assert (tmp_path / "first_move" / "run.bag").is_file() and not (tmp_path / "one").exists()
    assert (tmp_path / "latest" / "report.html").is_file()


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("two", "two exists already: choose another name"),
        ("../out", "cannot be a name"),
        ("..", "cannot be a name"),
        ("a/b", "cannot be a name"),
        ("", "cannot be a name"),
        ("latest", "cannot be a name"),
        ("journal", "cannot be a name"),
        (".hidden", "cannot be a name"),
    ],
)
def test_name_that_is_taken_or_leads_out_is_refused(tmp_path: Path, name: str, error: str) -> None:
    """Nothing is overwritten, nothing leaves the folder of runs."""
    made(tmp_path, "one", 1000.0, False)
    made(tmp_path, "two", 1000.0, False)
    with pytest.raises(RunFolderError, match=error):
        rename_run(tmp_path, "one", name)
    assert {each.name for each in tmp_path.iterdir()} == {"one", "two"}


def test_deleted_run_is_gone_with_its_link_and_nothing_else(tmp_path: Path) -> None:
    """Files that a link in the run points to stay."""
    run = made(tmp_path, "one", 1000.0, True)
    made(tmp_path, "two", 1000.0, True)
    (tmp_path / "latest").symlink_to("one")
    kept = tmp_path.parent / "kept"
    kept.mkdir()
    (kept / "file").touch()
    (run / "away").symlink_to(kept)
    delete_run(tmp_path, "one")
    assert [each.name for each in tmp_path.iterdir()] == ["two"]
    assert (kept / "file").is_file()


NOT_RUNS = ("..", "../two", "two/..", "", ".", "latest", "missing")
NOT_HERE = ("../out", "{above}/out", "deep/one")
"""Where bags are all the same."""


@pytest.mark.parametrize(
    ("run", "why"),
    [
        *((run, "there is no recording") for run in NOT_RUNS + NOT_HERE),
        ("empty", "empty holds no bag"),
    ],
)
def test_only_recordings_are_deleted(tmp_path: Path, run: str, why: str) -> None:
    """Neither by a path, nor by a link, nor a folder without a bag."""
    runs = tmp_path / "runs"
    for folder in (runs / "empty", runs / "deep"):
        folder.mkdir(parents=True)
    for folder, name in ((runs, "two"), (runs / "deep", "one"), (tmp_path, "out")):
        made(folder, name, 1000.0, True)
    (runs / "latest").symlink_to("two")
    there = sorted(tmp_path.rglob("*"))
    with pytest.raises(RunFolderError, match=why):
        delete_run(runs, run.format(above=tmp_path))
    assert sorted(tmp_path.rglob("*")) == there


def test_what_is_being_recorded_stays(tmp_path: Path) -> None:
    """The recorder would go on writing into a file that nobody sees any more."""
    run = made(tmp_path, "one", 1000.0, False)
    unfinished(run / "run.bag")
    assert [(each.busy, each.length) for each in list_runs(tmp_path)] == [(True, "being recorded")]
    for change in (lambda: delete_run(tmp_path, "one"), lambda: rename_run(tmp_path, "one", "b")):
        with pytest.raises(RunFolderError, match="one is being recorded: press Stop first"):
            change()
    os.utime(run / "run.bag", (1000.0, 1000.0))
    assert [(each.busy, each.length) for each in list_runs(tmp_path)] == [(False, "not finished")]
    delete_run(tmp_path, "one")


def test_parts_are_listed_in_their_order_and_the_first_is_reported(tmp_path: Path) -> None:
    """A long recording has several; the tenth comes after the second."""
    run = made(tmp_path, "one", 1000.0, False)
    for number in (10, 2):
        (run / f"run.part{number}.bag").write_bytes(b"x")
    (one,) = list_runs(tmp_path)
    assert one.bags == ("run.bag", "run.part2.bag", "run.part10.bag")
    assert one.length == "damaged" and bag_of(tmp_path, "one") == run / "run.bag"


def unfinished(bag: Path) -> None:
    """Write a bag as the recorder has it open: no index yet."""

    def block(data: bytes) -> bytes:
        return struct.pack("<I", len(data)) + data

    fields = {b"op": b"\x03", b"index_pos": bytes(8), b"conn_count": bytes(4)}
    head = b"".join(block(name + b"=" + value) for name, value in fields.items())
    bag.write_bytes(b"#ROSBAG V2.0\n" + block(head) + block(b" " * 4000))
