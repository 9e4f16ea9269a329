"""When the cores of the motion nodes may rest, and that a motion after a rest begins now."""

from __future__ import annotations

import pytest
from harness.opponents.ideal_twin import DT, FAR, HOME, Bench
from scara_control.joint_motion import JointMotion
from scara_control.motion.commands import Command


def rest(bench: Bench, seconds: float) -> None:
    """Let time pass without ticks, as in a node that rests; the twin goes on measuring."""
    bench.now += seconds
    bench.core.measure(JointMotion.measured(HOME, (0.0,) * len(HOME), bench.now))


def test_a_move_keeps_the_core_busy_until_the_joints_are_there() -> None:
    """From its announcement to its answer, the time that the joints take to arrive included."""
    bench = Bench()
    assert bench.core.is_idle
    bench.move()
    while not bench.outcomes:
        assert not bench.core.is_idle
        bench.tick()
    assert bench.core.is_idle


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP])
def test_a_stop_keeps_the_core_busy_until_its_ramp_has_ended(command: Command) -> None:
    """A latched emergency stop rests too: it needs no ticks."""
    bench = Bench()
    bench.move()
    bench.tick(20)
    bench.core.command(command, "", bench.now)
    assert not bench.core.is_idle
    bench.tick(100)
    assert bench.core.is_idle


@pytest.mark.parametrize("seconds", [0.003, 0.05, 40.0])
def test_a_move_after_a_rest_is_announced_from_now_on(seconds: float) -> None:
    """The first packet is no older than a period, and the way is the same as without the rest."""
    fresh, rested = Bench(), Bench()
    rest(rested, seconds)
    rested.core.tick(rested.now)
    asked = rested.now
    for bench in (fresh, rested):
        bench.move(FAR)
        bench.until("idle")
    assert asked - DT <= rested.packets[0].times[0] <= asked + 2 * DT
    ways = [[s.q for s in bench.setpoints if s.q != HOME] for bench in (fresh, rested)]
    assert ways[0] == ways[1]
