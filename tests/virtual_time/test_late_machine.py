"""A late machine in virtual time: the real core, the real stand-in, and processes that stand still.

What is late is told apart from what is silent. Times are judged here, where a millisecond is one;
the tests of whole cells judge what happens.
"""

from __future__ import annotations

import pytest
from harness.emulated.emulated_pair import EmulatedPair, moves
from harness.pair import ROBOT
from harness.workspace import ROOT
from twin_controller.config import load_twin_controller
from twin_controller.core.events import Tick
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup
from twin_controller.core.sides.own_gap import OwnGaps

STRICT, DESK = (
    Setup(ROBOT, load_twin_controller(ROBOT, ROOT / "config", links))
    for links in ("strict", "desk")
)
SETUPS = {"strict": STRICT, "desk": DESK}
TICK_S = 0.011
"""From one look of the controller to the next, and a millisecond."""


class LatePair(EmulatedPair):
    """A pair whose processes can stand still; their robots go on, as a servo that catches up."""

    def __init__(self, setup: Setup) -> None:
        """Connect; the stand-in has a program there and back."""
        there, back = {"joint_1": 40.0, "joint_2": 30.0}, {"joint_1": 0.0, "joint_2": 0.0}
        super().__init__(moves(there, back, speed_percent=20.0), setup=setup)
        self.gaps = OwnGaps(setup.config.own_gap)
        self.connect()

    def lost(self) -> list[str]:
        """Return why a link was lost, each time."""
        return [d.why for d in self.decisions() if d.trigger == "LINK_LOST"]

    def late_side(self, side: str, duration: float) -> None:
        """Let the process of one side stand still: it neither reports nor hears."""
        setattr(self, f"{side}_up", False)
        self.run(duration)
        setattr(self, f"{side}_up", True)

    def late_controller(self, duration: float) -> None:
        """Let the controller stand still: both sides go on, and their last reports wait."""
        self.gaps.look(self.now)
        for _ in range(round(duration * 1000)):
            self.now = round(self.now + 0.001, 6)
            self.move_real(self.now)
            self.move_simulated(self.now, self.now + self.twin_clock)
        self.feed(Tick(self.now, self.gaps.look(self.now)))
        self._report_real()
        self._report_twin()

    def together_again(self) -> None:
        """Wait for the end of the motion; a pair that has come apart is stopped and aligned."""
        self.run_until(lambda: self.state.lead.mode in (Mode.IDLE, Mode.PAUSED), 20.0)
        if self.state.lead.mode is Mode.PAUSED:
            assert self.operate("STOP").success
            self.run(1.0)
            assert self.operate("ALIGN").success
            self.run_until(lambda: self.state.lead.mode is Mode.IDLE, 20.0)


def under_way(setup: Setup) -> LatePair:
    """Give a pair whose real robot leads by its program."""
    pair = LatePair(setup)
    pair.start()
    pair.until(Mode.REAL_LEADS, 2.0)
    pair.run(0.5)
    return pair


@pytest.mark.parametrize(
    ("links", "side", "late"),
    [
        ("strict", "real", 0.080),
        ("strict", "twin", 0.200),
        ("desk", "real", 0.650),
        ("desk", "twin", 0.950),
    ],
)
def test_a_late_process_of_a_side_costs_no_link(links: str, side: str, late: float) -> None:
    """Up to the limit of the profile, idle or under way.

    A pair that has come apart meanwhile has paused, as it should; STOP and ALIGN lead on.
    """
    pair = under_way(SETUPS[links])
    pair.late_side(side, late)
    pair.together_again()
    pair.late_side(side, late)
    pair.run(1.0)
    assert pair.mode is Mode.IDLE and pair.lost() == []


@pytest.mark.parametrize(
    ("links", "side", "limit"),
    [
        ("strict", "real", 0.100),
        ("strict", "twin", 0.250),
        ("desk", "real", 0.700),
        ("desk", "twin", 1.000),
    ],
)
def test_a_silent_side_is_found_in_time(links: str, side: str, limit: float) -> None:
    """Strict as it always was, 0.1 s and 0.25 s; a desk takes longer, and finds it too."""
    pair = under_way(SETUPS[links])
    begun = pair.now
    setattr(pair, f"{side}_up", False)
    pair.run_until(lambda: pair.mode is Mode.OFFLINE, limit + TICK_S)
    assert pair.now - begun <= limit + TICK_S and len(pair.lost()) == 1


@pytest.mark.parametrize("late", [0.04, 0.07, 0.099])
def test_a_late_controller_loses_no_side(late: float) -> None:
    """With the strict limits, once a second: what it did not hear was said all the same.

    A twin that has heard nothing for 0.1 s has ended its stream: that pair has paused.
    """
    pair = under_way(STRICT)
    while pair.mode is Mode.REAL_LEADS:
        pair.late_controller(late)
        pair.run(1.0)
    pair.together_again()
    assert pair.lost() == []
