"""The core of joint_vel_controller.

Ramped, within the limits, never without somebody holding the key.
"""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.jogging.jog import JogController, braking_speed

ROBOT, CONFIG = load_robot(), load_motion()
JOINTS = ROBOT.twin_joints
NAMES = [joint.name for joint in JOINTS]
CAPS = [joint.velocity * CONFIG.jog.speed_percent / 100.0 for joint in JOINTS]
DT = CONFIG.period
MODES = dict.fromkeys(NAMES, "velocity")


class Bench:
    """A controller, its clock and a twin that does what it is told, measured one period late."""

    def __init__(self, q=(0.0, 0.0, -0.1, 0.0), qdot=(0.0,) * 4):
        self.now = 20.0
        self.core = JogController(ROBOT, CONFIG, self.now)
        self.q, self.qdot = list(q), list(qdot)
        self.sent = []
        self.core.measure(JointMotion.measured(tuple(q), tuple(qdot), self.now))

    def tick(self, count=1):
        """Go on by periods; return what was sent last."""
        for _ in range(count):
            self.now += DT
            velocities = self.core.tick(self.now)
            self.core.measure(JointMotion.measured(tuple(self.q), tuple(self.qdot), self.now))
            self.sent.append(velocities)
            for name, velocity in velocities.items():
                k = NAMES.index(name)
                self.q[k] += velocity * DT
                self.qdot[k] = velocity
        return self.sent[-1]

    def jog(self, names, velocities, duration=0.0, displacements=()):
        """Send a jog command."""
        self.core.command(names, velocities, displacements, duration, self.now)


def test_a_jog_ramps_up_ends_by_itself_and_falls_silent():
    """Within the acceleration; after the time-out down; a few zeros; nothing more."""
    bench = Bench()
    bench.jog(["table_joint"], [0.3])
    assert bench.core.report() == "jogging table_joint 0.3 rad/s"
    bench.tick(20)
    assert bench.sent[-1] == {"table_joint": 0.3}
    bench.tick(10)
    assert (
        bench.core.report() == "stopping: no command for 250 ms"
        or bench.core.report().startswith("idle")
    )
    bench.tick(20)
    sent = [velocities["table_joint"] for velocities in bench.sent if velocities]
    changes = [abs(after - before) for before, after in zip([0.0, *sent], sent)]
    assert max(changes) <= JOINTS[3].acceleration * DT + 1e-12
    assert sent[-CONFIG.jog.final_zeros :] == [0.0] * CONFIG.jog.final_zeros
    assert bench.sent[-1] == {}
    assert bench.core.report() == "idle: no command for 250 ms"


def test_a_jog_goes_on_while_it_is_repeated():
    """A key held down."""
    bench = Bench()
    for _ in range(10):
        bench.jog(["joint_1"], [0.2])
        bench.tick(10)
    assert bench.sent[-1] == {"joint_1": 0.2}


def test_duration_shortens_the_time_out_and_never_prolongs_it():
    """A duration of an hour is still 0.25 s."""
    for duration, last in ((0.05, 0.05), (3600.0, CONFIG.jog.timeout)):
        bench = Bench()
        bench.jog(["joint_1"], [0.2], duration)
        bench.tick(60)
        full = [velocities for velocities in bench.sent if velocities.get("joint_1") == 0.2]
        assert len(full) * DT == pytest.approx(last, abs=1.5 * DT)


def test_joints_that_are_no_longer_named_stop():
    """Each command says everything."""
    bench = Bench()
    bench.jog(["joint_1", "joint_2"], [0.2, -0.2])
    bench.tick(10)
    bench.jog(["joint_1"], [0.2])
    bench.tick(10)
    assert bench.sent[-1] == {"joint_1": 0.2}
    assert 0.0 in [velocities.get("joint_2") for velocities in bench.sent]


def test_velocity_zero_stops_at_once():
    """The end of a trim."""
    bench = Bench()
    bench.jog(["joint_1"], [0.2])
    bench.tick(10)
    bench.jog(["joint_1"], [0.0])
    bench.tick(10)
    assert bench.sent[-1] == {} and bench.core.report() == "idle"


def test_a_trim_gives_way_to_who_jogs():
    """Its jogs come more often; those that are on their way would replace a person's."""
    bench = Bench()
    bench.core.command(["joint_1"], [0.01], (), 0.0, bench.now, prompt=True)
    bench.jog(["joint_1"], [0.2])
    with pytest.raises(MotionRefusedError, match="somebody else jogs: a trim gives way"):
        bench.core.command(["joint_1"], [0.01], (), 0.0, bench.now, prompt=True)
    bench.tick(10)
    assert bench.sent[-1]["joint_1"] == pytest.approx(0.2)


@settings(max_examples=80, deadline=None)
@given(
    st.tuples(
        *[st.floats(0.0, 1.0).map(lambda x, j=j: j.lower + x * (j.upper - j.lower)) for j in JOINTS]
    ),
    st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 4), min_size=1, max_size=40),
)
def test_no_jogging_leads_beyond_a_limit(q, commands):
    """From anywhere, by any sequence of commands held for 0.1 s each."""
    bench = Bench(q)
    for shares in commands:
        bench.jog(NAMES, [share * cap for share, cap in zip(shares, CAPS)])
        bench.tick(10)
        for joint, position in zip(JOINTS, bench.q):
            assert joint.lower - 1e-9 <= position <= joint.upper + 1e-9


@pytest.mark.parametrize("k", range(4))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("wait", [0.0, 0.23])
def test_a_limit_is_approached_and_not_passed(k, sign, wait):
    """Jogging on and on ends within a hundredth of the range before the limit."""
    joint = JOINTS[k]
    end = joint.upper if sign > 0 else joint.lower
    q = [0.0, 0.0, -0.1, 0.0]
    q[k] = end - sign * 0.2 * (joint.upper - joint.lower)
    bench = Bench(q)
    bench.core.wait_for(wait)
    for _ in range(200):
        bench.jog([joint.name], [sign * CAPS[k]])
        bench.tick(5)
    # What waits was reckoned some periods before: 0.002 deg, or 0.15 mm of a quick slide.
    beyond = 1e-12 if not wait else 1.5e-4 if joint.si_unit == "m" else 4e-5
    assert -beyond <= sign * (end - bench.q[k]) <= 0.01 * (joint.upper - joint.lower)


@given(st.floats(0.0, 2.0), st.floats(1.0, 50.0), st.floats(0.0, 0.2))
def test_from_the_braking_speed_a_joint_stops_at_its_limit(room, deceleration, reaction):
    """Way to react plus way to brake: v T + v^2 / 2b = d."""
    joint = JOINTS[0]
    v = braking_speed(joint, joint.upper - room, 1.0, deceleration, reaction)
    assert v * reaction + v * v / (2.0 * deceleration) == pytest.approx(room, abs=1e-9)
    assert braking_speed(joint, joint.lower + room, -1.0, deceleration, reaction) == pytest.approx(
        v
    )


def test_outside_its_limits_a_joint_can_only_be_jogged_back():
    """No way further out."""
    bench = Bench((JOINTS[0].upper + 0.01, 0.0, -0.1, 0.0))
    bench.jog(["joint_1"], [0.2])
    assert bench.tick(5) == {"joint_1": 0.0}
    bench.jog(["joint_1"], [-0.2])
    assert bench.tick(5)["joint_1"] < 0.0


@pytest.mark.parametrize(
    ("names", "velocities", "displacements", "duration", "text"),
    [
        (
            ["elbow"],
            [0.1],
            (),
            0.0,
            "unknown joint 'elbow': the twin has joint_1, joint_2, joint_3, table_joint",
        ),
        (
            ["joint_1", "joint_1"],
            [0.1, 0.1],
            (),
            0.0,
            "joint names are missing or occur twice: joint_1, joint_1",
        ),
        ([], [], (), 0.0, "joint names are missing"),
        (["joint_1"], [0.1, 0.2], (), 0.0, "got 2 joint values, expected 1: joint_1"),
        (["joint_1"], [math.nan], (), 0.0, "not finite: joint_1 = nan"),
        (
            ["joint_1"],
            [1.0],
            (),
            0.0,
            r"joint_1 = 1 rad/s is outside \[-0\.7679, 0\.7679\], 10 % of its speed",
        ),
        (["joint_3"], [-0.3], (), 0.0, r"joint_3 = -0\.3 m/s is outside \[-0\.2, 0\.2\]"),
        (["joint_1"], [0.1], [0.1], 0.0, "displacements are not supported: give velocities"),
        (["joint_1"], [0.1], (), -1.0, r"duration = -1\.0 s is no duration"),
        (["joint_1"], [0.1], (), math.nan, "duration = nan s is no duration"),
    ],
)
def test_a_wrong_jog_is_refused_and_shown(names, velocities, displacements, duration, text):
    """Refused, not clamped; nothing moves; the state says why."""
    bench = Bench()
    with pytest.raises(ScaraControlError, match=text):
        bench.jog(names, velocities, duration, displacements)
    assert bench.tick(3) == {} and bench.core.report().startswith("idle: refused: ")


def test_a_jog_needs_fresh_measurements():
    """Without them the limits could not be kept."""
    bench = Bench()
    bench.now += 1.0
    with pytest.raises(MotionRefusedError, match=r"twin/joint_states is 1\.00 s old, allowed 0\.5"):
        bench.jog(["joint_1"], [0.1])
    with pytest.raises(MotionRefusedError, match="no twin/joint_states yet"):
        JogController(ROBOT, CONFIG, 0.0).command(["joint_1"], [0.1], (), 0.0, 0.0)


@pytest.mark.parametrize("command", [Command.STOP, Command.PAUSE, Command.ESTOP])
def test_stop_ramps_down_and_the_held_key_does_not_go_on(command):
    """It must be released first."""
    bench = Bench()
    bench.jog(["joint_1"], [0.5])
    bench.tick(10)
    bench.core.obey(command, "enough", bench.now)
    assert f"{command.name}: enough" in bench.core.report()
    for _ in range(10):
        with pytest.raises(
            MotionRefusedError,
            match=r"stopped: commands are ignored until they pause for 250 ms|emergency stop",
        ):
            bench.jog(["joint_1"], [0.5])
        bench.tick(5)
    sent = [velocities["joint_1"] for velocities in bench.sent if velocities]
    assert max(abs(b - a) for a, b in pairwise(sent)) <= JOINTS[0].acceleration * DT + 1e-9
    assert sent[-1] == 0.0
    bench.core.obey(Command.RESUME, "", bench.now)
    bench.tick(40)
    assert bench.sent[-1] == {}


def test_emergency_stop_is_latched_until_reset():
    """RESET moves nothing."""
    bench = Bench()
    bench.core.obey(Command.ESTOP, "button", bench.now)
    bench.tick(50)
    assert bench.core.report() == "estopped: ESTOP: button"
    with pytest.raises(MotionRefusedError, match="emergency stop is latched: RESET first"):
        bench.jog(["joint_1"], [0.1])
    bench.core.obey(Command.RESET, "", bench.now)
    assert bench.tick(50) == {} and bench.core.report() == "idle"
    bench.jog(["joint_1"], [0.1])


def test_a_moving_joint_is_taken_over_at_its_speed():
    """No jump from the motion of another controller."""
    bench = Bench(qdot=(0.6, 0.0, 0.0, 0.0))
    bench.jog(["joint_1"], [0.0])
    assert bench.tick()["joint_1"] == pytest.approx(0.6 - JOINTS[0].acceleration * DT)


def test_a_joint_that_a_trajectory_takes_is_left_to_it():
    """The last command wins in the simulator; there is no fight."""
    bench = Bench()
    bench.jog(["joint_1", "joint_2"], [0.2, 0.2])
    bench.tick(5)
    bench.core.update_modes(MODES)
    bench.core.update_modes(MODES | {"joint_1": "trajectory"})
    assert "joint_1" not in bench.tick() and "joint_2" in bench.sent[-1]
    assert (
        bench.core.report()
        == "jogging joint_2 0.2 rad/s: joint_1 was taken by its trajectory controller"
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_jog_obeys_the_cap_of_all_motion(way):
    """A cap that a person near the robot has caused holds for jogs too, also while one runs."""
    bench = Bench()
    bench.jog(["table_joint"], [way * 0.3])
    bench.tick(10)
    bench.core.limit_speed(1.0)
    cap = JOINTS[NAMES.index("table_joint")].velocity * 0.01
    assert cap < 0.3
    bench.tick(10)
    assert bench.sent[-1]["table_joint"] == pytest.approx(way * cap)
    assert "(capped at 1 % of the largest speed)" in bench.core.report()
    for wrong in (0.99, 100.01):
        with pytest.raises(MotionRefusedError, match=rf"percent = {wrong} is outside \[1, 100\]"):
            bench.core.limit_speed(wrong)
    bench.core.limit_speed(100.0)
    bench.jog(["table_joint"], [way * 0.3])
    bench.tick(20)
    assert bench.sent[-1]["table_joint"] == pytest.approx(way * 0.3)


def test_a_jog_after_rest_begins_with_one_period_of_its_ramp():
    """The loop rests while nothing is jogged; the first command brings the core up to now."""
    bench = Bench()
    assert bench.core.is_idle
    bench.now += 3.0
    bench.core.measure(JointMotion.measured(tuple(bench.q), tuple(bench.qdot), bench.now))
    bench.core.tick(bench.now)
    bench.jog(["table_joint"], [0.3])
    assert not bench.core.is_idle
    joint = JOINTS[NAMES.index("table_joint")]
    assert bench.tick()["table_joint"] <= joint.acceleration * DT * 1.0001
    while not bench.core.is_idle:
        bench.tick()
    assert bench.sent[-1] == {"table_joint": 0.0}


def test_a_stop_before_a_waiting_jog_has_begun_moves_nothing():
    """The state says that it waits, and for what; the robot is told of it, and no joint yet."""
    bench = Bench()
    bench.core.wait_for(0.3)
    bench.jog(["joint_1"], [0.5])
    bench.tick(10)
    assert bench.core.report() == "jogging joint_1 0.5 rad/s (300 ms later, with the real robot)"
    ahead = bench.core.ahead(bench.now)
    assert ahead is not None and ahead.names == tuple(NAMES)
    assert ahead.points[0].q == pytest.approx(bench.q)
    assert ahead.points[-1].q[0] > bench.q[0] and ahead.points[-1].qdot[0] > 0.0
    bench.core.obey(Command.STOP, "enough", bench.now)
    assert bench.core.ahead(bench.now) is None
    bench.tick(60)
    assert {v for velocities in bench.sent for v in velocities.values()} <= {0.0}
    assert bench.core.report() == "idle: STOP: enough"


def test_a_held_key_stays_barred_though_the_node_stood_still_before_the_stop():
    """That nobody listened for a second was no pause of the stream."""
    bench = Bench()
    bench.jog(["joint_1"], [0.5])
    bench.tick(10)
    bench.now += 1.0
    bench.core.stood_still(1.0)
    bench.core.obey(Command.STOP, "enough", bench.now)
    with pytest.raises(MotionRefusedError, match="stopped: commands are ignored until they pause"):
        bench.jog(["joint_1"], [0.5])


def test_a_clock_that_goes_back_ends_a_jog_and_bars_no_new_one():
    """Its time-out would come when the time is again where it was, and so would a stop's end."""
    bench = Bench()
    bench.jog(["table_joint"], [0.3])
    bench.tick(10)
    bench.now = 0.0
    bench.tick(100)
    assert bench.sent[-1] == {} and bench.core.report() == "idle: the clock went back"
    bench.core.obey(Command.STOP, "by hand", bench.now + 100.0)
    bench.tick()
    bench.jog(["table_joint"], [0.3])
    assert bench.tick()["table_joint"] > 0.0
