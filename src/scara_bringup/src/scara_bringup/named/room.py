"""Whether a machine has room for one more cell."""

from __future__ import annotations

from dataclasses import dataclass

NEEDED_CORES = 1.0  # our choice: what a cell takes while it starts and while it moves


@dataclass(frozen=True)
class ProcessorLoad:
    """What processors have done so far.

    Attributes:
        idle_s: Time in which they had nothing to do, all together [s].
        granted_s: Processor time that the group of this process was given [s].
        cores: Processors that this process may use.
        quota: Of so many processors' time the group may use; None: of all.
    """

    idle_s: float
    granted_s: float
    cores: int
    quota: float | None = None


def cores_left(before: ProcessorLoad, after: ProcessorLoad, dt: float) -> float:
    """Return how many processors are free, from two looks.

    Args:
        before: The first look.
        after: The second one.
        dt: Time between them [s].

    Example:
        >>> two = ProcessorLoad(10.0, 1.0, 2), ProcessorLoad(11.5, 2.0, 2)
        >>> cores_left(*two, 1.0)
        1.5
        >>> eight = ProcessorLoad(10.0, 1.0, 8, 2.0), ProcessorLoad(17.5, 2.5, 8, 2.0)
        >>> cores_left(*eight, 1.0)
        0.5
    """
    idle = min(float(after.cores), max(0.0, (after.idle_s - before.idle_s) / dt))
    if after.quota is None:
        return idle
    return min(idle, max(0.0, after.quota - (after.granted_s - before.granted_s) / dt))


def no_room(left: float, cores: int, name: str) -> str:
    """Say that there is no room for the cell ``name``, and what to do; empty if there is."""
    if left >= NEEDED_CORES:
        return ""
    return (
        f"only {left:.1f} of {cores} processors are free, and a cell needs {NEEDED_CORES:g}: end "
        "what computes (./cell status shows the cells, top the rest), start this one on another "
        f"machine, or start it all the same: ./cell up --name {name} --anyway"
    )
