"""A stopped pair is left by a person only: whoever goes on commanding the twin leads nobody."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle

import pytest
from harness.running.thorough import SEARCH, thorough
from harness.scenes.steps import AT_REST_DEG_MM, ROBOT, nothing_moves, run_program
from harness.scenes.truth import standstill_since, travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import Command
from scara_control.trajectory.goal import Goal, GoalError

WATCHED_S = 60.0 if SEARCH else 8.0
"""Longer than what any rule of a stopped pair counts, 3 s; the slowest pace is sent twice."""
PERIODS_S = (0.2, 0.5, 2.0)
DECIDED_S = 0.1
"""So soon after the twin moves again it is decided that it is stopped again."""
MOVES_RAD_S = 0.02
"""The twin is faster than this: it moves. A quarter of a percent of joint_1's largest speed."""


class Source:
    """A program that commands the twin at its own pace and has never heard of a stop."""

    def __init__(self, cell: VirtualCell) -> None:
        self.cell, self.twin = cell, cell.twin
        self.names = tuple(joint.name for joint in cell.files.robot.twin_joints)
        self.home = cell.twin.truth[-1][1]
        self.sign = cycle((1.0, -1.0))
        positions = cell.files.robot.positions_m
        self.places = cycle((positions["P2"], positions["P3"]))
        self.refused: list[str] = []

    def velocity(self) -> None:
        """Drive a joint past all motion nodes."""
        self.twin.command_velocity("joint_1", next(self.sign) * 0.25)

    def position(self) -> None:
        """Send a joint somewhere past all motion nodes."""
        self.twin.command_position("joint_1", self.home[0] + next(self.sign) * 0.1)

    def jog(self) -> None:
        """Press a jog key for a moment."""
        self.twin.jog(["joint_1"], [next(self.sign) * 0.5])

    def goal(self) -> None:
        """Send a trajectory."""
        there = (self.home[0] + next(self.sign) * 0.3, *self.home[1:])
        try:
            self.twin.accept(Goal(self.names, (JointMotion(there, (), (), 1.0),)))
        except GoalError as error:
            # Its client reads this and may send the next one all the same.
            self.refused.append(str(error))

    def follow(self) -> None:
        """Send some set points of a stream."""
        here, now = self.twin.truth[-1][1], self.twin._now()
        speed = (next(self.sign) * 0.3, *(0.0 for _ in here[1:]))
        times = [now + 0.02 * k for k in range(1, 11)]
        points = [
            JointMotion.measured((here[0] + speed[0] * (at - now), *here[1:]), speed, at)
            for at in times
        ]
        self.twin._stream(Setpoints.due(self.names, times, points))

    def move(self) -> None:
        """Ask for a point."""
        self.twin.move_to.begin(next(self.places), 30.0, "", lambda success, text: None)


SOURCES = ("velocity", "position", "jog", "goal", "follow", "move")
EACH_TIME = ("velocity", "goal", "move")
"""Past all motion nodes, by a node that refuses, and by one that takes it."""
SELDOM = [source for source in SOURCES if source not in EACH_TIME]
SOURCE = pytest.mark.parametrize("source", [*EACH_TIME, *thorough(*SELDOM)])


class Paced:
    """Sends at one period after the other, each for as long as it is told."""

    def __init__(self, cell: VirtualCell, source: str) -> None:
        self._cell, self._send = cell, getattr(Source(cell), source)
        self.period = 0.4
        self._again()

    def _again(self) -> None:
        self._send()
        self._cell.schedule.after(self.period, self._again)


ALONE = [("velocity", (period,)) for period in PERIODS_S]


@pytest.mark.parametrize(
    ("source", "periods"),
    [
        *(("velocity", PERIODS_S), ("move", PERIODS_S)),
        *thorough(*((source, PERIODS_S) for source in ("goal", *SELDOM)), *ALONE),
    ],
)
def test_whoever_commands_the_twin_moves_no_stopped_robot(
    source: str, periods: tuple[float, ...]
) -> None:
    """For as long as it likes; it is said once that the twin moves, as soon as it does.

    That a goal is refused each time the next test says.
    """
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        paced = Paced(cell, source)
        cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 10.0, "TWIN_LEADS")
        cell.schedule.run(0.4)
        assert cell.operate("STOP").success
        stopped = cell.schedule.now
        cell.schedule.run(1.0)
        rested = cell.schedule.now
        assert standstill_since(cell.real.truth, stopped) < stopped + 0.4
        for period in periods:
            paced.period = period
            cell.schedule.run(WATCHED_S / len(periods))
        assert travel(cell.real.truth, rested) < AT_REST_DEG_MM, cell.why
        assert cell.mode in ("STOPPED", "FAULT")
        after = [each for each in cell.decisions if each.now > cell.clock() - WATCHED_S - 1.0]
        assert not [each for each in after if "LEADS" in each.mode_after]
        assert len([each for each in after if each.trigger == "TWIN_MOVED_STOPPED"]) <= 1


@pytest.mark.parametrize("source", ["velocity", *thorough("position", "jog")])
def test_stop_on_the_twins_side_counts_whoever_moves_the_twin(source: str) -> None:
    """Its pose controller drives nothing then: a jog, or a joint that is commanded past it."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        Paced(cell, source)
        cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 10.0, "TWIN_LEADS")
        cell.schedule.run(0.4)
        cell.twin.told(Command.STOP, 17)
        cell.wait_whatever(lambda: cell.mode == "STOPPED", 0.2, "STOPPED")
        assert cell.decisions[-1].trigger == "TWIN_STOPPED"
        cell.schedule.run(1.0)
        rested = cell.schedule.now
        cell.schedule.run(3.0)
        assert travel(cell.real.truth, rested) < AT_REST_DEG_MM, cell.why


@SOURCE
def test_a_twin_that_moves_while_stopped_is_stopped_within_a_tenth_of_a_second(
    source: str,
) -> None:
    """A motion that is announced is stopped before it begins; ALIGN lets the source lead again."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        sender = Source(cell)
        send: Callable[[], None] = getattr(sender, source)
        assert cell.operate("STOP").success
        cell.schedule.run(1.0)
        begun = cell.schedule.now
        send()
        cell.schedule.run(2.0)
        said = [each for each in cell.decisions if each.trigger == "TWIN_MOVED_STOPPED"]
        moves = [
            at
            for at, _, qdot in cell.twin.truth
            if at > begun and max(map(abs, qdot)) > MOVES_RAD_S
        ]
        if source == "goal":
            # The twin's own node knows of the stop, and says so before anything moves.
            assert not said and not moves and "ALIGN first" in sender.refused[0]
        else:
            assert len(said) == 1 and "ALIGN, then it may lead" in said[0].why
            decided = said[0].now - cell.clock() + cell.schedule.now
            assert not moves or decided - moves[0] < DECIDED_S
            assert not moves or moves[-1] - decided < 0.4, "it stands again"
        assert travel(cell.real.truth, begun) < AT_REST_DEG_MM
        assert cell.operate("ALIGN").success
        cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")
        # The twin's nodes hear of the mode a little later.
        cell.schedule.run(0.2)
        send()
        cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 5.0, "TWIN_LEADS")


@pytest.mark.parametrize("cancels", [True, False])
def test_a_program_that_was_queued_before_a_stop_never_starts(cancels: bool) -> None:
    """CSTOPI clears what waits in the robot, whether it ends the program that runs or not."""
    files = load_files(ROBOT, settings={"cstopi_for_abort": cancels})
    with VirtualCell(files) as cell:
        cell.connect()
        run_program(cell)
        cell.real.signal("rsr3", None)
        cell.schedule.run(0.4)
        assert cell.operate("STOP").success
        cell.schedule.run(1.0)
        nothing_moves(cell, cell.schedule.now, 4.0)
        assert cell.mode == "STOPPED"


@pytest.mark.parametrize("on_the_twin", [None, Command.RESUME, Command.YIELD])
def test_a_pause_of_the_twin_alone_is_shown_and_let_go(on_the_twin: Command | None) -> None:
    """Nothing moves, but jogs are refused from then on: by RESUME of either side they are not."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        cell.twin.told(Command.PAUSE, 0)
        cell.wait_whatever(lambda: cell.mode == "PAUSED", 1.0, "PAUSED")
        begun = cell.schedule.now
        cell.twin.jog(["joint_1"], [0.5])
        cell.schedule.run(2.0)
        assert travel(cell.twin.truth, begun) < AT_REST_DEG_MM and cell.mode == "PAUSED"
        if on_the_twin:
            cell.twin.told(on_the_twin, 0)
            cell.wait_whatever(lambda: cell.mode == "IDLE", 1.0, "IDLE")
        else:
            assert cell.operate("RESUME").success and cell.mode == "IDLE"
        cell.schedule.run(0.5)
        cell.twin.jog(["joint_1"], [0.5])
        cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 5.0, "TWIN_LEADS")


def test_a_pause_is_accepted_while_nothing_moves() -> None:
    """What comes after it moves nothing; RESUME gives the pair back as it was."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        assert cell.operate("PAUSE").success and cell.mode == "PAUSED"
        cell.schedule.run(0.5)
        begun = cell.schedule.now
        cell.twin.command_velocity("joint_1", 0.25)
        cell.schedule.run(2.0)
        assert travel(cell.real.truth, begun) < AT_REST_DEG_MM
        assert travel(cell.twin.truth, begun) < AT_REST_DEG_MM
        assert cell.operate("RESUME").success and cell.mode == "IDLE"
        cell.schedule.run(0.5)
        cell.twin.command_velocity("joint_1", 0.25)
        cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 5.0, "TWIN_LEADS")
