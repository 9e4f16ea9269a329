"""Lines that are repeated over many places: a pallet, a tray, a row of fixtures.

A loop counts its rounds in a register; at its head another register is set for each position that
goes along, ``R[52:place]=R[51:round]+9``, and the motion goes to ``P[R[52]]``. So each place is a
position of its own, which can be touched up at the robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec
from scara_config import Robot
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.listing import (
    AssignLine,
    Binary,
    For,
    Indexed,
    Line,
    MotionLine,
    Name,
    Position,
    Wait,
    WaitUntil,
    Word,
)

from operator_panel.teach import draft as teach
from operator_panel.teach.draft import SUCTION, VACUUM, Draft, TeachError

SETTLE_S = 0.15
"""Before the suction is switched: the arm stands still then. As in the programs that come along."""


def own_places(draft: Draft, first: int, last: int) -> tuple[int, ...]:
    """Return the numbers of the positions that the lines ``first`` to ``last`` go to.

    Raises:
        TeachError: The lines hold half of a block, or a register says where one goes.
    """
    teach.whole_block(draft, first, last)
    motions = (
        number
        for number in range(first, last + 1)
        if isinstance(draft.program.lines[number - 1], MotionLine)
    )
    found = dict.fromkeys(int(teach.own_position(draft, n).index[0]) for n in motions)  # type: ignore[arg-type]
    if not found:
        raise TeachError(f"lines {first} to {last} go nowhere")
    return tuple(found)


def repeated(
    draft: Draft,
    robot: Robot,
    first: int,
    last: int,
    places: Mapping[int, Sequence[Position]],
    fresh: bool = False,
) -> Draft:
    """Repeat lines once for each place.

    Lines in a loop of as many rounds go through their places with it: so one loop fetches here and
    brings there. Lines outside of a loop get one of their own.

    Args:
        draft: The program.
        robot: Its joints.
        first: Number of the first line.
        last: Number of the last line.
        places: For each position that the lines go to, by its number, where it is in each round.
        fresh: Those positions were made for these lines: no other line can go there.

    Raises:
        TeachError: They hold half of a block, or stand in a loop of another number of rounds.
    """
    teach.whole_block(draft, first, last)
    rounds = len(next(iter(places.values())))
    if rounds < 2:
        raise TeachError("one place only: there is nothing to repeat")
    counter = _counter(draft, first, rounds)
    free = teach.free_register(draft.program.lines)
    own_loop = counter is None
    if counter is None:
        counter, free = Indexed("R", (float(free),), 0, "round"), free + 1
    lines, positions = draft.program.lines, draft.program.positions
    names = {each.number: each.comment for each in positions}
    others = (*lines[: first - 1], *lines[last:])
    left = () if fresh else teach.needed_positions(positions, set(places), others)
    kept = tuple(each for each in positions if each.number not in places or each in left)
    taken = max((each.number for each in kept), default=0)
    new, head, targets = [], [], {}
    for number, there in places.items():
        name = names[number]
        register = Indexed("R", (float(free),), 0, name or f"place {number}")
        head.append(AssignLine(register, Binary("+", counter, float(taken))))
        targets[number] = Indexed("P", (msgspec.structs.replace(register, comment=""),))
        for round_, position in enumerate(there, start=1):
            said = f"{name} {round_}" if name else ""
            new.append(msgspec.structs.replace(position, number=taken + round_, comment=said))
        taken, free = taken + rounds, free + 1
    block = [*head, *(_led(line, targets) for line in lines[first - 1 : last])]
    if own_loop:
        block = [For(counter, 1.0, float(rounds)), *block, Word("ENDFOR")]
    changed = (*lines[: first - 1], *block, *lines[last:])
    return teach.changed(draft, robot, changed, (*kept, *new))


def _counter(draft: Draft, line: int, rounds: int) -> Indexed | None:
    """Return what counts the innermost loop around a line; None: it stands in none.

    Raises:
        TeachError: That loop has another number of rounds.
    """
    program = draft.program
    partners = flow_of(program, program.name).partners
    around = [
        begin
        for begin, end in partners.items()
        if isinstance(program.lines[begin], For) and begin < line - 1 < end
    ]
    if not around:
        return None
    begin = max(around)
    loop = program.lines[begin]
    assert isinstance(loop, For)
    if (loop.first, loop.last, loop.step) != (1.0, float(rounds), 1):
        raise TeachError(
            f"line {begin + 1} does not go round {rounds} times, as there are places: "
            "choose lines outside of its loop, or as many places"
        )
    return loop.counter


def _led(line: Line, targets: Mapping[int, Indexed]) -> Line:
    """Return a line that goes where registers say."""
    if not isinstance(line, MotionLine):
        return line
    led = tuple(targets.get(int(each.index[0]), each) for each in line.targets)  # type: ignore[arg-type]
    return msgspec.structs.replace(line, targets=led)


def handled(
    draft: Draft,
    robot: Robot,
    after: int,
    above: Sequence[Position],
    there: Sequence[Position],
    close: bool,
    speeds: tuple[float, float],
    cnt: float | None,
) -> Draft:
    """Add lines that fetch a part or set it down: above, down, the gripper, above again.

    Args:
        draft: The program.
        robot: Its joints.
        after: The line in front of them.
        above: Where the tool comes from and goes to again, for each place.
        there: Where it handles the part, for each place; with more than one they are repeated.
        close: Fetch it; else set it down.
        speeds: Of the joint motion to above [%], of the lines down and up [mm/s].
        cnt: How far the corner above is rounded, 0..100; None: FINE.

    Raises:
        TeachError: A number or a joint is out of range, or :func:`repeated` refuses it.
    """
    taken = max((each.number for each in draft.program.positions), default=0)
    name = "pick" if close else "place"
    new = (
        msgspec.structs.replace(above[0], number=taken + 1, comment=f"above {name}"),
        msgspec.structs.replace(there[0], number=taken + 2, comment=name),
    )
    high, low = (Indexed("P", (float(each.number),), 0, each.comment) for each in new)
    level = Name("ON" if close else "OFF")
    lines: tuple[Line, ...] = (
        MotionLine("J", (high,), speeds[0], "%", cnt),
        MotionLine("L", (low,), speeds[1], "mm/sec"),
        Wait(SETTLE_S),
        AssignLine(SUCTION, level),
        WaitUntil(Binary("=", VACUUM, level)),
        MotionLine("L", (high,), speeds[1], "mm/sec", cnt),
    )
    made = teach.inserted(draft, robot, after, lines, (*draft.program.positions, *new))
    if len(there) == 1:
        return made
    places = {taken + 1: above, taken + 2: there}
    return repeated(made, robot, after + 1, after + len(lines), places, fresh=True)


def recorded(
    draft: Draft,
    robot: Robot,
    after: int,
    positions: Sequence[Position],
    kind: str,
    speed: float,
    cnt: float | None,
) -> Draft:
    """Add a motion to a new position, or a round of motions to several."""
    made = teach.recorded(draft, robot, after, positions[0], kind, speed, cnt)
    if len(positions) == 1:
        return made
    number = int(teach.own_position(made, after + 1).index[0])  # type: ignore[arg-type]
    return repeated(made, robot, after + 1, after + 1, {number: positions}, fresh=True)


def last_added(before: Draft, after: int, made: Draft) -> int:
    """Return the line to choose behind an edit: the last that was added, within its loop."""
    number = after + len(made.program.lines) - len(before.program.lines)
    line = made.program.lines[number - 1] if number else None
    return number - 1 if isinstance(line, Word) and line.words == "ENDFOR" else number
