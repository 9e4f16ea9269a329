"""One choice after the other, as long as the program gets quicker."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec
from scara_config.programs.tp.listing import Program

from what_if.improving.choices import Choice, Value, chosen

WORTH_S = 0.005
"""A change that saves less is not made: a person reads each; our choice."""
Values = list[Value | None]


class Found(msgspec.Struct, frozen=True):
    """What a descent came to.

    Attributes:
        values: Of each choice; None: as it was written.
        seconds: The program takes so long [s].
    """

    values: Values
    seconds: float


def descend(
    program: Program,
    choices: Sequence[Choice],
    begin: Values,
    sequence: Sequence[int],
    seconds: Callable[[Program], float],
    allowed: Callable[[Program], bool],
) -> Found:
    """Change a program as long as it gets quicker and nothing speaks against it.

    Of each choice the values are sorted by the time that they lead to. It is halved between those
    that are too quick and those that are allowed: as if of two the slower one were allowed if the
    quicker one is. What is taken was tried in any case.

    Args:
        program: As it was written.
        choices: What may be otherwise.
        begin: Values to begin with, allowed ones.
        sequence: The order in which the choices are looked at, shape (n,).
        seconds: Tells how long a program takes [s].
        allowed: Tells whether nothing speaks against it.
    """
    values, best = list(begin), seconds(chosen(program, choices, begin))

    def with_(k: int, value: Value | None) -> Program:
        return chosen(program, choices, [*values[:k], value, *values[k + 1 :]])

    def quicker(k: int) -> bool:
        nonlocal best
        others = [value for value in choices[k].values(values[k]) if value != values[k]]
        timed = sorted(
            (time, number)
            for number, value in enumerate(others)
            for time in [seconds(with_(k, value))]
            if time < best - WORTH_S
        )
        refused, taken, at = -1, len(timed), 0
        while refused + 1 < taken:
            if allowed(with_(k, others[timed[at][1]])):
                taken = at
            else:
                refused = at
            at = (refused + taken) // 2
        if taken == len(timed):
            return False
        best, number = timed[taken]
        values[k] = others[number]
        return True

    # A list and no generator: each round looks at all choices, not only up to the first success.
    while any([quicker(k) for k in sequence]):
        pass
    # What the others have made needless goes again.
    for k in sequence:
        without = with_(k, None)
        if values[k] is not None and seconds(without) < best + WORTH_S and allowed(without):
            values[k], best = None, seconds(without)
    return Found(values, best)
