"""A program that was taught and exported, in joints and Cartesian: both sides go the same way.

The robot runs it while the twin follows; then the operator leads both through it, line by line.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from harness.running.thorough import SEARCH
from harness.scenes.steps import ROBOT
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files
from harness.workspace import ROOT
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft, draft_of, empty
from operator_panel.teach.places import position_of
from operator_panel.teach.walk import LedMove, Walk
from scara_config.frames import find_frames
from scara_config.programs.files import is_cartesian, taught_of
from scara_config.programs.tp.listing import Word
from what_if.converting import converted_text

REST_MM = 0.1
"""Both tools, and one way of running it beside another, at each rest."""
MOTION_PERCENT = {"ideal": 0.3, "field": 1.0}
"""Of reach, both tools at one instant while the robot leads: docs/benchmarks.md."""
REST_S = 1.0
ALL_STOPS = [
    ("J", 50.0, (0.0, 60.0, -40.0)),
    ("L", 200.0, (30.0, 60.0, -60.0)),
    ("L", 150.0, (50.0, 90.0, -60.0)),
    ("J", 30.0, (-20.0, 110.0, -30.0)),
    ("L", 200.0, (-45.0, 80.0, -30.0)),
]
"""Kind, speed [percent or mm/s], where [deg, deg, mm]; by day the first three."""
STOPS = ALL_STOPS if SEARCH else ALL_STOPS[:3]


def drafted(files: CellFiles) -> Draft:
    """Return the stops as they are taught on the page, with a rest behind each."""
    robot = files.robot
    made = empty("MINE", robot)
    for number, (kind, speed, (one, two, three)) in enumerate(STOPS):
        values = dict(zip(("joint_1", "joint_2", "joint_3"), (one, two, three)))
        now = {j.name: values.get(j.name, 0.0) * j.scale for j in robot.joints}
        here = position_of(robot, now)
        made = teach.recorded(made, robot, 2 * number, here, kind, speed, None)
        made = teach.waiting(made, robot, 2 * number + 1, REST_S)
    return made


def exported(files: CellFiles) -> str:
    """Return its file in the frame of the pallet; each position is Cartesian."""
    table = find_frames(ROOT / "config")
    text, kept = converted_text(drafted(files).text, files.robot, table, "cartesian", 1)
    assert not kept and all(map(is_cartesian, draft_of(text, files.robot).program.positions))
    return text


Ways = dict[str, tuple[np.ndarray, np.ndarray]]
"""Of each side times [s] and places of its tool [mm], shape (m, 3)."""


def ways_of(cell: VirtualCell, since: float) -> Ways:
    """Return where both tools were."""
    tool, names = cell.setup.tool, cell.setup.names
    columns = [names.index(joint.name) for joint in tool.joints]
    found: Ways = {}
    for side in ("real", "twin"):
        rows = [row for row in getattr(cell, side).truth if row[0] >= since]
        places = [tool.position([q[k] for k in columns]) for _, q, _ in rows]
        found[side] = np.array([at for at, _, _ in rows]), 1e3 * np.array(places)
    return found


def apart(ways: Ways) -> np.ndarray:
    """Return the distance of both tools at each instant of the twin [mm]."""
    (at, real), (times, twin) = ways["real"], ways["twin"]
    there = np.column_stack([np.interp(times, at, real[:, axis]) for axis in range(3)])
    return np.linalg.norm(there - twin, axis=1)


def rests(ways: Ways) -> np.ndarray:
    """Return where the tools stood, shape (rests, sides, 3): those that hold longer than 0.5 s."""
    (at, real), (times, twin) = ways["real"], ways["twin"]
    stood = [0, *np.flatnonzero(np.linalg.norm(np.diff(real, axis=0), axis=1) > 1e-3), len(at) - 1]
    ends = [at[b] for a, b in pairwise(stood) if at[b] - at[a] > 0.5]
    found = [
        [[np.interp(end - 0.01, *each) for each in zip((t,) * 3, w.T)] for t, w in ways.values()]
        for end in ends
    ]
    assert times[-1] >= at[-1] - 0.1 and len(twin) > 0
    return np.array(found)


@cache
def files_of(plant: str) -> CellFiles:
    """Return the cell's files, with the program in place of its second one."""
    return load_files(ROBOT, plant=plant)


def run(plant: str, text: str) -> Ways:
    """Let the robot run a program, the twin behind it; return both ways."""
    files = files_of(plant)
    draft = draft_of(text, files.robot)
    programs = {**files.programs, 2: taught_of(draft.program, files.robot, "MINE.LS")}
    with VirtualCell(dataclasses.replace(files, programs=programs)) as cell:
        cell.connect()
        begun = cell.schedule.now
        cell.run_program("MINE")
        cell.wait_still(REST_S)
        return ways_of(cell, begun)


@pytest.mark.thorough
@pytest.mark.parametrize("plant", ["ideal", "field"])
def test_an_exported_program_leads_both_sides_the_same_way(plant: str) -> None:
    """In joints and Cartesian to the same rests; in motion within the limits of a led twin."""
    files = files_of(plant)
    known = [run(plant, text) for text in (drafted(files).text, exported(files))]
    stood = [rests(ways) for ways in known]
    for ways, places in zip(known, stood):
        assert len(places) == len(STOPS)
        assert np.linalg.norm(places[:, 0] - places[:, 1], axis=1).max() <= REST_MM
        assert apart(ways).max() <= 0.01 * MOTION_PERCENT[plant] * files.robot.reach_mm
    assert np.linalg.norm(stood[0] - stood[1], axis=2).max() <= REST_MM
    led = run_by_operator(plant)
    assert np.linalg.norm(led - stood[0], axis=2).max() <= REST_MM


def run_by_operator(plant: str) -> np.ndarray:
    """Lead both through the draft line by line; return where they stood behind each motion."""
    files = files_of(plant)
    found = []
    with VirtualCell(files) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        walk = Walk(drafted(files), files.robot)
        while not isinstance(act := walk.run_on(), Word):
            if not isinstance(act, LedMove):
                continue
            begun = cell.schedule.now
            fields = {"target" if k == "joint_positions" else k: v for k, v in act.fields.items()}
            fields["target"] = tuple(fields["target"])
            answer = cell.operate("MOVE_JOINTS", **fields)
            assert answer.success, answer.message
            cell.wait_still(0.6)
            found.append([way[-1] for _, way in ways_of(cell, begun).values()])
    return np.array(found)
