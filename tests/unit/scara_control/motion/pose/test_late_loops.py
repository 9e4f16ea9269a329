"""A loop of joint_pose_controller that is late, and a clock that goes back."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from harness.opponents import ideal_twin
from harness.opponents.ideal_twin import CONFIG, DT, FAR, HOME, Bench
from scara_control.joint_motion import JointMotion


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


def test_a_stall_before_a_move_leaves_the_follower_the_time_to_aim(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where the first motion is announced further ahead than a packet looks, it waits as well."""
    longer = msgspec.structs.replace(CONFIG.move, announce=0.4)
    monkeypatch.setattr(ideal_twin, "CONFIG", msgspec.structs.replace(CONFIG, move=longer))
    bench = Bench()
    bench.move()
    bench.tick(5)
    bench.now += 1.0
    bench.tick()
    stood = bench.now
    while not any(bench.setpoints[-1].qdot):
        bench.tick()
    told = 5 * DT + longer.horizon
    assert bench.now - stood == pytest.approx(longer.announce - told, abs=2.5 * DT)


def test_a_clock_that_goes_back_ends_all_motion():
    """After a reset of the simulation nothing of the old time axis is left but the newest cap."""
    bench = Bench()
    bench.move()
    bench.core.limit_speed(50.0, bench.now)
    bench.tick(20)
    bench.now = 0.0
    bench.tick()
    assert bench.report.speed_limit_percent == 50.0
    assert [outcome.message for outcome in bench.outcomes] == ["aborted: the clock went back"]
    assert bench.report.state == "idle"
    bench.tick()
    bench.q, bench.qdot = HOME, (0.0,) * 4
    bench.tick()
    bench.move()
    bench.until("idle")


@pytest.mark.parametrize("late", [1, 2, 5, 20])
def test_a_loop_that_was_held_while_a_move_began_sends_each_set_point_once(late: int) -> None:
    """The request is the first to know what time it is; the loop's ticks of before come then."""
    bench = Bench()
    held = bench.now + DT
    bench.core.tick(held + (late + 0.4) * DT)
    bench.core.measure(JointMotion.measured(bench.q, bench.qdot, held))
    bench.core.move((), FAR, 100.0, held + (late + 0.4) * DT)
    bench.now = held - DT
    bench.until("idle", 2000)
    assert [outcome.success for outcome in bench.outcomes] == [True]
    stamps = [packet.times[0] for packet in bench.packets]
    assert np.allclose(np.diff(stamps), DT) and stamps[0] == pytest.approx(held + late * DT)
