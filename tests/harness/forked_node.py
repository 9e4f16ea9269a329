"""Be a node in a fork: ``forked_node.py ENVIRONMENT PROGRAM ARGUMENTS``; see harness/forks.py."""

from __future__ import annotations

import ctypes
import json
import os
import runpy
import sys
from pathlib import Path

import rospy
from rosgraph.names import get_ros_namespace
from scara_bringup.processes import warm_parent_io

MARK = "CELL_TEST_MARK"


def wear(mark: str) -> None:
    """Let /proc show the stage's mark in place of none, which is as long."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    begin, end = int(fields[47]), int(fields[48])
    place = ctypes.string_at(begin, end - begin).index(f"{MARK}=".encode()) + len(MARK) + 1
    ctypes.memmove(begin + place, mark.encode(), len(mark))


def main() -> None:
    """Take the environment and the words, and begin the program."""
    told, words = json.loads(sys.argv[1]), sys.argv[2:]
    wear(told[MARK])
    os.environ.update(told)
    sys.argv, sys.path[0] = words, str(Path(words[0]).resolve().parent)
    # rospy has read both when it was imported.
    rospy.names.reload_mappings(words)
    rospy.names._set_caller_id(f"{get_ros_namespace()}unnamed")
    warm_parent_io._show(Path(words[0]).name, words)
    runpy.run_path(words[0], run_name="__main__")


if __name__ == "__main__":
    main()
