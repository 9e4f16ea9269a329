"""What a program of the robot's teach pendant consists of: one struct for each kind of line.

An expression is a number or one of the structs of the first half; a line one of the second. Both
keep what a person wrote, brackets and comments too, so that a printed text reads as before.

Source:
    The maker's operator's manual B-83284EN/09, chapter 4; files that controllers wrote.
"""

from __future__ import annotations

from typing import TypeAlias

import msgspec


class Name(msgspec.Struct, frozen=True, cache_hash=True):
    """A word that stands for itself: ON, LPOS, RESET, ``$SYSTEM.$VARIABLE``, OVERRIDE."""

    word: str


class Text(msgspec.Struct, frozen=True):
    """A text in quotes, an argument of a call."""

    value: str


class Indexed(msgspec.Struct, frozen=True, cache_hash=True):
    """``R[1]``, ``PR[GP1:2,3:comment]``, ``DO[R[4]]``, ``P[1]``, ``LBL[10:comment]``.

    Attributes:
        kind: The word before the bracket.
        index: One expression, two for an element of a position.
        group: Motion group of a position; 0: not said.
        comment: Behind the colon.
    """

    kind: str
    index: tuple[Expression, ...]
    group: int = 0
    comment: str = ""


class Unary(msgspec.Struct, frozen=True, cache_hash=True):
    """``!x`` or ``-x``."""

    operator: str
    operand: Expression


class Binary(msgspec.Struct, frozen=True, cache_hash=True):
    """Two operands: arithmetic, comparison, AND, OR."""

    operator: str
    left: Expression
    right: Expression


class Bracket(msgspec.Struct, frozen=True, cache_hash=True):
    """``(x)``: mixed logic."""

    inner: Expression


class PulseTime(msgspec.Struct, frozen=True):
    """``PULSE,0.5sec``: what an output is set to; without a time as long as the robot is set up."""

    seconds: Expression | None = None


Expression: TypeAlias = float | Name | Text | Indexed | Unary | Binary | Bracket | PulseTime


class Remark(msgspec.Struct, frozen=True):
    """``!text``, ``//a line that is switched off``, ``--eg:text``."""

    mark: str
    text: str


class Blank(msgspec.Struct, frozen=True):
    """An empty line."""


class MotionLine(msgspec.Struct, frozen=True):
    """``J P[1] 50% FINE Offset,PR[2]``.

    Attributes:
        kind: J, L, C or A.
        targets: P[n] or PR[n]; C has two, the middle of the arc first.
        speed: A number or R[n]; None: as fast as it can (``max_speed``).
        unit: ``%``, ``sec``, ``msec``, ``mm/sec``, ``cm/min``, ``inch/min`` or ``deg/sec``.
        cnt: How far corners are rounded, 0..100; None: FINE.
        options: What stands behind, each as its text.
    """

    kind: str
    targets: tuple[Indexed, ...]
    speed: Expression | None
    unit: str
    cnt: Expression | None = None
    options: tuple[str, ...] = ()


class AssignLine(msgspec.Struct, frozen=True):
    """``R[1]=R[2]+1``, ``DO[1]=ON``, ``OVERRIDE=50%``, ``TIMER[1]=START``."""

    target: Indexed | Name
    value: Expression


class Label(msgspec.Struct, frozen=True):
    """``LBL[1:comment]``."""

    label: Indexed


class Jump(msgspec.Struct, frozen=True):
    """``JMP LBL[1]``."""

    label: Indexed


class Call(msgspec.Struct, frozen=True):
    """``CALL NAME(1,R[2])``; ``RUN NAME`` begins it beside this program.

    Attributes:
        program: Its name, or the string register that holds it.
        beside: RUN.
    """

    program: str | Indexed
    arguments: tuple[Expression, ...] = ()
    beside: bool = False


class If(msgspec.Struct, frozen=True):
    """``IF condition,action``."""

    condition: Expression
    action: Line


class IfThen(msgspec.Struct, frozen=True):
    """``IF condition THEN``, up to ELSE or ENDIF."""

    condition: Expression


class Select(msgspec.Struct, frozen=True):
    """``SELECT R[1]=1,action``: the first case."""

    subject: Expression
    value: Expression
    action: Line


class Case(msgspec.Struct, frozen=True):
    """``=2,action``, a further case of SELECT; None: ``ELSE,action``."""

    value: Expression | None
    action: Line


class For(msgspec.Struct, frozen=True):
    """``FOR R[1]=1 TO 10``, up to ENDFOR; ``step`` is -1 with DOWNTO."""

    counter: Indexed
    first: Expression
    last: Expression
    step: int = 1


class Wait(msgspec.Struct, frozen=True):
    """``WAIT .50(sec)`` or ``WAIT R[1]``: so many seconds."""

    seconds: Expression


class WaitUntil(msgspec.Struct, frozen=True):
    """``WAIT condition TIMEOUT,LBL[1]``."""

    condition: Expression
    timeout: Indexed | None = None


class Numbered(msgspec.Struct, frozen=True):
    """``PAYLOAD[1]``, ``UALM[2]``: an instruction with a number in brackets."""

    instruction: Indexed


class Notice(msgspec.Struct, frozen=True):
    """``MESSAGE[text]``."""

    text: str


class Condition(msgspec.Struct, frozen=True):
    """``SKIP CONDITION x``, ``OFFSET CONDITION PR[1]``: what the options of later motions mean."""

    kind: str
    condition: Expression


class Word(msgspec.Struct, frozen=True):
    """A line of fixed words: ABORT, PAUSE, END, ELSE, ENDIF, ENDFOR, LOCK PREG, UNLOCK PREG."""

    words: str


class Unknown(msgspec.Struct, frozen=True):
    """A line that was not understood; only in a program that was read leniently."""

    text: str


Line: TypeAlias = (
    Remark
    | Blank
    | MotionLine
    | AssignLine
    | Label
    | Jump
    | Call
    | If
    | IfThen
    | Select
    | Case
    | For
    | Wait
    | WaitUntil
    | Numbered
    | Notice
    | Condition
    | Word
    | Unknown
)


class Coordinate(msgspec.Struct, frozen=True):
    """One number of a position: ``J1= 10.000 deg``; None: not taught (asterisks)."""

    name: str
    value: float | None
    unit: str


class GroupPosition(msgspec.Struct, frozen=True):
    """A position of one motion group.

    Attributes:
        number: GP1 is 1.
        frame: UF; ``F``: that which is selected.
        tool: UT.
        config: Arm configuration of a Cartesian position, as it stands between the quotes.
        coordinates: X Y Z W P R or J1..J9, and E1..E3.
    """

    number: int
    frame: str
    tool: str
    config: str
    coordinates: tuple[Coordinate, ...]


class Position(msgspec.Struct, frozen=True):
    """``P[1:"comment"]{...}``."""

    number: int
    comment: str
    groups: tuple[GroupPosition, ...]


class Program(msgspec.Struct, frozen=True):
    """A file ``NAME.LS``.

    Attributes:
        name: Behind /PROG.
        kind: Behind the name: ``Macro``, ``Cond``; mostly empty.
        attributes: Of /ATTR, each as its text; those of TCD among them.
        application: The lines of /APPL.
        lines: Of /MN; the first is line 1.
        positions: Of /POS.
    """

    name: str
    lines: tuple[Line, ...]
    positions: tuple[Position, ...] = ()
    attributes: dict[str, str] = {}
    application: tuple[str, ...] = ()
    kind: str = ""

    @property
    def comment(self) -> str:
        """What the list of programs shows beside the name."""
        return self.attributes.get("COMMENT", "").strip('"')
