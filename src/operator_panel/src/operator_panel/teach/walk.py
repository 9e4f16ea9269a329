"""A draft is gone through line by line: what each line asks of both robots, led by the operator."""

from __future__ import annotations

from copy import copy
from typing import Any

import msgspec
from scara_config import ConfigError, Robot
from scara_config.programs.steps import GripperStep, WaitStep
from scara_config.programs.tp.execution import execute, flow_of
from scara_config.programs.tp.listing import (
    Indexed,
    Line,
    MotionLine,
    Name,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.motion import asked
from scara_config.programs.tp.printer import print_expression, print_line
from scara_config.programs.tp.values import ExecutionError, Value, Written, number, truth
from scara_config.programs.walk import taught

from operator_panel.teach.draft import Draft, TeachError, line_of
from operator_panel.teach.places import twin_target

SELECTIONS = (Name("UFRAME_NUM"), Name("UTOOL_NUM"))
"""Positions tell their frames themselves."""
FLANGE = ("0", "1")
"""UT of positions whose lines the flange follows; 1 is all 0 as the kit sets a robot up."""
SUCTION, VACUUM = Indexed("RO", (1.0,)), Indexed("RI", (1.0,))
KINDS = {"J": "joint", "L": "linear", "C": "circular"}
CORNER_MM = 50.0
"""The tool passes the end of a motion with CNT100 no further away (our choice: the robot's own
corners grow with its speed)."""
MOST_PLACES = 16
"""The twin takes so many places on the way of one order."""
MOST_EMPTY = 2000
"""So many lines without anything that takes time never end; our choice."""


class LedMove(msgspec.Struct, frozen=True):
    """A motion of both robots.

    Attributes:
        fields: Of MOVE_JOINTS, for the controller and for the judge alike.
        corner_mm: How far from its end the next may begin, by its CNT; 0: it stops there.
    """

    fields: dict[str, Any]
    corner_mm: float = 0.0

    def joined(self, then: LedMove) -> LedMove | None:
        """Return this motion and the next as one order; None: they go in other ways."""
        first, last = dict(self.fields), dict(then.fields)
        place, via = first.pop("joint_positions"), first.pop("via", [])
        corner = min(first.pop("corner_mm", self.corner_mm), self.corner_mm)
        ends = {"joint_positions": last.pop("joint_positions")}
        full = len(via) >= MOST_PLACES * len(place)
        if first != last or first.get("path") == "circular" or full:
            return None
        fields = {**first, **ends, "via": [*via, *place], "corner_mm": corner}
        return LedMove(fields, then.corner_mm)


Act = LedMove | GripperStep | WaitStep | WaitUntil | Word
"""What takes time. Nothing goes on until what a line waits for is so, see :meth:`Walk.holds`; a
word is the end."""


class Walk:
    """Where a draft is gone through, and what its own lines have set.

    Attributes:
        at: Number of the line that was executed last; 0: none.
        next: Number of the line that comes next.
        closed: Whether the real robot's gripper is closed, as it shows; None: it does not.
    """

    def __init__(self, draft: Draft, robot: Robot, at: int = 0) -> None:
        """Stand behind a line; no register is known yet."""
        self.draft, self._robot = draft, robot
        self.at, self.next = at, at + 1
        self.closed: bool | None = None
        self._flow = flow_of(draft.program, draft.program.name)
        self._values: dict[Indexed | Name, Value] = {}
        self._switched: bool | None = None
        self._until: WaitUntil | None = None

    @property
    def text(self) -> str:
        """The line that was executed last, with its number."""
        return f"line {self.at}: {print_line(self.draft.program.lines[self.at - 1]).strip()}"

    def copied(self) -> Walk:
        """Return a walk that stands here too; what either sets from now on, the other lacks."""
        made = copy(self)
        made._values = dict(self._values)
        return made

    def step(self) -> Act | None:
        """Execute the next line; return what it asks for, None if nothing takes time.

        Raises:
            TeachError: It cannot be executed from here; in the words of the robot's executor.
        """
        if self.next > len(self.draft.program.lines):
            return Word("END")
        self.at, self._switched = self.next, None
        try:
            after, line = execute(self._flow, self.at - 1, self)
            self.next = after + 1
            if self._switched is not None:
                return GripperStep(self.at, self._switched)
            return None if line is None else self._act(line)
        except ConfigError as error:
            raise TeachError(str(error)) from error

    def run_on(self) -> Act:
        """Execute lines until one asks for something that takes time.

        Motions whose corners are rounded are one order, as far as what comes between them is known
        before they begin.

        Raises:
            TeachError: As :meth:`step`, or nothing ever does.
        """
        act = self._next()
        while isinstance(act, LedMove) and act.corner_mm:
            # Looked ahead on a copy: what cannot be joined has to be executed later, in its turn.
            ahead = self.copied()
            # The gripper may show something else by then: a line that asks for it ends the order.
            ahead.closed = None
            try:
                then = ahead._next()
            except TeachError:
                # It is raised once the lines in front of it were executed.
                break
            both = act.joined(then) if isinstance(then, LedMove) else None
            if both is None:
                break
            act = both
            self.at, self.next, self._values = ahead.at, ahead.next, ahead._values
        return act

    def _next(self) -> Act:
        for _ in range(MOST_EMPTY):
            found = self.step()
            if found is not None:
                return found
        raise TeachError(f"{MOST_EMPTY} lines without a motion or a wait: it does not end")

    def holds(self) -> bool:
        """Tell whether what the last line waits for is so.

        Raises:
            TeachError: It depends on what only the robot knows.
        """
        try:
            return self._until is None or truth(self._until.condition, self)
        except ExecutionError as error:
            raise TeachError(f"{self.text}: {error}") from error

    def _act(self, line: Line) -> Act:
        match line:
            case MotionLine():
                return self._move(line)
            case Wait():
                return WaitStep(self.at, number(line.seconds, self))
            case WaitUntil():
                self._until = line
                return line
            case Word(words="END" | "ABORT"):
                return line
        raise TeachError(f"{self.text}: only the robot itself executes it")

    def _move(self, line: MotionLine) -> LedMove:
        found = asked(line, self)
        known = {each.number: each for each in self.draft.program.positions}
        plain = found.kind in KINDS and all(each.kind == "P" for each in found.targets)
        timed = found.percent is None and found.mm_s is None
        if not plain or timed or found.offset or found.tool_offset or found.acc != 100.0:
            raise TeachError(f"{self.text}: only the robot itself executes it")
        positions = [known[taught(each, self, known)] for each in found.targets]
        if found.kind != "J" and any(p.groups[0].tool not in FLANGE for p in positions):
            raise TeachError(f"{self.text}: only the robot itself leads the tip of another tool")
        *via, end = (twin_target(self._robot, position) for position in positions)
        fields: dict[str, Any] = {"joint_positions": end}
        fields["speed_percent"] = found.percent or 100.0
        if found.kind != "J":
            fields |= {"path": KINDS[found.kind], "speed_mm_s": found.mm_s or 0.0}
        if via:
            fields["via"] = via[0]
        return LedMove(fields, 0.01 * (found.cnt or 0.0) * CORNER_MM)

    def read(self, place: Indexed | Name) -> Value:
        """Return what a line of the draft has set, or the gripper.

        Raises:
            ExecutionError: Only the robot knows it.
        """
        if place == VACUUM and self.closed is not None:
            return self.closed
        if place not in self._values:
            raise ExecutionError(f"only the robot knows {print_expression(place)}")
        return self._values[place]

    def write(self, place: Indexed | Name, value: Written) -> None:
        """Take what a line sets.

        Raises:
            ExecutionError: It is neither a register nor the gripper.
        """
        register = place in SELECTIONS or (isinstance(place, Indexed) and place.kind == "R")
        if place == SUCTION and isinstance(value, bool):
            self._switched = value
        elif not register or not isinstance(value, float | bool):
            raise ExecutionError(f"only the robot sets {print_expression(place)}")
        self._values[place] = value


def motion_to(draft: Draft, robot: Robot, line: int) -> LedMove:
    """Return the motion of one line, whatever the lines before it do.

    Raises:
        TeachError: There is no such line, it is no motion, or registers say where it goes.
    """
    line_of(draft, line)
    found = Walk(draft, robot, line - 1).step()
    if not isinstance(found, LedMove):
        raise TeachError(f"line {line} is no motion")
    return found


def motion_above(draft: Draft, line: int) -> int:
    """Return the number of the nearest motion above a line.

    Raises:
        TeachError: There is none.
    """
    for above in range(min(line, len(draft.program.lines) + 1) - 1, 0, -1):
        if isinstance(draft.program.lines[above - 1], MotionLine):
            return above
    raise TeachError("no motion stands above")
