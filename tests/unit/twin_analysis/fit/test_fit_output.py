"""What a fit prints into a file follows from the recording alone."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scara_config import load_robot
from twin_analysis.fit import fit_twin_node as fit_twin

CONFIG = Path(__file__).resolve().parents[4] / "config"


@pytest.mark.parametrize("terminal", [True, False])
def test_a_progress_bar_is_for_a_terminal(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    """Its time is another one in each run; in a file it would make the same fit another one."""
    robot = load_robot(CONFIG)
    start = SimpleNamespace(delay=0.0)
    recording = SimpleNamespace(real=np.zeros((10, len(robot.twin_joints))), delay=None)

    def found(*words: Any) -> str:
        words[-1](1.0)
        return "found"

    monkeypatch.setattr(fit_twin, "fit_twin", found)
    console = Console(file=StringIO(), force_terminal=terminal, width=100)
    words: Any = (robot, CONFIG, recording, start, None, 0.4, 10, console)
    assert fit_twin.search(*words) == "found"
    assert ("mm rms" in console.file.getvalue()) is terminal  # type: ignore[attr-defined]
