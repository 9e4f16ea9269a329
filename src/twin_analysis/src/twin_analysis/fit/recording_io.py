"""What a fit reads from a bag: the stream the twin got, and where the robot was."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from cell_recorder.reading.bag_reader_io import Bag, BagError
from ruamel.yaml import YAML
from scara_control.joint_motion import JointMotion
from scipy.interpolate import CubicHermiteSpline
from twin_experiments.metrics.series import SampleGap, gaps_between, known_at
from twin_experiments.report.run_reader_io import read_configuration

from twin_analysis.fit.offline_twin_io import Packet
from twin_analysis.fit.twin_model import FloatArray

replace = msgspec.structs.replace

FOLLOW, TRUTH, MEASURED = "joint_pose_controller/follow", "real/ground_truth", "real/joint_states"
GAP_S = 0.5
"""A stream that pauses for longer begins anew. Our choice."""
SETTLE_S = 0.3
"""So long behind a hole of the stream the twin is taken to catch up with it. Our choice."""


class Recording(msgspec.Struct, frozen=True):
    """One stretch in which the twin followed the robot; times count from its begin [s].

    Attributes:
        packets: The stream.
        delay: Delay of the robot's registers that the stamps were made with [s], None if the bag
            does not tell.
        truth: True if the robot's positions are ground truth; else they are what the controller
            measured and dated.
        times: Instants (m,), rising; those in holes are left out.
        real: The robot's joints at these instants (m, n), the twin's order, SI.
        moved: For each joint how far it moved, SI.
    """

    packets: tuple[Packet, ...]
    delay: float | None
    truth: bool
    times: FloatArray
    real: FloatArray
    moved: tuple[float, ...]

    @property
    def duration(self) -> float:
        """Length of the stretch [s]."""
        return float(self.times[-1])


def check_robot(bag: Bag, name: str) -> None:
    """Refuse a recording of another robot.

    Args:
        bag: The bag; one that holds no robot.yaml is taken.
        name: Of the robot that is fitted.

    Raises:
        BagError: It was recorded of another one.
    """
    recorded = _recorded(bag, "robot.yaml").get("name", name)
    if recorded != name:
        raise BagError(
            f"{bag.path}: recorded of {recorded}; this is {name}: "
            f"fit it with SCARA_ROBOT={recorded}"
        )


def read_recording(bag: Bag, joints: Sequence[str], step: float, longest_gap: float) -> Recording:
    """Read the longest uninterrupted stretch of following.

    Args:
        bag: The bag of a run in which the real robot led.
        joints: The twin's joints.
        step: Distance of the instants [s].
        longest_gap: Packets or positions further apart than this [s] leave a hole. Its instants are
            left out, behind one of the packets those of :data:`SETTLE_S` too.

    Raises:
        BagError: There is no stream, or the robot's positions are missing, or begin after it, or
            are not known where it begins, or one of the two lacks a joint.
    """
    bag.require([FOLLOW])
    origin = bag.start
    packets = [
        packet
        for packet in (
            _packet(bag, at, message, joints, origin) for at, message in bag.messages(FOLLOW)
        )
        if packet
    ]
    stretch = _longest(packets)
    if len(stretch) < 10:
        raise BagError(
            f"{bag.path}: the twin did not follow in this recording: run the experiment real_leads"
        )
    begin, end = stretch[0].arrived - 1e-4, stretch[-1].arrived
    truth = bool(bag.count(TRUTH))
    topic = TRUTH if truth else MEASURED
    spline = _robot(bag, topic, joints, origin)
    times = np.arange(0.0, end - begin, step)
    inside = (times + begin >= spline.x[0]) & (times + begin <= spline.x[-1])
    if not inside[0]:
        raise BagError(
            f"{bag.path}: {topic} is recorded from {spline.x[0]:.2f} to {spline.x[-1]:.2f} s, but "
            f"the twin follows from {begin:.2f} s on: record both from the start"
        )
    # Through a hole of the packets the twin goes its own way, and then it hurries back: neither
    # shows how it follows. In a hole of the positions nobody knows any.
    arrived = np.array([packet.arrived for packet in stretch])
    holes = (
        *(
            SampleGap(gap.side, gap.start, gap.duration + SETTLE_S)
            for gap in gaps_between("twin", arrived, longest_gap)
        ),
        *gaps_between("real", spline.x, longest_gap),
    )
    known = inside & known_at(times + begin, holes)
    if not known[0]:
        raise BagError(
            f"{bag.path}: {topic} has a hole at {begin:.2f} s, where the twin begins to follow: "
            "record it again"
        )
    times = times[known]
    real = spline(times + begin)
    moved = tuple(float(value) for value in np.ptp(real, axis=0))
    shifted = tuple(
        Packet(p.arrived - begin, tuple(replace(m, time=m.time - begin) for m in p.motions))
        for p in stretch
    )
    return Recording(shifted, _delay(bag), truth, times, real, moved)


def _delay(bag: Bag) -> float | None:
    """Return the delay in the recorded twin_controller.yaml [s]."""
    value = _recorded(bag, "twin_controller.yaml").get("real", {}).get("sample_latency_ms")
    return None if value is None else float(value) * 1e-3


def _recorded(bag: Bag, name: str) -> Any:
    """Return the content of a recorded file; empty if the bag does not hold it."""
    return YAML(typ="safe").load(read_configuration(bag).get(name, "")) or {}


def _columns(bag: Bag, topic: str, held: Sequence[str], joints: Sequence[str]) -> list[int]:
    """Return where in a message of a topic the joints are."""
    held = list(held)
    if not set(joints) <= set(held):
        raise BagError(
            f"{bag.path}: {topic} has {', '.join(held) or 'no joints'}; the twin of this robot has "
            f"{', '.join(joints)}"
        )
    return [held.index(name) for name in joints]


def _packet(
    bag: Bag, at: float, message: Any, joints: Sequence[str], origin: float
) -> Packet | None:
    """Convert one message; None for the end of a stream."""
    points = message.points
    if not points:
        return None
    order = _columns(bag, FOLLOW, message.joint_names, joints)
    stamp = message.header.stamp
    # Whole seconds first: a double of the seconds since 1970 resolves 0.2 us at best.
    stamped = (stamp.sec - int(origin)) + stamp.nanosec * 1e-9 - (origin - int(origin))
    motions = []
    for point in points:
        q, qdot, qddot = (
            tuple(float(values[k]) for k in order)
            for values in (point.positions, point.velocities, point.accelerations)
        )
        after = point.time_from_start
        motions.append(JointMotion(q, qdot, qddot, stamped + after.sec + after.nanosec * 1e-9))
    return Packet(at - origin, tuple(motions))


def _longest(packets: Sequence[Packet]) -> list[Packet]:
    """Return the longest run of packets without a gap."""
    best: list[Packet] = []
    current: list[Packet] = []
    for packet in packets:
        if current and packet.arrived - current[-1].arrived > GAP_S:
            current = []
        current.append(packet)
        best = current if len(current) > len(best) else best
    return best


def _robot(bag: Bag, topic: str, joints: Sequence[str], origin: float) -> CubicHermiteSpline:
    """Return the robot's joints over time."""
    bag.require([topic])
    stamps: list[float] = []
    positions: list[list[float]] = []
    velocities: list[list[float]] = []
    for _, message in bag.messages(topic):
        order = _columns(bag, topic, message.name, joints)
        stamp = message.header.stamp
        at = (stamp.sec - int(origin)) + stamp.nanosec * 1e-9 - (origin - int(origin))
        # A spline needs rising times.
        if stamps and at <= stamps[-1]:
            continue
        stamps.append(at)
        positions.append([message.position[k] for k in order])
        velocities.append([message.velocity[k] for k in order])
    return CubicHermiteSpline(np.array(stamps), np.array(positions), np.array(velocities))
