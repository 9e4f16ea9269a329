"""The desk lets through who may, and stops what nobody holds any more."""

from __future__ import annotations

import asyncio

import pytest
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import MOST_WATCHERS, PageDesk
from operator_panel.door import Answer
from scara_ros.names import Seat
from unit.operator_panel.control.conftest import KEEP_S, LET_GO_S, Clock, Door, command, signs, stop


def test_first_command_takes_control_and_the_pages_others_wait(desk: PageDesk, door: Door) -> None:
    """Before the command, so that it is obeyed; a viewer says nothing at all."""
    assert door.holder == "operator 1" and desk.name_of("b") == "operator 2"
    assert door.asked == [("operator 1", "TAKE", False)]
    assert desk.refusal("b") == "operator 1 holds control"
    assert asyncio.run(desk.take("b")) == "operator 1 holds control"
    assert asyncio.run(desk.take("a")) == ""
    assert len(door.asked) == 1, "nothing is taken twice, or from anybody"


def test_command_is_as_old_as_its_press(desk: PageDesk, door: Door, clock: Clock) -> None:
    """A stop that comes while control is taken is newer."""
    pressed, control = clock.now, door.control
    door.holder = ""

    async def slow(seat: Seat, action: str, moves: bool) -> Answer:
        clock.now += 1.0
        return await control(seat, action, moves)

    door.control = slow  # type: ignore[method-assign]
    assert command(desk, "b", "ALIGN").success
    assert door.when[-1] == pressed and clock.now > pressed


@pytest.mark.parametrize("name", ["PAUSE", "STOP", "ESTOP"])
def test_what_ends_a_motion_takes_no_control(desk: PageDesk, door: Door, name: str) -> None:
    """Whoever stops need not answer for what moves next."""
    door.holder = ""
    asyncio.run(desk.command("b", name)) if name == "PAUSE" else stop(desk, "b", name)
    signs(desk)
    assert door.holder == "" and desk.refusal("b") == desk.refusal("a") == ""


def test_control_that_somebody_else_took_first_refuses_the_command(
    desk: PageDesk, door: Door
) -> None:
    """What the page knew was old: the controller's answer counts, and nothing is sent."""
    door.holder, control = "", door.control

    async def late(seat: Seat, action: str, moves: bool) -> Answer:
        door.holder = "fitter 1"
        return await control(seat, action, moves)

    door.control = late  # type: ignore[method-assign]
    assert not command(desk, "b", "HOME").success and door.commands == []


def test_page_lets_go_of_control_30_s_after_its_last_command(
    desk: PageDesk, door: Door, clock: Clock
) -> None:
    """A question of others, or a look at the page, is no command; each command counts anew."""
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert door.asked[-1] == ("operator 1", "KEEP", False)
    assert command(desk, "a", "HOME").success
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert door.holder == "operator 1"
    stop(desk, "a")
    clock.now += 2.0
    signs(desk)
    assert door.asked[-1] == ("operator 1", "RELEASE", False) and door.holder == ""
    signs(desk)
    assert door.asked[-1][1] == "RELEASE", "nothing is taken again without a command"


@pytest.mark.parametrize("mode", ["TWIN_LEADS", "OPERATOR_LEADS", "REAL_LEADS", "PAUSED"])
def test_page_keeps_control_while_something_runs_and_30_s_from_its_end(
    desk: PageDesk, door: Door, clock: Clock, mode: str
) -> None:
    """A long program, a pause over lunch."""
    door.mode = mode
    for _ in range(100):
        clock.now += 1.0
        signs(desk)
    door.mode = "IDLE"
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert {action for _, action, _ in door.asked[1:]} == {"KEEP"}
    clock.now += 2.0
    signs(desk)
    assert door.holder == ""


def test_control_that_was_granted_later_lasts_from_then(
    desk: PageDesk, door: Door, clock: Clock
) -> None:
    """Whoever asked has time to press what they asked for."""
    clock.now += 100.0
    asyncio.run(desk.ask("b"))
    door.asker = "operator 2"
    clock.now += 19.0
    door.holder, door.asker = "operator 2", ""
    signs(desk)
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert door.holder == "operator 2"


@pytest.mark.parametrize(
    ("name", "page", "why"),
    [
        *[(stop, page, "") for stop in ("STOP", "ESTOP", "PAUSE") for page in "abv"],
        *[(stop, "a page of an earlier server", "") for stop in ("STOP", "ESTOP")],
        ("HOME", "a", ""),
        ("HOME", "b", "operator 1 holds control"),
        ("HOME", "v", "only watches"),
        ("HOME", "a page of an earlier server", "load it again"),
    ],
)
def test_whoever_sees_the_page_may_end_a_motion_and_who_is_in_control_begin_one(
    desk: PageDesk, door: Door, name: str, page: str, why: str
) -> None:
    """In control or not, with the token or without; a refusal is in words, and sends nothing."""
    if name in ("STOP", "ESTOP"):
        answer = stop(desk, page, name)
    else:
        answer = command(desk, page, name)
        assert (why in desk.refusal(page, name)) and bool(desk.refusal(page, name)) == bool(why)
    assert answer.success == (not why) and why in answer.message
    assert door.commands == ([] if why else [name])


def test_pages_that_watch_are_bounded_and_operators_always_fit(desk: PageDesk) -> None:
    """Whoever reaches the port may watch, and each page costs memory."""
    opened = 1
    while not desk.crowded():
        desk.open(f"watcher {opened}", Role.VIEWER)
        opened += 1
    assert opened == MOST_WATCHERS and "watch already" in desk.crowded()
    desk.sessions.pop("watcher 1")
    for number in range(3):
        desk.open(f"operator {number}", Role.OPERATOR)
    assert desk.crowded() == ""


def test_page_loaded_again_keeps_control_and_lets_go_no_later(
    desk: PageDesk, door: Door, clock: Clock
) -> None:
    """Same browser tab, new id: the same seat, whose signs go on; to look anew is no command."""
    signs(desk)
    clock.now += LET_GO_S - 1.0
    desk.left("a")
    desk.open("a2", Role.OPERATOR)
    desk.arrived("a2", "tab a")
    door.asked.clear()
    signs(desk)
    assert desk.name_of("a2") == "operator 1"
    assert door.asked == [("operator 1", "KEEP", False)]
    clock.now += 2.0
    signs(desk)
    assert door.holder == ""


def test_page_whose_line_broke_after_it_was_loaded_again_keeps_its_seat(desk: PageDesk) -> None:
    """Of its former self nothing comes back."""
    desk.left("a")
    for page in ("a2", "a3"):
        desk.open(page, Role.OPERATOR)
        desk.arrived(page, "tab a")
        desk.left(page)
    desk.arrived("a3", "tab a")
    assert desk.name_of("a3") == "operator 1"


def test_number_of_a_page_that_is_long_gone_is_used_again(desk: PageDesk, clock: Clock) -> None:
    """Nobody is "operator 9" because the page was loaded nine times."""
    desk.left("b")
    desk.open("c", Role.OPERATOR)
    assert desk.name_of("c") == "operator 3", "control may still be held by the second"
    clock.now += 3.0 * KEEP_S
    desk.open("d", Role.OPERATOR)
    assert desk.name_of("d") == "operator 2"


def test_other_tab_does_not_inherit(desk: PageDesk) -> None:
    """It has to ask; nor does another person in the same tab."""
    desk.left("a")
    desk.open("c", Role.OPERATOR)
    desk.arrived("c", "tab c")
    desk.open("d", Role.OPERATOR, "foreman")
    desk.arrived("d", "tab a")
    assert (desk.name_of("c"), desk.name_of("d")) == ("operator 3", "foreman 4")
    assert "operator 1 holds control" in command(desk, "c", "HOME").message


def test_page_that_comes_while_the_holder_is_gone_commands_once_control_is_free(
    desk: PageDesk, door: Door
) -> None:
    """The twin controller waits for the holder's sign of life; the page only watches meanwhile."""
    desk.left("a")
    desk.open("c", Role.OPERATOR)
    desk.arrived("c", "tab c")
    signs(desk)
    assert door.holder == "operator 1" and desk.refusal("c")
    door.holder = ""
    signs(desk)
    assert door.holder == "" and desk.refusal("c") == ""
    assert command(desk, "c", "HOME").success and door.holder == "operator 3"


def test_page_that_is_gone_gives_no_sign_of_life(desk: PageDesk, door: Door) -> None:
    """By that alone the twin controller knows."""
    desk.left("a")
    door.asked.clear()
    signs(desk)
    assert door.asked == []
