"""Zones and people count in every mode: the pendant can start a program in all of them."""

from __future__ import annotations

import numpy as np
import pytest
from harness.pair import HOME, SETUP, WATCHED, Pair, ramp, shifted
from scara_control.keep_out.points import positions
from twin_controller.core.actions import Command
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup

RETRY_S = SETUP.config.stop.retry_ms * 1e-3
FAR, NEAR = 6.0, 0.8
SURFACE = SETUP.keep_out[0].upper_mm[2] * 1e-3
INTO_THE_TABLE = shifted(HOME, 0.0, 0.0, -45.0)


def into(mode: Mode, setup: Setup = SETUP) -> Pair:
    """Return a pair in a mode in which nobody leads, its robot well and free to be started."""
    pair = Pair(setup=setup, twin=shifted(HOME, 60.0) if mode is Mode.ALIGNING else HOME)
    pair.link("real", True)
    pair.link("twin", True)
    pair.see(FAR, 0.8 if mode is Mode.ALIGNING else 2.5)
    if mode is Mode.FAULT:
        pair.alarm("SRVO-050")
        pair.see(FAR, 0.3)
        pair.fault = pair.fault_persists = False
    elif mode is Mode.OFFLINE:
        pair.link("twin", False)
        pair.see(FAR, 0.3)
    assert pair.mode is mode
    return pair


def stops(pair: Pair, begun: int) -> int:
    """Return how often the real robot was told to stop since action number ``begun``."""
    return pair.performed(begun).count(Command.STOP_REAL)


@pytest.mark.parametrize("mode", [Mode.OFFLINE, Mode.FAULT])
def test_a_robot_started_beside_a_person_is_stopped_in_every_mode(mode: Mode) -> None:
    """Once, and the mode means what it meant."""
    pair = into(mode, WATCHED)
    begun = len(pair.actions)
    pair.see(NEAR, 0.5)
    assert stops(pair, begun) == 0, "a robot at rest is left alone"
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 3.0))
    pair.see(NEAR, 1.5)
    assert not pair.own_program and pair.mode is mode
    assert pair.real_q[0] == pytest.approx(HOME[0], abs=0.01)
    assert stops(pair, begun) == 1 and "a person" in pair.why


def test_a_program_that_runs_on_into_a_stopped_pair_is_stopped_for_a_person() -> None:
    """It was begun while a fault was latched: behind the RESET nobody leads, and it still moves."""
    pair = into(Mode.FAULT, WATCHED)
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 8.0))
    pair.see(FAR, 0.3)
    assert pair.operate("RESET").success
    pair.see(FAR, 0.5)
    assert pair.mode is Mode.STOPPED and pair.own_program
    begun = len(pair.actions)
    pair.see(NEAR, 1.0)
    assert stops(pair, begun) >= 1 and not pair.own_program
    assert pair.mode is Mode.STOPPED and "a person" in pair.why


@pytest.mark.parametrize("mode", [Mode.OFFLINE, Mode.FAULT, Mode.ALIGNING])
def test_a_robot_started_towards_a_zone_is_stopped_before_it_in_every_mode(mode: Mode) -> None:
    """The tool does not enter; an alignment ends by it, the other modes stay."""
    pair = into(mode)
    begun = len(pair.actions)
    pair.start_program(ramp(HOME, INTO_THE_TABLE, 1.0), run=1.3)
    assert not pair.own_program
    assert positions(SETUP.points[0], np.array([pair.real_q]))[0][2] > SURFACE
    assert stops(pair, begun) == 1 and "keep-out zone below_table" in pair.why
    assert pair.mode is (Mode.STOPPED if mode is Mode.ALIGNING else mode)


def test_a_robot_that_does_not_obey_is_stopped_again_but_not_each_cycle() -> None:
    """As any stop; started anew it is stopped at once, one that never obeys loses its drives."""
    pair = into(Mode.OFFLINE, WATCHED)
    begun = len(pair.actions)
    obeys = pair.command_real
    pair.command_real = lambda do: None  # type: ignore[method-assign]
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 6.0))
    pair.see(NEAR, 2.5 * RETRY_S)
    assert stops(pair, begun) == 3
    pair.command_real = obeys  # type: ignore[method-assign]
    pair.see(NEAR, 3 * RETRY_S)
    begun, here = len(pair.actions), pair.real_q
    pair.start_program(ramp(here, shifted(here, 60.0), 3.0))
    pair.see(NEAR, 0.2)
    assert stops(pair, begun) == 1 and not pair.own_program
    pair.command_real = lambda do: obeys(do) if do is Command.ESTOP_REAL else None  # type: ignore[method-assign]
    pair.start_program(ramp(pair.real_q, shifted(pair.real_q, 60.0), 6.0))
    pair.see(NEAR, 10 * RETRY_S)
    assert pair.mode is Mode.ESTOP and not pair.drives
