r"""Judge whether a reading can follow the one before it: nothing that has mass jumps.

Neither Modbus TCP nor JSON carries a checksum of its own, so a wrong value within its range can be
recognised only by what the robot could have done since. A reading fits the one before if its clock
did not go back and shows no time that has not been yet: readings come late, never early. ``late``
is by how much the last one was later than the promptest of the last seconds. And with
:math:`\Delta t` the longer of the two clocks' spans plus ``SLACK`` each joint must obey

.. math:: |q - q_0| \le k_v v_{max} \Delta t + r,
   \qquad |\dot q - \dot q_0| \le k_a a_{max} \Delta t + r / s,
   \qquad |q - q_0 - \dot q_0 \Delta t_r| \le \tfrac12 k_a a_{max} \Delta t^2 + |\dot q_0| s + r

with :math:`r` the resolution and :math:`s` the slack; of a robot that tells no speeds only the
first. A single reading that does not fit is
refused. Readings that go on fitting each other mean that the robot or its clock has really jumped,
and then nothing known of it holds. The first reading has none before it: it counts once a second
one fits it.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import msgspec
from scara_config.robot import Joint
from scara_control.joint_motion import JointMotion

SLACK = 0.005
"""Added to each span [s]: a reading may be one period of the remote older than its clock says.

Our choice."""
GAP = 0.3
"""After a longer silence [s] nothing is compared: the controller has forgotten that side too.

Our choice."""
EARLY = 0.03
"""How much [s] a reading may be prompter than the promptest so far.

Our choice: a line may get better by this much."""
LATEST = 1.0
"""A reading later than this [s] is none of now. Our choice."""
FIRST_LATE = 0.05
"""How late [s] the first reading may have been: a connection begins with much to do. Our choice."""
FORGET = 5.0
"""Time [s] after which the promptest reading no longer counts: clocks drift, ways change.

Our choice."""
SPEED_FACTOR = 1.5
"""Of the greatest speed; the same as for a single reading. Our choice."""
REAL_ACCELERATION = 4.0
"""Of the acceleration in robot.yaml: an emergency stop brakes twice as hard, speeds are noisy.

Our choice."""
TWIN_ACCELERATION = 40.0
"""The same for the twin, whose drives may push as hard as their effort allows. Our choice."""
RESOLUTION = 0.05
"""What a position may be off by rounding and noise, in the joint's border unit. Our choice."""
LASTING = 3
"""This many readings in a row that fit each other, but not what was before, are a jump.

Our choice."""
MOST_REFUSED = 8
"""After this many refused readings in a row, whatever they are, the last good one is of no use.

Our choice."""


class Reading(msgspec.Struct, frozen=True):
    """One reading: the joints at a time of the remote clock, and when it came, of ours [s]."""

    motion: JointMotion
    local: float


class Verdict(Enum):
    """What becomes of a reading."""

    FIRST = "first"
    ACCEPTED = "accepted"
    REFUSED = "refused"
    JUMPED = "jumped"


class Plausibility(msgspec.Struct, frozen=True):
    """The last reading believed, and the ones since that were not.

    Attributes:
        suspect: The last reading that was refused, or the first one.
        agreeing: So many refused readings in a row fit each other.
        refused: So many were refused in a row.
        reason: Why the last reading was refused, empty if it was not.
        late: How much later the last reading was than the promptest one [s].
    """

    last: Reading | None = None
    suspect: Reading | None = None
    agreeing: int = 0
    refused: int = 0
    reason: str = ""
    late: float = FIRST_LATE


def judge(
    state: Plausibility,
    reading: Reading,
    joints: Sequence[Joint],
    acceleration: float = REAL_ACCELERATION,
    wrap: float = 0.0,
) -> tuple[Plausibility, Verdict]:
    """Judge one reading.

    Args:
        state: What was read before.
        reading: The new reading; counts and finiteness are checked already.
        joints: The joints, in the order of the reading.
        acceleration: Largest acceleration, as a multiple of the one in robot.yaml.
        wrap: Where the remote clock begins again at 0 [s]; 0 if it never does.

    Returns:
        The new state with the reason of a refusal, and the verdict. After JUMPED judge the next one
        from a fresh state.
    """
    follows = _Follows(joints, acceleration, wrap)
    if state.last is None or reading.local - state.last.local > GAP:
        if (
            state.last is None
            and state.suspect
            and not follows.conflict(state.suspect, reading, FIRST_LATE)
        ):
            return Plausibility(
                last=reading, late=follows.lateness(state.suspect, reading, FIRST_LATE)
            ), Verdict.ACCEPTED
        return Plausibility(suspect=reading), Verdict.FIRST
    reason = follows.conflict(state.last, reading, state.late)
    if not reason:
        return Plausibility(
            last=reading, late=follows.lateness(state.last, reading, state.late)
        ), Verdict.ACCEPTED
    agrees = state.suspect is not None and not follows.conflict(state.suspect, reading, FIRST_LATE)
    after = Plausibility(
        state.last,
        reading,
        state.agreeing + 1 if agrees else 1,
        state.refused + 1,
        reason,
        state.late,
    )
    jumped = after.agreeing >= LASTING or after.refused >= MOST_REFUSED
    return after, Verdict.JUMPED if jumped else Verdict.REFUSED


class _Follows(msgspec.Struct, frozen=True):
    """Whether one reading can follow another."""

    joints: Sequence[Joint]
    acceleration: float
    wrap: float

    def spans(self, before: Reading, reading: Reading) -> tuple[float, float]:
        """Return by how much our clock and the remote one went on."""
        remote = reading.motion.time - before.motion.time
        # Back by more than half of its range: the clock has begun again at 0.
        if self.wrap and remote < -0.5 * self.wrap:
            remote += self.wrap
        return reading.local - before.local, remote

    def lateness(self, before: Reading, reading: Reading, late: float) -> float:
        """Return how late ``reading`` is, when the one before was ``late``."""
        local, remote = self.spans(before, reading)
        return max(late + local - remote, 0.0) * max(1.0 - local / FORGET, 0.0)

    def conflict(self, before: Reading, reading: Reading, late: float) -> str:
        """Return why ``reading`` cannot follow ``before``, or an empty text."""
        local, remote = self.spans(before, reading)
        if remote < 0.0 or not -EARLY <= late + local - remote <= LATEST:
            return f"the clock went on by {remote:.3f} s in {local:.3f} s"
        span = max(local, remote) + SLACK
        old, new = before.motion, reading.motion
        unknown = (None,) * len(self.joints)
        rows = zip(self.joints, old.q, new.q, old.qdot or unknown, new.qdot or unknown)
        found = (
            _jump(joint, q1 - q0, v0, v1, remote, span, self.acceleration)
            for joint, q0, q1, v0, v1 in rows
        )
        return next(filter(None, found), "")


def _jump(
    joint: Joint,
    step: float,
    v0: float | None,
    v1: float | None,
    remote: float,
    span: float,
    acceleration: float,
) -> str:
    """Return why a joint cannot have moved by ``step`` within ``span`` [s].

    Its speed went from ``v0`` to ``v1`` meanwhile; None: it tells none.
    """
    resolution, limit = RESOLUTION * joint.scale, acceleration * joint.acceleration
    far = abs(step) > SPEED_FACTOR * joint.velocity * span + resolution
    if v0 is not None:
        off = abs(step - v0 * remote)
        far = far or off > 0.5 * limit * span**2 + abs(v0) * SLACK + resolution
    if far:
        moved = f"{abs(step) / joint.scale:.3f} {joint.unit}"
        return f"{joint.name} jumped by {moved} in {1e3 * span:.0f} ms"
    if v0 is None or v1 is None:
        return ""
    if abs(v1 - v0) > limit * span + resolution / SLACK:
        change = f"{abs(v1 - v0) / joint.scale:.1f} {joint.unit}/s"
        return f"{joint.name} changed its speed by {change} in {1e3 * span:.0f} ms"
    return ""
