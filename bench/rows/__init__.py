"""The rows of the benchmark, one module for each group.

Each row is a function that returns its record.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable

from bench.record import Record
from bench.room import Room

RowFunction = Callable[[Room], Record]

GROUPS = {
    "kinematics": ("ik_single", "ik_batch", "ik_accuracy"),
    "tracking": ("tracking", "tracking_wrong_mass"),
    "simulation": ("simulation", "simulation_repeatable"),
    "wires": ("modbus_read", "loop_jitter"),
    "ros": ("service_call", "gateway"),
    "cells": ("sync_error", "sync_error_slow", "state_age", "cell_cost", "start"),
    "company": ("page_open", "two_cells"),
    "pauses": ("pause_twin_leads", "pause_real_leads", "stopped_twin_leads"),
    "oracles": ("oracle_kinematics", "oracle_dynamics"),
    "recording": ("recorder_write", "recorder_loss", "report"),
}
"""Modules of this folder and the rows in them, in the order in which they run."""


def names() -> list[str]:
    """Return the names of all rows, in the order in which they run."""
    return [name for rows in GROUPS.values() for name in rows]


def row(name: str) -> RowFunction:
    """Return a row's function.

    Its module is imported now, so that a broken one costs its own rows only.
    """
    group = next(group for group, rows in GROUPS.items() if name in rows)
    found: RowFunction = getattr(importlib.import_module(f"bench.rows.{group}"), name)
    return found
