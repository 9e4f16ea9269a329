"""A draft that a page leads both robots through: whatever goes wrong ends it, and nothing waits."""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from harness.workspace import ROOT
from operator_panel.control import desk_io
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import PageDesk
from operator_panel.control.jog import DeadMan
from operator_panel.door import Answer
from operator_panel.page.view_io import PageView
from operator_panel.page.work import leading_io
from operator_panel.page.work.leading_io import SEEN_S, Leading, _by_line
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import TeachError
from operator_panel.teach.kept_io import Lesson
from operator_panel.teach.places import position_of
from operator_panel.view.judged import Judged
from operator_panel.view.snapshot import Snapshot
from scara_config import load_robot
from scara_config.frames import NO_FRAMES
from scara_ros.names import Seat
from unit.operator_panel.control.conftest import KEEP_S, LET_GO_S, SCARA, Door
from what_if.converting import converted_text

ROBOT = load_robot(ROOT / "config")
MOVING = 20
"""Looks that a motion takes."""


class Cell(Door):
    """Both robots move for some looks after each command; ``happens`` may change anything."""

    def __init__(self) -> None:
        """Stand still, and let nothing happen."""
        super().__init__()
        self.sent: list[tuple[int, dict[str, Any]]] = []
        self.looks = self.left = 0
        self.happens: Callable[[Cell], None] = lambda _: None
        self.refuses = ""
        self.gripper = "off"

    def snapshot(self) -> Snapshot:
        """Tell the time of the state too."""
        found = super().snapshot()
        state = msgspec.structs.replace(
            found.state,  # type: ignore[type-var]
            real_gripper=self.gripper,
            real_standing_still=not self.left,
            twin_standing_still=not self.left,
        )
        return msgspec.structs.replace(found, state=state, received=time.monotonic())

    async def command(self, seat: Seat, command: str, **fields: Any) -> Answer:
        """Move, unless it is refused."""
        self.sent.append((self.looks, {**fields, "now": time.monotonic()}))
        if self.refuses:
            return Answer(False, self.refuses)
        if command == "MOVE_JOINTS":
            self.mode, self.left = "OPERATOR_LEADS", MOVING
        return Answer(True, "done")

    async def grip(self, close: bool, asked: float) -> Answer:
        """Do it at once."""
        self.gripper = "on" if close else "off"
        return Answer(True, "done")

    async def try_motion(self, motion: str, **fields: Any) -> Answer:
        """Have no judge."""
        return Answer(False, "no judge runs")

    async def convert(self, text: str, to: str, frame: int = -1) -> Answer:
        """Be the second world."""
        if self.refuses:
            return Answer(False, self.refuses)
        found, _ = converted_text(text, ROBOT, NO_FRAMES, to)
        return Answer(True, "", {"text": found})

    def look(self) -> None:
        """Let a period pass."""
        self.looks += 1
        self.happens(self)
        if self.left:
            self.left -= 1
            if not self.left and self.mode == "OPERATOR_LEADS":
                self.mode = "IDLE"


class Scene:
    """A page in control of a cell, and a draft of three motions."""

    def __init__(self, folder: Path) -> None:
        """Teach it."""
        self.cell = Cell()
        dead_man = DeadMan(ROBOT, 10.0, 0.25)
        self.desk = PageDesk(self.cell, dead_man, SCARA, KEEP_S, LET_GO_S, 0.6, lambda _: None)  # type: ignore[arg-type]
        session = self.desk.open("a", Role.OPERATOR)
        self.desk.arrived("a", "tab a")
        self.lesson = Lesson(folder, ROBOT)
        made = self.lesson.draft
        for number in range(3):
            turned = {"joint_1": 0.1 * number}
            here = position_of(ROBOT, {j.name: turned.get(j.name, 0.0) for j in ROBOT.joints})
            made = teach.recorded(made, ROBOT, number, here, "J", 50.0, None)
        self.teach(made)
        view = PageView(ROBOT, None, None, self.cell, self.desk, session)  # type: ignore[arg-type]
        self.leading = Leading(view, self.lesson)

    def teach(self, draft: teach.Draft) -> None:
        """Let this be the draft."""
        self.lesson.history = self.lesson.history.edited(draft, 0)

    def run(self) -> str:
        """Run the draft to its end; return what is said of it."""

        async def periods() -> None:
            while True:
                self.cell.look()
                self.desk.log.look(self.cell.snapshot(), False, time.monotonic())
                self.leading.look()
                await asyncio.sleep(0)

        async def run() -> str:
            version, passing = self.lesson.history.version, asyncio.create_task(periods())
            try:
                return (await asyncio.wait_for(self.leading.run(version), 20.0))[1]
            except TeachError as error:
                return str(error)
            finally:
                passing.cancel()

        said = asyncio.run(run())
        assert self.lesson.runner == ""
        return said


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Give a page in control, and a draft."""
    return Scene(tmp_path)


@pytest.mark.parametrize("press", [Leading.step, Leading.go_here])
def test_a_motion_is_as_old_as_its_press(
    scene: Scene, press: Callable[[Leading], Awaitable[object]]
) -> None:
    """A STOP that comes while it is judged is newer, and so refuses it."""
    stopped: list[float] = []

    async def slow(motion: str, **fields: Any) -> Answer:
        stopped.append(time.monotonic())
        return Answer(False, "no judge runs")

    scene.cell.try_motion = slow  # type: ignore[method-assign]
    scene.leading.choose(0 if press is Leading.step else 1)
    asyncio.run(press(scene.leading))  # type: ignore[arg-type]
    ((_, fields),) = scene.cell.sent
    assert fields["asked"] <= stopped[0]


def test_a_step_is_of_the_line_that_was_chosen_when_it_was_pressed(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cartesian positions are asked for first; whoever waits may choose another line."""
    known = asyncio.Event()

    async def in_joints() -> teach.Draft:
        await known.wait()
        return scene.lesson.draft

    async def press() -> None:
        pressed = asyncio.create_task(scene.leading.step())
        await asyncio.sleep(0)
        scene.leading.choose(2)
        known.set()
        await pressed

    monkeypatch.setattr(scene.leading, "_in_joints", in_joints)
    scene.leading.choose(1)
    asyncio.run(press())
    ((_, fields),) = scene.cell.sent
    assert fields["joint_positions"][0] == pytest.approx(0.1), "line 2, and not line 3"


def test_a_step_that_was_refused_is_made_again(scene: Scene) -> None:
    """Both robots would go to the line behind without that one."""
    asyncio.run(scene.leading.step())
    scene.cell.refuses = "a stop or a pause came after it was pressed: press it again"
    with pytest.raises(TeachError, match="press it again"):
        asyncio.run(scene.leading.step())
    scene.cell.refuses = ""
    asyncio.run(scene.leading.step())
    reached = [fields["joint_positions"][0] for _, fields in scene.cell.sent]
    assert reached == pytest.approx([0.0, 0.1, 0.1], abs=1e-6), "line 1, and line 2 twice"
    assert scene.leading.chosen == 2


@pytest.mark.parametrize(
    ("tone", "sentence", "tones"),
    [
        ("good", "OK: takes 1.00 s", {1: "good", 2: "good", 3: "good"}),
        ("bad", "REFUSED at 1.00 s, line 2 of TAUGHT: too far", {1: "good", 2: "bad"}),
        ("bad", "REFUSED at 1.00 s, line 3 of SUB: too far", {}),
        ("bad", "REFUSED at 1.00 s, line 3 of TAUGHT_2: too far", {}),
        ("warn", "Not judged: x: line 2 of TAUGHT: reads DI[1]", {2: "warn"}),
        ("warn", "Not judged: a move is judged first: ask again", {}),
    ],
)
def test_lines_are_well_up_to_the_one_that_the_judge_names(
    scene: Scene, tone: str, sentence: str, tones: dict[int, str]
) -> None:
    """A draft that nobody has judged is not well anywhere; another program's line is not its."""
    said = _by_line(Judged("", tone, sentence), scene.lesson.draft.program)
    assert {line: shown for line, (shown, _) in said.items()} == tones


def test_each_motion_is_sent_once_the_one_before_has_ended(scene: Scene) -> None:
    """And is older than the state by which it is sent: a stop that is not seen yet refuses it."""
    assert scene.run() == "TAUGHT has ended."
    begun = [look for look, _ in scene.cell.sent]
    assert len(begun) == 3
    assert all(later - earlier >= MOVING for earlier, later in itertools.pairwise(begun))
    for _, fields in scene.cell.sent:
        assert fields["asked"] <= fields["now"] - SEEN_S
    assert scene.leading.chosen == 3


def stopped(cell: Cell) -> None:
    """STOP during the second motion."""
    if len(cell.sent) == 2:
        cell.mode, cell.left = "STOPPED", 0


def robbed(cell: Cell) -> None:
    """Somebody else is in control."""
    if len(cell.sent) == 2:
        cell.holder = "fitter 1"


def led(cell: Cell) -> None:
    """The robot moves by itself before the second motion has ended."""
    if len(cell.sent) == 2 and cell.left == 1:
        cell.mode = "REAL_LEADS"


def refusing(cell: Cell) -> None:
    """The controller takes no third motion."""
    if len(cell.sent) == 2:
        cell.refuses = "MOVE_JOINTS: link_2 would be in zone door"


@pytest.mark.parametrize(
    ("happens", "sent", "why"),
    [
        (stopped, 2, "line 2: J P[2] 50% FINE: "),
        (robbed, 2, "line 2: J P[2] 50% FINE: this page is not in control any more"),
        (led, 2, "line 2: J P[2] 50% FINE: "),
        (refusing, 3, "line 3: J P[3] 50% FINE: MOVE_JOINTS: link_2 would be in zone door"),
    ],
)
def test_whatever_goes_wrong_ends_the_run_at_its_line(
    scene: Scene, happens: Callable[[Cell], None], sent: int, why: str
) -> None:
    """Nothing is sent behind it, and the draft can be edited again."""
    scene.cell.happens = happens
    said = scene.run()
    assert said.startswith(why), said
    assert len(scene.cell.sent) == sent


def test_a_step_behind_a_run_is_of_the_line_at_which_that_was_ended(scene: Scene) -> None:
    """Its motion did not end; what was stepped through before the run counts no more."""
    for _ in range(3):
        asyncio.run(scene.leading.step())
    scene.cell.mode, scene.cell.left, scene.cell.happens = "IDLE", 0, stopped
    scene.cell.sent.clear()
    assert "line 2" in scene.run()
    scene.cell.mode = "IDLE"
    asyncio.run(scene.leading.step())
    assert scene.cell.sent[-1][1]["joint_positions"][0] == pytest.approx(0.1, abs=1e-6)
    assert scene.leading.chosen == 2


def test_page_that_is_gone_ends_its_run(scene: Scene) -> None:
    """A reload too: the new page has another connection."""

    def gone(cell: Cell) -> None:
        if len(cell.sent) == 2:
            scene.desk.left("a")

    scene.cell.happens = gone
    assert "the page has gone" in scene.run()
    assert len(scene.cell.sent) == 2


def test_paused_run_goes_on_when_the_pair_does(scene: Scene) -> None:
    """The motion is kept by the pair, the lines behind it by the run."""
    paused: list[int] = []

    def pause(cell: Cell) -> None:
        if len(cell.sent) == 2 and len(paused) < 5:
            paused.append(cell.looks)
            cell.mode, cell.left = "PAUSED", 2
        elif cell.mode == "PAUSED":
            cell.mode = "OPERATOR_LEADS"

    scene.cell.happens = pause
    assert scene.run() == "TAUGHT has ended."
    assert len(scene.cell.sent) == 3 and len(paused) == 5


def test_run_keeps_control_through_a_wait_of_any_length(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page that is idle for so long lets go: the program would end in its middle."""
    clock: Any = SimpleNamespace(now=time.monotonic())
    clock.monotonic = lambda: clock.now
    signs: list[asyncio.Task[None]] = []

    def pass_a_second(cell: Cell) -> None:
        if cell.mode == "IDLE":
            clock.now += 1.0
            signs.append(asyncio.create_task(scene.desk.give_signs()))

    for module in (desk_io, leading_io):
        monkeypatch.setattr(module, "time", clock)
    scene.cell.happens = pass_a_second
    scene.teach(teach.waiting(scene.lesson.draft, ROBOT, 3, LET_GO_S + 10.0))
    assert scene.run() == "TAUGHT has ended."
    assert scene.cell.holder == scene.desk.name_of("a")


def test_run_waits_for_the_gripper_that_it_switches(scene: Scene) -> None:
    """The line behind the wait comes once the robot shows the vacuum."""
    scene.teach(teach.gripping(scene.lesson.draft, ROBOT, 1, True))
    assert scene.run() == "TAUGHT has ended."
    assert scene.cell.gripper == "on" and len(scene.cell.sent) == 3


def test_cartesian_draft_is_led_to_its_joints(scene: Scene) -> None:
    """As the robot's own interpreter tells them; where it cannot, nothing is sent."""
    made = scene.lesson.draft
    for number, bent in enumerate((0.5, -1.2), start=1):
        here = {each.name: 0.0 for each in ROBOT.joints} | {"joint_2": bent}
        made = teach.touched_up(made, ROBOT, number, position_of(ROBOT, here))
    wanted = [each.groups[0].coordinates for each in made.program.positions]
    text, (kept,) = converted_text(made.text, ROBOT, NO_FRAMES, "cartesian")
    assert kept.startswith("P[3] stays in joints")
    scene.teach(teach.draft_of(text, ROBOT))
    scene.cell.refuses = "P[1]: no joint positions bring the tool there"
    assert scene.run() == f"Cartesian positions: {scene.cell.refuses}"
    assert scene.cell.sent == []
    scene.cell.refuses = ""
    assert scene.run() == "TAUGHT has ended."
    for (_, fields), coordinates in zip(scene.cell.sent, wanted, strict=True):
        degrees = math.degrees(fields["joint_positions"][1])
        assert degrees == pytest.approx(coordinates[1].value, abs=1e-3)


def test_a_second_press_of_run_while_control_is_asked_for_is_refused(scene: Scene) -> None:
    """It neither runs the draft beside the first nor lets it be edited under that one."""
    take = asyncio.Event()

    async def slow(seat: Seat, action: str, moves: bool) -> Answer:
        await take.wait()
        return Answer(False, "another page is in control")

    async def twice() -> tuple[str, str]:
        first = asyncio.create_task(scene.leading.run(scene.lesson.history.version))
        await asyncio.sleep(0)
        with pytest.raises(TeachError) as second:
            await scene.leading.run(scene.lesson.history.version)
        running = scene.lesson.runner
        take.set()
        with pytest.raises(TeachError, match="another page"):
            await first
        return str(second.value), running

    scene.cell.control = slow  # type: ignore[method-assign]
    scene.cell.holder = ""
    said, running = asyncio.run(asyncio.wait_for(twice(), 10.0))
    assert "runs it" in said and running and scene.lesson.runner == ""
    assert scene.cell.sent == []


def test_second_run_is_refused_while_one_goes_on(scene: Scene) -> None:
    """Two pages: one leads."""
    scene.lesson.runner = "operator 2"
    with pytest.raises(TeachError, match="operator 2 runs it"):
        asyncio.run(scene.leading.run(scene.lesson.history.version))
    assert scene.cell.sent == []
