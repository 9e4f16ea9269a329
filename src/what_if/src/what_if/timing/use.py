"""What a motion asks of the joints and how fast the arm's points get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scara_config import Joint
from scara_control.dynamics.effort import DynamicModel
from scara_control.keep_out.points import WatchedPoint, all_positions, speed_points

from what_if.geometry.bodies import FloatArray
from what_if.timing.leg import Course


@dataclass(frozen=True)
class Use:
    """The largest demands of a course.

    Attributes:
        speed: Largest share of each joint's speed, shape (n,).
        acceleration: Likewise.
        effort: Likewise.
        speed_at: When the largest share of speed is asked for, from the course's begin [s].
        effort_at: Likewise of effort.
        point_speed: Largest speed of a watched point [m/s].
        point: Its name.
        work: Mechanical work of the joints [J].
    """

    speed: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    speed_at: float
    effort_at: float
    point_speed: float
    point: str
    work: float


def use_of(
    joints: Sequence[Joint], points: Sequence[WatchedPoint], model: DynamicModel, course: Course
) -> Use:
    r"""Look at a course at all its times.

    The work is that of the joints where they drive,
    :math:`\int \sum_i \max(0, \tau_i \dot q_i)\,dt`, with the efforts of inertia, velocity
    coupling, gravity, damping and dry friction: what braking would give back counts as heat.

    Args:
        joints: The twin's joints.
        points: The points whose speed counts.
        model: Dynamics of the arm with what it carries.
        course: At least one time.
    """
    # The efforts at all times, shape (m, n)
    damping, friction = np.array(model.damping), np.array(model.friction)
    rigid = np.array(
        [
            model.inverse_dynamics(q, qdot, qddot)
            for q, qdot, qddot in zip(
                course.q.tolist(), course.qdot.tolist(), course.qddot.tolist()
            )
        ]
    )
    efforts: FloatArray = rigid + damping * course.qdot + friction * np.sign(course.qdot)
    shares = [
        np.abs(values) / np.array([getattr(joint, name) for joint in joints])
        for values, name in (
            (course.qdot, "velocity"),
            (course.qddot, "acceleration"),
            (efforts, "effort"),
        )
    ]
    power = np.sum(np.maximum(efforts * course.qdot, 0.0), axis=1)
    steps = np.diff(course.times)
    speed_at, _, effort_at = (float(course.times[k.max(axis=1).argmax()]) for k in shares)
    fastest, point = _point_speed(speed_points(points), course)
    return Use(
        shares[0].max(axis=0),
        shares[1].max(axis=0),
        shares[2].max(axis=0),
        speed_at,
        effort_at,
        fastest,
        point,
        float(np.sum(0.5 * (power[1:] + power[:-1]) * steps)),
    )


def _point_speed(points: Sequence[WatchedPoint], course: Course) -> tuple[float, str]:
    """Return the largest speed of a point [m/s], and which one."""
    if len(course.times) < 2 or not points:
        return 0.0, ""
    ways = np.linalg.norm(np.diff(all_positions(points, course.q), axis=1), axis=2)
    steps = np.diff(course.times)
    # A way to where the joints are takes no time.
    speeds = np.divide(ways, steps, out=np.zeros_like(ways), where=steps > 0.0)
    largest = speeds.max(axis=1)
    number = int(np.argmax(largest))
    return float(largest[number]), points[number].name
