"""The robot's own programs that a bag holds: which lines it showed, and since when."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import Bag, BagError, open_bag

from what_if.errors import WhatIfError
from what_if.world import Cell

DATA, STATE, JOINTS = "real/robot_data", "twin_controller/state", "real/joint_states"
SHOWN = re.compile(r"^(?P<name>\S+) line (?P<line>\d+) running\Z")
SAME_PERCENT = 0.5
"""An override that changes by more is another one: the robot knows whole percents."""
Row = tuple[float, ...]


@dataclass(frozen=True)
class RecordedRun:
    """A program that the robot ran at one override.

    Attributes:
        program: Its name.
        q: Where the joints were at its beginning, joints of the twin, SI.
        override_percent: Of every programmed speed.
        seen: Numbers of the lines that the robot showed, and since when [s].
    """

    program: str
    q: Row
    override_percent: float
    seen: tuple[tuple[int, float], ...]


def read_runs(cell: Cell, path: Path) -> list[RecordedRun]:
    """Read the programs that ran at one override, without a pause.

    Raises:
        WhatIfError: The bag cannot be read, or does not hold what is needed.
    """
    try:
        with open_bag(path) as bag:
            missing = [topic for topic in (DATA, STATE, JOINTS) if not bag.count(topic)]
            if missing:
                raise WhatIfError(f"{path}: holds no message of {', '.join(missing)}")
            runs, overrides = _lines(bag), _overrides(bag, path)
            places = _places(bag, [joint.name for joint in cell.robot.twin_joints])
    except BagError as error:
        raise WhatIfError(str(error)) from error
    found = []
    for program, seen in runs:
        begin, end = seen[0][1], seen[-1][1]
        # What was set before the program began counts from its beginning on.
        before = [percent for at, percent in overrides if at <= begin][-1:]
        given = before + [percent for at, percent in overrides if begin < at <= end]
        q = next((place for at, place in reversed(places) if at <= begin), None)
        if given and q is not None and max(given) - min(given) <= SAME_PERCENT and given[0] > 0.0:
            found.append(RecordedRun(program, q, given[0], tuple(seen)))
    return found


def _lines(bag: Bag) -> list[tuple[str, list[tuple[int, float]]]]:
    """Return the lines of each program from its start on; a pause ends what counts."""
    found: list[tuple[str, list[tuple[int, float]]]] = []
    running = ""
    for _, message in bag.messages(DATA):
        shown = SHOWN.match(message.program) if message.running else None
        name = shown["name"] if shown and message.control_type == "program" else ""
        if name and name != running:
            found.append((name, []))
        running = name
        if shown and name:
            line, seen = int(shown["line"]), found[-1][1]
            if not seen or seen[-1][0] != line:
                seen.append((line, _stamp(message)))
    return found


def _overrides(bag: Bag, path: Path) -> list[tuple[float, float]]:
    found = []
    for _, message in bag.messages(STATE):
        if not hasattr(message, "real_override_percent"):
            raise WhatIfError(f"{path}: {STATE}: tells no real_override_percent: record it anew")
        found.append((_stamp(message), float(message.real_override_percent)))
    return found


def _places(bag: Bag, names: list[str]) -> list[tuple[float, Row]]:
    found = []
    for _, message in bag.messages(JOINTS):
        at = {name: k for k, name in enumerate(message.name)}
        if not set(names) - set(at):
            place = tuple(float(message.position[at[name]]) for name in names)
            found.append((_stamp(message), place))
    return found


def _stamp(message: Any) -> float:
    # The reader's types have ROS 2's names of the fields of a stamp.
    return float(message.header.stamp.sec) + 1e-9 * float(message.header.stamp.nanosec)
