"""Folders of runs."""

from __future__ import annotations

from pathlib import Path

from twin_experiments.run.run_experiment_node import new_run_folder


def test_two_runs_in_one_second_get_two_folders(tmp_path: Path) -> None:
    """No run writes into another's folder."""
    first, second = new_run_folder(tmp_path / "runs", "s"), new_run_folder(tmp_path / "runs", "s")
    assert (first.name, second.name) == ("s", "s_2")
