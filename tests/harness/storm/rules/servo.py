"""How fast a drive gets that is told a speed at once: a model of our own, by a plant's numbers."""

from __future__ import annotations

from functools import cache

from harness.storm.rules.history import Joint

STEP_S = 5e-4
SETTLES_S = 1.0
"""What a drive makes of a new speed is over by then."""


@cache
def fastest(joint: Joint, told: float, before: float = 0.0) -> float:
    """Return the largest speed of a joint, as a part of its greatest, when it is told another one.

    The command goes to the new speed by the acceleration that the drive takes. A motor that has
    less falls behind, and is faster than its command while it catches up.

    Args:
        joint: Its limits and its servo.
        told: The speed that it is told, as a part of its greatest, positive.
        before: The one before, with which it moves; negative: the other way.
    """
    servo = joint.servo
    if servo is None:
        return told
    stiffness, friction = servo.frequency**2, 2.0 * servo.damping * servo.frequency
    speed = command = before * joint.velocity
    # So far it is behind a command that goes on at that speed.
    behind = friction * (1.0 - servo.feedforward) * speed / stiffness
    ramp, limit, most = servo.command_acceleration * STEP_S, servo.servo_acceleration, 0.0
    for _ in range(round(SETTLES_S / STEP_S)):
        command = min(command + ramp, told * joint.velocity)
        force = stiffness * behind + friction * (servo.feedforward * command - speed)
        speed += min(max(force, -limit), limit) * STEP_S
        speed = min(max(speed, -joint.velocity), joint.velocity)
        behind += (command - speed) * STEP_S
        most = max(most, speed)
    return max(told, most / joint.velocity)
