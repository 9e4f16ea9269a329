"""The twin's tool goes after a pointer that drags it: never faster than the fast jog, level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from operator_panel.control.guide import GRASP_MM, GuidedTool
from operator_panel.control.jog import DeadMan, JogError
from operator_panel.control.tool_jog import ToolArm
from unit.operator_panel.control.conftest import FOUR, LIMIT_PERCENT, SCARA, SIX
from unit.operator_panel.control.test_tool_jog import BENT, FOUR_BENT, PERIOD, SIX_BENT

MM = 1e-3


def place(arm: ToolArm, q: Mapping[str, float]) -> np.ndarray:
    """Return where the tool is [m]."""
    found: np.ndarray = arm.pose(q)[:3, 3]
    return found


def after(q: Mapping[str, float], velocities: Mapping[str, float]) -> dict[str, float]:
    """Return the joints one period later."""
    return {name: value + PERIOD * velocities.get(name, 0.0) for name, value in q.items()}


@pytest.mark.parametrize(("arm", "start"), [(SCARA, BENT), (FOUR, FOUR_BENT), (SIX, SIX_BENT)])
def test_the_tool_comes_to_the_pointer_level_and_no_faster_than_the_fast_jog(
    arm: ToolArm, start: dict[str, float]
) -> None:
    """By as much as the pointer was dragged, from wherever on the tool it took hold."""
    q, begin = dict(start), place(arm, start)
    held = GuidedTool(arm, (begin[0] + 0.02, begin[1] - 0.01)).begun(lambda: q)
    held = held.as_fast_as(GuidedTool(arm, (begin[0] - 0.04, begin[1] + 0.01)))
    for _ in range(80):
        before = place(arm, q)
        q = after(q, held.velocities(lambda q=q: q))
        assert np.linalg.norm(place(arm, q) - before) <= PERIOD * arm.speeds.fast_mm_s * MM * 1.05
    assert place(arm, q) == pytest.approx(begin + (-0.06, 0.02, 0.0), abs=1e-3)


@given(x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0))
def test_wherever_a_pointer_says_it_is_the_speed_is_limited(x: float, y: float) -> None:
    """Of the tool, and of each joint as its jog."""
    begin = place(SCARA, BENT)
    held = replace(GuidedTool(SCARA, (begin[0], begin[1])).begun(lambda: BENT), pointer=(x, y))
    velocities = held.velocities(lambda: BENT)
    for joint in SCARA.joints:
        assert abs(velocities[joint.name]) <= joint.velocity * LIMIT_PERCENT / 100.0
    moved = {name: q + 1e-6 * velocities.get(name, 0.0) for name, q in BENT.items()}
    speed = np.linalg.norm(place(SCARA, moved) - begin) / 1e-6
    assert speed <= SCARA.speeds.fast_mm_s * MM * 1.001


@pytest.mark.parametrize("off_mm", [GRASP_MM + 1.0, math.inf])
def test_a_pointer_beside_the_tool_moves_nothing(off_mm: float) -> None:
    """A press somewhere in the picture is no drag of the tool."""
    x, y, _ = place(SCARA, BENT)
    with pytest.raises(JogError, match="mm off the tool: take hold of the tool"):
        GuidedTool(SCARA, (x + off_mm * MM, y)).begun(lambda: BENT)


def test_guiding_ends_as_a_jog_does() -> None:
    """With no sign of the pointer, at its release, at a STOP; late signs of it begin nothing."""
    x, y, _ = place(SCARA, BENT)
    man = DeadMan(SCARA.robot, LIMIT_PERCENT, 0.25)

    def drag(press: int, now: float) -> dict[str, float]:
        man.hold_way("a", press, GuidedTool(SCARA, (x, y)), now)
        man.tick(now, lambda: BENT)
        man.hold_way("a", press, GuidedTool(SCARA, (x + 0.05, y)), now)
        return man.tick(now, lambda: BENT)

    assert any(drag(1, 0.0).values())
    assert not any(man.tick(0.3, lambda: BENT).values()) and not man.page
    assert not any(drag(1, 0.4).values()), "this press is over"
    for press, end in ((2, lambda: man.release("a", 2)), (3, man.stop)):
        assert any(drag(press, 1.0 * press).values())
        end()
        assert not any(man.tick(press + 0.01, lambda: BENT).values()) and not man.page
