"""Turn bags into tracks of one mechanism.

Each is an experiment between its markers, or the whole recording.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from cell_recorder.reading.bag_reader_io import open_bag
from scara_config import Robot, load_robot
from scara_control.kinematics.screws import ScrewModel, tool_positions
from twin_experiments.config import ExperimentsFile, load_experiments
from twin_experiments.metrics.tracks import Mechanism, Track, first_to_move
from twin_experiments.report.configuration import ROBOT, choose
from twin_experiments.report.record import WHOLE, RecordError, Span, cut, find_spans
from twin_experiments.report.run_reader_io import (
    MARKER,
    MEASURED,
    REAL,
    TWIN,
    read_configuration,
    read_leader,
)

from twin_analysis.compare.joint_topics_io import JointTopic, read_joint_topic


@dataclass(frozen=True)
class Topics:
    """Which topics hold the sides.

    ``real`` None: the ground truth if it was recorded, else what was measured.
    """

    real: str | None = None
    twin: str = TWIN


@dataclass(frozen=True)
class Opened:
    """One bag read: both sides, experiments, profile and remarks.

    ``has_profile`` is False where the profile is this machine's, because the bag holds none.
    ``leader``: of a recording without marks, the side that the controller named first as the one
    that leads; empty: it named none.
    """

    label: str
    real: JointTopic
    twin: JointTopic
    spans: tuple[Span, ...]
    leader: str
    robot: Robot
    has_profile: bool
    experiments: ExperimentsFile
    repaired: bool
    missing: tuple[str, ...]


def read_bag(path: Path, label: str, topics: Topics, config_directory: Path | None) -> Opened:
    """Read what a comparison needs of one bag.

    Raises:
        BagError: It cannot be read, or lacks a topic.
        RecordError: What is in it cannot be used.
        ConfigError: A configuration file is wrong.
    """
    with open_bag(path) as bag:
        here = load_robot(config_directory)
        recorded = read_configuration(bag)
        chosen = choose(recorded, here, load_experiments(here, config_directory))
        real = topics.real or (REAL if bag.count(REAL) else MEASURED)
        # One experiment over everything if nothing was marked.
        spans: tuple[Span, ...] = (Span(WHOLE, -math.inf, math.inf, True, marked=False),)
        if bag.count(MARKER):
            markers = [(at - bag.start, message.data) for at, message in bag.messages(MARKER)]
            spans = find_spans(markers, bag.end - bag.start)
        sides = (
            read_joint_topic(bag, real, "real"),
            read_joint_topic(bag, topics.twin, "twin"),
        )
        return Opened(
            label=label,
            real=sides[0],
            twin=sides[1],
            spans=spans,
            leader="" if bag.count(MARKER) else read_leader(bag),
            robot=chosen.robot,
            has_profile=ROBOT in recorded,
            experiments=chosen.experiments,
            repaired=bag.repaired,
            # Only who has read them knows what is missing of them.
            missing=tuple(bag.missing),
        )


def find_mechanism(opened: Sequence[Opened]) -> Mechanism:
    """Return the joints that all sides of all bags have; with kinematics if the profile fits.

    This machine's profile, by which a first bag without one is read, fits no robot that has a joint
    which it does not know.

    Raises:
        RecordError: They have none in common; what each has is named. Or a bag is of another robot
            than the first one, by whose profile all are read.
    """
    robot = opened[0].robot
    sides = [topic for bag in opened for topic in (bag.real, bag.twin)]
    common = [name for name in sides[0].names if all(name in side.names for side in sides)]
    if not common:
        held = "; ".join(
            f"{bag.label} {t.topic}: {', '.join(t.names)}"
            for bag in opened
            for t in (bag.real, bag.twin)
        )
        raise RecordError(f"no joint is in all of them: {held}")
    for bag in opened[1:]:
        kinds = [kind_of(each, common) for each in (bag.robot, robot)]
        if bag.has_profile and kinds[0] != kinds[1]:
            whose = "" if opened[0].has_profile else ", by this machine's profile"
            raise RecordError(
                f"{bag.label} was recorded of {kinds[0]}, {opened[0].label} of {kinds[1]}{whose}: "
                "only recordings of one robot can be held together"
            )
    profile = [joint for joint in robot.twin_joints if joint.name in common]
    ours = {joint.name for joint in robot.joints}
    # Without a profile of its own, who has a joint more is another robot, whose names mean nothing.
    stranger = not opened[0].has_profile and any(not ours.issuperset(s.names) for s in sides)
    if stranger or not profile:
        return Mechanism(tuple(common), None, (), None)
    names = tuple(joint.name for joint in profile)
    arm = [joint.name for joint in robot.arm_joints]
    if not set(arm) <= set(names):
        return Mechanism(names, tuple(profile), (), None)
    columns = tuple(names.index(name) for name in arm)
    return Mechanism(
        names, tuple(profile), columns, partial(tool_positions, ScrewModel.from_robot(robot))
    )


def kind_of(robot: Robot, names: Sequence[str]) -> str:
    """Return in words what has to be alike: a robot's name, and which of some joints slide."""
    sliding = sorted(j.name for j in robot.joints if j.name in names and j.si_unit == "m")
    return f"{robot.name} (sliding: {', '.join(sliding) or 'none'})"


def lengths_of(robot: Robot) -> list[list[float]]:
    """Return what says where the tool is: its home pose and the screw axes, to 1 um."""
    rows = [*robot.home_pose, *(joint.screw_axis or () for joint in robot.arm_joints)]
    return [[round(value, 6) for value in row] for row in rows]


def tracks_of(
    opened: Opened, mechanism: Mechanism, percent: float
) -> tuple[list[Track], list[tuple[str, str]]]:
    """Return the experiments of one bag; and the names of others, with why they are not there.

    Args:
        opened: The bag.
        mechanism: The joints.
        percent: Speed from which a joint moves, of its largest.

    Raises:
        RecordError: A value is not finite.
    """
    real, twin = (
        opened.real.motion("real", mechanism.names),
        opened.twin.motion("twin", mechanism.names),
    )
    notes = (*opened.real.notes, *opened.twin.notes)
    found: list[Track] = []
    lost: list[tuple[str, str]] = []
    for span in opened.spans:
        try:
            sides = (cut(real, span.start, span.end), cut(twin, span.start, span.end))
        # The recording may have ended as this one began: the others are whole.
        except RecordError as error:
            lost.append((span.label, f"{opened.label}: {error}"))
            continue
        # Who led: by the experiment's definition, else as the controller said, else by the motion.
        experiment = opened.experiments.experiments.get(span.name)
        if experiment is not None:
            leader: str = experiment.leader
        else:
            speeds = mechanism.moving_speeds(sides, percent)
            leader = opened.leader or first_to_move(*sides, speeds)
        when = (span.start, span.end)
        found.append(Track(opened.label, span.label, leader, *sides, notes, *when, span.finished))
    return found, lost
