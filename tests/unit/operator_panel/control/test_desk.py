"""The desk lets through who may, and stops what nobody holds any more."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Mapping
from typing import Any

import pytest
from harness.workspace import ROOT
from operator_panel.config import load_panel
from operator_panel.control import desk_io as desk_module
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import MOST_WATCHERS, Desk
from operator_panel.control.jog import DeadMan
from operator_panel.control.tool_jog import ToolArm
from operator_panel.door import Answer, Seat
from operator_panel.view.snapshot import CellState, Snapshot
from scara_config import load_robot

from scara_description.urdf import parse_urdf

ROBOT = load_robot(ROOT / "config")
MODEL = parse_urdf(ROBOT.description.read_text(encoding="utf-8"))
ARM = ToolArm(ROBOT, MODEL, load_panel(ROOT / "config").jog.tool, 10.0)
KEEP_S, LET_GO_S = 5.0, 30.0


class Door:
    """A cell that obeys who holds control and remembers; TAKE takes what nobody holds."""

    def __init__(self) -> None:
        self.holder = self.asker = ""
        self.asked: list[tuple[str, str, bool]] = []
        self.mode = "IDLE"
        self.commands: list[str] = []
        self.jogs: list[dict[str, float]] = []
        self.position: dict[str, float] = {}

    def snapshot(self) -> Snapshot:
        """Return a state that is never silent."""
        refused = "" if self.mode in ("IDLE", "TWIN_LEADS") else "only while both stand ready"
        state = CellState(
            self.mode,
            name=tuple(self.position),
            twin_position=tuple(self.position.values()),
            command=("JOG",),
            refused=(refused,),
            holder=self.holder,
            asker=self.asker,
            not_in_control=f"{self.holder or 'nobody'} holds control",
        )
        return Snapshot(master=True, state=state, received=math.inf)

    async def command(self, seat: Seat, command: str, **_: Any) -> Answer:
        """Remember what the holder commands."""
        if seat.name != self.holder and command != "PAUSE":
            return Answer(False, f"{self.holder} holds control")
        self.commands.append(command)
        return Answer(True, "done")

    async def control(self, seat: Seat, action: str, moves: bool) -> Answer:
        """Remember; the rules are the twin controller's and are tested there."""
        self.asked.append((seat.name, action, moves))
        if action == "TAKE" and not self.holder:
            self.holder = seat.name
        if action == "RELEASE" and self.holder == seat.name:
            self.holder = ""
        return Answer(self.holder == seat.name or action not in ("TAKE", "KEEP"), action)

    def stop(self, seat: Seat, command: str) -> Awaitable[Answer]:
        """Remember."""
        self.commands.append(command)

        async def answer() -> Answer:
            return Answer(True, "stopped", {"confirmed": True})

        return answer()

    def jog(self, velocities: Mapping[str, float]) -> None:
        """Remember."""
        self.jogs.append(dict(velocities))


@pytest.fixture
def door() -> Door:
    """Give a cell."""
    return Door()


@pytest.fixture
def desk(door: Door) -> Desk:
    """Give a desk with two operators, a and b, and a viewer v; a is in control by a command."""
    dead_man = DeadMan(ROBOT, 10.0, 0.25)
    made = Desk(door, dead_man, ARM, KEEP_S, LET_GO_S, 0.6, lambda _: None)  # type: ignore[arg-type]
    for page, role in (("a", Role.OPERATOR), ("b", Role.OPERATOR), ("v", Role.VIEWER)):
        made.open(page, role)
        made.arrived(page, f"tab {page}")
    signs(made)
    assert door.asked == [] and door.holder == "", "who only looks says nothing"
    assert command(made, "a", "SPEED").success
    door.commands.clear()
    return made


class Clock:
    """The monotonic time of the desk."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Begin now."""
        self.now = desk_module.time.monotonic()
        monkeypatch.setattr(desk_module.time, "monotonic", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Give the time into a test's hand."""
    return Clock(monkeypatch)


def signs(desk: Desk) -> None:
    """Let all pages give their sign of life."""
    asyncio.run(desk.give_signs())


def hold(desk: Desk, press: int = 1, joint: str = "joint_1") -> str:
    """Hold a jog button of page a until the twin controller knows and the joint may move."""
    desk.hold("a", press, joint, 1, 3.0)
    signs(desk)
    return desk.hold("a", press, joint, 1, 3.0)


def command(desk: Desk, page: str, name: str) -> Answer:
    """Send a command."""
    return asyncio.run(desk.command(page, name))


def stop(desk: Desk, page: str, name: str = "STOP") -> Answer:
    """Press a stop."""

    async def press() -> Answer:
        return await desk.stop(page, name)

    return asyncio.run(press())


def test_first_command_takes_control_and_the_pages_others_wait(desk: Desk, door: Door) -> None:
    """Before the command, so that it is obeyed; a viewer says nothing at all."""
    assert door.holder == "operator 1" and desk.name_of("b") == "operator 2"
    assert door.asked == [("operator 1", "TAKE", False)]
    assert desk.refusal("b") == "operator 1 holds control"
    assert asyncio.run(desk.take("b")) == "operator 1 holds control"
    assert asyncio.run(desk.take("a")) == ""
    assert len(door.asked) == 1, "nothing is taken twice, or from anybody"


@pytest.mark.parametrize("name", ["PAUSE", "STOP", "ESTOP"])
def test_what_ends_a_motion_takes_no_control(desk: Desk, door: Door, name: str) -> None:
    """Whoever stops need not answer for what moves next."""
    door.holder = ""
    asyncio.run(desk.command("b", name)) if name == "PAUSE" else stop(desk, "b", name)
    signs(desk)
    assert door.holder == "" and desk.refusal("b") == desk.refusal("a") == ""


def test_control_that_somebody_else_took_first_refuses_the_command(desk: Desk, door: Door) -> None:
    """What the page knew was old: the controller's answer counts, and nothing is sent."""
    door.holder, control = "", door.control

    async def late(seat: Seat, action: str, moves: bool) -> Answer:
        door.holder = "fitter 1"
        return await control(seat, action, moves)

    door.control = late  # type: ignore[method-assign]
    assert not command(desk, "b", "HOME").success and door.commands == []


def test_page_lets_go_of_control_30_s_after_its_last_command(
    desk: Desk, door: Door, clock: Clock
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
    desk: Desk, door: Door, clock: Clock, mode: str
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


def test_jog_is_a_command_at_each_of_its_signs(desk: Desk, door: Door, clock: Clock) -> None:
    """It takes what is free, and keeps it while a button is held."""
    door.holder = ""
    assert hold(desk) == ""
    assert door.asked[-1] == ("operator 1", "TAKE", True) and door.holder == "operator 1"
    signs(desk)
    for _ in range(200):
        clock.now += 0.2
        assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    clock.now += LET_GO_S - 1.0
    signs(desk)
    assert door.holder == "operator 1"


def test_control_that_was_granted_later_lasts_from_then(
    desk: Desk, door: Door, clock: Clock
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
    ("page", "name", "passes"),
    [("a", "HOME", True), ("b", "HOME", False), ("v", "HOME", False)],
)
def test_command_reaches_the_cell_only_from_who_may(
    desk: Desk, door: Door, page: str, name: str, passes: bool
) -> None:
    """One operator moves the pair, a viewer watches; the refusal is in words."""
    answer = command(desk, page, name)
    assert answer.success == passes and door.commands == ([name] if passes else [])
    assert passes or answer.message


def test_pages_that_watch_are_bounded_and_operators_always_fit(desk: Desk) -> None:
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


@pytest.mark.parametrize("page", ["a", "b", "v", "a page of an earlier server"])
@pytest.mark.parametrize("name", ["STOP", "ESTOP"])
def test_whoever_sees_the_page_may_stop(desk: Desk, door: Door, page: str, name: str) -> None:
    """In control or not, with the token or without."""
    assert stop(desk, page, name).success and door.commands == [name]


def test_stop_is_sent_before_anything_else_is_tried(desk: Desk, door: Door) -> None:
    """A jog that cannot be ended, a log that cannot be written: the STOP is out, and answered."""

    def fail(_: Mapping[str, float]) -> None:
        raise OSError("no space left on device")

    hold(desk)
    door.jog = fail  # type: ignore[assignment]
    assert stop(desk, "v").success and door.commands == ["STOP"]


def test_unknown_page_is_told_to_load_again(desk: Desk) -> None:
    """After a restart of the panel."""
    assert "load it again" in command(desk, "old", "HOME").message


def test_stop_ends_a_held_jog(desk: Desk, door: Door) -> None:
    """The zero does not wait for the answer."""
    assert hold(desk) == ""
    desk.jog_tick()
    stop(desk, "b")
    assert door.jogs[-1] == {"joint_1": 0.0}


def test_lost_page_lets_go_of_its_joint(desk: Desk, door: Door) -> None:
    """A closed tab, a torn cable."""
    hold(desk)
    desk.left("a")
    desk.jog_tick()
    assert door.jogs == [{"joint_1": 0.0}]


@pytest.mark.parametrize(
    ("page", "mode", "why"),
    [
        ("b", "IDLE", "operator 1 holds control"),
        ("v", "IDLE", "only watches"),
        ("a", "ESTOP", "stand ready"),
    ],
)
def test_jog_is_refused_to_others_and_in_other_modes(
    desk: Desk, door: Door, page: str, mode: str, why: str
) -> None:
    """Nothing is sent."""
    door.mode = mode
    assert why in desk.hold(page, 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert door.jogs == []


def test_a_press_wakes_who_sends_and_keeps_it_awake_until_the_release(desk: Desk) -> None:
    """While no button is held nothing has to be sent; the longest wait would fail the test."""
    assert not desk.jog_tick()
    hold(desk)
    desk.wait_for_press(60.0)
    assert desk.jog_tick()
    assert desk.jog_tick()
    desk.let_go("a", 1)
    assert not desk.jog_tick()


def test_mode_that_changes_under_a_held_button_releases_it(desk: Desk, door: Door) -> None:
    """An emergency stop on the other side, for example."""
    hold(desk)
    door.mode = "ESTOP"
    assert desk.hold("a", 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert door.jogs == [{"joint_1": 0.0}]
    door.mode = "IDLE"
    assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    desk.jog_tick()
    assert door.jogs == [{"joint_1": 0.0}], "the same press must not start again"


def test_page_loaded_again_keeps_control(desk: Desk, door: Door) -> None:
    """Same browser tab, new id: the same seat, whose signs of life go on."""
    signs(desk)
    desk.left("a")
    desk.open("a2", Role.OPERATOR)
    desk.arrived("a2", "tab a")
    door.asked.clear()
    signs(desk)
    assert desk.name_of("a2") == "operator 1"
    assert door.asked == [("operator 1", "KEEP", False)]


def test_page_loaded_again_lets_go_no_later(desk: Desk, door: Door, clock: Clock) -> None:
    """To look anew is no command."""
    signs(desk)
    clock.now += LET_GO_S - 1.0
    desk.left("a")
    desk.open("a2", Role.OPERATOR)
    desk.arrived("a2", "tab a")
    signs(desk)
    assert door.asked[-1][1] == "KEEP"
    clock.now += 2.0
    signs(desk)
    assert door.holder == ""


def test_page_whose_line_broke_after_it_was_loaded_again_keeps_its_seat(desk: Desk) -> None:
    """Of its former self nothing comes back."""
    desk.left("a")
    for page in ("a2", "a3"):
        desk.open(page, Role.OPERATOR)
        desk.arrived(page, "tab a")
        desk.left(page)
    desk.arrived("a3", "tab a")
    assert desk.name_of("a3") == "operator 1"


def test_number_of_a_page_that_is_long_gone_is_used_again(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody is "operator 9" because the page was loaded nine times."""
    desk.left("b")
    desk.open("c", Role.OPERATOR)
    assert desk.name_of("c") == "operator 3", "control may still be held by the second"
    now = desk_module.time.monotonic()
    monkeypatch.setattr(desk_module.time, "monotonic", lambda: now + 3.0 * KEEP_S)
    desk.open("d", Role.OPERATOR)
    assert desk.name_of("d") == "operator 2"


def test_other_tab_does_not_inherit(desk: Desk) -> None:
    """It has to ask; nor does another person in the same tab."""
    desk.left("a")
    desk.open("c", Role.OPERATOR)
    desk.arrived("c", "tab c")
    desk.open("d", Role.OPERATOR, "foreman")
    desk.arrived("d", "tab a")
    assert (desk.name_of("c"), desk.name_of("d")) == ("operator 3", "foreman 4")
    assert "operator 1 holds control" in command(desk, "c", "HOME").message


def test_page_that_comes_while_the_holder_is_gone_commands_once_control_is_free(
    desk: Desk, door: Door
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


def test_page_that_is_gone_gives_no_sign_of_life(desk: Desk, door: Door) -> None:
    """By that alone the twin controller knows."""
    desk.left("a")
    door.asked.clear()
    signs(desk)
    assert door.asked == []


def test_nothing_jogs_before_the_twin_controller_knows_whose_motion_it_is(
    desk: Desk, door: Door
) -> None:
    """What it does not know it would stop."""
    assert desk.hold("a", 1, "joint_1", 1, 3.0) == ""
    desk.jog_tick()
    assert door.jogs == []
    signs(desk)
    assert door.asked[-1] == ("operator 1", "KEEP", True)
    desk.hold("a", 1, "joint_1", 1, 3.0)
    desk.jog_tick()
    assert len(door.jogs) == 1


@pytest.mark.parametrize("page", ["a", "b", "v"])
def test_whoever_sees_the_page_may_pause(desk: Desk, door: Door, page: str) -> None:
    """It ends a motion, as STOP does; the button is not greyed by who holds control."""
    assert desk.refusal(page, "PAUSE") == ""
    assert command(desk, page, "PAUSE").success and door.commands == ["PAUSE"]


def test_wrong_jog_of_a_browser_is_answered_in_words(desk: Desk) -> None:
    """Not by an exception in the server."""
    assert "unknown joint" in hold(desk, joint="joint_9")


def test_held_tool_moves_by_the_rule_of_the_held_joint(desk: Desk, door: Door) -> None:
    """Once the twin controller knows whose motion it is; a stop of anybody ends it for good."""
    names = tuple(joint.name for joint in ROBOT.twin_joints)
    door.position = dict(zip(names, (20.0, 60.0, -50.0, 0.0)))

    def sign(press: int) -> str:
        return desk.hold_tool("a", press, "x", "world", 1, False)

    assert sign(1) == "" and not desk.jog_tick() and door.jogs == []
    signs(desk)
    assert sign(1) == "" and desk.jog_tick()
    assert set(door.jogs[-1]) == {"joint_1", "joint_2", "joint_3"}
    stop(desk, "v")
    assert door.jogs[-1] == dict.fromkeys(door.jogs[-1], 0.0)
    sent = len(door.jogs)
    assert sign(1) == "" and not desk.jog_tick() and len(door.jogs) == sent
    assert desk.hold_tool("b", 1, "x", "world", 1, False) == "operator 1 holds control"


def test_tool_is_not_jogged_from_an_unknown_place(desk: Desk, door: Door) -> None:
    """The reason comes with the next sign."""
    desk.hold_tool("a", 1, "x", "world", 1, False)
    signs(desk)
    desk.hold_tool("a", 1, "x", "world", 1, False)
    assert not desk.jog_tick() and not any(any(each.values()) for each in door.jogs)
    assert "where joint_1 is, is not known" in desk.hold_tool("a", 1, "x", "world", 1, False)
