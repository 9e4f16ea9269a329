"""Read joint states from any bag: of this cell, or of somebody else's robot."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, BagError
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.report.record import RecordError, build_side
from twin_experiments.report.run_reader_io import seconds_since

JOINT_STATE = "sensor_msgs/msg/JointState"
MOST_NAMED = 8


@dataclass(frozen=True)
class JointTopic:
    """What a topic of joint states holds.

    It has the joints of most messages, times [s] since the bag's start, values, remarks.
    """

    topic: str
    names: tuple[str, ...]
    stamps: Array
    positions: Array
    velocities: Array | None
    notes: tuple[str, ...]

    def motion(self, side: str, names: tuple[str, ...]) -> Motion:
        """Return the motion of the joints ``names``; missing velocities are differentiated.

        Raises:
            RecordError: Less than two samples, or a value is not finite.
        """
        columns = [self.names.index(name) for name in names]
        positions = self.positions[:, columns]
        # A slope needs times that go on; the others are left out with their samples.
        rising = np.concatenate(([True], np.diff(np.maximum.accumulate(self.stamps)) > 0.0))
        if self.velocities is not None:
            velocities = self.velocities[:, columns]
        elif rising.sum() > 1:
            velocities = np.zeros_like(positions)
            velocities[rising] = np.gradient(positions[rising], self.stamps[rising], axis=0)
        else:
            velocities = np.zeros_like(positions)
        return build_side(side, self.stamps, positions, velocities)


def read_joint_topic(bag: Bag, topic: str, side: str) -> JointTopic:
    """Read a topic of joint states.

    Args:
        bag: An open bag.
        topic: Name, relative or absolute.
        side: ``real`` or ``twin``, for the text of errors.

    Raises:
        BagError: The topic is not in the bag, or holds something else; what the bag has is named.
        RecordError: Its messages are empty or inconsistent.
    """
    # Refuse a topic that is missing or of another type, naming those that would do
    suitable = [name for name in bag.topics if bag.kind(name) == JOINT_STATE]
    others = list(bag.topics)
    more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
    some = (", ".join(others[:MOST_NAMED]) or "nothing") + more
    held = ", ".join(suitable) or f"none; it has {some}"
    option = f"--{side}-topic"
    if not bag.count(topic):
        raise BagError(
            f"{bag.path}: no message of {topic} ({option}); "
            f"topics of joint states in the bag: {held}"
        )
    if bag.kind(topic) != JOINT_STATE:
        raise BagError(
            f"{bag.path}: {topic} ({option}) is {bag.kind(topic)}; "
            f"topics of joint states in the bag: {held}"
        )
    rows = [(at - bag.start, message) for at, message in bag.messages(topic)]
    # Several nodes may publish on one topic, each its own joints.
    kinds = Counter(tuple(message.name) for _, message in rows)
    names, count = kinds.most_common(1)[0]
    rows = [(at, message) for at, message in rows if tuple(message.name) == names]
    if not names or any(len(message.position) != len(names) for _, message in rows):
        raise RecordError(
            f"{bag.path}: {topic}: joint states without names, "
            "or with other than one position for each name"
        )
    notes = []
    if len(kinds) > 1:
        notes.append(
            f"{topic}: {sum(kinds.values()) - count} messages with other joints than "
            f"{', '.join(names)} are left out"
        )
    # Far in the past if they have none.
    stamps = np.array([seconds_since(message.header.stamp, bag.start) for _, message in rows])
    if (stamps < -1e6).any():
        stamps = np.array([at for at, _ in rows])
        notes.append(f"{topic}: no stamps, times of receipt are used")
    velocities = None
    if all(len(message.velocity) == len(names) for _, message in rows):
        velocities = np.array([message.velocity for _, message in rows])
    else:
        notes.append(f"{topic}: no velocities, positions are differentiated")
    return JointTopic(
        topic,
        names,
        stamps,
        np.array([message.position for _, message in rows]),
        velocities,
        tuple(notes),
    )
