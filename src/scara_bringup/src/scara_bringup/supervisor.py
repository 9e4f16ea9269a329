"""Decide what to start, to say and to end: (state, event, now) -> (state, actions).

No process is touched here.

A cell goes STARTING -> RUNNING -> ENDING -> ENDED. It begins to end when a node dies that it cannot
do without, when the readiness deadline has passed, when a signal comes, or when the run in the
foreground is over; the first of these gives the exit code.
"""

from __future__ import annotations

import signal
from dataclasses import dataclass, field, replace
from enum import Enum

from scara_bringup.config import Bringup
from scara_bringup.plan import NodePlan, ending_order
from scara_bringup.readiness import Missing


class Phase(Enum):
    """Where the cell is."""

    STARTING = "starting"
    RUNNING = "running"
    ENDING = "ending"
    ENDED = "ended"


@dataclass(frozen=True)
class ProcessEnded:
    """Event: a process is gone; ``code`` is its exit code, negative for a signal."""

    name: str
    code: int


@dataclass(frozen=True)
class Checked:
    """Event: readiness was looked at."""

    missing: tuple[Missing, ...]


@dataclass(frozen=True)
class Interrupted:
    """Event: SIGINT, SIGTERM or SIGHUP has come."""

    number: int


@dataclass(frozen=True)
class TimePassed:
    """Event: time has passed."""


Event = ProcessEnded | Checked | Interrupted | TimePassed


@dataclass(frozen=True)
class StartNode:
    """Action: start this node."""

    node: NodePlan


@dataclass(frozen=True)
class SendSignal:
    """Action: send a signal to the process groups of these nodes."""

    names: frozenset[str]
    number: int


@dataclass(frozen=True)
class Announce:
    """Action: tell that the cell is ready."""


@dataclass(frozen=True)
class Explain:
    """Action: say what has ended and what follows; show the last lines of these logs."""

    text: str
    logs: tuple[str, ...] = ()


Action = StartNode | SendSignal | Announce | Explain

_ESCALATION = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


@dataclass(frozen=True)
class Cell:
    """The state of the supervision.

    Attributes:
        nodes: The plan of all nodes that run until the end.
        foreground: What runs once the cell is ready and ends it; None: the cell stays.
        deadlines: Times of bringup.yaml.
        phase: See :class:`Phase`.
        alive: Names of living processes.
        deadline: When patience with the present phase, or with the last signal, ends.
        order: While ending: the groups that remain.
        strikes: While ending: how many signals the first of these groups has got.
        lacking: What was missing at the last look.
        exit_code: What the whole ends with.
    """

    nodes: tuple[NodePlan, ...]
    foreground: NodePlan | None
    deadlines: Bringup
    phase: Phase = Phase.STARTING
    alive: frozenset[str] = frozenset()
    deadline: float = 0.0
    order: tuple[frozenset[str], ...] = ()
    strikes: int = 0
    lacking: tuple[Missing, ...] = field(default=())
    exit_code: int = 0


Step = tuple[Cell, list[Action]]


def begin(
    nodes: list[NodePlan],
    foreground: NodePlan | None,
    deadlines: Bringup,
    now: float,
    running: tuple[NodePlan, ...] = (),
) -> Step:
    """Start every node; those ``running`` already (the master) are only watched and ended."""
    everyone = (*running, *nodes)
    cell = Cell(everyone, foreground, deadlines, deadline=now + deadlines.ready_timeout)
    return replace(cell, alive=frozenset(node.name for node in everyone)), [
        StartNode(node) for node in nodes
    ]


def step(cell: Cell, event: Event, now: float) -> Step:
    """Advance by one event at the monotonic time ``now`` [s]."""
    if isinstance(event, ProcessEnded):
        cell = replace(cell, alive=cell.alive - {event.name})
    if cell.phase is Phase.ENDED:
        return cell, []
    if cell.phase is Phase.ENDING:
        return _while_ending(cell, event, now)
    if isinstance(event, Interrupted):
        return _end(
            cell,
            128 + event.number,
            Explain(f"{signal.Signals(event.number).name}: ending the cell"),
            now,
        )
    if isinstance(event, ProcessEnded):
        optional = {node.name for node in cell.nodes if node.optional}
        return (_do_without if event.name in optional else _lost)(cell, event, now)
    if cell.phase is Phase.STARTING:
        return _while_starting(cell, event, now)
    return cell, []


def _while_starting(cell: Cell, event: Event, now: float) -> Step:
    """Go to RUNNING when nothing is missing, give up at the deadline."""
    if isinstance(event, Checked):
        cell = replace(cell, lacking=event.missing)
        if not event.missing:
            return _ready(cell)
    if now < cell.deadline:
        return cell, []
    lines = [f"  {item.node}: {item.what}" for item in cell.lacking] or [
        "  no look at the cell was possible"
    ]
    text = (
        f"the cell is not ready after {cell.deadlines.ready_timeout:g} s; missing:\n"
        + "\n".join(lines)
    )
    logs = tuple(dict.fromkeys(item.node for item in cell.lacking))
    return _end(cell, 1, Explain(text, logs), now)


def _ready(cell: Cell) -> Step:
    """Announce the cell and start what runs in the foreground."""
    cell = replace(cell, phase=Phase.RUNNING)
    if cell.foreground is None:
        return cell, [Announce()]
    return replace(cell, alive=cell.alive | {cell.foreground.name}), [
        Announce(),
        StartNode(cell.foreground),
    ]


def _do_without(cell: Cell, event: ProcessEnded, _now: float) -> Step:
    """Go on without a node, and say so."""
    nodes = tuple(node for node in cell.nodes if node.name != event.name)
    text = f"node {event.name} {describe_exit(event.code)}; the cell goes on without it"
    return replace(cell, nodes=nodes), [Explain(text, (event.name,))]


def _lost(cell: Cell, event: ProcessEnded, now: float) -> Step:
    """Take the end of the foreground as the result, that of any other process as a fault."""
    if cell.foreground is not None and event.name == cell.foreground.name:
        code = event.code if event.code >= 0 else 128 - event.code
        explain = Explain(f"{event.name} {describe_exit(event.code)}") if code else None
        return _end(cell, code, explain, now)
    # A node that ends in peace (0) is a fault too; a signal counts as a shell counts it.
    code = event.code or 1
    if code < 0:
        code = 128 - code
    return _end(
        cell,
        code,
        Explain(f"node {event.name} {describe_exit(event.code)}; ending the cell", (event.name,)),
        now,
    )


def _end(cell: Cell, code: int, explain: Explain | None, now: float) -> Step:
    """Begin to end everything, in order."""
    nodes = [*cell.nodes, *([cell.foreground] if cell.foreground else [])]
    # Due at once: nobody has been asked to end, so nobody is waited for.
    cell = replace(
        cell, phase=Phase.ENDING, exit_code=code, order=ending_order(nodes), strikes=0, deadline=now
    )
    cell, actions = _advance(cell, now)
    return cell, [*([explain] if explain else []), *actions]


def _while_ending(cell: Cell, event: Event, now: float) -> Step:
    """Go on with the next group or the next harder signal; a second Ctrl-C skips all patience."""
    if isinstance(event, Interrupted) and event.number == signal.SIGINT:
        # All at once, and by SIGKILL: who presses Ctrl-C twice has lost patience. Other signals
        # come twice by themselves: a closed terminal sends SIGHUP so, a logout SIGTERM and SIGHUP.
        cell = replace(cell, order=(cell.alive,), strikes=len(_ESCALATION) - 1, deadline=now)
    died = isinstance(event, ProcessEnded) and any(event.name in group for group in cell.order[1:])
    cell, actions = _advance(cell, now)
    if isinstance(event, ProcessEnded) and died:
        return cell, [
            Explain(f"node {event.name} {describe_exit(event.code)} as well", (event.name,)),
            *actions,
        ]
    return cell, actions


def _advance(cell: Cell, now: float) -> Step:
    """Send what is due now."""
    order = cell.order
    while order and not order[0] & cell.alive:
        order = order[1:]
    if order != cell.order:
        cell = replace(cell, order=order, strikes=0, deadline=now)
    if not order:
        return replace(cell, phase=Phase.ENDED), []
    if now < cell.deadline:
        return cell, []
    names = order[0] & cell.alive
    if cell.strikes == len(_ESCALATION):
        text = f"{', '.join(sorted(names))} cannot be ended, not even by SIGKILL"
        return replace(cell, phase=Phase.ENDED, exit_code=cell.exit_code or 1), [Explain(text)]
    graces = (
        cell.deadlines.interrupt_grace,
        cell.deadlines.terminate_grace,
        cell.deadlines.kill_grace,
    )
    number = _ESCALATION[cell.strikes]
    told = (
        [Explain(f"{', '.join(sorted(names))} still there: {number.name}")] if cell.strikes else []
    )
    cell = replace(cell, deadline=now + graces[cell.strikes], strikes=cell.strikes + 1)
    return cell, [*told, SendSignal(names, number)]


def describe_exit(code: int) -> str:
    """Say how a process ended.

    >>> describe_exit(-9), describe_exit(2)
    ('was killed by SIGKILL', 'ended with exit code 2')
    """
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"was killed by signal {-code}"
