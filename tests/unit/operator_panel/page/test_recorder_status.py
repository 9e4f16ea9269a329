"""What tab Recordings says of the recorder: as it is now, not as it was told last."""

from __future__ import annotations

import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.workspace import ROOT
from operator_panel.config import load_panel
from operator_panel.control.authority import Role
from operator_panel.page.records import recordings_io
from operator_panel.page.records.recordings_io import _Recordings
from operator_panel.page.view_io import PageView
from operator_panel.runs import Run
from operator_panel.view.snapshot import Diagnosis, Snapshot
from scara_config import load_robot

RECORDING = "recording run_7, 12 s"


def watched() -> PageView:
    """Return a page that only watches, and no cell."""
    nobody: Any = None
    viewer: Any = SimpleNamespace(role=Role.VIEWER)
    robot, config = load_robot(ROOT / "config"), load_panel(ROOT / "config")
    return PageView(robot, config, nobody, nobody, nobody, viewer)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ({}, "Recorder: not heard of yet"),
        ({"/recorder": 1.0}, f"Recorder: {RECORDING}"),
        # It was killed; the operator makes the run and has no bag.
        (
            {"/recorder": 10.2},
            "Recorder: silent for 10 s: nothing may be recorded. Is its node running?",
        ),
        ({"/cell_1/recorder": 10.2, "/recorder": 1.0}, f"Recorder: {RECORDING}"),
    ],
)
def test_recorder_that_has_died_is_not_shown_as_recording(
    tmp_path: Path, names: dict[str, float], told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its last status stays among the diagnoses."""
    from nicegui import Client, ui

    now = time.monotonic()
    heard = {name: Diagnosis(0, name, RECORDING, now - after) for name, after in names.items()}
    with Client(ui.page("/recordings")):
        form = _Recordings(watched(), tmp_path)
        # A machine that stands still in between makes no silence longer.
        monkeypatch.setattr(recordings_io, "time", SimpleNamespace(monotonic=lambda: now))
        form._refresh(Snapshot(diagnoses=heard), False)
    assert form._status.text == told


def test_no_name_of_a_bag_ends_the_list_of_recordings(tmp_path: Path) -> None:
    """Somebody may have put it there; the recordings behind it must be listed, too."""
    from nicegui import Client, ui

    name = "of hall\\N.bag"
    with Client(ui.page("/recordings")) as client:
        _Recordings(watched(), tmp_path)._line(Run("run_7", "", "", "", True, bags=(name,)))
    found = [each.props.get("href") for each in client.elements.values()]
    assert f"/runs/run_7/{name}" in found
