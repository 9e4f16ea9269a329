"""STOP, ESTOP and PAUSE on a robot, by how it was set up: each row of docs/operating/stops.md."""

from __future__ import annotations

import functools

import pytest
from harness.stops.rows import COMMANDS, PLANTS, SCENES, Instant, Row, measure

LATER_S = 0.1
"""The robot stands at most so long after its own ramp has ended."""
AFTER = {"STOP": "STOPPED", "ESTOP": "ESTOP", "PAUSE": "PAUSED"}


@functools.lru_cache(maxsize=1)
def rows(instant: Instant) -> tuple[Row, ...]:
    """Return the rows of an instant; the tests of one instant follow each other."""
    return tuple(measure(instant))


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("plant", PLANTS)
def test_the_robot_stands_within_its_ramp_whatever_was_set_up(
    plant: str, scene: str, command: str
) -> None:
    """CSTOPI for ABORT on or off, *IMSTP assigned or not: HOLD works on all.

    The program is paused or gone and no next move begins; the mode is that of the command.
    """
    found = [row for row in rows(Instant("full", scene, plant)) if row.command == command]
    assert len(found) == 4
    for row in found:
        assert row.moved and row.led == (scene == "twin leads"), row
        assert row.stood_s is not None and row.stood_s <= row.ramp_s + LATER_S, row
        assert not row.began and row.program in ("paused", "aborted"), row
        assert row.success and row.mode == AFTER[command], row


@pytest.mark.parametrize("command", ["STOP", "ESTOP"])
@pytest.mark.parametrize("scene", [scene for scene in SCENES if scene != "twin leads"])
@pytest.mark.parametrize("plant", PLANTS)
def test_hold_alone_stops_a_robots_own_program_too(plant: str, scene: str, command: str) -> None:
    """With the simple allocation HOLD is what is left, and it is enough."""
    found = [row for row in rows(Instant("simple", scene, plant)) if row.command == command]
    assert len(found) == 4
    for row in found:
        assert row.stood_s is not None and row.stood_s <= row.ramp_s + LATER_S, row
        assert row.moved and not row.began and row.program in ("paused", "aborted"), row


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("uop", ["simple", "none"])
def test_a_robot_without_the_signals_of_the_stream_is_never_led(uop: str, plant: str) -> None:
    """Without an RSR, or without any input, no motion of the twin reaches the robot."""
    found = rows(Instant(uop, "twin leads", plant))
    assert found and not any(row.moved or row.led for row in found)
