"""A gripper's switch is passed on, a refused or lost one is seen, a stop switches nothing."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import ROBOT, SETUP, idle_pair
from harness.parts import changed
from twin_controller.core.actions import AnyAction, Decided, Grip
from twin_controller.core.events import GripAnswered, TwinGripper
from twin_controller.core.lead.modes import Mode
from twin_controller.core.orders.gripper import Grips
from twin_controller.core.setup import Setup
from twin_controller.reporting.snapshots import decode_state, encode_state
from twin_controller.view import alarm_text, state_view, statuses

CONFIG = SETUP.config.gripper
RETRY = CONFIG.retry_ms * 1e-3


class Grippers:
    """A connected pair whose grippers the test shows."""

    def __init__(self) -> None:
        self.pair = idle_pair()
        self.pair.until(Mode.IDLE, 30.0)
        self.real_shows(False)
        self.twin_shows(False)

    def real_shows(self, on: bool, vacuum: bool = False) -> list[AnyAction]:
        """Let the real robot report its gripper."""
        flags = self.pair.state.sides.real.flags
        assert flags is not None
        return self.pair.feed(
            msgspec.structs.replace(flags, now=self.pair.now, gripper=on, vacuum=vacuum)
        )

    def twin_shows(self, on: bool, part: str = "") -> list[AnyAction]:
        """Let the twin report its gripper."""
        return self.pair.feed(TwinGripper(self.pair.now, on, bool(part), part))

    def later(self, seconds: float) -> list[AnyAction]:
        """Let time pass; the sides go on reporting where they are."""
        before = len(self.pair.actions)
        self.pair.run(seconds)
        return self.pair.actions[before:]

    def enter(self, mode: Mode) -> None:
        """Put the pair into a mode."""
        self.pair.state = changed(self.pair.state, lead__mode=mode)

    @property
    def trouble(self) -> str:
        """Return what the operator sees."""
        return self.pair.state.orders.grips.trouble


@pytest.fixture
def grippers() -> Grippers:
    """Give a pair at rest with both grippers off."""
    return Grippers()


def orders(actions: list[AnyAction]) -> list[Grip]:
    """Return the orders among the actions."""
    return [action for action in actions if isinstance(action, Grip)]


def triggers(actions: list[AnyAction]) -> list[str]:
    """Return what was decided."""
    return [
        action.trigger
        for action in actions
        if isinstance(action, Decided) and action.trigger.startswith("GRIPPER")
    ]


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode is not Mode.OFFLINE])
def test_switch_of_the_real_gripper_is_passed_on_in_every_mode(
    grippers: Grippers, mode: Mode
) -> None:
    """The twin shows what is: also a part let go by hand during a stop."""
    grippers.enter(mode)
    assert Grip("twin", True) in orders(grippers.real_shows(True))
    grippers.twin_shows(True)
    assert orders(grippers.real_shows(False)) == [Grip("twin", False)]


@pytest.mark.parametrize("mode", [Mode.IDLE, Mode.TWIN_LEADS, Mode.OPERATOR_LEADS])
def test_switch_of_the_twins_gripper_is_passed_on_while_it_may_command(
    grippers: Grippers, mode: Mode
) -> None:
    """The robot follows the twin's gripper as it follows its motion."""
    grippers.enter(mode)
    actions = grippers.twin_shows(True)
    assert orders(actions) == [Grip("real", True)] and triggers(actions) == ["GRIPPER_SWITCHED"]


@pytest.mark.parametrize(
    "mode", [Mode.REAL_LEADS, Mode.PAUSED, Mode.STOPPED, Mode.ESTOP, Mode.FAULT, Mode.ALIGNING]
)
def test_switch_of_the_twins_gripper_is_refused_otherwise_and_seen(
    grippers: Grippers, mode: Mode
) -> None:
    """Never ignored: a decision, and an alarm until both do the same again."""
    grippers.enter(mode)
    actions = grippers.twin_shows(True)
    assert orders(actions) == [] and triggers(actions) == ["GRIPPER_REFUSED"]
    assert f"in {mode}: not passed on to the real robot" in grippers.trouble
    grippers.twin_shows(False)
    assert grippers.trouble == ""


def test_switch_of_the_twins_gripper_stays_the_twins_where_no_client_switches_the_robots(
    grippers: Grippers,
) -> None:
    """Its own programs do: two slots show it, none sets it."""
    grippers.pair.setup = Setup(ROBOT, SETUP.config, switches_gripper=False)
    actions = grippers.twin_shows(True)
    assert orders(actions) == [] and triggers(actions) == ["GRIPPER_REFUSED"]
    assert "the robot's own programs switch its gripper" in grippers.trouble
    assert Grip("twin", True) not in orders(grippers.real_shows(True))
    assert grippers.trouble == ""


def test_ordered_switch_is_no_switch_of_that_side(grippers: Grippers) -> None:
    """The echo of an order goes back to nobody."""
    grippers.real_shows(True)
    assert orders(grippers.twin_shows(True)) == []
    assert grippers.pair.state.orders.grips.twin is None
    grippers.twin_shows(False)
    assert orders(grippers.real_shows(False)) == []


def test_order_that_is_not_shown_is_repeated_and_then_told_as_undelivered(
    grippers: Grippers,
) -> None:
    """A few attempts, then a decision with the number of them, and an alarm that stays."""
    first = orders(grippers.real_shows(True))
    actions = grippers.later(RETRY * (CONFIG.attempts + 2))
    assert len(first + orders(actions)) == CONFIG.attempts
    assert triggers(actions) == ["GRIPPER_UNDELIVERED"]
    assert f"was told {CONFIG.attempts} times to be on and is not" in grippers.trouble
    assert grippers.trouble in alarm_text(SETUP, grippers.pair.state, grippers.pair.now)
    assert any(
        status.message == grippers.trouble
        for status in statuses(SETUP, grippers.pair.state, {}, grippers.pair.now)
    )


def test_refusal_of_the_twin_is_told_with_its_reason(grippers: Grippers) -> None:
    """No part below the twin's nozzle: the operator reads why."""
    grippers.real_shows(True, vacuum=True)
    grippers.twin_shows(True)
    actions = grippers.pair.feed(
        GripAnswered(grippers.pair.now, "twin", False, "no part within 1.5 mm")
    )
    assert triggers(actions) == ["GRIPPER_REFUSED"] and "no part within 1.5 mm" in grippers.trouble
    grippers.twin_shows(True, "part_1")
    assert grippers.trouble == ""


def test_one_holding_and_the_other_not_is_told_after_a_while(grippers: Grippers) -> None:
    """A part that was lost on one side only shows in the state."""
    grippers.real_shows(True, vacuum=True)
    grippers.twin_shows(True)
    assert grippers.trouble == ""
    assert triggers(grippers.later(CONFIG.agree_ms * 1e-3 + 0.05)) == ["GRIPPERS_DIFFER"]
    assert grippers.trouble == "the grippers differ: real holding, twin on"


@pytest.mark.parametrize("side", ["real", "twin"])
def test_lost_link_and_reconnect_switch_nothing(grippers: Grippers, side: str) -> None:
    """What a side shows first after a reconnect counts; a difference is told, not repaired."""
    grippers.real_shows(True)
    grippers.twin_shows(True)
    pair = grippers.pair
    pair.link(side, False)
    assert getattr(pair.state.sides, side).gripper.on is None
    pair.link(side, True)
    pair.until(Mode.IDLE, 30.0)
    shown = grippers.real_shows(False) if side == "real" else grippers.twin_shows(False)
    assert orders(shown) == []
    assert orders(grippers.later(0.3)) == []


@pytest.mark.parametrize("command", ["STOP", "ESTOP", "PAUSE"])
def test_stop_switches_no_gripper(grippers: Grippers, command: str) -> None:
    """A held part stays held."""
    grippers.real_shows(True, vacuum=True)
    grippers.twin_shows(True, "part_1")
    grippers.pair.actions.clear()
    grippers.pair.operate(command)
    grippers.pair.run(1.0)
    assert orders(grippers.pair.actions) == []


@pytest.mark.parametrize("command", ["STOP", "ESTOP", "PAUSE"])
def test_a_switch_from_before_a_stop_is_not_sent_again_after_it(
    grippers: Grippers, command: str
) -> None:
    """The robot never showed it: what it holds it keeps, and that is said."""
    assert Grip("real", True) in orders(grippers.twin_shows(True))
    grippers.pair.operate(command)
    later = grippers.later(1.0)
    assert Grip("real", True) not in orders(later)
    assert triggers(later) == ["GRIPPER_UNDELIVERED"] and "told 1 times" in grippers.trouble


def test_state_shows_both_grippers_and_is_recorded_whole(grippers: Grippers) -> None:
    """The topic tells them in words; a recorded state gives the same decisions again."""
    grippers.real_shows(True)
    grippers.twin_shows(True, "part_7")
    view = state_view(SETUP, grippers.pair.state, grippers.pair.now)
    assert (view.real_gripper, view.twin_gripper) == ("on", "holding part_7")
    state = grippers.pair.state
    assert decode_state(encode_state(state)) == changed(state, lead__decisions=())


def test_a_switch_that_is_taken_back_at_once_comes_back_to_nobody(grippers: Grippers) -> None:
    """The twin does both, late: neither is a switch of its own."""
    grippers.real_shows(True)
    grippers.twin_shows(True)
    grippers.real_shows(False)
    grippers.real_shows(True)
    assert orders(grippers.twin_shows(False)) == [] and orders(grippers.twin_shows(True)) == []
    assert grippers.pair.state.orders.grips == Grips()


def test_an_order_for_what_is_shown_already_is_no_trouble(grippers: Grippers) -> None:
    """Off and on before one reading: the robot never shows the off."""
    grippers.twin_shows(True)
    grippers.real_shows(True)
    grippers.twin_shows(False)
    grippers.twin_shows(True)
    assert orders(grippers.later(RETRY * (CONFIG.attempts + 2))) == [] and grippers.trouble == ""


def test_an_order_that_took_another_back_is_kept_while_its_side_may_do_the_first(
    grippers: Grippers,
) -> None:
    """It shows what was wanted last before it has done either; later that is the answer."""
    grippers.real_shows(True)
    assert orders(grippers.real_shows(False)) == [Grip("twin", False)]
    grippers.later(0.1 * RETRY)
    assert grippers.pair.state.orders.grips.twin is not None
    grippers.later(RETRY)
    assert grippers.pair.state.orders.grips.twin is None
