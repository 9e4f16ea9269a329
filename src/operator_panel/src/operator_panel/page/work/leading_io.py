"""A draft is tried on both robots by the operator's lead, one motion after the other.

Nothing is queued: a motion is sent once the one before it has ended, and by a state that was newer
than each stop. So a stop, a refusal, another leader, a reload or the loss of control ends a run.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import time

from scara_config.programs.files import is_cartesian
from scara_config.programs.steps import GripperStep, WaitStep
from scara_config.programs.tp.listing import Program, WaitUntil, Word

from operator_panel.page.preview.asking_io import ONLY_LOOKS, ask
from operator_panel.page.view_io import PageView
from operator_panel.teach.draft import Draft, TeachError, draft_of
from operator_panel.teach.kept_io import Lesson
from operator_panel.teach.walk import (
    LedMove,
    Walk,
    motion_above,
    motion_to,
)
from operator_panel.view.judged import Judged
from operator_panel.view.progress import Fate
from operator_panel.view.snapshot import CellState
from scara_msgs.msg import TwinControllerState as Mode

GRIP_S = 5.0
"""So long a run waits for the gripper; our choice: ten times what the stand-in takes."""
SEEN_S = 0.5
"""A state is never older than this when it comes; our choice: ten of its periods."""
LOOK_S = 1.0
OPEN = ("off", "")
CHANGED = "the draft has changed since it was judged: press Run again"
Said = tuple[str, str]
"""Tone and words."""


class Leading:
    """Steps and runs of one page.

    Attributes:
        chosen: Number of the line that was chosen or executed last; 0: in front of all.
        verdicts: Number of a line to tone and words.
        said: What the last judgement of the whole was.
    """

    def __init__(self, view: PageView, lesson: Lesson) -> None:
        """Stand in front of all."""
        self._view, self._lesson = view, lesson
        self.chosen = lesson.history.chosen
        self.verdicts: dict[int, Said] = {}
        self.said: Said = ("", "")
        self._walk: Walk | None = None
        # A draft, and the same with its positions in joints.
        self._solved: tuple[Draft, Draft] | None = None
        self._judged = lesson.history.version
        self._looked = asyncio.Event()

    def choose(self, number: int) -> None:
        """Choose a line; what the lines before it have set is forgotten."""
        self.chosen, self._walk = number, None

    def look(self) -> None:
        """Take notice of what is new: verdicts are of one draft, and a choice is a line of it."""
        self._looked.set()
        history = self._lesson.history
        if history.version != self._judged:
            self._judged, self.verdicts = history.version, {}
            self._walk = None
            self.chosen = min(self.chosen, len(history.draft.program.lines))

    async def judge_all(self) -> Judged:
        """Ask the second world for the whole draft, from where the cell stands now."""
        draft, version = self._lesson.draft, self._lesson.history.version
        title = f"Draft {draft.program.name}"
        path = str(self._lesson.path)
        found = await ask(self._view, title, "PROGRAM", program=path, **ONLY_LOOKS)
        self.said = (found.tone, found.sentence)
        if version == self._lesson.history.version:
            self.verdicts = _by_line(found, draft.program)
        return found

    async def step(self) -> Said | None:
        """Execute the next line."""
        # What was chosen counts, whatever is chosen while the second world is asked.
        asked, walk, chosen = time.monotonic(), self._walk, self.chosen
        draft = await self._in_joints()
        if walk is None or walk.draft != draft:
            walk = Walk(draft, self._view.robot, chosen)
        # On a copy: a line that is refused was not executed, and comes again.
        walk = walk.copied()
        act = walk.step()
        if isinstance(act, Word):
            return "good", "The program ends here."
        number, text = walk.at, walk.text
        match act:
            case LedMove():
                await self._go(number, act, asked)
            case GripperStep():
                await self._grip(act.on, text, asked)
            case WaitUntil() if not self._holds(walk):
                raise TeachError(f"{text}: that is not so yet")
        self.chosen, self._walk = number, walk
        return None if isinstance(act, LedMove) else ("good", text.capitalize())

    async def step_back(self) -> None:
        """Go to the position of the nearest motion above."""
        number, asked = motion_above(self._lesson.draft, self.chosen), time.monotonic()
        move = motion_to(await self._in_joints(), self._view.robot, number)
        await self._go(number, move, asked)
        self.choose(number)

    async def go_here(self) -> None:
        """Go to the position of the chosen line."""
        number, asked = self.chosen, time.monotonic()
        move = motion_to(await self._in_joints(), self._view.robot, number)
        await self._go(number, move, asked)

    async def _in_joints(self) -> Draft:
        """Return the draft with its Cartesian positions in joints; its lines are the same.

        Raises:
            TeachError: The second world cannot tell them.
        """
        draft = self._lesson.draft
        if not any(map(is_cartesian, draft.program.positions)):
            return draft
        if self._solved is None or self._solved[0] != draft:
            answer = await self._view.door.convert(draft.text, "joints")
            if not answer.success:
                raise TeachError(f"Cartesian positions: {answer.message}")
            self._solved = draft, draft_of(answer.values["text"], self._view.robot)
        return self._solved[1]

    async def _go(self, number: int, move: LedMove, asked: float) -> None:
        """Judge one motion, show its verdict, and send it unless the gate would refuse it.

        It is as old as its press, at ``asked`` [s]: a stop may come while it is judged.

        Raises:
            TeachError: It was refused.
        """
        self._free()
        title = f"Line {number} of {self._lesson.draft.program.name}"
        found = await ask(self._view, title, "MOVE_JOINTS", **move.fields)
        self.verdicts[number] = (found.tone, found.sentence)
        if found.is_refused and self._view.door.snapshot().gate == "refuse":
            raise TeachError(found.sentence)
        answer = await self._view.send("MOVE_JOINTS", title, asked=asked, **move.fields)
        if not answer.success:
            raise TeachError(answer.message)

    async def _grip(self, close: bool, text: str, asked: float) -> None:
        answer = await self._view.grip("Grip" if close else "Let go", close, asked)
        if not answer.success:
            raise TeachError(f"{text}: {answer.message}")

    def _free(self) -> None:
        if self._lesson.runner:
            raise TeachError(f"{self._lesson.runner} runs it: STOP first, or wait for its end")

    async def run(self, version: int) -> Said:
        """Go through all lines; both robots move.

        Args:
            version: Of the draft that was asked about.

        Raises:
            TeachError: The draft is another one by now, or something has ended the run; the text
                says at which line, and what.
        """
        self._free()
        self._lesson.runner = self._view.session.name
        try:
            if refused := await self._view.desk.take(self._view.session.page):
                raise TeachError(refused)
            if version != self._lesson.history.version:
                raise TeachError(CHANGED)
            walk = Walk(await self._in_joints(), self._view.robot)
            # A line that something ends comes again by Step, as one that was refused.
            self._walk = walk.copied()
            while not isinstance(act := walk.run_on(), Word):
                self.chosen = walk.at
                await self._do(walk, act)
                self._walk = walk.copied()
        finally:
            self._lesson.runner = ""
        return "good", f"{walk.draft.program.name} has ended."

    async def _do(self, walk: Walk, act: LedMove | GripperStep | WaitStep | WaitUntil) -> None:
        """Do one thing of a run to its end."""
        match act:
            case LedMove():
                await self._ready(walk)
                await self._moved(walk, act)
            case GripperStep():
                await self._ready(walk)
                await self._grip(act.on, walk.text, self._asked())
            case WaitStep():
                await self._passed(walk, act.seconds)
            case WaitUntil():
                until = time.monotonic() + GRIP_S
                while not self._holds(walk):
                    if time.monotonic() > until:
                        raise TeachError(f"{walk.text}: not so within {GRIP_S:g} s")
                    await self._ready(walk)
                    await self._next_look()

    def _holds(self, walk: Walk) -> bool:
        """Tell whether what the last line waits for is so now."""
        state = self._view.door.snapshot().state
        shown = state.real_gripper if state is not None else ""
        walk.closed = shown not in OPEN if shown else None
        return walk.holds()

    async def _moved(self, walk: Walk, move: LedMove) -> None:
        """Send a motion and wait for its end."""
        view = self._view
        title = f"Line {walk.at} of {walk.draft.program.name}"
        number, answer = await view.desk.begin_command(
            view.session.page, "MOVE_JOINTS", title, asked=self._asked(), **move.fields
        )
        if not answer.success:
            raise TeachError(f"{walk.text}: {answer.message}")
        while (found := view.desk.log.find(number)) is not None and not found.ended:
            self._mine(walk)
            await self._next_look()
        if found is None or found.outcome is not Fate.DONE:
            raise TeachError(f"{walk.text}: {found.text if found else 'lost sight of it'}")

    def _asked(self) -> float:
        """Return how old a run's next act is: a stop that is not seen yet must refuse it."""
        return self._view.door.snapshot().received - SEEN_S

    async def _passed(self, walk: Walk, seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            await self._ready(walk)
            await self._next_look()

    async def _ready(self, walk: Walk) -> None:
        """Wait while the pair is paused; both stand still then.

        Raises:
            TeachError: Something else than this run leads, or has stopped the pair.
        """
        while True:
            state = self._mine(walk)
            if state.mode == Mode.IDLE:
                return
            if state.mode != Mode.PAUSED:
                raise TeachError(f"{walk.text}: {state.why}")
            await self._next_look()

    def _mine(self, walk: Walk) -> CellState:
        """Return the state while this page is there and in control; by that it keeps control.

        Raises:
            TeachError: It is not.
        """
        session, state = self._view.session, self._view.door.snapshot().state
        known = self._view.desk.sessions.get(session.page)
        if known is None or not known.there:
            raise TeachError(f"{walk.text}: the page has gone")
        if state is None or state.holder != session.name:
            raise TeachError(f"{walk.text}: this page is not in control any more")
        # A run that waits is no idle page: both robots stand still for as long as its WAIT says.
        known.commanded = time.monotonic()
        return state

    async def _next_look(self) -> None:
        self._looked.clear()
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._looked.wait(), LOOK_S)


def _by_line(found: Judged, program: Program) -> dict[int, Said]:
    """Return the verdict for each line: all before the one that is wrong are well, if judged."""
    if found.tone == "good":
        return {number: ("good", "OK") for number in range(1, len(program.lines) + 1)}
    # A line of a program that is called is none of this one's.
    line = re.search(rf"\bline (\d+) of {re.escape(program.name)}\b", found.sentence)
    if line is None:
        return {}
    wrong = int(line[1])
    before = range(1, wrong) if found.is_judged else ()
    verdicts = {number: ("good", "OK up to here") for number in before}
    return verdicts | {wrong: (found.tone, found.sentence)}
