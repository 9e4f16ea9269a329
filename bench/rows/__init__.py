"""The rows of the benchmark, one module for each group; each row is a function that returns its record."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from bench.record import Record
from bench.room import Room

RowFunction = Callable[[Room], Record]

_GROUPS = ("kinematics", "tracking", "simulation", "wires", "ros")
"""Modules of this folder, in the order in which they run: each has a table ``ROWS``."""


def all_rows() -> dict[str, RowFunction]:
    """Return every row by its name, in the order in which they run."""
    return {name: row for group in _GROUPS for name, row in importlib.import_module(f"bench.rows.{group}").ROWS.items()}
