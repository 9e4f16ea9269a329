"""PyBullet's engines. One takes 29 MB: 20 are only cleared, 9 are the same in each."""

from __future__ import annotations

import os
from typing import Any

from scara_control.dynamics.cleared_memory_io import give_back_cleared

_spare: list[int] = []


def new_engine() -> int:
    """Return an engine that nobody has used: one of the process's parent if there is one left."""
    if _spare:
        return _spare.pop()
    # Not at the top of the module: the first import writes a line, see _load_quietly.
    import pybullet

    return int(pybullet.connect(pybullet.DIRECT))


def joint_infos(body: int, client: int) -> list[Any]:
    """Return what an engine says of each joint of a body; see PyBullet's ``getJointInfo``."""
    import pybullet

    count = pybullet.getNumJoints(body, physicsClientId=client)
    return [pybullet.getJointInfo(body, k, physicsClientId=client) for k in range(count)]


def prepare_engines() -> None:
    """Start engines for the processes that will be forked from this one, and share them so.

    To be called without another thread. Two is what the simulator takes: its world, and what it
    reckons with. Each process that was forked finds both as they are here.
    """
    _load_quietly()
    _spare.extend([new_engine() for _ in range(2)])
    give_back_cleared()


def _load_quietly() -> None:
    """Import PyBullet without the line that it writes to the terminal: when it was built."""
    shown, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        # The line comes from C, which knows nothing of sys.stderr.
        os.dup2(nothing, 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(shown, 2)
        os.close(shown)
        os.close(nothing)
