"""ARTICLE.LS, printed and typed again: the tool is told the way between the article's positions.

Positions by the law of cosines, straight in joints between them; no code of the planner's.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.config import EmulatorConfig, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.tp.executor import ProgramState
from harness.workspace import ROOT
from scara_config import Robot
from scara_config.programs.files import read_listing, read_taught
from scara_config.programs.tp.printer import print_program

L1, L2, H = 0.35, 0.30, 0.16
PLACES = ((0.65, 0.0, 0.0), (0.51, 0.16, 0.10), (0.51, -0.16, 0.16))
"""P1, P2, P3 of the article [m]."""
ROUTE = (0, 1, 2, 0, 1, 2, 0)
NEAR_M = 1e-4
"""The tool strays at most so far: a tenth of a millimetre."""


def joints(x: float, y: float, z: float) -> np.ndarray:
    """Return the righty joint positions in closed form [rad, m]."""
    cosine = (x * x + y * y - L1 * L1 - L2 * L2) / (2 * L1 * L2)
    q2 = math.acos(min(cosine, 1.0))
    q1 = math.atan2(y, x) - math.atan2(L2 * math.sin(q2), L1 + L2 * math.cos(q2))
    return np.array([q1, q2, z - H])


def tips(q: np.ndarray) -> np.ndarray:
    """Return where the tool is, shape (m, 3) [m]."""
    a, b = q[:, 0], q[:, 0] + q[:, 1]
    return np.stack(
        [L1 * np.cos(a) + L2 * np.cos(b), L1 * np.sin(a) + L2 * np.sin(b), H + q[:, 2]], axis=1
    )


@pytest.mark.parametrize("typed", [False, True])
def test_the_tool_takes_the_articles_way_within_a_tenth_of_a_millimetre(
    config: EmulatorConfig, robot: Robot, tmp_path: Path, typed: bool
) -> None:
    """As it stands in its folder, and as somebody typed what is printed of it."""
    shipped = ROOT / "config" / "robots" / "fanuc_sr6ia" / "programs" / "ARTICLE.LS"
    path = tmp_path / "ARTICLE.LS"
    path.write_text(print_program(read_listing(shipped)))
    program = read_taught(path if typed else shipped, robot)
    assert program == next(
        each for each in load_programs(robot, ROOT / "config").values() if each.name == "ARTICLE"
    )
    controller = Controller(config, robot, {2: program}, 1.7e9)
    controller.write_override(100)
    controller.pulse_input("panel_run2")
    rows, state = [], ProgramState.RUNNING
    while state is not ProgramState.ABORTED or len(rows) < 1000:
        shown = controller.step()
        state = shown.program_state
        rows.append(controller._motion._targets[:3])
    went = tips(np.array(rows))
    stops = [joints(*PLACES[k]) for k in ROUTE]
    share = np.linspace(0.0, 1.0, 8000)[:, None]
    way = tips(np.vstack([a + share * (b - a) for a, b in pairwise(stops)]))
    apart = [float(np.linalg.norm(way - place, axis=1).min()) for place in went[::20]]
    assert max(apart) < NEAR_M
    for k in ROUTE:
        assert np.linalg.norm(went - np.array(PLACES[k]), axis=1).min() < 2e-5
