"""Threads of a node take turns often enough for a control cycle of 10 ms."""

from __future__ import annotations

import sys

from scara_ros.nodes.threads import TURN_S, take_turns


def test_a_computing_thread_gives_way_within_a_fraction_of_a_cycle() -> None:
    """Python's own interval is half a cycle."""
    before = sys.getswitchinterval()
    try:
        take_turns()
        assert sys.getswitchinterval() == TURN_S <= 0.001
    finally:
        sys.setswitchinterval(before)
