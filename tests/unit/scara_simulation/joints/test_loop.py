"""One joint's loop: the last command wins, switching makes no jump, limits hold and are counted."""

from __future__ import annotations

import msgspec
import pytest
from scara_control.joint_track import JointTrack
from scara_control.pid import PidGains
from scara_simulation.config import LoopGains
from scara_simulation.joints.loop import JointLoop
from scara_simulation.joints.model import JointModel

DT = 1e-3
INERTIA = 2.0
GAINS = LoopGains(
    position=PidGains(p=INERTIA * 3600.0, i=INERTIA * 36000.0, d=INERTIA * 120.0, i_clamp=5.0),
    velocity=PidGains(p=INERTIA * 60.0, i=INERTIA * 45.0, i_clamp=5.0),
)
MODEL = JointModel(
    "joint_1",
    lower=-1.0,
    upper=1.0,
    velocity=3.0,
    acceleration=10.0,
    effort=100.0,
    standstill=0.003,
    tolerance=1e-4,
    jerk=1000.0,
)


QUICK = msgspec.structs.replace(MODEL, velocity=1e3)
"""A joint for which no set point is a jump: what is due is met at once."""


class Joint:
    """An inertia with a constant load and dry friction.

    Moved by a loop as the simulator does it.
    """

    def __init__(self, load=0.0, q=0.0, model_based=True, model=MODEL, friction=0.0):
        self.loop = JointLoop(model, GAINS, q, model_based=model_based)
        self.q, self.qdot, self.t, self.load, self.model_based = q, 0.0, 0.0, load, model_based
        self.friction = friction
        self.efforts = []

    def run(self, steps):
        """Advance and return the joint."""
        for _ in range(steps):
            wanted = self.loop.reference(self.t, self.q, self.qdot, DT)
            effort = self.loop.effort(
                self.q, self.qdot, INERTIA * wanted[2] if self.model_based else 0.0, DT
            )
            self.efforts.append(effort)
            self.qdot += (effort - self.load) / INERTIA * DT
            self.qdot -= max(-abs(self.qdot), min(abs(self.qdot), self.friction / INERTIA * DT)) * (
                1 if self.qdot > 0 else -1
            )
            self.q += self.qdot * DT
            self.t += DT
        return self


def track(times, points, **options):
    """Make a track of one joint."""
    defaults = {"extrapolation_limit": 0.05, "stop_accelerations": [10.0]}
    columns = [[[point[k]] for point in points] for k in range(3)]
    return JointTrack(times, *columns, **(defaults | options))


def test_joint_starts_by_holding_its_position():
    """Without a command nothing moves, whatever the load."""
    joint = Joint(load=3.0, q=0.4).run(3000)
    assert joint.loop.mode == "position"
    assert joint.q == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize("model_based", [True, False])
def test_position_command_is_reached_and_reported(model_based):
    """What is told is the command, and error is set point minus measured."""
    joint = Joint(model_based=model_based)
    joint.loop.command_position(0.01)
    joint.run(1)
    state = joint.loop.state(joint.q, joint.qdot)
    assert (state.kind, state.set_point) == ("position", 0.01)
    assert state.error == pytest.approx(0.01 - joint.q)
    joint.run(1500)
    assert joint.q == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize("step", [0.001, 0.01, 0.7, -0.9])
def test_position_step_of_any_size_keeps_effort_speed_and_set_point(step):
    """The way to the set point is limited, so the loop neither saturates nor overshoots."""
    joint = Joint()
    joint.loop.command_position(step)
    speeds, shares = [], []
    for _ in range(2000):
        joint.run(1)
        speeds.append(abs(joint.qdot))
        shares.append(joint.q / step)
    assert joint.loop.saturated_steps == 0
    assert max(speeds) < 1.01 * MODEL.velocity
    assert max(map(abs, joint.efforts)) < 1.3 * INERTIA * MODEL.acceleration
    assert max(shares) < 1.005
    assert joint.q == pytest.approx(step, abs=1e-7)


def test_new_position_command_goes_on_from_the_present_motion():
    """A command on the way makes no jump of the effort, and the last one is reached."""
    joint = Joint(model=msgspec.structs.replace(MODEL, jerk=100.0))
    joint.loop.command_position(0.9)
    joint.run(300)
    joint.loop.command_position(-0.9)
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(joint.efforts[-2], abs=2.0 * INERTIA * 100.0 * DT)
    assert joint.run(3000).q == pytest.approx(-0.9, abs=1e-6)


@pytest.mark.parametrize("known", [0.8, 1.0, 1.2])
def test_joint_does_not_stick_beside_its_set_point(known):
    """At rest the error says which way to push, also when the friction is not known exactly."""
    model = msgspec.structs.replace(MODEL, friction=known * 8.0, stick_band=2e-5)
    joint = Joint(model=model, friction=8.0)
    for target in (0.002, -0.1, 0.0):
        joint.loop.command_position(target)
        assert joint.run(1500).q == pytest.approx(target, abs=1e-4)
        joint.run(1000)
        assert joint.q == pytest.approx(target, abs=4e-5)
        assert abs(joint.qdot) < 0.01 * MODEL.standstill


def test_a_jump_of_the_set_point_does_not_wind_up_the_integral():
    """Wound up by the jump, the integral would carry the joint 5e-4 past the set points."""
    joint = Joint()
    joint.run(10)
    joint.loop.command_track(track([joint.t], [(0.05, 0.0, 0.0)]), 0)
    assert max(joint.run(1).q for _ in range(600)) < 0.05 + 1e-4
    assert joint.q == pytest.approx(0.05, abs=1e-6)


def test_new_gains_keep_the_effort_of_the_integral():
    """The load is carried on; the other loop's gains are those of the next hand-over."""
    joint = Joint(load=4.0).run(3000)
    other = LoopGains(
        position=PidGains(p=9000.0, i=30000.0, d=300.0, i_clamp=6.0), velocity=GAINS.velocity
    )
    joint.loop.set_gains(other)
    assert joint.loop.loop_gains is other
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(4.0, abs=1e-3)
    joint.loop.set_gains(
        msgspec.structs.replace(other, position=PidGains(p=9000.0, i=30000.0, d=300.0, i_clamp=3.0))
    )
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(3.0, abs=1e-2)


def test_d_of_the_velocity_loop_acts_against_the_measured_acceleration():
    """A step of the set point makes no kick, a push does."""
    gains = LoopGains(position=GAINS.position, velocity=PidGains(d=5.0))
    loop = JointLoop(MODEL, gains, 0.0, model_based=False)
    loop.command_velocity(1.0)
    efforts = []
    for qdot in (0.0, 0.0, 0.01):
        loop.reference(0.0, 0.0, qdot, DT)
        efforts.append(loop.effort(0.0, qdot, 0.0, DT))
    assert efforts == pytest.approx([0.0, 0.0, -5.0 * 0.01 / DT])


def test_velocity_command_is_reached_and_zero_turns_into_holding():
    """0 at standstill closes the position loop where the joint stands."""
    joint = Joint()
    joint.loop.command_velocity(0.5)
    joint.run(400)
    assert joint.qdot == pytest.approx(0.5, abs=0.01)
    assert not joint.loop.holding
    joint.loop.command_velocity(0.0)
    joint.run(1500)
    held = joint.loop.position_setpoint
    assert joint.loop.holding
    assert joint.loop.mode == "velocity"
    joint.load = 4.0
    joint.run(2000)
    assert joint.q == pytest.approx(held, abs=1e-5)


def test_last_command_wins():
    """Each command changes the mode at once, and forgets the one before."""
    joint = Joint()
    joint.loop.command_track(track([0.0], [(0.5, 0.0, 0.0)]), 0)
    assert joint.loop.mode == "trajectory"
    joint.loop.command_velocity(0.1)
    assert joint.loop.mode == "velocity"
    joint.loop.command_position(-0.2)
    assert joint.loop.mode == "position"
    assert joint.run(2000).q == pytest.approx(-0.2, abs=1e-5)


def test_switching_the_mode_makes_no_jump_of_the_effort():
    """What the integral carries is taken over to the other loop and back."""
    joint = Joint(load=4.0).run(3000)
    carried = joint.efforts[-1]
    assert carried == pytest.approx(4.0, abs=1e-3)
    joint.loop.command_velocity(0.0)
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(carried, abs=1e-3)
    joint.loop.command_velocity(1e-4)
    joint.run(2)
    assert joint.efforts[-1] == pytest.approx(carried, abs=0.1)
    joint.loop.command_position(joint.q)
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(carried, abs=0.5)


def test_trajectory_with_feed_forward_is_followed_without_error():
    """Position, velocity and acceleration are met, half a step of the integrator included."""
    joint = Joint()
    joint.loop.command_track(track([0.0, 0.4], [(0.0, 0.0, 0.0), (0.8, 0.0, 0.0)]), 0)
    worst = 0.0
    for _ in range(400):
        expected = joint.loop.reference(joint.t, joint.q, joint.qdot, DT)[0]
        worst = max(worst, abs(expected - joint.q))
        joint.run(1)
    assert max(map(abs, joint.efforts)) > 40.0
    assert worst < 2e-5


def test_newer_track_takes_over_at_its_first_point():
    """A packet that begins later does not interrupt what is due before it."""
    joint = Joint(model=QUICK)
    joint.loop.command_track(track([0.0], [(0.1, 0.0, 0.0)]), 0)
    joint.loop.command_track(track([0.5], [(0.3, 0.0, 0.0)]), 0)
    assert joint.loop.reference(0.4, 0.0, 0.0, DT)[0] == 0.1
    assert joint.loop.reference(0.5, 0.0, 0.0, DT)[0] == 0.3


def test_newer_track_replaces_all_that_was_to_come_after_its_first_point():
    """A stop that is due now ends every motion announced for later."""
    joint = Joint(model=QUICK)
    for start, q in ((0.0, 0.1), (0.5, 0.3), (0.2, 0.2)):
        joint.loop.command_track(track([start], [(q, 0.0, 0.0)]), 0)
    assert joint.loop.reference(0.4, 0.0, 0.0, DT)[0] == 0.2
    assert joint.loop.reference(0.9, 0.0, 0.0, DT)[0] == 0.2


def test_postponed_track_is_the_same_motion_later():
    """After a pause the motion goes on where it stood."""
    joint = Joint(model=QUICK)
    joint.loop.command_track(track([0.0, 1.0], [(0.0, 0.5, 0.0), (0.5, 0.5, 0.0)]), 0)
    before = joint.loop.reference(0.4, 0.0, 0.0, DT)
    joint.loop.postpone(10.0)
    assert joint.loop.reference(10.4, 0.0, 0.0, DT) == pytest.approx(before)


def test_set_point_beyond_a_limit_is_kept_inside_and_counted():
    """An extrapolation must not drive the joint into its stop."""
    joint = Joint(q=0.9, model=QUICK)
    joint.loop.command_track(track([0.0], [(0.95, 3.0, 0.0)]), 0)
    assert joint.loop.reference(0.04, 0.9, 0.0, DT) == (1.0, 0.0, 0.0)
    assert joint.loop.limited_steps == 1


@pytest.mark.parametrize(("over", "counted"), [(0.9e-3, 0), (1.1e-3, 1)])
def test_smooth_path_a_hair_beyond_a_limit_is_kept_inside_and_not_counted(over, counted):
    """Two set points inside, and ten tolerances between them: no trouble worth an alarm."""
    joint = Joint(q=1.0)
    joint.loop.command_track(track([0.0], [(1.0 + over, 0.0, 0.0)]), 0)
    assert joint.loop.reference(0.0, 1.0, 0.0, DT) == (1.0, 0.0, 0.0)
    assert joint.loop.limited_steps == counted


def test_set_point_beyond_a_limit_by_less_than_the_tolerance_is_followed():
    """Rounding at the limit is no trouble worth counting."""
    joint = Joint(q=1.0)
    joint.loop.command_track(track([0.0], [(1.00009, 0.0, 0.0)]), 0)
    assert joint.loop.reference(0.0, 1.0, 0.0, DT)[0] == 1.00009
    assert joint.loop.limited_steps == 0


def test_velocity_command_towards_a_limit_slows_down_and_stops_there():
    """The joint stands at its limit without overrunning it."""
    joint = Joint(q=0.5)
    joint.loop.command_velocity(3.0)
    joint.run(3000)
    assert joint.q == pytest.approx(1.0, abs=1e-4)
    assert joint.loop.holding
    assert joint.loop.limited_steps > 0
    joint.loop.command_velocity(-0.5)
    joint.run(300)
    assert joint.qdot == pytest.approx(-0.5, abs=0.02)


def test_saturated_effort_is_limited_counted_and_stops_the_integral():
    """Past the joint's effort nothing goes out, and the integral waits."""
    joint = Joint(model_based=False)
    joint.loop.command_position(1.0)
    joint.run(5)
    assert joint.efforts == [100.0] * 5
    assert joint.loop.saturated_steps == 5
    joint.loop.command_position(joint.q)
    joint.qdot = 0.0
    joint.run(1)
    assert joint.efforts[-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("steps", [0, 50])
def test_a_stop_ends_a_position_command_of_a_plain_pid(steps):
    """It has no path to be seen by, and before its first step not even a speed."""
    joint = Joint(model_based=False)
    joint.loop.command_position(1.0)
    joint.run(steps)
    joint.loop.stop()
    stood = joint.run(2000).q
    assert stood < 0.3
    assert joint.run(500).q == pytest.approx(stood, abs=1e-5)


def test_a_stop_leaves_a_joint_of_a_plain_pid_that_rests_where_its_weight_holds_it():
    """It hangs below its set point; held there, it would sag by as much again at each stop."""
    joint = Joint(load=50.0, model_based=False).run(3000)
    joint.loop.stop()
    assert joint.loop.mode == "position"
    assert joint.loop.position_setpoint == 0.0


def test_friction_is_overcome_in_the_direction_of_the_set_point_without_a_jump():
    """Damping grows with the speed; dry friction sets in over the speed of standing still."""
    model = JointModel("j", -1, 1, 3, 10, 100, standstill=0.01, damping=2.0, friction=0.5)
    assert model.friction_effort(0.0) == 0.0
    assert model.friction_effort(0.005) == pytest.approx(0.26)
    assert model.friction_effort(1.0) == pytest.approx(2.5)
    assert model.friction_effort(-1.0) == pytest.approx(-2.5)


@pytest.mark.parametrize(
    ("velocity", "error", "effort"),
    [
        (0.0, 1e-4, 0.25),
        (0.0, -1e-3, -0.5),
        (0.005, 2e-4, 0.5),
        (0.005, -2e-4, 0.0),
        (0.01, -1.0, 0.5),
        (-1.0, 1.0, -0.5),
    ],
)
def test_friction_at_rest_is_overcome_in_the_direction_of_the_error(velocity, error, effort):
    """In proportion within the band; while the set point moves the error changes nothing."""
    model = JointModel("j", -1, 1, 3, 10, 100, standstill=0.01, friction=0.5, stick_band=2e-4)
    assert model.friction_effort(velocity, error) == pytest.approx(effort)


def test_reset_forgets_every_command():
    """After a reset the joint holds the given position in position mode."""
    joint = Joint()
    joint.loop.command_track(track([0.0], [(0.5, 1.0, 0.0)]), 0)
    joint.run(100)
    joint.loop.reset(0.0)
    joint.q = joint.qdot = 0.0
    joint.run(100)
    assert (joint.loop.mode, joint.q, joint.loop.applied_effort) == ("position", 0.0, 0.0)


def test_velocity_loop_is_reported_in_velocity_mode():
    """Set point and value are velocities then."""
    joint = Joint()
    joint.loop.command_velocity(0.5)
    joint.run(10)
    state = joint.loop.state(joint.q, joint.qdot)
    assert (state.joint, state.kind, state.set_point, state.process_value) == (
        "joint_1",
        "velocity",
        0.5,
        joint.qdot,
    )
    assert state.gains is GAINS.velocity
