"""A robot that is late on its path is told as that, in time and in millimetres."""

from __future__ import annotations

import re

import pytest
from harness.running.thorough import thorough
from harness.scenes.steps import AWAY
from harness.scenes.troubled import TroubledCell, desk_files
from twin_controller.view import Level, statuses

DELAY = "twin_controller: delay"


def told(cell: TroubledCell) -> tuple[int, str]:
    """Return level and text of the delay's diagnosis."""
    found = statuses(cell.setup, cell._state, {}, cell.clock())
    return next((status.level, status.message) for status in found if status.name == DELAY)


@pytest.mark.parametrize("stood", [*thorough(0.0), 0.1])
def test_a_robot_that_stood_for_a_moment_is_told_as_late(stood: float) -> None:
    """At full speed it stays a third of its reach behind, on its path: nothing said so."""
    with TroubledCell(desk_files("fanuc_sr6ia")) as cell:
        cell.real.robot.write_override(100)
        cell.connect()
        cell.schedule.run(1.0)
        assert cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=100.0).success
        cell.schedule.run(0.4)
        if stood:
            cell.stand_robot(stood)
        texts = []
        for _ in range(40):
            cell.schedule.run(0.02)
            level, text = told(cell)
            if level == Level.WARN:
                texts.append(text)
        late = [
            re.match(r"the real robot is (\d+) ms behind the twin: .* (\d+) mm", t) for t in texts
        ]
        if not stood:
            assert texts == []
            return
        assert late and all(late)
        longest = max(int(match.group(1)) for match in late if match is not None)
        # Its speed is a mean over a quarter of a second, in which the twin brakes.
        assert 0.5 * stood < 1e-3 * longest < 3.0 * stood
        cell.schedule.run(3.0)
        assert told(cell)[0] == Level.OK
