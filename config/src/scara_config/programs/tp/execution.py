"""What a line of a program does: to registers and signals, and to which line comes next.

What takes time is not done here: the line itself is handed to whoever executes the program, the
stand-in of the robot or the judge that walks through it.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import msgspec

from scara_config.loader import ConfigError
from scara_config.programs.tp.listing import (
    AssignLine,
    Blank,
    Bracket,
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
    Program,
    PulseTime,
    Remark,
    Select,
    Unknown,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.printer import print_line
from scara_config.programs.tp.values import (
    TIMER_WORDS,
    Evaluator,
    ExecutionError,
    Memory,
    Written,
    as_number,
    evaluate,
    evaluator,
    fixed,
    is_true,
    number,
    resolved,
    truth,
)


class Flow(msgspec.Struct, frozen=True):
    """A program and where its lines lead to.

    Attributes:
        program: What is executed.
        labels: Index of the line of each label.
        partners: IF -> its ELSE or ENDIF, ELSE -> ENDIF, FOR -> ENDFOR, ENDFOR -> FOR.
    """

    program: Program
    labels: dict[int, int]
    partners: dict[int, int]

    def named(self, index: int, why: str) -> str:
        """Return an error's text with the program's name, the line's number and its text."""
        text = print_line(self.program.lines[index]).strip()
        return f"line {index + 1} of {self.program.name}: {text}: {why}"


def flow_of(program: Program, source: str) -> Flow:
    """Return where the lines of a program lead to.

    Raises:
        ConfigError: A label is missing or there twice, a block has no end, or a variable is of a
            motion group other than 1; the text names file and line.
    """
    labels: dict[int, int] = {}
    partners: dict[int, int] = {}
    flow = Flow(program, labels, partners)
    blocks: list[int] = []

    def refused(index: int, why: str) -> ConfigError:
        return ConfigError(f"{source}: {flow.named(index, why)}")

    for index, line in enumerate(program.lines):
        if isinstance(line, Unknown):
            raise refused(index, "is not understood")
        # Whatever a remark or a message says is no variable.
        shown = "" if isinstance(line, Remark | Notice) else print_line(line)
        if other := _OTHER_GROUP.search(shown):
            raise refused(index, f"{other[1]}: the robot has motion group 1 alone")
        if isinstance(line, Label):
            number = line.label.index[0]
            if not isinstance(number, float) or int(number) in labels:
                raise refused(index, "is no new label")
            labels[int(number)] = index
        elif isinstance(line, IfThen | For):
            blocks.append(index)
        elif isinstance(line, Word) and line.words in _ENDS:
            begin, blocks = (blocks[-1], blocks[:-1]) if blocks else (-1, blocks)
            if begin < 0 or not isinstance(program.lines[begin], _ENDS[line.words]):
                raise refused(index, "nothing that it ends has begun")
            partners[begin] = index
            if line.words == "ELSE":
                blocks.append(index)
            elif line.words == "ENDFOR":
                partners[index] = begin
    if blocks:
        raise refused(blocks[-1], "has no end")
    for index, line in enumerate(program.lines):
        if isinstance(line, If | Select | Case):
            line = line.action
        # A jump, or the time-out of a wait, in whatever line it stands.
        for label in (getattr(line, "label", None), getattr(line, "timeout", None)):
            wanted = label.index[0] if label is not None else None
            # What stands in a register is known only when the line is executed.
            if isinstance(wanted, float) and int(wanted) not in labels:
                raise refused(index, f"there is no LBL[{int(wanted)}]")
    return flow


_OTHER_GROUP = re.compile(r"\[(GP[02-9]):")
_ENDS: dict[str, tuple[type, ...]] = {
    "ELSE": (IfThen,),
    "ENDIF": (IfThen, Word),
    "ENDFOR": (For,),
}
"""What may have begun before each word that ends a block; ELSE is a word."""


def execute(flow: Flow, index: int, memory: Memory) -> tuple[int, Line | None]:
    """Execute one line.

    Returns:
        Index of the line that comes next, and the line if it asks for something that takes time
        or another program: a motion, a wait, a call, PAUSE, ABORT, END, an alarm. Its indices and
        numbers are as they were written: :func:`evaluate` gives their values.

    Raises:
        ExecutionError: It cannot be executed; the text names program and line.
    """
    try:
        return _execute(flow, index, memory)
    except ExecutionError as error:
        raise ExecutionError(flow.named(index, str(error))) from error


Scan = Callable[[Memory], list[str]]
"""Executes a program of background logic once; returns its user alarms, each as a text."""


def background(program: Program) -> Scan:
    """Return what executes a program of background logic once, from its first to its last line.

    Raises:
        ConfigError: A line is none that background logic has; the text names program and line.

    Source:
        B-83284EN/09, section 9.12.2.
    """
    flow = flow_of(program, program.name)
    # Index, condition, what is done: a place is set, a line is gone on with; None: UALM.
    scanned: list[tuple[int, Evaluator, Indexed | Name | int | None, Evaluator]] = []
    for index, line in enumerate(program.lines):
        if isinstance(line, Remark | Blank | Label):
            continue
        action = line.action if isinstance(line, If) else line
        target: Indexed | Name | int | None = -1
        value = condition = evaluator(Name("ON"))
        if isinstance(line, If):
            condition = evaluator(line.condition)
        if isinstance(action, AssignLine) and (place := fixed(action.target)) is not None:
            # A pulse is no value, nor are START, STOP and RESET of a timer.
            word = action.value.word if isinstance(action.value, Name) else ""
            timed = word in TIMER_WORDS or isinstance(action.value, PulseTime)
            # A marker goes on following its expression, and a robot is delivered without.
            if not timed and getattr(place, "kind", "") != "M":
                target, value = place, evaluator(action.value)
        elif isinstance(action, Jump) and isinstance(action.label.index[0], float):
            target = flow.labels[int(action.label.index[0])]
        elif isinstance(action, Numbered) and action.instruction.kind == "UALM":
            target, value = None, evaluator(action.instruction.index[0])
        # A jump back would not end, and a condition without brackets is no mixed logic.
        back = isinstance(target, int) and target < index
        if back or (isinstance(line, If) and not isinstance(line.condition, Bracket)):
            why = "background logic has assignments of values to fixed places, UALM, JMP to a line "
            raise ConfigError(flow.named(index, f"{why}below, IF (...) with brackets before them"))
        scanned.append((index, condition, target, value))

    def scan(memory: Memory) -> list[str]:
        told, begin = list[str](), 0
        for index, holds, target, value in scanned:
            if index < begin:
                continue
            try:
                found = holds(memory)
                # Asked in each period, and mostly it does not hold: that answer needs no call.
                if found is False or not is_true(found):
                    continue
                if isinstance(target, int):
                    begin = target
                elif target is None:
                    alarm = int(as_number(value(memory)))
                    told.append(f"UALM[{alarm}] in line {index + 1} of {program.name}")
                else:
                    memory.write(target, value(memory))
            except ExecutionError as error:
                raise ExecutionError(flow.named(index, str(error))) from error
        return told

    return scan


def _execute(flow: Flow, index: int, memory: Memory) -> tuple[int, Line | None]:
    line, after = flow.program.lines[index], index + 1
    match line:
        # The stream program's own lines first: they are executed in each period.
        case MotionLine():
            return after, line
        case Jump():
            return line_of(flow, line.label, memory), None
        case Remark() | Blank() | Label() | Notice():
            return after, None
        case If():
            if truth(line.condition, memory):
                return _act(flow, line.action, after, memory)
            return after, None
        case IfThen():
            return (after if truth(line.condition, memory) else flow.partners[index] + 1), None
        case Select():
            return _select(flow, index, line, memory)
        case Case():
            while after < len(flow.program.lines) and isinstance(flow.program.lines[after], Case):
                after += 1
            return after, None
        case For():
            first, last = _whole(line.first, memory), _whole(line.last, memory)
            memory.write(resolved(line.counter, memory), first)
            # Multiplied by the step, one comparison serves TO and DOWNTO.
            runs = first * line.step <= last * line.step
            return (after if runs else flow.partners[index] + 1), None
        case Word(words="ELSE"):
            return flow.partners[index] + 1, None
        case Word(words="ENDFOR"):
            return _endfor(flow, index, memory), None
        case Word(words="ENDIF"):
            return after, None
    return _act(flow, line, after, memory)


def _act(flow: Flow, line: Line, after: int, memory: Memory) -> tuple[int, Line | None]:
    """Do what may also stand behind a condition."""
    match line:
        case Jump():
            return line_of(flow, line.label, memory), None
        case AssignLine():
            memory.write(resolved(line.target, memory), _written(line.value, memory))
            return after, None
        case Wait() | WaitUntil() | Call() | Numbered() | Condition() | Word():
            return after, line
    raise ExecutionError("cannot be executed")


def _written(value: Expression, memory: Memory) -> Written:
    """Return what an assignment sets."""
    if isinstance(value, PulseTime):
        return PulseTime(None if value.seconds is None else number(value.seconds, memory))
    if isinstance(value, Name) and value.word in TIMER_WORDS:
        return value
    return evaluate(value, memory)


def line_of(flow: Flow, label: Indexed, memory: Memory) -> int:
    """Return the index of the line of a label, whose number may stand in a register.

    Raises:
        ExecutionError: There is no such label.
    """
    wanted = int(number(label.index[0], memory))
    if wanted not in flow.labels:
        raise ExecutionError(f"there is no LBL[{wanted}]")
    return flow.labels[wanted]


def _select(flow: Flow, index: int, line: Select, memory: Memory) -> tuple[int, Line | None]:
    """Find the case that fits; the line behind the cases comes after it."""
    lines = flow.program.lines
    after = index + 1
    cases: list[Select | Case] = [line]
    while after < len(lines) and isinstance(case := lines[after], Case):
        cases.append(case)
        after += 1
    subject = number(line.subject, memory)
    for each in cases:
        if each.value is None or number(each.value, memory) == subject:
            return _act(flow, each.action, after, memory)
    return after, None


def _whole(expression: Expression, memory: Memory) -> float:
    """Return a number by which a loop counts. Source: B-83284EN/09, section 4.18.6."""
    found = number(expression, memory)
    if not found.is_integer():
        raise ExecutionError(f"{found:g} is no whole number")
    return found


def _endfor(flow: Flow, index: int, memory: Memory) -> int:
    """Count on and return the line that comes next."""
    begin = flow.partners[index]
    line = flow.program.lines[begin]
    assert isinstance(line, For)
    counter = resolved(line.counter, memory)
    counted, last = _whole(counter, memory), _whole(line.last, memory)
    if counted * line.step >= last * line.step:
        return index + 1
    memory.write(counter, counted + line.step)
    return begin + 1
