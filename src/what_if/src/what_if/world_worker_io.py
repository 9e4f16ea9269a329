"""One process's share of many drawn worlds: its cell, the question, and what comes of each row."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from scara_config import KeepOut
from scara_config.payload import Payload
from scara_config.profile import CHOICE

from what_if.cell_files_io import resting_cell
from what_if.judging import judge
from what_if.motions import Motion
from what_if.uncertainty.chances import Tried, tried
from what_if.uncertainty.spreads import Spread
from what_if.uncertainty.varied import payload_of, varied
from what_if.world import Lag, Part


@dataclass(frozen=True)
class State:
    """What of a world is in no file, so that another process can make it."""

    q: tuple[float, ...]
    lag: Lag
    parts: tuple[Part, ...]
    payload: Payload | None
    people: tuple[tuple[float, float, float], ...]
    zones: tuple[KeepOut, ...]
    override_percent: float
    cap_percent: float


@dataclass(frozen=True)
class Question:
    """What is asked of each process.

    Attributes:
        state: Of the world as it is believed to be.
        motion: What is tried.
        spreads: What is not exactly known.
        robot: Folder of config/robots; empty: as the files say.
        directory: Of the YAML files; None: the package scara_config.
    """

    state: State
    motion: Motion
    spreads: tuple[Spread, ...]
    robot: str
    directory: Path | None


class Worker:
    """The cell of one process, and the question that it is asked.

    Args:
        question: What is asked.

    Raises:
        ConfigError: A file of this machine is missing or wrong.
    """

    def __init__(self, question: Question) -> None:
        if question.robot:
            os.environ[CHOICE] = question.robot
        self._question = question
        # Kept open until the process ends, or another question comes.
        self._stack = ExitStack()
        resting, self._models = self._stack.enter_context(resting_cell(question.directory))
        state = {name: getattr(question.state, name) for name in State.__dataclass_fields__}
        self._world = replace(resting, **state)

    def close(self) -> None:
        """Free the engine."""
        self._stack.close()

    def tried(self, row: Sequence[float]) -> Tried:
        """Try the motion in one world."""
        world, spreads = self._world, self._question.spreads
        payload = payload_of(world, spreads, row)
        if payload is not None:
            world = replace(world, payload=payload, models=self._models.told(payload))
        return tried(judge(varied(world, spreads, row), self._question.motion))
