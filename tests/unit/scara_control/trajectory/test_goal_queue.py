"""Goals from acceptance to their end.

Streamed through the real pose controller to joints that obey.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import Command
from scara_control.motion.pose_control import PoseController
from scara_control.trajectory import execution
from scara_control.trajectory.execution import Ended, Execution
from scara_control.trajectory.goal import Code, Goal, GoalError
from scara_control.trajectory.goal_queue import BLOCKING, GoalQueue, Waiting


def waypoint(time, q, qdot=(), qddot=()):
    """Make a point of a goal, due ``time`` after its start."""
    return JointMotion(q, qdot, qddot, time)


ROBOT, CONFIG = load_robot(), load_motion()
NAMES = tuple(joint.name for joint in ROBOT.twin_joints)
HERE = (0.1, 0.2, -0.1, 0.0)
THERE = (0.5, 0.6, -0.05, 0.3)
ZERO = (0.0,) * 4
GOAL = Goal(NAMES, (waypoint(1.0, THERE),))


class Bench:
    """Queue, pose controller and joints that are at once at their set points (plus ``off``).

    In virtual time.
    """

    def __init__(self) -> None:
        """Stand at HERE."""
        self.now = 100.0
        self.desk = GoalQueue(ROBOT.twin_joints, CONFIG)
        self.pose = PoseController(ROBOT, CONFIG, self.now)
        self.q, self.off, self.deaf = HERE, ZERO, False
        self.ended: list[tuple[object, Ended]] = []
        self.begun: list[object] = []
        self.rejected: list[tuple[object, GoalError]] = []
        self.trace: list[tuple[float, tuple[float, ...]]] = []
        self.mode = ""
        self.refused = 0
        self.step()

    def step(self) -> None:
        """Let one period pass."""
        self.now = round(self.now + CONFIG.period, 6)
        q = tuple(a + b for a, b in zip(self.q, self.off))
        measured = JointMotion.measured(q, ZERO, self.now)
        self.desk.measure(measured)
        self.pose.measure(measured)
        packet = self.pose.tick(self.now)
        report = self.pose.report(self.now)
        self.desk.hear_motion(report.state, report.message, report.speed_limit_percent, self.now)
        if self.mode:
            self.desk.hear_mode(self.mode, "because", self.now)
        turn = self.desk.tick(self.now)
        if turn.packet is not None and not self.deaf:
            try:
                self.pose.follow(turn.packet, self.now)
            except ScaraControlError:
                self.refused += 1
            else:
                self.obey(turn.packet)
        elif packet is not None:
            self.obey(packet)
        if turn.end_stream:
            self.pose.end_follow(self.now)
        if turn.due is not None:
            self.begin(turn.due)
        self.ended += turn.ended
        self.rejected += turn.rejected
        self.trace.append((self.now, self.q))

    def accept(self, key: str, goal: Goal, own: bool = False) -> bool:
        """Check a goal and hand it in, as its server does."""
        checked = self.desk.draft(goal, self.now, own)()
        return self.desk.accept(key, checked, self.now, own)

    def begin(self, due: Waiting) -> None:
        """Check a goal that has waited and begin it, as its server does."""
        checked: Execution | GoalError
        try:
            checked = self.desk.draft(due.goal, self.now, due.own)()
        except GoalError as error:
            checked = error
        if self.desk.begin(due, checked, self.now):
            self.begun.append(due.key)

    def obey(self, packet: Setpoints) -> None:
        """Put the named joints where the packet's first point is."""
        wanted = dict(zip(packet.names, packet.points[0].q))
        self.q = tuple(wanted.get(name, q) for name, q in zip(NAMES, self.q))

    def run(self, duration: float) -> None:
        """Let time pass."""
        for _ in range(round(duration / CONFIG.period)):
            self.step()

    def until_ended(self, count: int = 1) -> Ended:
        """Let time pass until so many goals have ended; return how the last one did."""
        for _ in range(2000):
            if len(self.ended) >= count:
                return self.ended[-1][1]
            self.step()
        raise AssertionError(f"not ended: {self.pose.report(self.now)}")


@pytest.fixture
def bench() -> Bench:
    """Return a bench at rest."""
    return Bench()


def test_a_goal_is_streamed_to_its_end_and_succeeds(bench: Bench) -> None:
    """The joints are at the last point, the stream is ended, the pose controller is free again."""
    assert bench.accept("a", GOAL)
    bench.run(0.5)
    assert bench.pose.report(bench.now).state == "following"
    ended = bench.until_ended()
    assert (ended.code, ended.cancelled) == (Code.SUCCESSFUL, False)
    assert bench.q == pytest.approx(THERE, abs=1e-9)
    assert bench.refused == 0
    assert bench.accept("b", Goal(NAMES, (waypoint(1.0, HERE),))), "the twin is free at once"


def test_the_queue_is_idle_without_goals_only(bench: Bench) -> None:
    """Neither while one runs, nor while a client waits to hear that its goal never begins."""
    assert bench.desk.is_idle
    bench.accept("a", GOAL)
    bench.accept("b", GOAL)
    bench.desk.command(Command.STOP)
    bench.until_ended()
    assert [key for key, _ in bench.rejected] == ["b"]
    assert bench.desk.is_idle


def test_a_goal_of_some_joints_leaves_the_others(bench: Bench) -> None:
    """Only what is named moves."""
    goal = Goal(("joint_2",), (waypoint(1.0, (0.6,)),))
    bench.accept("a", goal)
    bench.run(0.3)
    feedback = bench.desk.feedback()
    assert feedback is not None
    assert feedback[1].names == ("joint_2",)
    assert len(feedback[1].desired.q) == 1
    assert bench.until_ended().code is Code.SUCCESSFUL
    assert bench.q == pytest.approx((HERE[0], 0.6, *HERE[2:]), abs=1e-9)


def test_the_cap_stretches_the_time_base(bench: Bench) -> None:
    """At a quarter of the peak speed the same way takes about four times as long."""
    bench.accept("a", GOAL)
    ways = zip(HERE, THERE, ROBOT.twin_joints)
    peak = 100.0 * max(abs(b - a) / 0.5333 / joint.velocity for a, b, joint in ways)
    cap, begin = max(1.0, 0.25 * peak), bench.now
    bench.pose.limit_speed(cap, bench.now)
    bench.until_ended()
    assert bench.now - begin == pytest.approx(peak / cap + CONFIG.move.announce, rel=0.1)


def test_pause_freezes_on_the_path_and_resume_goes_on(bench: Bench) -> None:
    """Nothing moves while paused, and the goal still succeeds."""
    bench.accept("a", GOAL)
    bench.run(0.6)
    bench.desk.command(Command.PAUSE)
    bench.run(0.6)
    held = bench.q
    bench.run(0.5)
    assert bench.q == held != THERE
    bench.desk.command(Command.RESUME)
    assert bench.until_ended().code is Code.SUCCESSFUL
    assert bench.q == pytest.approx(THERE, abs=1e-9)


def test_cancel_ramps_down_on_the_path(bench: Bench) -> None:
    """No jump: the speed falls within the acceleration limits, the end lies on the way."""
    bench.accept("a", GOAL)
    bench.run(0.6)
    bench.desk.cancel("a")
    ended = bench.until_ended()
    assert ended.cancelled and "cancelled" in ended.text
    assert HERE[0] < bench.q[0] < THERE[0]
    speeds = [(b[1][0] - a[1][0]) / CONFIG.period for a, b in pairwise(bench.trace)]
    changes = [abs(b - a) / CONFIG.period for a, b in pairwise(speeds)]
    assert max(changes) <= ROBOT.twin_joints[0].acceleration * 1.05


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP])
def test_a_stop_aborts_the_goal_with_its_reason(bench: Bench, command: Command) -> None:
    """The pose controller stops the joints, the client reads why."""
    bench.accept("a", GOAL)
    bench.run(0.6)
    bench.pose.command(command, "somebody pressed it", bench.now)
    ended = bench.until_ended()
    assert ended.code is Code.INVALID_GOAL and not ended.cancelled
    assert "somebody pressed it" in ended.text
    bench.run(0.5)
    if command is Command.ESTOP:
        with pytest.raises(
            GoalError, match=r"joint_pose_controller is estopped .*: RESET it first"
        ):
            bench.accept("b", GOAL)


def stop_a_goal(bench: Bench) -> None:
    """Stop a goal on its way, and let the pose controller come to rest."""
    bench.accept("a", GOAL)
    bench.run(0.6)
    bench.pose.command(Command.STOP, "", bench.now)
    bench.until_ended()
    while bench.pose.report(bench.now).state != "idle":
        bench.step()


def test_a_goal_right_after_a_stop_waits_until_a_stream_is_listened_to_again(bench: Bench) -> None:
    """A stream must have paused after a STOP, so the goal begins behind that pause."""
    stop_a_goal(bench)
    refused = bench.refused
    assert not bench.accept("b", GOAL)
    assert bench.until_ended(2).code is Code.SUCCESSFUL
    assert bench.refused == refused and bench.begun == ["b"]


def test_a_goal_waits_so_too_where_its_server_heard_of_the_stop_first(bench: Bench) -> None:
    """The state of joint_pose_controller, read behind it, still said that it follows."""
    bench.accept("a", Goal(NAMES, (waypoint(4.0, THERE),)))  # slow: it stands at once
    bench.run(0.1)
    bench.desk.command(Command.ESTOP, "test")
    bench.pose.command(Command.ESTOP, "test", bench.now)
    assert bench.desk.tick(bench.now).end_stream
    bench.until_ended()
    bench.pose.command(Command.RESET, "", bench.now)
    bench.step()
    while bench.pose.report(bench.now).state != "idle":
        bench.step()
    refused = bench.refused
    assert not bench.accept("b", GOAL)
    assert bench.until_ended(2).code is Code.SUCCESSFUL
    assert bench.refused == refused and bench.begun == ["b"]


def test_a_goal_that_waits_behind_a_stop_is_not_dropped_for_a_newer_one(bench: Bench) -> None:
    """Its client would never hear of it: the newer one is refused, and the waiting one begins."""
    stop_a_goal(bench)
    assert not bench.accept("b", GOAL)
    with pytest.raises(GoalError, match="another goal is waiting already"):
        bench.accept("c", GOAL)
    assert bench.until_ended(2).code is Code.SUCCESSFUL
    assert bench.begun == ["b"]


def test_a_newer_goal_replaces_the_running_one(bench: Bench) -> None:
    """The old one ramps down and is cancelled; the new one begins from there and succeeds."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    assert not bench.accept("b", Goal(NAMES, (waypoint(1.5, HERE),)))
    with pytest.raises(GoalError, match="another goal is waiting"):
        bench.accept("c", GOAL)
    bench.until_ended(2)
    assert [(key, ended.cancelled) for key, ended in bench.ended] == [("a", True), ("b", False)]
    assert "replaced" in bench.ended[0][1].text and bench.begun == ["b"]
    assert bench.q == pytest.approx(HERE, abs=1e-9)


def test_a_waiting_goal_can_be_cancelled_before_it_begins(bench: Bench) -> None:
    """It is gone at once; the running one ends as replaced."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    bench.accept("b", Goal(NAMES, (waypoint(1.5, HERE),)))
    assert bench.desk.cancel("b")
    bench.until_ended()
    bench.run(1.0)
    assert bench.begun == [] and len(bench.ended) == 1


@pytest.mark.parametrize("mode", BLOCKING)
def test_a_goal_is_rejected_while_the_twin_controller_does_something_else(
    bench: Bench, mode: str
) -> None:
    """Stopped, in error, paused, or somebody else leads: the reason is the controller's.

    Out of a stop only a person leads on: whoever sends goals may not have heard of it. A controller
    that fell silent blocks nothing.
    """
    bench.mode = mode
    bench.step()
    way_on = ": ALIGN first" if mode == "STOPPED" else ""
    with pytest.raises(GoalError, match=rf"the twin controller is in {mode} \(because\){way_on}"):
        bench.accept("a", GOAL)
    bench.mode = ""
    bench.run(CONFIG.trajectory.mode_timeout + 0.1)
    assert bench.accept("a", GOAL)


def test_a_goal_is_rejected_while_somebody_else_holds_control(bench: Bench) -> None:
    """It would be stopped as soon as the twin moves: said before, and only while it is so.

    The holder's own program is accepted, in a mode in which others are.
    """
    bench.desk.hear_mode("IDLE", "because", bench.now, "fitter 1 holds control: ask for it")
    with pytest.raises(GoalError, match="fitter 1 holds control: ask for it"):
        bench.accept("a", GOAL)
    assert bench.accept("b", GOAL, own=True)
    bench.desk.cancel("b")
    bench.desk.hear_mode("FAULT", "because", bench.now)
    with pytest.raises(GoalError, match="the twin controller is in FAULT"):
        bench.accept("c", GOAL, own=True)
    bench.desk.hear_mode("IDLE", "because", bench.now)
    assert not bench.accept("d", GOAL), "it waits for the end of the cancelled one"


def test_the_holders_goal_that_waits_for_its_older_one_is_still_the_holders(bench: Bench) -> None:
    """It has ended the one that ran: rejected now, it would leave the twin standing on its way."""
    bench.desk.hear_mode("IDLE", "because", bench.now, "fitter 1 holds control: ask for it")
    bench.accept("a", GOAL, own=True)
    bench.run(0.3)
    bench.desk.hear_mode("TWIN_LEADS", "because", bench.now, "fitter 1 holds control: ask for it")
    assert not bench.accept("b", Goal(NAMES, (waypoint(1.0, HERE),)), own=True)
    bench.run(0.5)
    bench.desk.hear_mode("IDLE", "because", bench.now, "fitter 1 holds control: ask for it")
    assert bench.until_ended(2).code is Code.SUCCESSFUL
    assert bench.begun == ["b"] and bench.rejected == []


@pytest.mark.parametrize("mode", ["IDLE", "TWIN_LEADS"])
def test_a_goal_is_accepted_in_the_other_modes(bench: Bench, mode: str) -> None:
    """Nobody else leads."""
    bench.mode = mode
    bench.step()
    assert bench.accept("a", GOAL)


def test_the_end_is_held_while_the_controller_says_that_the_twin_leads(bench: Bench) -> None:
    """A stream that ended earlier would count as a stop of the pair."""
    bench.mode = "TWIN_LEADS"
    bench.accept("a", GOAL)
    bench.run(1.5)
    assert bench.ended == [] and bench.q == pytest.approx(THERE, abs=1e-9)
    assert bench.pose.report(bench.now).state == "following"
    bench.mode = "IDLE"
    bench.run(0.05)
    assert bench.ended[0][1].code is Code.SUCCESSFUL


def test_a_joint_off_the_path_aborts(bench: Bench) -> None:
    """Beyond path_tolerance, named with joint and value."""
    bench.accept("a", replace(GOAL, path_tolerance=(("joint_2", 0.01),)))
    bench.run(0.5)
    bench.off = (0.0, 0.02, 0.0, 0.0)
    ended = bench.until_ended()
    assert ended.code is Code.PATH_TOLERANCE_VIOLATED
    assert "joint_2 is " in ended.text and "deg off the path, allowed 0.573" in ended.text


def test_a_goal_that_is_not_reached_in_time_aborts(bench: Bench) -> None:
    """Beyond goal_tolerance after goal_time_tolerance; a negative tolerance allows anything."""
    bench.off = (0.0, 0.0, 0.001, 0.0)
    bench.accept("a", replace(GOAL, goal_time_tolerance=0.3))
    ended = bench.until_ended()
    assert ended.code is Code.GOAL_TOLERANCE_VIOLATED
    assert "joint_3 is 1.000 mm from its goal" in ended.text
    bench.run(0.3)
    bench.accept("b", replace(GOAL, goal_tolerance=(("joint_3", -1.0),)))
    assert bench.until_ended(2).code is Code.SUCCESSFUL


def test_a_goal_is_rejected_before_the_pose_controller_has_spoken() -> None:
    """Nobody would follow."""
    desk = GoalQueue(ROBOT.twin_joints, CONFIG)
    with pytest.raises(GoalError, match="joint_pose_controller has not said anything yet"):
        desk.draft(GOAL, 1.0)


def test_a_goal_is_rejected_while_a_move_runs(bench: Bench) -> None:
    """One motion at a time."""
    bench.pose.move(NAMES, THERE, 20.0, bench.now)
    bench.run(0.05)
    with pytest.raises(
        GoalError, match="joint_pose_controller is announcing: wait, or STOP it first"
    ):
        bench.accept("a", GOAL)


def test_a_pose_controller_that_does_not_follow_aborts_the_goal(bench: Bench) -> None:
    """Its last words are the reason."""
    bench.deaf = True
    bench.accept("a", GOAL)
    ended = bench.until_ended()
    assert "joint_pose_controller does not follow: it is idle" in ended.text


def test_joint_states_that_fail_to_come_abort_the_goal(bench: Bench) -> None:
    """Nothing is driven blindly."""
    bench.accept("a", GOAL)
    bench.run(0.3)
    late = bench.now + CONFIG.state_timeout + 0.1
    assert bench.desk.tick(late).end_stream
    bench.desk.hear_motion("idle", "", 100.0, late)
    (_, ended), *_ = bench.desk.tick(late + 0.01).ended
    assert ended.text == "aborted: twin/joint_states fails to come"
    with pytest.raises(GoalError, match="no fresh twin/joint_states"):
        bench.desk.draft(GOAL, late)


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP, Command.PAUSE])
def test_a_goal_that_waits_for_another_one_to_end_never_begins_after_a_stop(
    bench: Bench, command: Command
) -> None:
    """B replaces A; STOP while A ramps down: B began 0.15 s after the STOP and ran to its end."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    assert not bench.accept("b", Goal(NAMES, (waypoint(1.0, HERE),)))
    bench.step()
    bench.pose.command(command, "test", bench.now)
    bench.desk.command(command, "test")
    bench.run(3.0)
    assert bench.begun == []
    key, error = bench.rejected[0]
    assert key == "b" and str(error).startswith(f"cancelled by {command.name}: test, before it")
    stood = bench.q
    bench.run(1.0)
    assert bench.q == stood


def test_a_goal_that_the_pose_controller_has_not_seen_yet_ends_with_a_stop(bench: Bench) -> None:
    """STOP comes milliseconds behind the goal: nothing moves, and the client is told."""
    bench.accept("a", GOAL)
    bench.pose.command(Command.STOP, "test", bench.now)
    bench.desk.command(Command.STOP, "test")
    bench.run(1.0)
    assert bench.q == HERE
    assert "aborted by STOP: test" in bench.ended[0][1].text


def test_a_goal_sends_nothing_more_after_a_stop(bench: Bench) -> None:
    """Its server stood still: joint_pose_controller has ended the stream, and would begin anew."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    assert bench.pose.is_following
    bench.desk.command(Command.STOP, "test")
    for _ in range(100):
        bench.now += CONFIG.period
        turn = bench.desk.tick(bench.now)
        assert turn.packet is None
        if turn.ended:
            break
    assert "aborted by STOP: test" in turn.ended[0][1].text


def test_a_late_robot_with_a_ring_gets_its_trajectories(bench: Bench) -> None:
    """Set points reach as far ahead as it is late; only a clock makes the first one early."""
    bench.desk.look_ahead(0.4, 0.144)
    bench.accept("a", GOAL)
    assert bench.until_ended().code is Code.SUCCESSFUL
    assert bench.refused == 0


@pytest.mark.parametrize("stopped", [False, True])
def test_a_clock_that_goes_back_ends_a_goal_and_delays_no_new_one(
    bench: Bench, stopped: bool
) -> None:
    """As where a simulation begins anew; neither the mode nor a stop of before counts."""
    bench.mode = "OPERATOR_LEADS"
    assert bench.accept("old", GOAL)
    bench.run(0.2)
    if stopped:
        bench.desk.command(Command.STOP)
        bench.until_ended()
    bench.now, bench.mode = 1.0, ""
    bench.ended += bench.desk.tick(bench.now).ended
    bench.run(2.0)
    assert [key for key, _ in bench.ended] == ["old"]
    assert stopped or "the clock went back" in bench.ended[0][1].text
    assert bench.accept("new", GOAL), "it begins at once"
    bench.until_ended(2)
    assert bench.ended[1][1].code == Code.SUCCESSFUL


def slow_check(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, meanwhile: Callable[[], object]
) -> None:
    """Let the next goal's check take 0.6 s, in which joints are measured and something happens."""
    check_way = execution.check_way

    def slowly(*arguments: Any) -> float:
        monkeypatch.setattr(execution, "check_way", check_way)
        meanwhile()
        bench.now += 0.6
        bench.desk.measure(JointMotion.measured(bench.q, ZERO, bench.now))
        return check_way(*arguments)

    monkeypatch.setattr(execution, "check_way", slowly)


def test_a_goal_begins_when_its_check_has_ended(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Begun before, it would be late at its first set point, and aborted for that."""
    slow_check(bench, monkeypatch, lambda: None)
    assert bench.accept("a", GOAL)
    assert bench.desk.tick(bench.now).packet is not None
    assert bench.until_ended().code is Code.SUCCESSFUL
    assert bench.refused == 0


def test_a_goal_goes_on_while_another_one_is_checked_that_then_begins_where_it_has_led(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends meanwhile, so the newer one is planned anew from there."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    slow_check(bench, monkeypatch, bench.until_ended)
    assert not bench.accept("b", Goal(NAMES, (waypoint(1.0, HERE),)))
    assert bench.ended[0][1].code is Code.SUCCESSFUL
    assert bench.until_ended(2).code is Code.SUCCESSFUL
    assert bench.q == pytest.approx(HERE, abs=1e-9) and bench.refused == 0


def test_a_goal_whose_joint_moves_while_it_is_checked_is_rejected(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody jogs it: it stands no longer where the trajectory begins."""
    slow_check(bench, monkeypatch, lambda: setattr(bench, "q", THERE))
    with pytest.raises(GoalError, match=r"from the first point, .*: it has moved since"):
        bench.accept("a", GOAL)
    assert bench.desk.is_idle


@pytest.mark.parametrize(
    ("end", "said"),
    [
        (lambda desk: desk.command(Command.STOP, "test"), ["cancelled by STOP: test, before it"]),
        (lambda desk: desk.command(Command.PAUSE), ["cancelled by PAUSE, before it"]),
        (lambda desk: desk.cancel("b"), []),
    ],
)
def test_a_goal_that_waited_does_not_begin_behind_a_stop_that_comes_during_its_check(
    bench: Bench,
    monkeypatch: pytest.MonkeyPatch,
    end: Callable[[GoalQueue], object],
    said: list[str],
) -> None:
    """Nor behind a cancellation; a check takes as long as a person needs to press STOP."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    assert not bench.accept("b", Goal(NAMES, (waypoint(1.0, HERE),)))
    slow_check(bench, monkeypatch, lambda: end(bench.desk))
    bench.run(3.0)
    assert bench.begun == [] and [key for key, _ in bench.ended] == ["a"]
    assert [str(error)[: len(text)] for (_, error), text in zip(bench.rejected, said)] == said
    assert len(bench.rejected) == len(said) and bench.desk.is_idle


def test_a_waiting_goal_that_is_found_wrong_where_it_would_begin_is_rejected(bench: Bench) -> None:
    """It was right where the joints were when it came; its client is told."""
    bench.accept("a", GOAL)
    bench.run(0.5)
    assert not bench.accept("b", Goal(NAMES, (waypoint(0.0, bench.q), waypoint(1.0, HERE))))
    bench.run(3.0)
    assert bench.begun == [] and bench.rejected[0][0] == "b"
    assert "from the first point" in str(bench.rejected[0][1])
