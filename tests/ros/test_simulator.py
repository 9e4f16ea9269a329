"""Node ``simulator`` by rosrun: rates, stamps, commands, services, refusals."""

from __future__ import annotations

import itertools
import threading
import time
from contextlib import contextmanager

import pytest

START = [0.0, 0.0, -0.160, 0.0]


@pytest.fixture(scope="module")
def node(ros_module):
    """Start the simulator once for this module."""
    ros_module.run("scara_simulation", "simulator")
    ros_module.wait_for_service("reset_simulation")
    return ros_module


@pytest.fixture
def cell(node):
    """Give a running simulator at its start pose."""
    from std_srvs.srv import Empty

    for name in ("unpause_physics", "reset_simulation"):
        node.service(name, Empty)()
    return node


def empty(ros, name):
    """Call one of Gazebo's services."""
    from std_srvs.srv import Empty

    return ros.service(name, Empty)()


def command(ros, joint, kind, value):
    """Send one command to a joint's controller."""
    from std_msgs.msg import Float64

    ros.publisher(f"twin/{joint}_{kind}_controller/command", Float64).publish(Float64(value))


@contextmanager
def turning(ros, joint, velocity):
    """Repeat a velocity, as whoever commands one has to; the last one is 0."""
    ended = threading.Event()

    def repeat():
        while not ended.wait(0.05):
            command(ros, joint, "velocity", velocity)

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        command(ros, joint, "velocity", 0.0)


def state_such_that(ros, condition, timeout=10.0):
    """Return the next joint state that meets ``condition``."""
    from sensor_msgs.msg import JointState

    return ros.wait_for_message("twin/joint_states", JointState, timeout, such_that=condition)


def stands(state):
    """Return whether the table is at rest."""
    return abs(state.velocity[3]) < 1e-6


def modes_such_that(ros, condition):
    """Wait for the joints' modes that meet ``condition``; older ones may be on their way."""
    from std_msgs.msg import String

    return ros.wait_for_message(
        "twin/controller_modes", String, such_that=lambda modes: condition(modes.data)
    ).data


def refusal(ros, text, timeout=10.0):
    """Return the diagnostics entry whose last refusal contains ``text``."""
    from diagnostic_msgs.msg import DiagnosticArray

    def entry(message):
        values = [
            {pair.key: pair.value for pair in status.values}
            for status in message.status
            if status.name == f"{ros.namespace}/simulator: physics"
        ]
        return any(text in found.get("last refusal", "") for found in values)

    return ros.wait_for_message("/diagnostics", DiagnosticArray, timeout, such_that=entry)


def test_joint_states_come_every_10_ms_of_nominal_time(cell):
    """The stamps are the system's time, exactly 10 ms apart unless a stall was skipped."""
    import rospy
    from sensor_msgs.msg import JointState

    states = cell.collect("twin/joint_states", JointState)
    cell.wait_until(lambda: len(states) >= 200, 20.0, "200 joint states")
    stamps = [state.header.stamp.to_nsec() for state in states[:200]]
    steps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    assert steps.count(10_000_000) >= 195
    assert all(step > 0 and step % 1_000_000 == 0 for step in steps)
    assert abs(rospy.get_time() - states[-1].header.stamp.to_sec()) < 0.5
    assert states[0].name == ["joint_1", "joint_2", "joint_3", "table_joint"]
    assert list(states[0].position) == pytest.approx(START, abs=1e-6)
    assert states[0].effort[2] > 5.0


def test_position_command_moves_the_joint(cell):
    """The joint ends at the set point, and its controller tells so."""
    from control_msgs.msg import JointControllerState

    command(cell, "joint_1", "position", 0.2)
    state = state_such_that(
        cell, lambda s: abs(s.position[0] - 0.2) < 1e-4 and abs(s.velocity[0]) < 1e-3
    )
    assert list(state.position[1:]) == pytest.approx(START[1:], abs=0.02)
    loop = cell.wait_for_message("twin/joint_1_position_controller/state", JointControllerState)
    assert loop.set_point == 0.2
    assert loop.error == pytest.approx(loop.set_point - loop.process_value, abs=1e-4)
    assert loop.p > 0.0
    assert loop.time_step == pytest.approx(0.001)


def test_velocity_command_turns_the_table_until_zero_comes(cell):
    """In velocity mode the velocity controller tells its state."""
    from control_msgs.msg import JointControllerState

    with turning(cell, "table_joint", 0.5):
        state_such_that(cell, lambda s: s.position[3] > 0.1 and abs(s.velocity[3] - 0.5) < 0.02)
        loop = cell.wait_for_message(
            "twin/table_joint_velocity_controller/state", JointControllerState
        )
        assert loop.set_point == 0.5
        modes_such_that(
            cell,
            lambda modes: (
                modes == "joint_1:position joint_2:position joint_3:position table_joint:velocity"
            ),
        )
    stopped = state_such_that(cell, lambda s: abs(s.velocity[3]) < 1e-6)
    assert state_such_that(cell, lambda s: True).position[3] == pytest.approx(
        stopped.position[3], abs=1e-3
    )


def test_velocity_that_nobody_repeats_ends(cell):
    """A client that is gone turns nothing for ever."""
    command(cell, "table_joint", "velocity", 0.3)
    state_such_that(cell, lambda s: s.velocity[3] > 0.2)
    state_such_that(cell, stands)


@pytest.mark.parametrize("name", ["STOP", "ESTOP"])
def test_stop_ends_a_direct_motion_on_its_way(cell, name):
    """The simulator obeys by itself; after ESTOP it refuses until RESET."""
    from scara_msgs.msg import MotionCommand

    orders = cell.publisher("motion_command", MotionCommand)
    # A position, for it would be reached: a velocity ends by itself, sooner still when it is
    # refused. The way there lasts more than a second.
    command(cell, "table_joint", "position", 3.0)
    state_such_that(cell, lambda s: s.velocity[3] > 0.2)
    orders.publish(MotionCommand(command=getattr(MotionCommand, name)))
    assert state_such_that(cell, stands).position[3] < 2.9
    if name == "ESTOP":
        command(cell, "table_joint", "velocity", 0.3)
        refusal(cell, "table_joint: the emergency stop is latched: RESET first")
        orders.publish(MotionCommand(command=MotionCommand.RESET))
    with turning(cell, "table_joint", -0.3):
        state_such_that(cell, lambda s: s.velocity[3] < -0.2)


def test_set_points_are_met_at_their_time(cell):
    """A streamed motion of two joints: the state stamped t is where the set points are at t."""
    import rospy
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    publisher = cell.publisher("twin/joint_setpoints", JointTrajectory)
    states = cell.collect("twin/joint_states", JointState)
    cell.wait_until(lambda: states, 10.0, "a joint state")
    begin = rospy.Time.from_sec(rospy.get_time() + 0.3)
    message = JointTrajectory(joint_names=["table_joint", "joint_2"])
    message.header.stamp = begin
    for t, q in ((0.0, 0.0), (0.5, 0.4)):
        message.points.append(
            JointTrajectoryPoint([q, 2 * q], [0.0, 0.0], [0.0, 0.0], [], rospy.Duration.from_sec(t))
        )
    publisher.publish(message)
    cell.wait_until(
        lambda: states[-1].header.stamp.to_sec() > begin.to_sec() + 0.7,
        10.0,
        "the end of the motion",
    )
    for state in states:
        s = min(max((state.header.stamp - begin).to_sec() / 0.5, 0.0), 1.0)
        wanted = 0.4 * (10 * s**3 - 15 * s**4 + 6 * s**5)
        assert state.position[3] == pytest.approx(wanted, abs=2e-4)
        assert state.position[1] == pytest.approx(2 * wanted, abs=2e-4)
    modes_such_that(cell, lambda modes: "joint_2:trajectory" in modes)


def test_pause_step_and_unpause(cell):
    """Gazebo's services: time stands still, goes on by hand, and goes on by itself."""
    from sensor_msgs.msg import JointState

    from scara_msgs.srv import Step

    step = cell.service("step", Step)
    running = step(1)
    assert not running.success
    assert "call pause_physics first" in running.message
    empty(cell, "pause_physics")
    try:
        states = cell.collect("twin/joint_states", JointState, publishers=1)
        too_many = step(60_001)
        text = "steps = 60001 is outside [0, 60000]"
        assert (too_many.success, too_many.message) == (False, text)
        time.sleep(0.2)  # what was true before the pause is on its way
        states.clear()
        assert step(100).success
        cell.wait_until(lambda: len(states) >= 10, 5.0, "10 states for 100 steps")
        assert len(states) == 10
        stamps = [state.header.stamp.to_nsec() for state in states]
        assert [b - a for a, b in itertools.pairwise(stamps)] == [10_000_000] * 9
    finally:
        empty(cell, "unpause_physics")  # the next test, or this one again, finds time running
    cell.wait_until(lambda: len(states) > 30, 10.0, "states after the pause")


def test_bad_command_moves_nothing_and_is_shown(cell):
    """Refused, counted, and told in the diagnostics with joint, value and range."""
    command(cell, "joint_3", "position", 0.1)
    refusal(cell, "joint_3 = 0.1 m is outside [-0.21, 0] m")
    assert list(state_such_that(cell, lambda s: True).position) == pytest.approx(START, abs=1e-5)


def test_bad_set_points_are_refused_whole(cell):
    """An unknown joint in the message spoils all of it."""
    import rospy
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    message = JointTrajectory(
        joint_names=["joint_1", "joint_9"], points=[JointTrajectoryPoint(positions=[0.3, 0.3])]
    )
    message.header.stamp = rospy.Time.from_sec(rospy.get_time())
    cell.publisher("twin/joint_setpoints", JointTrajectory).publish(message)
    refusal(cell, "unknown joint 'joint_9'")
    assert list(state_such_that(cell, lambda s: True).position) == pytest.approx(START, abs=1e-5)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["_real_time_factor:=0"], "needs ~publish_clock:=true"),
        (["_real_time_factor:=-1", "_publish_clock:=true"], "must be a number in [0, 1000]"),
    ],
)
def test_wrong_parameters_end_the_node_with_code_2(ros, arguments, text):
    """One line says what is wrong."""
    node = ros.run("scara_simulation", "simulator", *arguments)
    assert node.wait(20.0) == 2
    assert text in node.output
    assert "Traceback" not in node.output


def test_faster_than_real_time_publishes_the_clock(ros):
    """Simulated time is then the simulation's own, and a signal ends it cleanly."""
    import time

    from rosgraph_msgs.msg import Clock

    node = ros.run("scara_simulation", "simulator", "_real_time_factor:=0", "_publish_clock:=true")
    clocks = ros.collect("/clock", Clock)
    ros.wait_until(lambda: len(clocks) > 2, 20.0, "the clock")
    first, began = clocks[-1].clock.to_sec(), time.monotonic()
    ros.wait_until(lambda: clocks[-1].clock.to_sec() > first + 10.0, 20.0, "10 s of simulated time")
    assert clocks[-1].clock.to_sec() - first > 2.0 * (time.monotonic() - began)
    assert node.stop() == 0
    assert "Traceback" not in node.output


def test_state_comes_for_each_physics_step_while_somebody_listens(ros):
    """Every millisecond of nominal time; only a stall of the machine may be skipped."""
    from control_msgs.msg import JointControllerState

    ros.run("scara_simulation", "simulator")
    states = ros.collect("twin/joint_3_position_controller/state_each_step", JointControllerState)
    ros.wait_until(lambda: len(states) >= 300, 20.0, "300 states")
    stamps = [state.header.stamp.to_nsec() for state in states[:300]]
    steps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    assert steps.count(1_000_000) >= 295
    assert min(steps) > 0


def test_a_stalled_listener_holds_nobody_up(ros):
    """The others hear each joint state, and physics leaves no time out; it hears again later."""
    import signal
    from pathlib import Path

    from sensor_msgs.msg import JointState

    # Ten times as fast, and a topic of each step: a socket that nobody reads is full soon.
    arguments = ("_real_time_factor:=10", "_publish_clock:=true")
    node = ros.run("scara_simulation", "simulator", *arguments)
    states = ros.collect("twin/joint_states", JointState)
    ros.wait_until(lambda: len(states) > 10, 20.0, "joint states")
    topic = ros.name("twin/joint_1_position_controller/state_each_step")
    listener = ros.stage.start("rostopic", "hz", topic)
    ros.wait_until(lambda: "average rate" in listener.output, 20.0, "a listener that hears")

    def threads():
        return len(list(Path(f"/proc/{node.pid}/task").iterdir()))

    at_ease = threads()
    listener.signal(signal.SIGSTOP)
    # What its socket does not take is kept by a thread of its own: only then the stall is felt.
    ros.wait_until(lambda: threads() > at_ease, 60.0, "a full socket")
    begin = len(states)
    ros.wait_until(lambda: len(states) > begin + 1000, 30.0, "10 s of simulated time")
    stamps = [state.header.stamp.to_nsec() for state in states[begin : begin + 1000]]
    steps = {later - earlier for earlier, later in itertools.pairwise(stamps)}
    assert steps == {10_000_000}, "a step that is longer is a joint state lost, or time left out"
    heard = listener.output.count("average rate")
    listener.signal(signal.SIGCONT)
    ros.wait_until(
        lambda: listener.output.count("average rate") > heard, 20.0, "what waited for it"
    )
