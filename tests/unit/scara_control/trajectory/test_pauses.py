"""A pause outlives the trajectory in which it was given; no twin controller watches here."""

from __future__ import annotations

import pytest
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.trajectory.goal import Code, GoalError
from unit.scara_control.trajectory.test_goal_queue import GOAL, HERE, NAMES, THERE, Bench

REFUSED = "paused: RESUME or STOP first"


def told(bench: Bench, command: Command) -> None:
    """Give a command to both nodes."""
    bench.pose.command(command, "test", bench.now)
    bench.desk.command(command, "test")


def paused() -> Bench:
    """Return a bench whose goal stands on its way."""
    bench = Bench()
    bench.accept("a", GOAL)
    bench.run(0.5)
    told(bench, Command.PAUSE)
    bench.run(0.5)
    return bench


def test_a_paused_trajectory_is_replaced_by_no_goal_and_goes_on_by_resume() -> None:
    """The newer one would move what somebody holds; the older one keeps its target."""
    bench = paused()
    held = bench.q
    with pytest.raises(GoalError, match=REFUSED):
        bench.accept("b", GOAL)
    bench.run(0.5)
    assert bench.q == held != THERE and bench.pose.is_following and not bench.ended
    told(bench, Command.RESUME)
    assert bench.until_ended().code is Code.SUCCESSFUL
    assert bench.q == pytest.approx(THERE, abs=1e-9)


@pytest.mark.parametrize("leads_on", [Command.RESUME, Command.STOP, Command.ESTOP, Command.YIELD])
def test_a_pause_lasts_when_its_trajectory_is_cancelled(leads_on: Command) -> None:
    """Neither a goal nor a move begins, until somebody leads on."""
    bench = paused()
    bench.desk.cancel("a")
    bench.until_ended()
    bench.run(0.2)
    assert bench.pose.report(bench.now).state == "paused"
    with pytest.raises(GoalError, match=REFUSED):
        bench.accept("b", GOAL)
    with pytest.raises(MotionRefusedError, match=REFUSED):
        bench.pose.move(NAMES, HERE, 20.0, bench.now)
    told(bench, leads_on)
    told(bench, Command.RESET)
    bench.run(0.2)
    bench.accept("c", GOAL)
    assert bench.until_ended(2).code is Code.SUCCESSFUL
