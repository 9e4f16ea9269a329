"""The last hundredths of a millimetre of move_to, and the bookkeeping of its requests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_control.config import MotionConfig
from scara_control.joint_motion import Vector
from scara_control.kinematics.tool import ToolKinematics
from scara_control.motion.commands import MotionRefusedError

_EASING, _LEAST_EASE = 0.7, 0.15
"""Gain after each overshoot, and the least that is left of it (our choice: settles with up to 0.15
s of delay)."""


@dataclass(frozen=True, slots=True)
class TrimStep:
    """What to do now.

    Attributes:
        qdot: Joint velocities, shape (n,).
        error: How far the tool is from the point [m].
        yaw_error: How far it is turned from where it shall be [rad]; 0 where nobody can choose it.
    """

    qdot: tuple[float, ...]
    error: float
    yaw_error: float


def tool_error(tool: ToolKinematics, q: Sequence[float], point: Sequence[float]) -> float:
    """Return the distance of the tool from ``point`` [m]."""
    return math.dist(tool.position(q), point)


def yaw_error(tool: ToolKinematics, q: Sequence[float], target: Sequence[float]) -> float:
    """Return how far the tool must turn to be as at ``target``, in (-pi, pi] [rad].

    0 where the tool's yaw cannot be chosen.
    """
    return math.remainder(tool.yaw(target) - tool.yaw(q), math.tau) if tool.turns else 0.0


class Trim:
    r"""Small joint velocities towards a point, in spite of friction.

    .. math:: \dot q_w = J^{-1} k (p - p(q), \psi - \psi(q)),
        \quad \text{near the straight arm } \dot q_w = k (q_{target} - q)

    There the tool's error says little about the joints, so theirs is used instead. A velocity loop
    does not break a joint loose for the smallest velocities; what the joint is slower than wanted
    is therefore integrated and added:

    .. math:: \dot q = \dot q_w + k_i \int (\dot q_w - \dot q_{measured}) dt

    Each time a joint has run past its target its gain is eased, so that a slow machine only makes
    the trim slower.
    """

    def __init__(
        self,
        tool: ToolKinematics,
        target: Sequence[float],
        point: Sequence[float],
        config: MotionConfig,
    ) -> None:
        """Begin a trim.

        Args:
            tool: The arm.
            target: Joint positions of the point, shape ``(n,)``.
            point: Where the tool shall be [m].
            config: Gains, largest speeds, tolerance.
        """
        self._tool, self._target, self._point = tool, tuple(target), tuple(point)
        self._config = config.trim
        self._fastest = tuple(
            joint.velocity * config.jog.speed_percent / 100.0 for joint in tool.joints
        )
        self._most_added = tuple(
            joint.velocity * config.trim.breakaway_percent / 100.0 for joint in tool.joints
        )
        self._added = [0.0] * len(tool.joints)
        self._ease = [1.0] * len(tool.joints)

    def step(self, q: Sequence[float], qdot: Sequence[float], dt: float) -> TrimStep:
        """Return what to do now; no velocity once within the tolerance.

        Args:
            q: Measured joint positions, shape ``(n,)``.
            qdot: Measured joint velocities, shape ``(n,)``.
            dt: Time since the last step [s].
        """
        error = tool_error(self._tool, q, self._point)
        turn = yaw_error(self._tool, q, self._target)
        trim = self._config
        if error <= trim.tolerance_mm * 1e-3 and abs(turn) <= math.radians(trim.tolerance_deg):
            return TrimStep((0.0,) * len(q), error, turn)
        wanted = enumerate(self._wanted(q, turn))
        pushed = tuple([self._push(k, velocity, qdot[k], dt) for k, velocity in wanted])
        return TrimStep(pushed, error, turn)

    def _wanted(self, q: Sequence[float], turn: float) -> tuple[float, ...]:
        """Return the joint velocities towards the point.

        They are not faster than the tool and the joints may be.
        """
        trim, here = self._config, self._tool.position(q)
        solved = self._tool.joint_velocities(
            q, [trim.gain * (p - at) for p, at in zip(self._point, here)], trim.gain * turn
        )
        qdot = solved.qdot
        if solved.damped:
            qdot = tuple([trim.gain * (wanted - at) for wanted, at in zip(self._target, q)])
        slower = [trim.speed_mm_s * 1e-3 / max(math.hypot(*self._tool.velocity(q, qdot)), 1e-12)]
        slower += [
            fastest / max(abs(velocity), 1e-12) for fastest, velocity in zip(self._fastest, qdot)
        ]
        share = min(1.0, *slower)
        return tuple([velocity * share for velocity in qdot])

    def _push(self, k: int, wanted: float, qdot: float, dt: float) -> float:
        """Return the velocity of joint ``k``.

        It is what is wanted, and what breaks the joint loose, never in the wrong direction.
        """
        if self._added[k] * wanted < 0.0:
            self._added[k] = 0.0
            self._ease[k] = max(_EASING * self._ease[k], _LEAST_EASE)
        wanted *= self._ease[k]
        most, fastest = self._most_added[k], self._fastest[k]
        self._added[k] = min(
            max(self._added[k] + self._config.integral_gain * (wanted - qdot) * dt, -most), most
        )
        return min(max(wanted + self._added[k], -fastest), fastest)


class Trimming:
    """The trim at the end of one move, until the tool has stayed where it shall be.

    Not begun until the joints have arrived.
    """

    def __init__(self, tool: ToolKinematics, target: Sequence[float], config: MotionConfig) -> None:
        """Remember where to; ``target`` are the tool's joints there, shape ``(n,)``."""
        self.names = tuple(joint.name for joint in tool.joints)
        self.begun = False
        self._trim = Trim(tool, target, tool.position(target), config)
        self._config = config
        self._deadline = self._last = self._inside = 0.0
        # Whether the joints were told to move last, and until when they do not listen.
        self._moves = False
        self._deaf_until = 0.0

    def begin(self, now: float) -> None:
        """Begin at ``now`` [s]."""
        self.begun, self._last = True, now
        self._deadline = now + self._config.trim.timeout

    def hold(self, now: float) -> None:
        """Go on to ``now`` [s] without a motion: paused. The jogs before it were stopped too."""
        self._deadline += now - self._last
        if self._moves:
            # A stopped stream of jogs is heard again once it has paused.
            self._deaf_until, self._moves = self._last + self._config.jog.timeout, False
        self._last, self._inside = now, 0.0

    def step(self, q: Sequence[float], qdot: Sequence[float], now: float) -> Vector | None:
        """Return what the joints shall be told now; None: nothing.

        Args:
            q: Measured positions of the tool's joints, shape ``(n,)``.
            qdot: Measured velocities, shape ``(n,)``.
            now: [s]

        Raises:
            MotionRefusedError: The tool is too far away, or has not arrived in time.
        """
        trim, dt = self._config.trim, now - self._last
        step, self._last = self._trim.step(q, qdot, dt), now
        moves = any(step.qdot)
        self._inside = 0.0 if moves else self._inside + dt
        late = now > self._deadline
        if not self.settled and (late or step.error > trim.range_mm * 1e-3):
            why = "ended without reaching it" if late else f"begins below {trim.range_mm:g} mm"
            raise MotionRefusedError(
                f"the tool stays {step.error * 1e3:.3f} mm from the point, allowed "
                f"{trim.tolerance_mm:g}, and {math.degrees(abs(step.yaw_error)):.3f} deg "
                f"from the yaw, allowed {trim.tolerance_deg:g}: trimming {why}"
            )
        if now < self._deaf_until or not (moves or self._moves):
            return None
        self._moves = moves
        return step.qdot

    @property
    def settled(self) -> bool:
        """Whether the tool has stayed within the tolerance for long enough."""
        return self._inside >= self._config.trim.settled


class Requests:
    """At most one running request: a newer one cancels the older, STOP cancels it too."""

    def __init__(self) -> None:
        """Start without any."""
        self._newest = 0
        self._cancelled: dict[int, str] = {}

    def begin(self) -> int:
        """Begin a request; the older ones are cancelled."""
        self.cancel("replaced by a newer request")
        self._newest += 1
        self._cancelled[self._newest] = ""
        return self._newest

    @property
    def oldest(self) -> int | None:
        """The oldest request that still runs."""
        return min(self._cancelled, default=None)

    def cancel(self, why: str) -> None:
        """Cancel all running requests; the first reason stays."""
        self._cancelled = {request: text or why for request, text in self._cancelled.items()}

    def why_cancelled(self, request: int) -> str:
        """Return why a running request was cancelled, or an empty text."""
        return self._cancelled[request]

    def end(self, request: int) -> None:
        """Forget a request."""
        del self._cancelled[request]
