"""Percentages of a configuration by their meaning; each has its own range."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

SpeedPercent = Annotated[float, Meta(ge=1.0, le=100.0)]
"""Part of a largest speed or deceleration at which something is done: never so slow as to stand."""

SharePercent = Annotated[float, Meta(gt=0.0, le=100.0)]
"""Part of a whole: an error of the reach, a threshold of the largest speed, a jog's speed."""

AccelerationPercent = Annotated[float, Meta(gt=0.0, le=1000.0)]
"""A stand-in's acceleration, relative to robot.yaml; a drive may be better than its data sheet."""

TolerancePercent = Annotated[float, Meta(ge=0.0, le=10_000.0)]
"""Margin on top of a limit; 0 is none, a very large one is as good as no limit."""
