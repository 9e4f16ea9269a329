"""Folders of runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from twin_experiments.run.run_experiment_node import link_latest, new_run_folder


def test_two_runs_in_one_second_get_two_folders(tmp_path: Path) -> None:
    """No run writes into another's folder."""
    first, second = new_run_folder(tmp_path / "runs", "s"), new_run_folder(tmp_path / "runs", "s")
    assert (first.name, second.name) == ("s", "s_2")


def test_latest_follows_the_newest_run(tmp_path: Path) -> None:
    """The link is relative, so that the folder can be moved."""
    for stamp in ("a", "b"):
        link_latest(new_run_folder(tmp_path, stamp))
        assert (tmp_path / "latest").readlink() == Path(stamp)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "latest"]


def test_a_real_folder_called_latest_is_left_alone(tmp_path: Path) -> None:
    """Somebody's data are not replaced by a link."""
    (tmp_path / "latest").mkdir()
    (tmp_path / "latest" / "precious").touch()
    with pytest.raises(OSError, match="latest"):
        link_latest(new_run_folder(tmp_path, "a"))
    assert (tmp_path / "latest" / "precious").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "latest"]
