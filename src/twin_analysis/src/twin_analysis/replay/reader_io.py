"""Read from a bag what a replay in front of a live twin needs.

It tells how the real side moved, when a program ran, and what was marked.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, open_bag
from twin_controller.core.events import RealMeasured
from twin_controller.core.sides.clock import unwrap_ms
from twin_controller.reporting.snapshots import decode_events
from twin_experiments.metrics.series import Mask, Motion
from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.record import RecordError
from twin_experiments.report.run_reader_io import MEASURED

from twin_analysis.compare.joint_topics_io import JointTopic, read_joint_topic
from twin_analysis.replay.decision_reader_io import INPUTS

FEWEST = 10
JUMPED_S, BACK_S = 3.0, 1.0
"""So far [s] the robot's clock may differ from ours between two answers, and go back. Our choice: a
clock that drifts by 200 ppm needs hours for it, and an overtaken answer is less late."""


def read_real(
    path: Path, mechanism: Mechanism, topic: str | None
) -> tuple[Motion, Mask | None, str]:
    """Read the real side as the twin controller saw it.

    From a topic of joint states if it is named, or nothing else is there.

    Args:
        path: The bag.
        mechanism: Joints, all of the twin's.
        topic: Joint states to be played instead.

    Returns:
        The motion by time since the bag's start [s], when a program ran (None: nobody says), and
        the topic that it was read from.

    Raises:
        BagError: The bag cannot be read, or a topic is missing.
        RecordError: The samples cannot be used.
    """
    with open_bag(path) as bag:
        if topic is None and bag.count(INPUTS):
            found = _read_samples(bag, mechanism.names)
            if found is not None:
                return *found, INPUTS
        chosen = topic or MEASURED
        motion = read_joint_topic(bag, chosen, "real").motion("real", mechanism.names)
        return motion, None, chosen


def _read_samples(bag: Bag, names: tuple[str, ...]) -> tuple[Motion, Mask] | None:
    """Return the readings of the robot among the inputs, by its own clock, and when a program ran.

    None if there are hardly any.
    """
    rows: list[tuple[float, int, RealMeasured]] = []
    for at, message in bag.messages(INPUTS):
        for event in decode_events(message.data.tobytes()):
            if isinstance(event, RealMeasured):
                before = rows[-1] if rows else None
                clock_ms = unwrap_ms(before[1] if before else None, event.clock_ms)
                if before is not None:
                    went = 1e-3 * (clock_ms - before[1])
                    passed = event.received - before[2].received
                    # In a silence both clocks go on; one that was started anew begins at 0.
                    if went < -BACK_S or abs(went - passed) > JUMPED_S:
                        raise RecordError(
                            f"{bag.path}: at {at - bag.start:.2f} s the robot's clock went by "
                            f"{went:.2f} s in {passed:.2f} s: it was started anew or set. "
                            f"--real-topic {MEASURED} plays what the controller published"
                        )
                rows.append((at - bag.start, clock_ms, event))
    if len(rows) < FEWEST:
        return None
    times = np.array([1e-3 * (clock_ms - rows[0][1]) for _, clock_ms, _ in rows])
    delays = np.array([at for at, _, _ in rows]) - times
    # The answer that was quickest tells best when the robot's clock showed what.
    stamps = times + delays.min()
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(stamps)) > 0.0))
    motions = [event.motion for _, _, event in rows]
    positions = np.array([m.q for m in motions])
    # Of a robot that tells no velocities the positions are differentiated.
    velocities = np.array([m.qdot for m in motions]) if all(m.qdot for m in motions) else None
    running = np.array([event.own_program or event.streaming for _, _, event in rows])
    samples = JointTopic(INPUTS, names, stamps, positions, velocities, ())
    # As samples that do not go forward are left out of the motion.
    return samples.motion("real", names), running[rising]
