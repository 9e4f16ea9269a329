"""Where recordings may go, and which go when there are too many."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from cell_recorder.recording.recording import RunsState, part_path
from cell_recorder.recording.runs_folder_io import (
    BagPathError,
    bag_file,
    keep_limit,
    mark_of,
    parts_of,
)

STAMP = "2030-01-02_03-04-05"
NOW = 2e9
HALF_MB = 500_000


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        ("", f"{STAMP}/run.bag"),
        ("a.bag", "a.bag"),
        ("deep/er/a.bag", "deep/er/a.bag"),
        ("{runs}/b/run.bag", "b/run.bag"),
    ],
)
def test_a_bag_goes_where_it_was_asked_for(tmp_path: Path, requested: str, expected: str) -> None:
    """An empty path makes a folder of its own per run."""
    assert bag_file(tmp_path, requested.format(runs=tmp_path), STAMP) == tmp_path / expected


@pytest.mark.parametrize(
    "requested",
    [
        "/etc/cron.d/x.bag",
        "../x.bag",
        "a/../../x.bag",
        "a/../b.bag",
        "{runs}/../x.bag",
        "{runs}_too/x.bag",
        "link/x.bag",
        "out.bag",
        "/",
    ],
)
def test_nothing_is_written_outside_the_runs_folder(tmp_path: Path, requested: str) -> None:
    """Neither by an absolute path nor by .. nor over a link; the allowed folder is named."""
    runs = tmp_path / "runs"
    runs.mkdir()
    (runs / "link").symlink_to(tmp_path)
    (runs / "out.bag").symlink_to(tmp_path / "x.bag")
    with pytest.raises(BagPathError, match=f"recordings go into {runs} only"):
        bag_file(runs, requested.format(runs=runs), STAMP)


@pytest.mark.parametrize("requested", ["report.html", "run", "run.bag.exe"])
def test_only_bags_are_written(tmp_path: Path, requested: str) -> None:
    """The page shows what lies in the folder of a run."""
    with pytest.raises(BagPathError, match=r"must end in \.bag"):
        bag_file(tmp_path, requested, STAMP)


def make(runs: Path, name: str, age: float, parts: int = 1, marked: bool = True) -> Path:
    """Make a recording of half a megabyte a part, last written to ``age`` [s] ago."""
    first = runs / name / "run.bag"
    first.parent.mkdir(parents=True)
    files = [Path(part_path(first, number)) for number in range(1, parts + 1)]
    for file in files:
        file.write_bytes(b"x" * HALF_MB)
    if marked:
        mark_of(first).write_text("")
        files.append(mark_of(first))
    for file in files:
        os.utime(file, (NOW - age, NOW - age))
    return first


def kept(runs: Path) -> set[str]:
    """Return the names of the folders that are left."""
    return {entry.name for entry in runs.iterdir()}


def test_the_oldest_of_no_experiment_goes_with_all_its_parts(tmp_path: Path) -> None:
    """Nothing younger than needed; what was removed is told, and counted on."""
    make(tmp_path, "old_experiment", 9000.0, parts=2, marked=False)
    make(tmp_path, "old", 8000.0, parts=2)
    make(tmp_path, "young", 7000.0)
    state, removed = keep_limit(tmp_path, RunsState(limit_mb=2.0, removed=3), NOW)
    assert [each.path for each in removed] == [tmp_path / "old" / "run.bag"]
    assert kept(tmp_path) == {"old_experiment", "young"}
    assert (state.removed, state.problem) == (4, "")
    assert state.held_mb == 1.5


def test_one_byte_beyond_the_limit_is_beyond_it(tmp_path: Path) -> None:
    """What fills it exactly stays."""
    old = make(tmp_path, "old", 9000.0, parts=2)
    assert keep_limit(tmp_path, RunsState(limit_mb=1.0), NOW)[1] == []
    (tmp_path / "note").write_bytes(b"x")
    _, removed = keep_limit(tmp_path, RunsState(limit_mb=1.0), NOW)
    assert [each.path for each in removed] == [old]


def test_an_experiment_and_what_is_being_written_stay(tmp_path: Path) -> None:
    """Even if the folder stays too full, which the state says."""
    make(tmp_path, "experiment", 9000.0, marked=False)
    busy = make(tmp_path, "busy", 8000.0)
    make(tmp_path, "of_another_cell", 30.0)
    state, removed = keep_limit(tmp_path, RunsState(limit_mb=1.0), NOW, busy)
    assert removed == []
    assert kept(tmp_path) == {"experiment", "busy", "of_another_cell"}
    assert state.held_mb == 1.5


def test_a_recording_that_goes_meanwhile_hides_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody removes the first that is looked at behind its mark."""
    for name in "abc":
        make(tmp_path, name, 9000.0)
    lstat, bags = Path.lstat, list[Path]()

    def gone(path: Path) -> os.stat_result:
        bags.extend([path] * (path.suffix == ".bag"))
        # Each is seen once when the sizes are added up.
        if bags[:1] == [path] and bags.count(path) == 2:
            raise FileNotFoundError(2, "No such file or directory")
        return lstat(path)

    monkeypatch.setattr(Path, "lstat", gone)
    _, found = keep_limit(tmp_path, RunsState(limit_mb=0.1), NOW)
    assert len(found) == 2


def test_what_else_lies_beside_a_recording_stays(tmp_path: Path) -> None:
    """Only the bags and the mark go; an empty folder goes with them."""
    make(tmp_path, "with_notes", 9000.0)
    (tmp_path / "with_notes" / "notes.txt").write_text("mine")
    make(tmp_path, "alone", 8000.0)
    keep_limit(tmp_path, RunsState(limit_mb=0.001), NOW)
    assert kept(tmp_path) == {"with_notes"}
    assert [file.name for file in (tmp_path / "with_notes").iterdir()] == ["notes.txt"]


def test_no_link_is_followed(tmp_path: Path) -> None:
    """`latest` counts once, and nothing outside is removed."""
    runs = tmp_path / "runs"
    inside = make(runs, "one", 9000.0)
    outside = make(tmp_path, "elsewhere", 9000.0)
    (runs / "latest").symlink_to("one")
    (runs / "away").symlink_to(outside.parent)
    state, removed = keep_limit(runs, RunsState(limit_mb=0.1), NOW)
    assert [each.path for each in removed] == [inside]
    assert outside.exists() and state.held_mb < 0.01


def test_a_link_is_no_mark(tmp_path: Path) -> None:
    """The recorder makes a file; a link that somebody has put there gives nothing up."""
    kept_one = make(tmp_path, "kept", 9000.0, marked=False)
    marked = make(tmp_path, "marked", 8000.0)
    mark_of(kept_one).symlink_to(mark_of(marked))
    _, removed = keep_limit(tmp_path, RunsState(limit_mb=0.1), NOW)
    assert [each.path for each in removed] == [marked]
    assert kept_one.exists()


def test_a_folder_that_cannot_be_looked_at_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is removed, and the next look may find it again."""
    first = make(tmp_path, "old", 8000.0)

    def refuse(path: Path) -> os.stat_result:
        raise OSError(116, "Stale file handle", str(path))

    monkeypatch.setattr(Path, "lstat", refuse)
    state, removed = keep_limit(tmp_path, RunsState(7.0, 0.1, 3), NOW)
    assert (state.held_mb, state.limit_mb, state.removed, removed) == (7.0, 0.1, 3, [])
    assert "cannot be read: Stale file handle" in state.problem
    monkeypatch.undo()
    assert [each.path for each in keep_limit(tmp_path, state, NOW)[1]] == [first]


def test_a_recording_that_cannot_be_removed_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others go all the same."""
    stuck = make(tmp_path, "stuck", 9000.0)
    make(tmp_path, "old", 8000.0)
    unlink = Path.unlink

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path == stuck:
            raise PermissionError(1, "Operation not permitted")
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    state, removed = keep_limit(tmp_path, RunsState(limit_mb=0.1), NOW)
    assert state.problem == f"{stuck} cannot be removed: Operation not permitted"
    assert [each.path.parent.name for each in removed] == ["old"]


def test_parts_are_found_in_their_order_and_no_stranger_with_them(tmp_path: Path) -> None:
    """A name may hold any sign; part 10,000 follows part 9,999; a copy is no part."""
    first = tmp_path / "r[1].bag"
    numbers = [1, 2, 9999, 10_000]
    names = [Path(part_path(first, number)).name for number in numbers]
    for name in (
        *names,
        "r1.part0002.bag",
        "r[1].part.bag",
        "r[1]_2.bag",
        "r[1].part0002 (copy).bag",
    ):
        (tmp_path / name).write_text("")
    assert [file.name for file in parts_of(first)] == names
