"""How the threads of a node share the interpreter."""

from __future__ import annotations

import sys

TURN_S = 0.0005  # our choice: short against the 2 mm of tool error that a millisecond of delay costs at full speed


def take_turns() -> None:
    """Let a thread that computes give way after half a millisecond.

    Python's own 5 ms is as long as half a control cycle: a set point that one thread has decided would wait so long for
    another one that publishes or reads, before it goes over the wire.
    """
    sys.setswitchinterval(TURN_S)
