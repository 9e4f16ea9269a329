"""A loop of joint_pose_controller that is late, and a clock that goes back."""

from __future__ import annotations

import msgspec
from harness.opponents.ideal_twin import FAR, HOME, Bench


def test_a_late_loop_does_not_make_the_twin_jump():
    """After a stall longer than the horizon the path goes on where the last packet ended."""
    bench = Bench()
    bench.move()
    bench.tick(20)
    promised = bench.packets[-1].points[-1]
    bench.now += 0.4
    bench.tick()
    assert msgspec.structs.replace(bench.setpoints[-1], time=promised.time) == promised
    bench.until("idle")
    assert bench.q == FAR


def test_a_clock_that_goes_back_ends_all_motion():
    """After a reset of the simulation nothing of the old time axis is left."""
    bench = Bench()
    bench.move()
    bench.tick(20)
    bench.now = 0.0
    bench.tick()
    assert [outcome.message for outcome in bench.outcomes] == ["aborted: the clock went back"]
    assert bench.report.state == "idle"
    bench.tick()
    bench.q, bench.qdot = HOME, (0.0,) * 4
    bench.tick()
    bench.move()
    bench.until("idle")
