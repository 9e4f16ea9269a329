"""Quantities of a configuration by their meaning; each has its own range.

Both ends of a range mean something: beyond them a number does not do what its key says, however it
was meant. They leave room for other robots and slower machines, a factor of 3 beside what is
shipped, and still refuse a comma that slipped by three places. All ranges are our choice, but where
a source is named.
"""

from __future__ import annotations

import ipaddress
from typing import Annotated

from msgspec import Meta, Struct

# Percentages.
SpeedPercent = Annotated[float, Meta(ge=1.0, le=100.0)]
"""Part of a largest speed or deceleration at which something is done: never so slow as to stand."""

PartPercent = Annotated[float, Meta(ge=1.0, le=100.0)]
"""Part of a whole that is never next to nothing: of a core, of the time that passes."""

FewPercent = Annotated[float, Meta(ge=0.1, le=10.0)]
"""Part of a reach that something may cost."""

SharePercent = Annotated[float, Meta(gt=0.0, le=100.0)]
"""Part of a whole: an error of the reach, a threshold of the largest speed, a jog's speed."""

AccelerationPercent = Annotated[float, Meta(gt=0.0, le=1000.0)]
"""A stand-in's acceleration, relative to robot.yaml; a drive may be better than its data sheet."""

TolerancePercent = Annotated[float, Meta(ge=0.0, le=10_000.0)]
"""Margin on top of a limit; 0 is none, a very large one is as good as no limit."""

StepPercent = Annotated[float, Meta(ge=0.1, le=10.0)]
"""Difference of two speeds that counts as none, or that one is changed by at once."""

WholePercent = Annotated[float, Meta(ge=0.0, le=100.0)]
"""Part of a whole; nothing and all of it are allowed."""

DriftPercent = Annotated[float, Meta(gt=0.0, le=1000.0)]
"""By how much what is measured may differ from what was predicted."""

# Positions and distances, in a joint's border unit (deg or mm) unless the name says another one.
StillTolerance = Annotated[float, Meta(ge=0.001, le=0.5)]
"""Motion that counts as none. Coarser, a side that moves would pass for one that stands; finer than
a drive's own noise, none would ever stand."""

FineTolerance = Annotated[float, Meta(ge=0.002, le=1.0)]
"""How far from its target something may be that has arrived: 1 deg is 11 mm at a reach of 650 mm.
Finer than a drive's own noise, nothing would ever arrive."""

LeadTolerance = Annotated[float, Meta(ge=0.05, le=5.0)]
"""How far the sides may be apart while one leads, or while the other's motion counts as following.
Larger, somebody else's motion would pass for it."""

CoarseTolerance = Annotated[float, Meta(ge=0.05, le=20.0)]
"""How far a motion may stray from its way, or begin beside where the joint is."""

BeyondLimit = Annotated[float, Meta(ge=0.02, le=5.0)]
"""How far a reading may lie outside a joint's range."""

DivergenceMm = Annotated[float, Meta(ge=0.5, le=200.0)]
"""Distance of the tools that is told: above what a pair in order shows, within the cell."""

ClearanceMm = Annotated[float, Meta(ge=1.0, le=100.0)]
"""By how much more than its faces a zone counts: above what the sides stray by."""

UncertaintyMm = Annotated[float, Meta(ge=1.0, le=1000.0)]
"""Part of a protective distance that stands for what is not known. Nothing is known better than to
a millimetre, and what is known worse than to a metre protects nobody."""

IntrusionMm = Annotated[float, Meta(ge=60.0, le=1000.0)]
"""What a body part reaches beyond what is seen: C of ISO 13855, at most 850 mm there."""

LengthMm = Annotated[float, Meta(ge=10.0, le=10_000.0)]
"""Length of a robot's link, or its reach."""

BodyMm = Annotated[float, Meta(ge=0.1, le=50.0)]
"""Distance of two bodies that counts as none, or that a plan and a motion may be apart."""

CoordinateMm = Annotated[float, Meta(ge=-10_000.0, le=10_000.0)]
"""A place in the cell."""

ExtentMm = Annotated[float, Meta(gt=0.0, le=10_000.0)]
"""Size of a thing in the cell, or how far apart two may be."""

PlacementMm = Annotated[float, Meta(ge=0.0, le=100.0)]
"""How far something may lie from where it should; 0: it never does."""

BodyCoordinate = Annotated[float, Meta(ge=-1e5, le=1e5)]
"""Place or angle of a body of the robot [mm] or [deg]."""

BodySize = Annotated[float, Meta(gt=0.0, le=1e5)]
"""Edge, radius or length [mm], or mass [kg], of a body of the robot."""

CoordinateM = Annotated[float, Meta(ge=-10.0, le=10.0)]
"""A place in the cell, or a part of a direction [m]."""

AngleDeg = Annotated[float, Meta(ge=-3600.0, le=3600.0)]
"""Position of a joint that turns: ten turns."""

LeverM = Annotated[float, Meta(ge=-1.0, le=1.0)]
"""From the tool's origin to the centre of what hangs at it [m]."""

# Motion, in a joint's border unit (deg or mm) a second.
JointSpeed = Annotated[float, Meta(ge=5.0, le=10_000.0)]
"""Largest speed of a joint."""

JointAcceleration = Annotated[float, Meta(ge=100.0, le=100_000.0)]
"""Largest acceleration of a joint."""

JointJerk = Annotated[float, Meta(ge=1000.0, le=2e6)]
"""Largest jerk of a joint."""

JointEffort = Annotated[float, Meta(ge=1.0, le=5000.0)]
"""Largest torque or force of a joint [N m] or [N]."""

Force = Annotated[float, Meta(gt=0.0, le=10_000.0)]
"""Force [N], or stiffness [N/mm], of a gripper or a touch."""

StandstillSpeed = Annotated[float, Meta(ge=0.1, le=100.0)]
"""Slower than this counts as standing; above what a drive at rest shows."""

ToolSpeedMmS = Annotated[float, Meta(ge=1.0, le=10_000.0)]
"""Speed of the tool. Nobody's tool is faster."""

WalkingMmS = Annotated[float, Meta(ge=1600.0, le=5000.0)]
"""Speed of a person: ISO 13855 reckons with no slower one than who walks [src]."""

DecelerationMS2 = Annotated[float, Meta(ge=1.0, le=100.0)]
"""With what the slowest point of an arm brakes."""

# Times [ms].
PeriodMs = Annotated[float, Meta(ge=1.0, le=100.0)]
"""From one of a stream's values to the next; slower ones cannot be followed."""

SpreadMs = Annotated[float, Meta(ge=0.5, le=60.0)]
"""Difference of two delays that counts."""

RegisterDelayMs = Annotated[float, Meta(ge=0.0, le=50.0)]
"""From the instant of a position until its register shows it; 0: at once."""

DelayMs = Annotated[float, Meta(ge=1.0, le=2000.0)]
"""From a set point to the motion; published are up to 180 ms [src]."""

MeasuredDelayMs = Annotated[float, Meta(ge=0.0, le=2000.0)]
"""As it was measured; a robot may be quicker than can be measured."""

ReactionMs = Annotated[float, Meta(ge=10.0, le=500.0)]
"""From what happens until it is answered. At least one look of the controller; 0.5 s is 0.8 m of
a person who walks."""

SilenceMs = Annotated[float, Meta(ge=20.0, le=1000.0)]
"""After so long without a sign a side counts as lost. A few periods at least; after a second a
robot at full speed is metres away from where it was last seen."""

DeskSilenceMs = Annotated[float, Meta(ge=100.0, le=5000.0)]
"""As SilenceMs, where no steel moves."""

RepeatMs = Annotated[float, Meta(ge=20.0, le=2000.0)]
"""From one try, probe or look to the next: longer than an answer takes; one after 2 s is late."""

StopRepeatMs = Annotated[float, Meta(ge=30.0, le=500.0)]
"""From one try to stop a robot to the next."""

QuietMs = Annotated[float, Meta(ge=30.0, le=2000.0)]
"""How long something must last before it counts, or is waited for after a stop."""

MemoryMs = Annotated[float, Meta(ge=100.0, le=3000.0)]
"""How far back in motions that are under way something is looked for."""

ShownMs = Annotated[float, Meta(ge=300.0, le=3000.0)]
"""How long a side may take to show what it was told before that is an alarm."""

RestMs = Annotated[float, Meta(ge=0.0, le=5000.0)]
"""How long the robot rests at a point of its way; 0: it passes."""

LagMs = Annotated[float, Meta(ge=0.0, le=1000.0)]
"""How late a stand-in's drive, clock or register is; 0: it is ideal."""

BusSilenceMs = Annotated[float, Meta(ge=100.0, le=60_000.0)]
"""As SilenceMs, on the bus between machines, which carries no motion."""

GateMs = Annotated[float, Meta(ge=20.0, le=30_000.0)]
"""How long a motion or a program waits for its judgement."""

SettleMs = Annotated[float, Meta(ge=300.0, le=10_000.0)]
"""How long both sides may take to agree, or a robot to be ready."""

PatienceMs = Annotated[float, Meta(ge=300.0, le=60_000.0)]
"""How long a person waits for something, or is waited for."""

# Times [s].
SignSeconds = Annotated[float, Meta(ge=0.02, le=2.0)]
"""As SilenceMs, in seconds: a stream or a jog that has been silent for so long has ended."""

StateSeconds = Annotated[float, Meta(ge=0.05, le=3.0)]
"""An older state is not believed."""

GraceSeconds = Annotated[float, Meta(ge=0.05, le=120.0)]
"""How long a process or a connection may take to begin or to end, or is silent before it counts."""

IdleSeconds = Annotated[float, Meta(ge=5.0, le=3600.0)]
"""How long a person who does nothing keeps what others want; longer than a look at the robot."""

HoldSeconds = Annotated[float, Meta(ge=0.0, le=3600.0)]
"""How long something must be over before a journal says so; 0: at once."""

DwellSeconds = Annotated[float, Meta(ge=0.0, le=600.0)]
"""How long an experiment stays at a point, or rests."""

WaitSeconds = Annotated[float, Meta(ge=0.5, le=2000.0)]
"""How long an answer of another program is waited for; a person notices."""

Duration = Annotated[float, Meta(ge=0.02, le=60.0)]
"""Part of a motion, or how long its end is waited for."""

ClockDriftPpm = Annotated[float, Meta(ge=10.0, le=5000.0)]
"""How much faster or slower a clock may run: a bad quartz has some hundred ppm."""

# Numbers of things.
FewSamples = Annotated[int, Meta(ge=1, le=10)]
"""Readings in a row that decide whether something moves: at 100 Hz 0.1 s at most."""

Samples = Annotated[int, Meta(ge=1, le=50)]
"""Readings that are taken together: at 100 Hz 0.5 s at most."""

Conflicts = Annotated[int, Meta(ge=5, le=1000)]
"""Readings in a row that must be wrong before that is no accident."""

Attempts = Annotated[int, Meta(ge=1, le=100)]
"""How often something is tried."""

StopAttempts = Annotated[int, Meta(ge=1, le=15)]
"""How often a means of stopping is tried before the next one."""

Port = Annotated[int, Meta(ge=1, le=65535)]
"""TCP port."""

ThingsHeld = Annotated[int, Meta(ge=1, le=10_000)]
"""How many things of a kind somebody may have at a time."""

RateHz = Annotated[float, Meta(ge=1.0, le=1000.0)]
"""How often a loop runs in a second."""

PhysicsRateHz = Annotated[int, Meta(ge=1, le=10_000)]
"""How often a simulator says something in a second: a whole part of its steps."""

PageRateHz = Annotated[float, Meta(ge=1.0, le=50.0)]
"""How often a page is drawn in a second; nobody sees more."""

BusRateHz = Annotated[float, Meta(ge=0.1, le=100.0)]
"""How often a cell tells the farm something in a second."""

AboveZero = Annotated[float, Meta(gt=0.0, le=1e9)]
"""Any amount but nothing, of a stand-in's mechanics."""

PalletCount = Annotated[int, Meta(ge=1, le=20)]
"""Rows or columns of a pallet."""

# Names.
HostName = Annotated[str, Meta(min_length=1, max_length=255)]
"""Name or IP address of a machine."""


def is_this_machine(host: str) -> bool:
    """Return whether a host is this machine and no other, by its letters: no name is looked up.

    Example:
        >>> is_this_machine("localhost"), is_this_machine("127.0.0.2"), is_this_machine("::1")
        (True, True, True)
        >>> is_this_machine("0.0.0.0"), is_this_machine("127.0.0.1.example")
        (False, False)
    """
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


PersonName = Annotated[str, Meta(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,31}\Z")]
"""As it stands in messages and journals."""

VariableName = Annotated[str, Meta(pattern=r"^[A-Za-z_][A-Za-z0-9_]*\Z")]
"""Of the environment."""

ShortText = Annotated[str, Meta(min_length=1, max_length=200)]
"""A file or a role, in a few words."""

RightsWord = Annotated[str, Meta(min_length=1, max_length=63)]
"""A role, a person or a command in a farm's rights."""


class ServerAddress(Struct, frozen=True):
    """Where a server listens; the rest of its section is its own business."""

    host: str
    port: Port
