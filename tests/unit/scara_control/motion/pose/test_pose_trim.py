"""The trim at the end of a move: part of the move, and whatever is commanded meanwhile goes on."""

from __future__ import annotations

import pytest
from harness.opponents.ideal_twin import CONFIG, DT, FAR, HOME, MODES, NAMES, Bench, smooth
from scara_control.motion.commands import Command

SAG = (2e-4, -2e-4, 0.0, 0.0)
"""So far the joints stay from their target [rad]: about 0.1 mm at the tool."""
JOGGED = {**dict.fromkeys(NAMES[:3], "velocity"), "table_joint": "trajectory"}
TAKING_OVER = {
    "move": lambda bench: bench.move(HOME),
    "stream": lambda bench: bench.stream(bench.q),
    "jog": lambda bench: bench.core.jogged(),
    "STOP": lambda bench: bench.command(Command.STOP, "door"),
    "ESTOP": lambda bench: bench.command(Command.ESTOP, "door"),
    "YIELD": lambda bench: bench.command(Command.YIELD, "door"),
}


class Trimmed(Bench):
    """Joints that sag at the end of a plan, and obey a trim's jogs."""

    def __init__(self) -> None:
        """Begin a move that is trimmed."""
        self.jogs: list[tuple[float, ...]] = []
        super().__init__()
        self.core.move((), FAR, 100.0, self.now, trims=True)

    def tick(self, count=1):
        """Go on by periods."""
        for _ in range(count):
            super().tick()
            jog = self.core.take_jog()
            if jog is not None:
                assert jog.names == NAMES[:3]
                self.jogs.append(jog.velocities)
            if self.jogs and not self.setpoints[-1].qdot[0] and jog is not None:
                self.qdot = (*self.jogs[-1], 0.0)
            self.q = tuple(q + v * DT for q, v in zip(self.q, self.qdot))
        return self.states[-1]

    def sag(self) -> None:
        """Come to the end of the plan, a little beside it, and begin to jog."""
        while self.core._driver.drive is not None or not self.setpoints:
            self.tick()
        self.q, self.qdot = tuple(q + off for q, off in zip(FAR, SAG)), (0.0,) * 4
        for _ in range(100):
            if self.jogs:
                break
            self.tick()
        self.modes(JOGGED)
        self.tick(3)


def test_a_trim_is_part_of_the_move():
    """The state says that it moves until the tool has stayed at its point; then it is answered."""
    bench = Trimmed()
    bench.sag()
    assert bench.report.state == "moving" and not bench.report.standing_still
    assert not bench.outcomes and not bench.core.is_idle
    bench.until("idle")
    (outcome,) = bench.outcomes
    assert outcome.success and outcome.message.startswith("reached in ")
    assert bench.q == pytest.approx(FAR, abs=7e-5) and bench.report.standing_still
    assert any(bench.jogs[0]) and not any(bench.jogs[-1])
    count = len(bench.jogs)
    bench.tick(20)
    assert len(bench.jogs) == count and bench.core.is_idle


@pytest.mark.parametrize("command", TAKING_OVER)
def test_a_command_ends_a_trim_at_once(command):
    """One outcome, with its reason; no jog comes any more."""
    bench = Trimmed()
    bench.sag()
    count, q = len(bench.jogs), bench.q
    TAKING_OVER[command](bench)
    bench.tick()
    (outcome,) = bench.outcomes
    assert not outcome.success and outcome.message.startswith("aborted")
    assert "replaced by" in outcome.message or "door" in outcome.message
    assert bench.core.take_jog() is None and len(bench.jogs) == count
    assert bench.q == pytest.approx(q, abs=1e-4)


def test_a_move_begins_where_the_trim_is_and_late_jogs_do_not_end_it():
    """Nothing jumps, and the joints are its own from its first motion on."""
    bench = Trimmed()
    bench.sag()
    first = len(bench.setpoints)
    bench.core.move((), HOME, 100.0, bench.now)
    bench.tick()
    bench.modes(MODES)
    bench.modes(JOGGED)
    bench.modes(MODES)
    assert bench.setpoints[first].q == pytest.approx(bench.q, abs=1e-4)
    bench.until("moving")
    assert smooth(bench.setpoints[first:])
    bench.until("idle")
    assert [outcome.success for outcome in bench.outcomes] == [False, True]


def test_a_stream_goes_on_in_spite_of_late_jogs_but_not_for_long():
    """Who goes on taking the joints is named as before."""
    bench = Trimmed()
    bench.sag()
    bench.stream(bench.q)
    for modes in (MODES, JOGGED, MODES):
        bench.tick()
        bench.modes(modes)
        bench.stream(bench.q)
    assert bench.report.state == "following"
    for _ in range(12):
        bench.tick()
        bench.stream(bench.q)
    bench.modes(JOGGED)
    assert "was taken by its velocity controller" in bench.report.message


def test_a_joint_that_somebody_else_moves_ends_the_trim():
    """Its jogs would fight for it."""
    bench = Trimmed()
    bench.sag()
    bench.modes({**JOGGED, "joint_2": "position"})
    bench.tick()
    (outcome,) = bench.outcomes
    assert outcome.message == "aborted: joint_2 was taken by its position controller"


def test_a_paused_trim_waits_and_is_heard_again_after_a_resume():
    """A stopped stream of jogs is heard once it has paused for its time-out."""
    bench = Trimmed()
    bench.sag()
    bench.command(Command.PAUSE)
    bench.tick()
    count, stopped = len(bench.jogs), bench.now
    bench.qdot = (0.0,) * 4
    bench.q = tuple(q + off for q, off in zip(FAR, SAG))
    assert bench.tick(5) == "paused"
    bench.command(Command.RESUME)
    bench.tick()
    assert bench.report.state == "moving" and len(bench.jogs) == count
    while len(bench.jogs) == count:
        bench.tick()
    assert CONFIG.jog.timeout - 2 * DT < bench.now - stopped < CONFIG.jog.timeout + 3 * DT
    bench.until("idle")
    assert bench.outcomes[-1].success


def test_a_tool_that_is_pushed_away_fails_the_move_with_the_rest():
    """A larger rest is a failed move, not one to be trimmed; the joints stop."""
    bench = Trimmed()
    bench.sag()
    bench.q = (FAR[0] + 0.02, *FAR[1:])
    bench.tick(2)
    (outcome,) = bench.outcomes
    assert not outcome.success and "trimming begins below 5 mm" in outcome.message
    assert bench.report.message == outcome.message and not any(bench.jogs[-1])
