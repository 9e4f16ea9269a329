"""What is known of the two sides: frozen structures, replaced by whoever takes a report in."""

from __future__ import annotations

import msgspec
from scara_control.joint_motion import JointMotion

from twin_controller.core.events import Joints, RealMeasured, TwinMotion, TwinPlan
from twin_controller.core.sides.change import ChangeState
from twin_controller.core.sides.clock import ClockEstimate
from twin_controller.core.sides.echo import EchoTube
from twin_controller.estimation.latch import Latch
from twin_controller.estimation.rhythm import Rhythm

HISTORY = 48
"""So many samples are kept of each side: the divergence and the lag look about 0.4 s back."""


class Gripper(msgspec.Struct, frozen=True):
    """What a side shows of its gripper."""

    # None until the side has shown it, and again once its data cannot be used.
    on: bool | None = None
    holding: bool = False
    # Only the twin knows which part it holds.
    part: str = ""


class Side(msgspec.Struct, frozen=True):
    """What both sides have in common; a lost side begins anew, but for the jumps of its clock."""

    connected: bool = False
    # Why nothing is known of it; empty once a link is up, set again when its data cannot be used.
    reason: str = "not connected yet"
    # When the newest sample was true at the latest [s]; None until the first one after a loss.
    seen: float | None = None
    # The joints by our clock, newest last. Empty means that the side cannot be judged, also while
    # its link stands.
    history: tuple[JointMotion, ...] = ()
    # Agreed position, onset and standstill.
    change: ChangeState = ChangeState()
    # Our own last commands to it: motion inside them is an echo and no lead.
    tube: EchoTube = EchoTube()
    # Samples taken for an echo since somebody leads; only shown.
    echoed: int = 0
    # Its clock against ours.
    clock: ClockEstimate = ClockEstimate()
    gripper: Gripper = Gripper()
    # How noisy its readings are at rest, of the noisiest joint, border units, and when that was
    # found [s]; a property of the side, so it outlives a loss.
    noise: float = 0.0
    noise_at: float = -1e9
    # From when to when the controller itself last stood still [s]: no silence of the side. Without
    # effect once something newer was heard.
    deaf: tuple[float, float] = (0.0, 0.0)
    # When the last stall of this machine ended and how long it was [s]; only named.
    stall: tuple[float, float] = (0.0, 0.0)

    @property
    def age_doubt(self) -> float:
        """Standard deviation of a reading from its stamp [s], as far as the side shows it."""
        return 0.0

    @property
    def last(self) -> JointMotion:
        """The newest sample; only where one is known to exist."""
        return self.history[-1]

    @property
    def usable(self) -> bool:
        """Whether its link is up and its data can be used."""
        return self.connected and bool(self.history)


class RealSide(Side, frozen=True):
    """The real robot."""

    # Its newest answer. None until one came that was newer than the one before.
    flags: RealMeasured | None = None
    # Its clock, unwrapped. An answer with the same clock holds no new sample.
    clock_ms: int | None = None
    # When its newest reading was renewed, by its clock [ms]; None until the first one.
    renewed_ms: float | None = None
    # When it was asked for its newest answer [s]: what is new in the next one is younger.
    asked: float = -1e9
    # How often it renews its readings; a property of the robot, so it outlives a loss.
    rhythm: Rhythm = Rhythm()
    # How old a reading is where its stamp is not its own; likewise.
    latch: Latch = Latch()
    # Text of its active alarm, and of its warning while nothing stops it. The robot says when they
    # end.
    alarm: str = ""
    warning: str = ""

    @property
    def period(self) -> float:
        """The time between two of its readings, and of its ticks [s]."""
        return self.latch.period or self.rhythm.period

    @property
    def age_doubt(self) -> float:
        """Until its motion has shown how old its readings are, each may be of any age."""
        return self.latch.doubt if self.flags is not None and self.flags.plain_clock else 0.0

    @property
    def ticked(self) -> bool:
        """Whether its readings' instants are known to a tick of its plain clock at best."""
        return self.flags is not None and self.flags.plain_clock and not self.latch.period_ms

    @property
    def takes_ahead(self) -> int:
        """How many set points it takes ahead of their time; 0: none."""
        return self.flags.ring_places if self.flags is not None else 0


class TwinSide(Side, frozen=True):
    """The simulated robot."""

    # State of its pose controller. Without it the twin cannot be commanded: it counts as lost.
    motion: TwinMotion | None = None
    # Set points it is going to pass. Dropped when it is stopped: it will not pass them.
    plan: TwinPlan | None = None
    # How fast each joint is in it against the fastest one, in parts of their largest speeds.
    shares: Joints = ()
    # What its arm touches, as its simulator tells; empty: nothing. Only said to a person.
    touches: str = ""

    def program_speed(self, most: float) -> float:
        """Return with what program speed no joint of the twin is faster than ``most`` [percent].

        A cap slows all of a path down: a move that is too short to get so fast needs none.
        """
        motion = self.motion
        if motion is None or not motion.target or motion.peak_percent <= 0.0:
            return most
        return min(100.0, most * max(1.0, motion.speed_requested_percent / motion.peak_percent))


class Sides(msgspec.Struct, frozen=True):
    """Both sides."""

    real: RealSide = RealSide()
    twin: TwinSide = TwinSide()

    @property
    def usable(self) -> bool:
        """Whether both sides are connected and fresh."""
        return self.real.usable and self.twin.usable and self.twin.motion is not None

    @property
    def known(self) -> bool:
        """Whether there is a sample of each side."""
        return bool(self.real.history) and bool(self.twin.history)
