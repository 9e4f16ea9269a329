"""Read one line of a program."""

from __future__ import annotations

import re
from collections.abc import Callable

from scara_config.programs.tp.expressions import (
    Cursor,
    LineError,
    expression,
    indexed,
    operand,
    value,
    variable,
)
from scara_config.programs.tp.listing import (
    AssignLine,
    Binary,
    Blank,
    Call,
    Case,
    Condition,
    Expression,
    For,
    If,
    IfThen,
    Indexed,
    Jump,
    Label,
    Line,
    MotionLine,
    Name,
    Notice,
    Numbered,
    Remark,
    Select,
    Wait,
    WaitUntil,
    Word,
)

WORDS = (
    *("ABORT", "PAUSE", "END", "ELSE", "ENDIF", "ENDFOR", "LOCK PREG", "UNLOCK PREG"),
    *("COL DETECT ON", "COL DETECT OFF", "SOFTFLOAT END", "BREAK", "RESUME_PROG", "CLEAR_RESUME"),
)
"""Lines that are nothing but words."""
NUMBERED = ("PAYLOAD", "UALM", "SOFTFLOAT")
"""Instructions with a number in brackets."""
UNITS = ("%", "msec", "sec", "mm/sec", "cm/min", "inch/min", "deg/sec")
"""Of the speed of a motion."""
OPTIONS = (
    *("ACC", "Offset", "Tool_Offset", "Skip", "SkipJump", "TB", "TA", "DB", "Wjnt", "INC", "PTH"),
    *("COORD", "EV", "Ind.EV", "RTCP", "BREAK", "CR", "PSPD", "RT_LD", "AP_LD", "VOFFSET", "MROT"),
)
"""First words of what may stand behind a motion."""
_OPTION = re.compile(r"(?:^|\s)(?=(?:" + "|".join(map(re.escape, OPTIONS)) + r")(?![a-z]))")
_MOTION = re.compile(r"([JLCA])\s+(?=P\[|PR\[)")


def read_line(text: str) -> Line:
    """Read what stands between a line's number and its semicolon.

    Raises:
        LineError: It is not understood.

    Example:
        >>> read_line("J P[1:home] 50% FINE    ").speed
        50.0
    """
    text = text.strip()
    if not text:
        return Blank()
    if mark := re.match(r"!|//|--(?:\w+:)?", text):
        if mark[0] == "!" and ";" in text:
            raise LineError("a semicolon ends the line, in a remark too")
        return Remark(mark[0], text[mark.end() :])
    if message := re.fullmatch(r"MESSAGE\[(.*)\]", text, re.DOTALL):
        return Notice(message[1])
    cursor = Cursor(text)
    line = _line(cursor)
    cursor.end()
    return line


def _line(cursor: Cursor) -> Line:
    if " ".join(cursor.rest.split()) in WORDS:
        words = " ".join(cursor.rest.split())
        cursor.at = len(cursor.text)
        return Word(words)
    if kind := cursor.find(_MOTION):
        return _motion(cursor, kind[1])
    for begin, read in _BEGINNINGS:
        if found := cursor.find(begin):
            return read(cursor, found[0])
    return _action(cursor)


def _action(cursor: Cursor) -> Line:
    """Read what may also stand behind a condition."""
    if cursor.find(r"JMP\b"):
        return Jump(variable(cursor, "LBL"))
    if call := cursor.find(r"(CALL|RUN)\b"):
        return _call(cursor, call[1] == "RUN")
    if plain := cursor.find(r"(?:ABORT|PAUSE|END)\b"):
        return Word(plain[0])
    target = _target(cursor)
    if target is not None:
        cursor.expect(r"=", "=")
        found = value(cursor)
        # Only an override has a unit behind its value.
        if isinstance(target, Name) and target.word == "OVERRIDE":
            cursor.find(r"%")
        return AssignLine(target, found)
    raise LineError("no instruction begins so")


def _target(cursor: Cursor) -> Indexed | Name | None:
    """Return what can be assigned to, if it stands here before ``=``."""
    here = cursor.at
    try:
        found = operand(cursor)
    except LineError:
        # The error has left operands that had begun: the next try counts from 0.
        found, cursor.depth = None, 0
    if isinstance(found, Indexed | Name) and cursor.rest.startswith("="):
        return found
    cursor.at = here
    return None


def _motion(cursor: Cursor, kind: str) -> MotionLine:
    targets = [variable(cursor, "P", "PR")]
    if kind == "C":
        targets.append(variable(cursor, "P", "PR"))
    speed: Expression | None = None
    unit = ""
    if cursor.find(r"max_speed\b") is None:
        speed = operand(cursor)
        unit = cursor.expect("|".join(UNITS), "a unit of speed")[0]
    cnt: Expression | None = None
    if cursor.find(r"FINE\b") is None:
        cursor.expect(r"CNT", "FINE or CNT")
        cnt = operand(cursor)
    rest = cursor.rest
    options = tuple(" ".join(part.split()) for part in _OPTION.split(rest) if part.strip())
    if options and _OPTION.match(rest) is None:
        raise LineError(f"{rest[:40]!r} is no option of a motion")
    cursor.at = len(cursor.text)
    return MotionLine(kind, tuple(targets), speed, unit, cnt, options)


def _call(cursor: Cursor, beside: bool) -> Call:
    program = indexed(cursor) or cursor.expect(r"[\w-]+", "the name of a program")[0]
    arguments: list[Expression] = []
    if cursor.find(r"\("):
        while True:
            arguments.append(expression(cursor))
            if cursor.find(r",") is None:
                break
        cursor.expect(r"\)", "a closing bracket")
    return Call(program, tuple(arguments), beside)


def _logical(cursor: Cursor) -> Expression:
    """Read a condition.

    Raises:
        LineError: It has AND and OR outside of brackets: an editor makes one word of both.

    Source:
        B-83284EN/09, sections 4.7.4 and 4.8.2; in brackets, 4.19.
    """
    found = expression(cursor)
    words, waiting = set[str](), [found]
    while waiting:
        part = waiting.pop()
        if isinstance(part, Binary):
            words.add(part.operator)
            waiting += [part.left, part.right]
    if words >= {"AND", "OR"}:
        why = "AND and OR cannot stand together in a condition without brackets"
        raise LineError(f"{why}: put brackets around all of it, (A AND (B OR C))")
    return found


def _if(cursor: Cursor, _: str) -> If | IfThen:
    condition = _logical(cursor)
    if cursor.find(r"THEN\b"):
        return IfThen(condition)
    cursor.expect(r",", "a comma or THEN")
    return If(condition, _action(cursor))


def _select(cursor: Cursor, _: str) -> Select:
    subject = operand(cursor)
    cursor.expect(r"=", "=")
    first = operand(cursor)
    cursor.expect(r",", "a comma")
    return Select(subject, first, _action(cursor))


def _case(cursor: Cursor, begin: str) -> Case:
    found = operand(cursor) if begin == "=" else None
    if begin == "=":
        cursor.expect(r",", "a comma")
    return Case(found, _action(cursor))


def _for(cursor: Cursor, _: str) -> For:
    counter = variable(cursor, "R")
    cursor.expect(r"=", "=")
    first = operand(cursor)
    way = cursor.expect(r"(TO|DOWNTO)\b", "TO or DOWNTO")[1]
    return For(counter, first, operand(cursor), 1 if way == "TO" else -1)


def _wait(cursor: Cursor, _: str) -> Wait | WaitUntil:
    found = _logical(cursor)
    # A register that is waited for alone holds seconds.
    is_time = isinstance(found, Indexed) and found.kind in ("R", "AR")
    if cursor.find(r"\(sec\)") or (not cursor.rest and is_time):
        return Wait(found)
    timeout = None
    if cursor.find(r"TIMEOUT\s*,"):
        timeout = variable(cursor, "LBL")
    return WaitUntil(found, timeout)


def _condition(cursor: Cursor, begin: str) -> Condition:
    return Condition(" ".join(begin.split()), _logical(cursor))


_BEGINNINGS: tuple[tuple[str, Callable[[Cursor, str], Line]], ...] = (
    (r"(?=LBL\[)", lambda cursor, _: Label(variable(cursor, "LBL"))),
    (r"IF\b", _if),
    (r"SELECT\b", _select),
    (r"=", _case),
    (r"ELSE\s*,", _case),
    (r"FOR\b", _for),
    (r"WAIT\b", _wait),
    (r"(?:SKIP|OFFSET|TOOL_OFFSET)\s+CONDITION\b", _condition),
    (r"(?=(?:PAYLOAD|UALM|SOFTFLOAT)\[)", lambda cursor, _: Numbered(variable(cursor, *NUMBERED))),
)
