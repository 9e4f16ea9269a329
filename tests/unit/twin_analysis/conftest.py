"""Bags like those of a whole run."""

from __future__ import annotations

from harness.imitated_run import bag_maker, make_bag, recorded_configuration

__all__ = [
    "bag_maker",
    "make_bag",
    "recorded_configuration",
]
