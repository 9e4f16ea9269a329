"""What the simulated tool carries, and what the twin's controller was told: two things."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from scara_config import load_robot
from scara_config.palletise import load_palletise
from scara_config.payload import Payload, PayloadError, load_payloads
from scara_config.profile import CHOICE
from scara_control.config import load_motion
from scara_control.dynamics.arm_model_io import ArmModel
from scara_control.dynamics.effort import load_of
from scara_control.dynamics.planner import Planner
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_control.motion.plan import Path as JointPath
from scara_control.motion.plan import plan_move
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.handling.part_world_io import PartWorld
from scara_simulation.handling.payload_desk import PayloadDesk, described, part_payload
from scara_simulation.handling.told_dynamics_io import ToldDynamics
from scara_simulation.health import SaturationWatch
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, Timing
from scara_simulation.tuning.gains import Tuning
from scara_simulation.tuning.stability import sample_plant
from scara_simulation.world_io import World

CONFIG = Path(__file__).parents[4] / "config"
ROBOT = load_robot(CONFIG)
SIMULATION = load_simulation(ROBOT, CONFIG)
TABLE = load_payloads(CONFIG)
EMPTY, RATED = TABLE.find(1), TABLE.find(4)
NAMES = [joint.name for joint in ROBOT.twin_joints]
FROM, TO = (-1.64, -2.3, -0.1, 0.0), (1.64, 2.3, -0.1, 0.0)
PERCENT = load_motion(CONFIG).move.effort_percent


@contextmanager
def cell(mounted: Payload, told: Payload) -> Iterator[tuple[World, Simulation]]:
    """Give the article's robot that carries one thing and was told another."""
    world = World(
        ROBOT.description,
        NAMES,
        ROBOT.tool_frame,
        dt=SIMULATION.dt,
        gravity=SIMULATION.gravity_m_s2,
        mounted=mounted,
    )
    with world, ToldDynamics(ROBOT, SIMULATION, told) as dynamics:
        control = JointControl(
            joint_models(ROBOT, SIMULATION, world.damping, world.friction),
            load_gains(ROBOT, CONFIG),
            FROM,
            SIMULATION.dt,
            dynamics,
            SIMULATION.tracking_bandwidth_rad_s,
        )
        control.permit(dynamics.unplanned_shares(PERCENT))
        yield world, Simulation(world, control, FROM, Timing(SIMULATION.step_ns, 0, 1, 1000))


def plan(payload: Payload | None) -> JointPath:
    """Plan the hard move at full speed for a payload; None: for none."""
    planner = Planner(ROBOT.twin_joints)
    if payload is not None:
        model = ArmModel(
            ROBOT.description, NAMES, ROBOT.tool_frame, gravity=9.81, payloads=[payload]
        )
        planner.load = load_of(model, ROBOT.twin_joints, PERCENT)
    return planner.move(JointMotion.at_rest(FROM), TO, 100.0)


def drive(simulation: Simulation, path: JointPath) -> tuple[float, float]:
    """Follow a path; return the largest error of joint 1 [rad] and the largest share of effort."""
    times = [k * 0.01 for k in range(int(path.duration / 0.01) + 2)]
    points = [path.at(time) for time in times]
    track = JointTrack(
        times,
        [point.q for point in points],
        [point.qdot for point in points],
        [point.qddot for point in points],
        extrapolation_limit=0.05,
        stop_accelerations=[joint.acceleration for joint in ROBOT.twin_joints],
    )
    simulation.control.command_track(NAMES, track)
    seen = simulation.advance(round(path.duration / SIMULATION.dt))
    error = max(abs(s.positions[0] - path.at(s.stamp_ns * 1e-9).q[0]) for s in seen)
    effort = max(
        abs(effort) / joint.effort
        for s in seen
        for effort, joint in zip(s.efforts, ROBOT.twin_joints)
    )
    return error, effort


def test_rated_load_that_was_told_is_moved_inside_the_efforts() -> None:
    """6 kg, full speed: no joint is asked for more than it has, and the arm follows."""
    with cell(RATED, RATED) as (_, simulation):
        error, effort = drive(simulation, plan(RATED))
    assert 0.8 < effort < 1.0 and simulation.control.saturated_steps == 0
    assert error < 0.001


def test_rated_load_that_planning_does_not_know_saturates_joint_1() -> None:
    """The same move as for an empty tool: the effort does not suffice, the arm is left behind."""
    with cell(RATED, RATED) as (_, simulation):
        error, effort = drive(simulation, plan(None))
    assert effort == 1.0 and simulation.control.saturated_steps > 20
    assert error > 0.02


@pytest.mark.parametrize(("share", "is_told"), [(0.64, False), (0.68, True), (1.0, True)])
def test_saturation_is_told_before_the_tool_is_off_by_a_millimetre(
    share: float, is_told: bool
) -> None:
    """In virtual time: moves that were planned for an empty tool, with more and more at it."""
    carried = msgspec.structs.replace(RATED, mass_kg=share * RATED.mass_kg)
    watch = SaturationWatch(SIMULATION.saturation_window_steps, SIMULATION.saturation_limit_percent)
    with cell(carried, carried) as (_, simulation):
        control = simulation.control
        assert watch.judge(simulation.steps, control.saturated_steps_of) == ""
        error, effort = drive(simulation, plan(None))
        told = watch.judge(simulation.steps, control.saturated_steps_of)
    assert effort == 1.0 and control.saturated_steps > 0
    assert told.startswith("joint_1 was at its effort limit") == is_told
    assert is_told or error * ROBOT.reach_mm < 0.1


@pytest.mark.parametrize(("mounted", "told"), [(RATED, EMPTY), (EMPTY, RATED)])
def test_wrong_payload_is_followed_worse(mounted: Payload, told: Payload) -> None:
    """On a motion that fits either way, ten times worse than with the right one."""
    path = plan_move(ROBOT.twin_joints, JointMotion.at_rest(FROM), TO, 40.0, 0.3)
    errors = []
    for knows in (mounted, told):
        with cell(mounted, knows) as (_, simulation):
            errors.append(drive(simulation, path)[0])
        assert simulation.control.saturated_steps == 0
    assert errors[1] > 10.0 * errors[0]


def test_empty_tool_moves_bit_for_bit_as_with_the_worlds_own_model() -> None:
    """The model without shapes is the world's, so no figure of the empty twin changes."""
    q, qdot, qddot = [0.3, -1.1, -0.1, 0.4], [3.0, -5.0, 0.5, 1.0], [20.0, 40.0, 5.0, 3.0]
    with cell(EMPTY, EMPTY) as (world, _), ToldDynamics(ROBOT, SIMULATION, EMPTY) as told:
        assert told(q, qdot, qddot) == world.inverse_dynamics(q, qdot, qddot)
        assert told.unplanned_shares(PERCENT) == (1.0,) * 4


def test_direct_command_is_slower_with_a_load() -> None:
    """Nobody plans it as a whole, so it gets what any pose leaves."""
    took = []
    for payload in (EMPTY, RATED):
        with cell(payload, payload) as (_, simulation):
            simulation.control.command_position("joint_1", 0.0)
            steps = 0
            while simulation.control.moving([0.0] * 4) or steps == 0:
                simulation.advance(1)
                steps += 1
            took.append(steps)
            assert simulation.control.saturated_steps == 0
    assert took[1] > 1.05 * took[0]


def test_mounting_leaves_the_joints_where_they_are() -> None:
    """And its weight is felt at once: joint 3 needs 59 N more to stay."""
    with cell(EMPTY, EMPTY) as (world, simulation):
        simulation.advance(300)
        before, light = world.read()[0], simulation.snapshot(with_loops=False).efforts[2]
        world.mount(RATED)
        assert world.read()[0] == pytest.approx(before, abs=1e-12)
        simulation.advance(3000)
        heavy = simulation.snapshot(with_loops=False).efforts[2]
    assert heavy - light == pytest.approx(6.0 * 9.81, abs=6.0)  # dry friction carries some of it


def test_gripped_part_counts_while_it_is_held() -> None:
    """In the world by its own body, in the controller's model beside the payload it was told."""
    work = load_palletise(CONFIG)
    part, still, held = part_payload(work), [0.0] * 4, [False]
    assert (part.mass_kg, part.centre_m[2]) == (0.05, pytest.approx(0.0105))
    with ToldDynamics(ROBOT, SIMULATION, RATED, part, lambda: held[0]) as told:
        alone = told(list(FROM), still, still)[2]
        held[0] = True
        assert told(list(FROM), still, still)[2] - alone == pytest.approx(0.05 * 9.81, rel=1e-6)
        told.tell(EMPTY)
        light = told(list(FROM), still, still)[2]
        assert alone - light == pytest.approx((6.0 - 0.05) * 9.81, rel=1e-6)
        held[0] = False
        told.tell(RATED)
        assert told(list(FROM), still, still)[2] == alone


def test_world_with_parts_carries_a_payload_and_its_parts_begin_anew() -> None:
    """Mounting is a change of tool: the parts go back to their stands."""
    work = load_palletise(CONFIG)
    world = PartWorld(ROBOT.description, NAMES, ROBOT.tool_frame, dt=1e-3, gravity=9.81, work=work)
    with world:
        first = [part.position for part in world.now.parts]
        light = world.mass_matrix([0.0] * 4)[2][2]
        world.reset(FROM)
        world.mount(RATED)
        assert world.mass_matrix([0.0] * 4)[2][2] - light == pytest.approx(6.0)
        now = [part.position for part in world.now.parts]
        assert max(math.dist(a, b) for a, b in zip(now, first, strict=True)) < 1e-6
        for _ in range(20):
            world.step([0.0, 0.0, 73.0, 0.0])
        assert world.read()[0] == pytest.approx(list(FROM), abs=0.01)


@pytest.mark.parametrize("name", ["fanuc_sr6ia", "fanuc_sr3ia", "articulated_six"])
def test_gains_are_stable_with_the_rated_load(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mounted payload is no reason why the simulator would not start."""
    monkeypatch.setenv(CHOICE, name)
    robot = load_robot(CONFIG)
    config, joints = load_simulation(robot, CONFIG), robot.twin_joints
    names = [joint.name for joint in joints]
    rated = load_payloads(CONFIG).payloads[-1]
    with ArmModel(
        robot.description, names, robot.tool_frame, gravity=9.81, payloads=[rated]
    ) as model:
        plant = sample_plant(
            model.mass_matrix,
            [(joint.lower, joint.upper) for joint in joints],
            model.damping,
            config.dt,
            config.tracking_bandwidth_rad_s,
            3,
        )
    Tuning(names, load_gains(robot, CONFIG), [joint.effort for joint in joints], plant)


def test_desk_refuses_what_cannot_be() -> None:
    """Unknown, too heavy, or while a joint moves; nothing changes then."""
    desk = PayloadDesk(TABLE)
    with pytest.raises(PayloadError, match=r"number = 9: is no payload"):
        desk.judge(9, None, [])
    with pytest.raises(PayloadError, match=r"mass_kg = 7: is outside \[0, 6\] kg"):
        desk.judge(2, Payload(2, "part", 7.0), [])
    with pytest.raises(PayloadError, match=r"joint_1, joint_2 move: .* only at standstill"):
        desk.judge(2, None, ["joint_1", "joint_2"])
    table, payload = desk.judge(2, Payload(2, "tool", 1.25), [])
    assert (payload.mass_kg, table.find(2).mass_kg, desk.table.find(2).mass_kg) == (
        1.25,
        1.25,
        0.05,
    )
    assert described(payload) == "PAYLOAD[2] tool: 1.25 kg, centre 0 0 0 mm"
