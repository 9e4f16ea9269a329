"""Bags like those of a whole run."""

from __future__ import annotations

from harness.imitated_run import (
    bag_maker,
    fastest_joint_percent,
    largest_tool_speed,
    make_bag,
    recorded_configuration,
)

__all__ = [
    "bag_maker",
    "fastest_joint_percent",
    "largest_tool_speed",
    "make_bag",
    "recorded_configuration",
]
