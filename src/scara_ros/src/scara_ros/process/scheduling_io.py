"""A control loop's place in the queue for the processor."""

from __future__ import annotations

import contextlib
import os

PRIORITY = 10  # our choice: before all that is ordinary, behind the kernel's own threads


def go_first() -> bool:
    """Let all threads of this process run before all that is ordinary; for a node with a loop.

    Called when the loop is ready to begin, for loading and checking must not hold up the loops that
    run already. Threads that are started later are like those that start them.

    They get the real-time class with turns (SCHED_RR). Niceness does not do: many kernels share the
    processor out by session first (autogroups) and look at it only within one. Without this a loop
    of the cell waited up to 100 ms for two busy cores; the kernel keeps 5 % of each second for the
    others, so that a loop that runs wild can be ended.

    Returns:
        Whether the system allows it: it does for root, for CAP_SYS_NICE and below RLIMIT_RTPRIO.
    """
    try:
        for thread in map(int, os.listdir("/proc/self/task")):
            with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
                os.sched_setscheduler(thread, os.SCHED_RR, os.sched_param(PRIORITY))
    except PermissionError:
        return False
    return True


def may_go_first() -> bool:
    """Return what :func:`go_first` would in this process; its threads stay what they are."""
    policy, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    except PermissionError:
        return False
    os.sched_setscheduler(0, policy, parameter)
    return True
