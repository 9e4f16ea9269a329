"""The runner under a clock of its own: stalls, pauses, steps of the system clock, errors."""

from __future__ import annotations

import itertools
from pathlib import Path
from threading import Thread

import pytest
from scara_config import load_robot
from scara_control.pid import PidGains
from scara_simulation.config import LoopGains, load_simulation
from scara_simulation.health import judge
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import JointModel
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.simulation import Simulation, Timing

from scara_simulation import real_time_runner_io as runner_module

MS = 1_000_000
CONFIG_FOLDER = Path(__file__).parents[4] / "config"
CONFIG = load_simulation(load_robot(CONFIG_FOLDER), CONFIG_FOLDER)
WAKE_MS = CONFIG.wake_period_ms


class Clock:
    """A clock that only sleeping moves; ``events`` happen at their time."""

    def __init__(self):
        self.now, self.offset, self.events = 5_000_000_000, 1_700_000_000_000_000_000, []

    def monotonic_ns(self):
        """Return the time that is never stepped."""
        return self.now

    def time_ns(self):
        """Return the system's time."""
        return self.now + self.offset

    def sleep(self, duration):
        """Let time pass."""
        self.now += max(round(duration * 1e9), 1000)
        while self.events and self.events[0][0] <= self.now:
            self.events.pop(0)[1]()


class Still:
    """A world in which nothing moves."""

    def read(self):
        """Return the state."""
        return [0.0], [0.0]

    def step(self, efforts):
        """Do nothing."""

    def reset(self, positions):
        """Do nothing."""


class Cell:
    """A runner, what it published, and a way to run it for a while."""

    def __init__(self, clock, factor=1.0, follow=True):
        model = JointModel("slide", -5.0, 5.0, 10.0, 50.0, 1e4, 0.01)
        control = JointControl(
            [model], [LoopGains(PidGains(p=1.0), PidGains(p=1.0))], [0.0], CONFIG.dt, None
        )
        self.clock, self.began = clock, clock.time_ns()
        self.simulation = Simulation(
            Still(), control, [0.0], Timing(CONFIG.step_ns, self.began, 5, 50)
        )
        self.snapshots, self.reports = [], []
        self.work = RealTimeRunner(
            self.simulation,
            CONFIG,
            factor=factor,
            follow_system_clock=follow,
            publish=self.snapshots.extend,
            report=self.reports.append,
        )

    def run(self, milliseconds, events=()):
        """Run, with ``events`` as (after milliseconds, what)."""
        end = self.clock.now + milliseconds * MS
        self.clock.events = [(self.clock.now + at * MS, what) for at, what in events]
        self.work.run(lambda: self.clock.now >= end)
        return self

    def stall(self, milliseconds):
        """Let time pass without the runner noticing."""
        self.clock.now += milliseconds * MS


@pytest.fixture
def clock(monkeypatch):
    """Replace the clock of the module under test."""
    clock = Clock()
    monkeypatch.setattr(runner_module, "time", clock)
    return clock


def milliseconds(cell):
    """Return the stamps of the snapshots in ms since the start."""
    return [(s.stamp_ns - cell.began) / MS for s in cell.snapshots]


def test_every_snapshot_has_its_nominal_stamp(clock):
    """5 ms apart exactly, in system time."""
    cell = Cell(clock).run(1000)
    assert milliseconds(cell) == [5.0 * k for k in range(1, 201)]


def test_pause_is_answered_once_all_states_before_it_are_published(clock):
    """Who steps by hand then gets the states of these steps, and none that comes late."""
    cell, askers, seen = Cell(clock), [], []

    def pause():
        cell.work.pause()
        seen.append(len(cell.snapshots))

    def publish(snapshots):
        if not askers:
            askers.append(Thread(target=pause))
            askers[0].start()
            askers[0].join(0.1)  # it must not end before what is on its way has left
        cell.snapshots.extend(snapshots)

    cell.work._publish = publish
    cell.run(50)
    askers[0].join(5.0)
    assert seen and seen[0] == len(cell.snapshots) > 0
    assert cell.work.step(5) and len(cell.snapshots) == seen[0] + 1


def test_short_stall_is_made_up_for(clock):
    """No snapshot is missing after a late wake."""
    cell = Cell(clock)
    cell.run(200, [(100, lambda: cell.stall(40))])
    assert milliseconds(cell) == [5.0 * k for k in range(1, len(cell.snapshots) + 1)]
    assert cell.work.status().stalls == 0


def test_long_stall_is_skipped_and_reported(clock):
    """The nominal time jumps to the present; the operator is told."""
    cell = Cell(clock)
    cell.run(1500, [(100, lambda: cell.stall(400))])
    assert milliseconds(cell)[-1] == pytest.approx(1500, abs=5 + WAKE_MS)
    status = cell.work.status()
    assert (status.stalls, status.skipped_steps) == (1, pytest.approx(350, abs=WAKE_MS))
    assert cell.reports[0].stalls == 1


def test_pause_stops_time_and_unpause_returns_to_the_present(clock):
    """Nothing is published in a pause; afterwards the stamps are the system's time again."""
    cell = Cell(clock)
    cell.run(1000, [(100, cell.work.pause), (700, cell.work.unpause)])
    stamps = milliseconds(cell)
    assert not [stamp for stamp in stamps if 105 < stamp < 695]
    assert stamps[-1] == pytest.approx(1000, abs=5 + WAKE_MS)
    assert cell.work.status().stalls == 0


def test_steps_by_hand_only_in_a_pause(clock):
    """They are published with their nominal stamps and count as simulated time."""
    cell = Cell(clock)
    answers = []
    by_hand = [
        (50, lambda: answers.append(cell.work.step(10))),
        (100, cell.work.pause),
        (150, lambda: answers.append(cell.work.step(200))),
        (500, cell.work.unpause),
    ]
    cell.run(800, by_hand)
    assert answers == [False, True]
    stamps = milliseconds(cell)
    assert stamps[:59] == [5.0 * k for k in range(1, 60)]
    assert not [stamp for stamp in stamps if 310 < stamp < 495]
    assert stamps[-1] == pytest.approx(800, abs=5 + WAKE_MS)


def test_reset_returns_the_simulation_to_its_start(clock):
    """The counters of time go on."""
    cell = Cell(clock).run(20)
    cell.simulation.control.command_position("slide", 1.0)
    cell.work.reset()
    assert cell.simulation.control.loops[0].position_setpoint == 0.0
    assert cell.simulation.steps == 20


@pytest.mark.parametrize(("follow", "shift"), [(True, 500), (False, 0)])
def test_step_of_the_system_clock_moves_the_stamps_unless_time_is_our_own(clock, follow, shift):
    """With /clock the simulation's time is nobody else's."""
    cell = Cell(clock, follow=follow)

    def set_clock():
        clock.offset += 500 * MS

    cell.run(2000, [(500, set_clock)])
    assert milliseconds(cell)[-1] == pytest.approx(2000 + shift, abs=5 + WAKE_MS)
    assert cell.work.status().clock_steps == (1 if follow else 0)


@pytest.mark.parametrize("factor", [0.5, 4.0, 50.0])
def test_factor_scales_simulated_time(clock, factor):
    """Four times real time makes four times the steps, and no wake is a stall."""
    cell = Cell(clock, factor=factor, follow=False).run(200)
    assert cell.simulation.steps == pytest.approx(200 * factor, abs=2 * WAKE_MS * factor)
    assert cell.work.status().stalls == 0


def test_factor_zero_does_not_wait(clock):
    """Each turn makes steps, however little time has passed."""
    cell = Cell(clock, factor=0.0, follow=False)
    turns = iter(range(100))
    cell.work.run(lambda: next(turns, None) is None)
    assert cell.simulation.steps == 100 * 10
    assert len(cell.snapshots) == 200
    cell.work.pause()
    before = clock.now
    cell.run(10)
    assert cell.simulation.steps == 100 * 10
    assert clock.now > before


def test_reports_come_each_second_and_soon_after_a_change(clock):
    """A refusal is told within 0.1 s, a quiet cell once a second."""
    cell = Cell(clock)
    cell.run(3000, [(500, lambda: cell.work.refuse("joint_1 = nan"))])
    assert len(cell.reports) == 4
    assert (cell.reports[0].refused, cell.reports[0].last_refusal) == (1, "joint_1 = nan")
    assert cell.reports[-1].real_time_factor == pytest.approx(1.0, abs=0.01)
    assert cell.reports[-1].deadlines.wakes == pytest.approx(1000 / WAKE_MS, abs=1)


@pytest.mark.parametrize(
    "marks",
    [
        [(1300, "pause"), (1600, "unpause")],  # within one report period
        [(1300, "pause"), (2600, "unpause")],
        [(200, "refuse"), (500, "refuse")],  # told before the first period has ended
    ],
)
def test_what_is_no_whole_second_is_not_too_slow(clock, marks):
    """A part of a pause, or of the first second: no share of real time can be told of it."""
    cell = Cell(clock)
    acts = {
        "pause": cell.work.pause,
        "unpause": cell.work.unpause,
        "refuse": lambda: cell.work.refuse("joint_1 = nan"),
    }
    cell.run(4200, [(at, acts[what]) for at, what in marks])
    pairs = itertools.pairwise([None, *cell.reports])
    assert "error" not in [judge(status, last, 1.0)[0] for last, status in pairs]
    assert cell.reports[-1].whole


def test_second_that_is_too_slow_behind_a_pause_is_told(clock):
    """Only the period with the pause in it is left out."""
    cell = Cell(clock)
    marks = [(1300, cell.work.pause), (1600, cell.work.unpause), (3300, lambda: cell.stall(400))]
    cell.run(4500, marks)
    pairs = itertools.pairwise([None, *cell.reports])
    assert [judge(status, last, 1.0)[0] for last, status in pairs][-1] == "error"


def test_error_of_a_callback_ends_the_run(clock):
    """It is raised in the thread that can end the node."""
    cell = Cell(clock)
    with pytest.raises(RuntimeError, match="out of paper"):
        cell.run(1000, [(100, lambda: cell.work.fail(RuntimeError("out of paper")))])
