"""Print a program as the robot's own controller writes it to a file."""

from __future__ import annotations

from collections.abc import Iterator

from scara_config.programs.tp.listing import (
    AssignLine,
    Binary,
    Blank,
    Bracket,
    Call,
    Case,
    Condition,
    Coordinate,
    Expression,
    For,
    GroupPosition,
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
    Text,
    Unary,
    Unknown,
    Wait,
    WaitUntil,
    Word,
)

TASK = (
    *("STACK_SIZE", "TASK_PRIORITY", "TIME_SLICE"),
    *("BUSY_LAMP_OFF", "ABORT_REQUEST", "PAUSE_REQUEST"),
)
"""Attributes that stand together, behind TCD."""
USUAL = {
    "OWNER": "MNEDITOR",
    "COMMENT": '""',
    "PROG_SIZE": "0",
    "CREATE": "DATE 00-01-01  TIME 00:00:00",
    "MODIFIED": "DATE 00-01-01  TIME 00:00:00",
    "FILE_NAME": "",
    "VERSION": "0",
    "LINE_COUNT": "0",
    "MEMORY_SIZE": "0",
    "PROTECT": "READ_WRITE",
    **{name: "50" if name == "TASK_PRIORITY" else "0" for name in TASK},
    "DEFAULT_GROUP": "1,*,*,*,*",
    "CONTROL_CODE": "00000000 00000000",
}
"""Attributes that every file has, in the maker's order; the controller fills in sizes and dates."""
ON_A_ROW = 3
"""Coordinates of a position."""


def print_program(program: Program) -> str:
    """Return the text of a file ``NAME.LS``.

    What :func:`scara_config.programs.tp.reader.read` makes of it is the same program again, with
    the attributes that every file has.
    """
    rows = [f"/PROG  {program.name}" + (f"\t  {program.kind}" if program.kind else "")]
    rows += ["/ATTR", *_attributes(program)]
    rows += ["/APPL", *program.application] if program.application else []
    rows.append("/MN")
    for number, line in enumerate(program.lines, start=1):
        rows.append(f"{number:4d}:{print_line(line)} ;")
    rows.append("/POS")
    for position in program.positions:
        comment = f':"{position.comment}"' if position.comment else ""
        rows.append(f"P[{position.number}{comment}]{{")
        for group in position.groups:
            rows += _group(group)
        rows.append("};")
    return "\n".join([*rows, "/END"]) + "\n"


def attributes_of(program: Program) -> dict[str, str]:
    """Return all attributes of the printed file: those of the program, and the usual others."""
    counted = {"LINE_COUNT": str(len(program.lines))}
    return {**USUAL, **program.attributes, **counted}


def _attributes(program: Program) -> Iterator[str]:
    attributes = attributes_of(program)
    for name, value in attributes.items():
        if name not in TASK:
            yield f"{name}" + ("\t" if len(name) > 7 else "\t\t") + f"= {value};"
        elif name == TASK[0]:
            rows = (f"{each}\t= {attributes[each]}" for each in TASK)
            yield "TCD:  " + ",\n      ".join(rows) + ";"


def print_line(line: Line) -> str:
    """Return what stands behind a line's number, without the semicolon.

    Example:
        >>> print_line(MotionLine("J", (Indexed("P", (1.0,)),), 50.0, "%"))
        'J P[1] 50% FINE   '
    """
    if isinstance(line, MotionLine):
        return _motion(line)
    if isinstance(line, Select | Case):
        return f"  {_case(line)}"
    return f"  {_statement(line)}".rstrip() if isinstance(line, Remark) else f"  {_statement(line)}"


def _motion(line: MotionLine) -> str:
    # A controller writes the end of an arc on a row of its own.
    targets = "    \n    :  ".join(print_expression(target) for target in line.targets)
    speed = "max_speed" if line.speed is None else print_expression(line.speed) + line.unit
    if line.cnt is None:
        termination = "FINE"
    else:
        # A controller writes CNT R[1], but CNT100.
        gap = " " if isinstance(line.cnt, Indexed) else ""
        termination = f"CNT{gap}{print_expression(line.cnt)}"
    return " ".join([f"{line.kind} {targets}", speed, termination, *line.options]) + "   "


def _case(line: Select | Case) -> str:
    action = _statement(line.action)
    if isinstance(line, Select):
        return f"SELECT {print_expression(line.subject)}={print_expression(line.value)},{action}"
    value = "ELSE" if line.value is None else f"={print_expression(line.value)}"
    return f"       {value},{action}"


def _statement(line: Line) -> str:
    match line:
        case Remark():
            return line.mark + line.text
        case Blank():
            return ""
        case AssignLine():
            percent = line.target == Name("OVERRIDE") and isinstance(line.value, float)
            value = print_expression(line.value) + ("%" if percent else "")
            return f"{print_expression(line.target)}={value}"
        case Label():
            return print_expression(line.label)
        case Jump():
            return f"JMP {print_expression(line.label)}"
        case Call():
            called = line.program
            name = called if isinstance(called, str) else print_expression(called)
            arguments = ",".join(print_expression(argument) for argument in line.arguments)
            way = "RUN" if line.beside else "CALL"
            return f"{way} {name}" + (f"({arguments})" if arguments else "")
        case If():
            return f"IF {print_expression(line.condition)},{_statement(line.action)}"
        case IfThen():
            return f"IF {print_expression(line.condition)} THEN"
        case For():
            way = "TO" if line.step > 0 else "DOWNTO"
            ends = f"{print_expression(line.first)} {way} {print_expression(line.last)}"
            return f"FOR {print_expression(line.counter)}={ends}"
        case Wait():
            if isinstance(line.seconds, float):
                return f"WAIT {_number(line.seconds, 2):>6}(sec)"
            return f"WAIT {print_expression(line.seconds)}"
        case WaitUntil():
            timeout = f" TIMEOUT,{print_expression(line.timeout)}" if line.timeout else ""
            return f"WAIT {print_expression(line.condition)}{timeout}"
        case Numbered():
            return print_expression(line.instruction)
        case Notice():
            return f"MESSAGE[{line.text}]"
        case Condition():
            return f"{line.kind} {print_expression(line.condition)}"
        case Word():
            return line.words
        case Unknown():
            return line.text
    raise AssertionError(f"{line!r} is printed elsewhere")


def print_expression(expression: Expression) -> str:
    """Return the text of an expression.

    Example:
        >>> print_expression(Binary("+", Indexed("R", (1.0,)), 0.5))
        'R[1]+.5'
    """
    match expression:
        case float() | int():
            return _number(expression)
        case Name():
            return expression.word
        case Text():
            return f"'{expression.value}'"
        case Indexed():
            return _variable(expression)
        case Unary():
            return expression.operator + print_expression(expression.operand)
        case Bracket():
            return f"({print_expression(expression.inner)})"
        case PulseTime():
            if expression.seconds is None:
                return "PULSE"
            return f"PULSE,{print_expression(expression.seconds)}sec"
        case Binary():
            gap = " " if expression.operator.isalpha() else ""
            left, right = print_expression(expression.left), print_expression(expression.right)
            return f"{left}{gap}{expression.operator}{gap}{right}"
    raise AssertionError(f"{expression!r} is no expression")


def _variable(variable: Indexed) -> str:
    group = f"GP{variable.group}:" if variable.group else ""
    index = ",".join(print_expression(each) for each in variable.index)
    comment = f":{variable.comment}" if variable.comment else ""
    return f"{variable.kind}[{group}{index}{comment}]"


def _number(value: float, digits: int = 0) -> str:
    """Return a number with the digits that it needs, and no zero before its point."""
    text = f"{value:.{digits}f}"
    while float(text) != value and digits < 12:
        digits += 1
        text = f"{value:.{digits}f}"
    return text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text


def _group(group: GroupPosition) -> Iterator[str]:
    yield f"   GP{group.number}:"
    config = f"\t\tCONFIG : '{group.config}'," if group.config else "\t"
    yield f"\tUF : {group.frame}, UT : {group.tool},{config}"
    # The external axes begin a row of their own.
    for axes in (False, True):
        found = [each for each in group.coordinates if each.name.startswith("E") == axes]
        for at in range(0, len(found), ON_A_ROW):
            row = found[at : at + ON_A_ROW]
            comma = "" if row[-1] is group.coordinates[-1] else ","
            yield "\t" + ",\t".join(map(_coordinate, row)) + comma


def _coordinate(coordinate: Coordinate) -> str:
    value = "********" if coordinate.value is None else _number(coordinate.value, 3)
    gap = "  " if coordinate.unit == "mm" else " "
    name = f"{coordinate.name:<2}"
    return f"{name}= {value:>9}{gap}{coordinate.unit}"
