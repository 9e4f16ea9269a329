"""A loop goes first where the system allows it, and says where it does not."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from scara_ros.process.scheduling_io import PRIORITY, may_go_first

# Each runs in a process of its own: whoever goes first would disturb the other tests.
LOOP = """
import os, threading
from scara_ros.process.scheduling_io import go_first

found, begin = [], threading.Event()

def look():
    begin.wait()
    found.append(os.sched_getscheduler(0) == os.SCHED_RR)

before = threading.Thread(target=look)
before.start()
allowed = go_first()
after = threading.Thread(target=look)
after.start()
begin.set()
before.join()
after.join()
print(allowed, found, os.sched_getparam(0).sched_priority)
"""
ORDINARY = """
import os
from scara_ros.process.scheduling_io import may_go_first
print(may_go_first(), os.sched_getscheduler(0) == os.SCHED_OTHER)
"""
NOBODY = "import os; os.setresgid(65534, 65534, 65534); os.setresuid(65534, 65534, 65534)\n"


def run(code: str) -> str:
    """What a Python of its own prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60.0, check=True
    )
    return done.stdout.strip()


def test_all_threads_of_a_loop_go_first_where_that_is_allowed() -> None:
    """Those that run already and those that are started later."""
    allowed = may_go_first()
    assert run(LOOP) == (f"True [True, True] {PRIORITY}" if allowed else "False [False, False] 0")
    assert run(ORDINARY) == f"{allowed} True"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody without rights")
def test_who_may_not_stays_ordinary_and_is_told() -> None:
    """No error: the loop runs, only later."""
    imported = "import scara_ros.process.scheduling_io, threading\n"
    assert run(imported + NOBODY + LOOP) == "False [False, False] 0"
    assert run(imported + NOBODY + ORDINARY) == "False True"
