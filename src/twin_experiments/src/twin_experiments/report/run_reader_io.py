"""Turn a bag into a :class:`twin_experiments.report.record.Run`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, BagError

from twin_experiments.metrics.pauses import Pause, find_pauses
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.parts_reader_io import read_handled
from twin_experiments.report.label.plant import PLANT, PlantError, RecordedPlant, parse_plant
from twin_experiments.report.predictions import Both, Foretold
from twin_experiments.report.record import (
    Age,
    Event,
    RecordError,
    Run,
    build_side,
    find_spans,
    whole_span,
)

MARKER = "experiment/marker"
REAL, TWIN = "real/ground_truth", "twin/joint_states"
MEASURED = "real/joint_states"
"""Stands for the real side where nobody knows the truth: at a real robot."""
AGED = (MEASURED, "joint_pose_controller/follow")
PREDICTIONS = "what_if/outcomes"
STATE = "twin_controller/state"
CONFIGURATION, DECISIONS, DIAGNOSTICS = (
    "twin_controller/configuration",
    "twin_controller/decisions",
    "/diagnostics",
)


def read_run(bag: Bag, joint_names: list[str]) -> Run:
    """Read everything that the report uses; a bag without marks is one experiment.

    Args:
        bag: An open bag.
        joint_names: Joints of both sides that are compared.

    Raises:
        BagError: A needed topic has no messages, a message cannot be read, or the plant is not
            understood.
        RecordError: A joint or a velocity is missing, or the marks start no experiment.
    """
    # Where neither was recorded the error names the truth.
    real_topic = REAL if bag.count(REAL) or not bag.count(MEASURED) else MEASURED
    bag.require((real_topic, TWIN))
    origin, end = bag.start, bag.end
    real = _side(bag, "real", real_topic, joint_names, origin)
    twin = _side(bag, "twin", TWIN, joint_names, origin)
    markers = [(at - origin, message.data) for at, message in bag.messages(MARKER)]
    whole = (whole_span(real, twin),)
    run = Run(
        path=str(bag.path),
        origin=origin,
        duration=end - origin,
        repaired=bag.repaired,
        joint_names=tuple(joint_names),
        spans=find_spans(markers, end - origin) if markers else whole,
        real=real,
        twin=twin,
        real_is_truth=real_topic == REAL,
        ages={topic: _age(bag, topic, origin) for topic in AGED if bag.count(topic)},
        decisions=_decisions(bag, origin),
        warnings=_warnings(bag, origin),
        configuration=read_configuration(bag),
        topics=bag.topics,
        handled=read_handled(bag),
        plant=read_plant(bag),
        configuration_digest=read_configuration_digest(bag),
        pauses=read_pauses(bag),
        predictions=read_predictions(bag),
        clock_half_widths=None if real_topic == REAL else _clock_half_widths(bag, origin),
        leader="" if markers else read_leader(bag),
    )
    # Only who has read all topics knows what is missing of them.
    return replace(run, missing=tuple(bag.missing))


def read_pauses(bag: Bag) -> tuple[Pause, ...]:
    """Return when nothing at all was recorded, counted from the start of the recording."""
    found: list[Pause] = []
    last = np.zeros(0)
    for times in bag.arrivals():
        found += find_pauses(np.concatenate((last, times - bag.start)))
        # A pause may lie between two parts.
        last = times[-1:] - bag.start if len(times) else last
    return tuple(found)


def read_leader(bag: Bag) -> str:
    """Return the side that a state or decision of the twin controller names first as the leader.

    Empty if none does: an operator who leads is no side.

    Raises:
        BagError: A message cannot be read.
    """
    for _, _, read in bag.merged((STATE, DECISIONS)):
        if (leader := str(read().leader)) in ("real", "twin"):
            return leader
    return ""


def seconds_since(stamp: Any, origin: float) -> float:
    """Return a ROS stamp in seconds since ``origin`` without losing its nanoseconds."""
    whole = int(origin)
    return float((stamp.sec - whole) + stamp.nanosec * 1e-9 - (origin - whole))


def _side(bag: Bag, side: str, topic: str, joint_names: list[str], origin: float) -> Motion:
    """Read the joint states of one side."""
    stamps, positions, velocities, layouts = [], [], [], []
    columns: dict[tuple[str, ...], list[int]] = {}
    for _, message in bag.messages(topic):
        names = tuple(message.name)
        if names not in columns:
            missing = [name for name in joint_names if name not in names]
            if missing:
                raise RecordError(
                    f"{topic}: joint {', '.join(missing)} is missing; "
                    f"it has {', '.join(names) or 'none'}"
                )
            columns[names] = [names.index(name) for name in joint_names]
        if len(message.velocity) != len(names) or len(message.position) != len(names):
            raise RecordError(
                f"{topic}: {len(names)} names, {len(message.position)} positions and "
                f"{len(message.velocity)} velocities"
            )
        stamps.append(seconds_since(message.header.stamp, origin))
        positions.append(message.position)
        velocities.append(message.velocity)
        layouts.append(names)
    if len(columns) == 1:  # all at once, which is quicker by half
        (found,) = columns.values()
        return build_side(
            side, np.array(stamps), np.array(positions)[:, found], np.array(velocities)[:, found]
        )
    chosen = [columns[names] for names in layouts]
    parts = (
        np.array([row[found] for row, found in zip(rows, chosen)])
        for rows in (positions, velocities)
    )
    return build_side(side, np.array(stamps), *parts)


def _age(bag: Bag, topic: str, origin: float) -> Age:
    """Return how old a stamped topic's content was on receipt.

    Of a trajectory its first point counts.
    """
    received, age = [], []
    for at, message in bag.messages(topic):
        due = seconds_since(message.header.stamp, origin)
        points = getattr(message, "points", None)
        if points:
            due += points[0].time_from_start.sec + points[0].time_from_start.nanosec * 1e-9
        received.append(at - origin)
        age.append(at - origin - due)
    return Age(np.array(received), np.array(age))


def _clock_half_widths(bag: Bag, origin: float) -> tuple[Array, Array]:
    """Return times, and how well the robot's clock was known then: half widths [s]."""
    known = [
        (at - origin, link.clock_uncertainty)
        for at, message in bag.messages(STATE)
        for link in message.links
        if link.name == "real" and link.connected
    ]
    # Two rows, even where nothing is known.
    times, half_widths = np.array(known, dtype=np.float64).reshape(-1, 2).T
    return times, half_widths


def _decisions(bag: Bag, origin: float) -> tuple[Event, ...]:
    """Return the twin controller's transitions and refusals."""
    found: list[Event] = []
    for at, m in bag.messages(DECISIONS):
        modes = m.mode_after
        if m.mode_before != m.mode_after:
            modes = f"{m.mode_before} → {m.mode_after}"
        found.append(Event(at - origin, modes, m.why or m.event))
    return tuple(found)


def _warnings(bag: Bag, origin: float) -> tuple[Event, ...]:
    """Return each warning and error of a node when it first appears or changes."""
    found: list[Event] = []
    last: dict[str, tuple[int, str]] = {}
    for at, message in bag.messages(DIAGNOSTICS):
        for status in message.status:
            level = int(status.level)
            if level and last.get(status.name) != (level, status.message):
                word = {1: "WARN", 2: "ERROR"}.get(level, "STALE")
                found.append(Event(at - origin, status.name, f"{word}: {status.message}"))
            # An OK is kept too: the same warning behind it is told again.
            last[status.name] = (level, status.message)
    return tuple(found)


def read_configuration(bag: Bag) -> dict[str, Any]:
    """Return the newest configuration in the bag, file name to content, empty if there is none.

    Raises:
        BagError: It is no JSON.
    """
    text = _newest_text(bag, CONFIGURATION)
    if text is None:
        return {}
    try:
        tree = json.loads(text)
    except ValueError as error:
        raise BagError(f"{bag.path}: {CONFIGURATION} is no JSON: {error}") from error
    return tree if isinstance(tree, dict) else {}


def read_configuration_digest(bag: Bag) -> str:
    """Return the digest that the twin controller gives the configuration, empty without one."""
    text = _newest_text(bag, CONFIGURATION)
    return "" if text is None else hashlib.sha256(text.encode()).hexdigest()[:12]


def read_plant(bag: Bag) -> RecordedPlant | None:
    """Return the plant of a recording; None if no stand-in said it: an older bag or a real robot.

    Raises:
        BagError: The text is not understood.
    """
    text = _newest_text(bag, PLANT)
    try:
        return None if text is None else parse_plant(text)
    except PlantError as error:
        raise BagError(f"{bag.path}: {error}") from error


def _newest_text(bag: Bag, topic: str) -> str | None:
    """Return the last string of a topic, None if there is none."""
    texts = [str(message.data) for _, message in bag.messages(topic)]
    return texts[-1] if texts else None


def read_predictions(bag: Bag) -> tuple[Foretold, ...]:
    """Return the motions that were judged and have ended, in order; an older bag has none.

    Raises:
        BagError: A message cannot be read.
    """
    return tuple(_foretold(at - bag.start, said) for at, said in bag.messages(PREDICTIONS))


def _foretold(at: float, said: Any) -> Foretold:
    """Convert a scara_msgs/MotionOutcome."""
    return Foretold(
        at,
        said.what,
        said.end,
        Both(said.time_predicted, said.time_measured),
        Both(said.way_predicted, said.way_measured),
        Both(_most(said.effort_predicted), _most(said.effort_measured)),
        said.drift,
    )


def _most(efforts: Sequence[float]) -> float | None:
    """Return the largest effort of all joints; None if none was heard."""
    return float(max(efforts)) if len(efforts) else None
