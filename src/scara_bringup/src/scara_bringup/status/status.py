"""What ``cell status`` says of a node: pure, from what was seen of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scara_ros.diagnosis import Diagnosis, Level


@dataclass(frozen=True)
class Usage:
    """What the kernel counts of a process: processor time [s] and memory [MB]."""

    processor_s: float
    memory_mb: float


@dataclass(frozen=True)
class NodeState:
    """One node, as a person wants to see it.

    Attributes:
        name: Of the node.
        pid: Its process.
        alive: Whether it runs.
        cpu_percent: Of one processor; None if it does not run.
        memory_mb: It uses, None if it does not run.
        says: What it has said about itself last, the worst first.
    """

    name: str
    pid: int
    alive: bool
    cpu_percent: float | None = None
    memory_mb: float | None = None
    says: tuple[Diagnosis, ...] = ()


def node_state(
    name: str,
    pid: int,
    before: Usage | None,
    after: Usage | None,
    dt: float,
    said: Sequence[Diagnosis] = (),
) -> NodeState:
    """Judge a node from two looks at its process, ``dt`` [s] apart; None: it was not there."""
    if after is None:
        return NodeState(name, pid, False, says=worst_first(said))
    cpu = None if before is None else 100.0 * (after.processor_s - before.processor_s) / dt
    return NodeState(name, pid, True, cpu, after.memory_mb, worst_first(said))


def worst_first(said: Sequence[Diagnosis]) -> tuple[Diagnosis, ...]:
    """Sort what a node says by how bad it is; of equals the first stays the first."""
    return tuple(sorted(said, key=lambda one: -one.level))


def in_words(state: NodeState) -> str:
    """Say in a few words what a node says of itself.

    What is fine is one word, the worst is quoted; the rest is counted.
    """
    if not state.alive:
        return "ENDED: see its log"
    bad = [one for one in state.says if one.level > Level.OK]
    if not bad:
        return "ok" if state.says else "-"
    more = f" (and {len(bad) - 1} more)" if len(bad) > 1 else ""
    grade = "warning" if bad[0].level == Level.WARN else "ERROR"
    return f"{grade}: {bad[0].message}{more}"
