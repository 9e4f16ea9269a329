"""A robot with filters, lag and ramps stops before a zone; its own programs are let through."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from fanuc_emulator.config import load_programs
from harness.emulated.emulated_pair import EmulatedPair, moves
from harness.pair import ROBOT, SETUP
from harness.programs import program_of, steps_of
from harness.running.pairs import by_pairs
from harness.running.thorough import examples, thorough
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from scara_config import KeepOut
from scara_config.programs.steps import MoveStep
from scara_control.keep_out.points import positions
from twin_controller.core.lead.modes import Mode
from twin_controller.core.safety.stopping import speed_reached
from twin_controller.core.setup import Setup

PHASES = (0.0, 0.003, 0.006, 0.009)
"""When the program begins between two samples [s]."""
FRONTS, SWINGS, OVERRIDES = (60.0, 200.0, 400.0), (-60.0, 0.0, 60.0), (30, 60, 100)
SURFACE = SETUP.keep_out[0].upper_mm[2]


def track_mm(pair: EmulatedPair) -> np.ndarray:
    """Return where the watched points really were [mm], shape (points, samples, 3)."""
    q = np.array([q for q, _ in pair.track])
    return np.array([positions(point, q) for point in pair.setup.points]) * 1e3


def run(pair: EmulatedPair, phase: float, limit: float) -> EmulatedPair:
    """Connect, start the program and run until the robot stands."""
    pair.connect()
    pair.run(phase)
    pair.start()
    pair.run(0.2)
    pair.run_until(lambda: pair.standing, limit)
    return pair


@pytest.mark.parametrize(
    ("front", "joint_2", "override", "phase"), by_pairs(FRONTS, SWINGS, OVERRIDES, PHASES)
)
def test_a_program_that_sweeps_into_a_wall_stands_before_it(
    front: float, joint_2: float, override: int, phase: float
) -> None:
    """While it gains speed, and at full speed; whenever its samples are taken."""
    setup = Setup(ROBOT, SETUP.config)
    setup.keep_out = (KeepOut("wall", (-700.0, front, -1000.0), (700.0, 900.0, 1000.0)),)
    program = moves({"joint_1": 140.0, "joint_2": joint_2, "joint_3": -160.0})
    pair = run(EmulatedPair(program, override, setup), phase, 6.0)
    assert pair.mode is Mode.STOPPED and "keep-out zone wall" in pair.why
    assert track_mm(pair)[:, :, 1].max() < front


@pytest.mark.parametrize(
    ("override", "phase"),
    [
        *zip(OVERRIDES, PHASES),
        *thorough(*sorted({*product(OVERRIDES, PHASES)} - {*zip(OVERRIDES, PHASES)})),
    ],
)
def test_a_program_that_plunges_into_the_table_stands_before_it(
    override: int, phase: float
) -> None:
    """The whole stroke of the vertical axis is there to gain speed."""
    pair = run(EmulatedPair(moves({}, {"joint_3": -205.0}), override), phase, 6.0)
    assert pair.mode is Mode.STOPPED
    assert "keep-out zone below_table" in pair.why
    assert track_mm(pair)[0, :, 2].min() > SURFACE


@pytest.mark.parametrize("name", ["ARTICLE", "PALLETISE"])
def test_the_shipped_programs_are_let_through_at_full_override(name: str) -> None:
    """They come near the table on purpose; the first moves of each."""
    program = next(
        program
        for program in load_programs(ROBOT, ROOT / "config").values()
        if program.name == name
    )
    steps = [step for step in steps_of(program) if isinstance(step, MoveStep)]
    pair = EmulatedPair(program_of(name, steps[: examples(12, 24)]))
    pair.connect()
    pair.start()
    pair.run(0.2)
    pair.run_until(lambda: pair.standing and not pair.shown.outputs.progrun, 30.0)
    assert not [decision.why for decision in pair.decisions() if decision.trigger == "KEEP_OUT"]


@given(before=st.floats(-2.0, 2.0), after=st.floats(-2.5, 2.5), delay=st.floats(0.0, 0.2))
def test_the_reached_speed_is_never_less_than_now_nor_more_than_the_largest(
    before: float, after: float, delay: float
) -> None:
    """A gain goes on, a loss does not count."""
    slope = (after - before) / 0.02
    reached = speed_reached((after,), (slope,), delay, (2.0,))[0]
    assert abs(after) <= abs(reached) <= max(2.0, abs(after)) and reached * after >= 0.0
    if abs(after) > abs(before) and before * after > 0.0:
        assert abs(reached) == pytest.approx(
            max(abs(after), min(2.0, abs(after) + abs(after - before) * delay / 0.02))
        )
