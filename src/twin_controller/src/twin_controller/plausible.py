r"""Judge whether a reading can follow the one before it: nothing that has mass jumps.

Neither Modbus TCP nor JSON carries a checksum of its own, so a wrong value within its range can be recognised only by
what the robot could have done since. With :math:`\Delta t` the longer of the two clocks' spans plus ``SLACK`` a reading fits
if both clocks have gone on by the same, to ``CLOCK_STEP``, and if for each joint

.. math:: |q - q_0| \le k_v v_{max} \Delta t + r, \qquad |\dot q - \dot q_0| \le k_a a_{max} \Delta t + r / s,
   \qquad |q - q_0 - \dot q_0 \Delta t_r| \le \tfrac12 k_a a_{max} \Delta t^2 + |\dot q_0| s + r

with :math:`r` the resolution and :math:`s` the slack. A single reading that does not fit is refused; readings that go on
fitting each other mean that the robot or its clock has really jumped, and then nothing known of it holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import msgspec
from scara_config.robot import Joint

SLACK = 0.005
"""Added to each span [s]: a reading may be one period of the remote older than its clock says. Our choice."""
GAP = 0.3
"""After a longer silence [s] nothing is compared: the controller has forgotten that side too. Our choice."""
CLOCK_STEP = 1.0
"""How far [s] one span may differ between the clocks: a busy machine holds a robot's clock up. Our choice."""
SPEED_FACTOR = 1.5
"""Of the greatest speed; the same as for a single reading. Our choice."""
REAL_ACCELERATION = 4.0
"""Of the acceleration in robot.yaml: an emergency stop brakes twice as hard, and speeds are noisy. Our choice."""
TWIN_ACCELERATION = 40.0
"""The same for the twin, whose drives may push as hard as their effort allows. Our choice."""
RESOLUTION = 0.05
"""What a position may be off by rounding and noise, in the joint's border unit. Our choice."""
LASTING = 3
"""So many readings in a row that fit each other, but not what was before, are a jump. Our choice."""
MOST_REFUSED = 8
"""After so many refused readings in a row, whatever they are, the last good one says nothing any more. Our choice."""


class Reading(msgspec.Struct, frozen=True):
    """One reading: joints in SI, the remote clock at which they were true and ours at which they came [s]."""

    q: tuple[float, ...]
    qdot: tuple[float, ...]
    remote: float
    local: float


class Verdict(Enum):
    """What becomes of a reading."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    JUMPED = "jumped"


class Plausibility(msgspec.Struct, frozen=True):
    """The last reading believed, and the ones since that were not.

    Attributes:
        suspect: The last refused reading.
        agreeing: So many refused readings in a row fit each other.
        refused: So many were refused in a row.
        reason: Why the last reading was refused, empty if it was not.
    """

    last: Reading | None = None
    suspect: Reading | None = None
    agreeing: int = 0
    refused: int = 0
    reason: str = ""


def judge(
    state: Plausibility, reading: Reading, joints: Sequence[Joint], acceleration: float = REAL_ACCELERATION, wrap: float = 0.0
) -> tuple[Plausibility, Verdict]:
    """Judge one reading.

    Args:
        state: What was read before.
        reading: The new reading; counts and finiteness are checked already.
        joints: The joints, in the order of the reading.
        acceleration: Largest acceleration, as a multiple of the one in robot.yaml.
        wrap: Where the remote clock begins again at 0 [s]; 0 if it never does.

    Returns:
        The new state with the reason of a refusal, and the verdict; after JUMPED judge the next one from a fresh state.
    """
    reason = _conflict(state.last, reading, joints, acceleration, wrap)
    if not reason:
        return Plausibility(last=reading), Verdict.ACCEPTED
    agrees = state.suspect is not None and not _conflict(state.suspect, reading, joints, acceleration, wrap)
    after = Plausibility(state.last, reading, state.agreeing + 1 if agrees else 1, state.refused + 1, reason)
    jumped = after.agreeing >= LASTING or after.refused >= MOST_REFUSED
    return after, Verdict.JUMPED if jumped else Verdict.REFUSED


def _conflict(before: Reading | None, reading: Reading, joints: Sequence[Joint], acceleration: float, wrap: float) -> str:
    """Return why ``reading`` cannot follow ``before``, or an empty text."""
    if before is None or reading.local - before.local > GAP:
        return ""
    local, remote = reading.local - before.local, reading.remote - before.remote
    if wrap and remote < -0.5 * wrap:
        remote += wrap
    if abs(remote - local) > CLOCK_STEP:
        return f"the clock went on by {remote:.3f} s in {local:.3f} s"
    rows = zip(joints, before.q, reading.q, before.qdot, reading.qdot)
    found = (_jump(joint, q1 - q0, v0, v1, remote, max(local, remote) + SLACK, acceleration) for joint, q0, q1, v0, v1 in rows)
    return next(filter(None, found), "")


def _jump(joint: Joint, step: float, v0: float, v1: float, remote: float, span: float, acceleration: float) -> str:
    """Return why a joint cannot have moved by ``step`` within ``span`` [s] while its speed went from v0 to v1."""
    resolution, limit = RESOLUTION * joint.scale, acceleration * joint.acceleration
    reach = SPEED_FACTOR * joint.velocity * span
    off = abs(step - v0 * max(remote, 0.0))
    if abs(step) > reach + resolution or off > 0.5 * limit * span**2 + abs(v0) * SLACK + resolution:
        return f"{joint.name} jumped by {abs(step) / joint.scale:.3f} {joint.unit} in {1e3 * span:.0f} ms"
    if abs(v1 - v0) > limit * span + resolution / SLACK:
        return f"{joint.name} changed its speed by {abs(v1 - v0) / joint.scale:.1f} {joint.unit}/s in {1e3 * span:.0f} ms"
    return ""
