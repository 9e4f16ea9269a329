"""The nominal time axis: exact stamps, skips and pauses."""

from __future__ import annotations

from threading import Lock
from types import SimpleNamespace

import pytest
import rospy
from scara_control.joint_track import JointTrack
from scara_control.motion.commands import Command
from scara_control.pid import PidGains
from scara_simulation.command_desk import CommandDesk
from scara_simulation.commands import CommandError
from scara_simulation.config import LoopGains
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import JointModel
from scara_simulation.simulation import Simulation, Timing
from scara_simulation.simulator_ports_node import CommandPorts

MS = 1_000_000
EPOCH = 1_700_000_000_123_456_789


class Mass:
    """One kilogram on a rail."""

    def __init__(self):
        self.q, self.qdot = 0.0, 0.0

    def read(self):
        """Return position and velocity."""
        return [self.q], [self.qdot]

    def step(self, efforts):
        """Move on by 1 ms."""
        self.qdot += efforts[0] * 1e-3
        self.q += self.qdot * 1e-3

    def reset(self, positions):
        """Stand there."""
        self.q, self.qdot = positions[0], 0.0


@pytest.fixture
def simulation():
    """Give the mass under control."""
    model = JointModel("slide", -5.0, 5.0, 10.0, 50.0, 1e4, 0.01)
    gains = LoopGains(PidGains(p=3600.0, d=120.0), PidGains(p=60.0))
    control = JointControl([model], [gains], [0.25], 1e-3, lambda q, qdot, qddot: qddot)
    return Simulation(Mass(), control, [0.25], Timing(MS, EPOCH, 5, 10))


def moving(velocity=1.0, start=0.25, duration=2.0, begin=0.0):
    """Make a track of even speed."""
    return JointTrack(
        [begin, begin + duration],
        [[start], [start + velocity * duration]],
        [[velocity]] * 2,
        [[0.0]] * 2,
        extrapolation_limit=0.05,
        stop_accelerations=[50.0],
    )


def test_stamps_are_exact_and_snapshots_evenly_spaced(simulation):
    """Every fifth step, whatever the size of the runs; integer nanoseconds."""
    stamps = [s.stamp_ns for run in (3, 4, 1, 12) for s in simulation.advance(run)]
    assert stamps == [EPOCH + k * 5 * MS for k in (1, 2, 3, 4)]


def test_loop_states_come_with_every_second_snapshot_here(simulation):
    """They are asked for at a lower rate."""
    assert [len(s.loops) for s in simulation.advance(20)] == [0, 1, 0, 1]


def test_watched_loops_are_told_for_each_step(simulation):
    """Stamped step by step, none twice and none lost, and only while somebody watches."""
    simulation.advance(3)
    simulation.watched = (0,)
    seen = [entry for s in simulation.advance(14) for entry in s.watched]
    assert [stamp for stamp, _ in seen] == [EPOCH + k * MS for k in range(4, 16)]
    assert {state.joint for _, state in seen} == {"slide"}
    simulation.watched = ()
    assert [stamp for s in simulation.advance(10) for stamp, _ in s.watched] == [
        EPOCH + 16 * MS,
        EPOCH + 17 * MS,
    ]


def test_set_points_are_met_at_their_nominal_time(simulation):
    """The state stamped t is the one wanted at t, however late the step was run."""
    simulation.control.command_track(["slide"], moving())
    last = simulation.advance(500)[-1]
    assert last.positions[0] == pytest.approx(0.25 + simulation.axis_time(last.stamp_ns), abs=1e-5)


def test_skipped_time_moves_the_stamps_and_not_the_due_times(simulation):
    """After a stall the joint is sent to where it should be by now."""
    simulation.control.command_track(["slide"], moving())
    simulation.advance(100)
    simulation.skip(300 * MS)
    last = simulation.advance(400)[-1]
    assert last.stamp_ns == EPOCH + 800 * MS
    assert last.positions[0] == pytest.approx(0.25 + 0.8, abs=1e-4)


def test_velocity_ends_in_time_though_the_clock_is_set_back(simulation):
    """Its sender may be dead: it would go on for an hour."""
    simulation.control.command_velocity("slide", 0.1, simulation.axis_time(EPOCH) + 0.2)
    assert simulation.advance(50)[-1].velocities[0] == pytest.approx(0.1, abs=0.01)
    simulation.skip(-3_600_000 * MS)
    assert simulation.advance(100)[-1].velocities[0] == pytest.approx(0.1, abs=0.01)
    assert simulation.advance(1000)[-1].velocities[0] == pytest.approx(0.0, abs=1e-6)


def test_clock_that_is_set_back_leaves_the_joint_where_it_is(simulation):
    """It went back to where its set points began, and made the motion again an hour later."""
    simulation.control.command_track(["slide"], moving())
    end = simulation.advance(3000)[-1].positions[0]
    simulation.skip(-3_600_000 * MS)
    assert simulation.advance(500)[-1].positions[0] == pytest.approx(end, abs=1e-4)
    simulation.skip(3_596_000 * MS)
    assert simulation.advance(4000)[-1].positions[0] == pytest.approx(end, abs=1e-4)


def test_paused_time_moves_stamps_and_due_times(simulation):
    """After a pause the motion goes on where it stood, without a jump."""
    simulation.control.command_track(["slide"], moving())
    simulation.advance(100)
    simulation.thaw(10_000 * MS)
    after = simulation.advance(5)[-1]
    assert after.stamp_ns == EPOCH + 10_105 * MS
    assert after.velocities[0] == pytest.approx(1.0, abs=0.05)
    assert after.positions[0] == pytest.approx(0.25 + 0.105, abs=2e-3)


def test_reset_returns_to_the_start_and_time_goes_on(simulation):
    """Commands are forgotten; stamps never go back."""
    simulation.control.command_track(["slide"], moving())
    simulation.advance(200)
    simulation.reset()
    assert simulation.control.modes == "slide:position"
    last = simulation.advance(200)[-1]
    assert last.positions == [0.25]
    assert last.stamp_ns == EPOCH + 400 * MS


def sent(track):
    """Make a message of the mass; the gate lets it through as it is."""
    return SimpleNamespace(names=["slide"], track=track)


@pytest.fixture
def desk(simulation):
    """Give the desk in front of the mass."""
    gate = SimpleNamespace(track=lambda message, now: message.track)
    config = SimpleNamespace(velocity_timeout_ms=500.0, stop_ramp_ms=500.0)
    return CommandDesk(simulation.control, gate, config)


def run(simulation, desk, steps):
    """Run as the node does; return the last state."""
    for _ in range(steps // 10):
        last = simulation.advance(10)[-1]
        desk.end_tracks(simulation.now)
    return last


@pytest.mark.parametrize(("stop", "stands_at"), [(Command.ESTOP, 1.0), (Command.STOP, 2.75)])
def test_an_emergency_stop_ends_set_points_that_were_taken_before(
    simulation, desk, stop, stands_at
):
    """5 s of them in one message, whose sender heard of no stop; STOP leaves them to the sender."""
    desk.track(sent(moving(0.5, duration=5.0)), simulation.now)
    run(simulation, desk, 1000)
    desk.obey(stop, simulation.now)
    ramping = run(simulation, desk, 490)
    assert ramping.velocities[0] == pytest.approx(0.5, abs=1e-3), "a ramp of the motion nodes"
    assert run(simulation, desk, 5000).positions[0] == pytest.approx(stands_at, abs=0.05)


@pytest.mark.parametrize(
    ("track", "most"),
    [
        (moving(0.5, duration=5.0, begin=0.31), 0.4),
        (moving(0.5, duration=5.0, begin=0.9), 0.2501),
        (moving(0.0, start=4.0, duration=0.01, begin=0.31), 3.5),
    ],
)
def test_set_points_that_come_in_the_ramp_of_an_emergency_stop_end_with_it(
    simulation, desk, track, most
):
    """Also those that would begin behind it, and a jump that the joint still catches up with."""
    desk.obey(Command.ESTOP, simulation.now)
    run(simulation, desk, 300)
    desk.track(sent(track), simulation.now)
    stood = run(simulation, desk, 700).positions[0]
    assert stood < most
    assert run(simulation, desk, 4000).positions[0] == pytest.approx(stood, abs=1e-4)
    with pytest.raises(CommandError, match="RESET first"):
        desk.track(sent(moving()), simulation.now)


def test_an_emergency_stop_leaves_a_joint_that_rests_behind_its_set_points(simulation, desk):
    """The motion nodes hold it by the last of them."""
    desk.track(sent(moving(0.0, start=0.3, duration=0.5)), simulation.now)
    run(simulation, desk, 1000)
    desk.obey(Command.ESTOP, simulation.now)
    assert run(simulation, desk, 1000).positions[0] == pytest.approx(0.3, abs=1e-6)
    assert simulation.control.modes == "slide:trajectory"


def test_the_node_looks_after_set_points_behind_each_run_of_steps(simulation, desk, monkeypatch):
    """And tells that another loop has the joint now."""
    for kind in ("Publisher", "Subscriber", "Service"):
        monkeypatch.setattr(rospy, kind, lambda *_, **__: SimpleNamespace())
    idle, told = dict.fromkeys(("pause", "unpause", "reset")), []
    runner = SimpleNamespace(lock=Lock(), simulation=simulation, **idle)
    ports = CommandPorts(["slide"], runner, desk, SimpleNamespace(publish_modes=told.append))
    desk.track(sent(moving(0.5, duration=5.0)), simulation.now)
    desk.obey(Command.ESTOP, simulation.now)
    for _ in range(6):
        simulation.advance(100)
        ports.ran()
    assert told == ["slide:position", "slide:trajectory", "slide:velocity"]
