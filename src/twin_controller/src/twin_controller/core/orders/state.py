"""All open orders of the pair."""

from __future__ import annotations

import msgspec

from twin_controller.config import Change, Stop
from twin_controller.core.events import AnyEvent, RealMeasured, TwinMeasured, TwinMotion
from twin_controller.core.orders.gripper import Grips
from twin_controller.core.orders.order import Order
from twin_controller.core.orders.speed import Speeds
from twin_controller.core.orders.stop import EStopOrder, StopOrder, TwinStop, hear_stop, strike_off
from twin_controller.core.orders.stream import StreamOrder, hear_stream
from twin_controller.core.setup import Setup
from twin_controller.core.sides.change import stands_still
from twin_controller.core.sides.side import Sides

replace = msgspec.structs.replace

OWN_COMMAND = 1 << 30
"""Set in the id of each of our commands to the twin, which reports the last one it obeyed."""


class TwinTold(msgspec.Struct, frozen=True):
    """Our last command to the twin; the shell sends it until the twin reports its id."""

    id: int = 0
    # What the twin reported when it was sent: until it takes effect the twin goes on reporting so.
    before: TwinMotion | None = None
    sent: float = 0.0


class Orders(msgspec.Struct, frozen=True):
    """What both sides were told and must still show."""

    # The stop or hold of the real robot. It outlives a lost link; ends when the robot shows it, is
    # let go on, or has its drives switched off.
    stop: StopOrder | None = None
    # The robot's HOLD is away, and it was we who took it: whoever has done that gives it back.
    hold_away: bool = False
    # When we gave it back last [s].
    hold_back: float = 0.0
    # The last answer showed a program or a stream: while the link is down it may still run.
    real_busy: bool = False
    # The stop, pause or emergency stop of the twin; ends when it stands, may move again or is lost.
    twin_stop: TwinStop | None = None
    # Latched with the mode, ended by the reset.
    estop: EStopOrder | None = None
    # The stop for a zone, a person or the Cartesian limit; ends when the robot stands.
    safety_stop: Order[str] | None = None
    # While the real robot follows, or pauses while it does.
    stream: StreamOrder | None = None
    grips: Grips = Grips()
    speeds: Speeds = Speeds()
    told: TwinTold = TwinTold()


def hear(
    config: Change,
    stop_config: Stop,
    orders: Orders,
    event: AnyEvent,
    sides: Sides,
    moves: bool,
    leads: bool,
) -> Orders:
    """Strike off what a side shows, before anybody judges what is late.

    Args:
        config: What counts as standing still.
        stop_config: How a stop is shown.
        orders: What is open.
        event: The input.
        sides: Both sides, as they were heard.
        moves: The real robot moves.
        leads: It leads: that it moves is no disobedience, only its stream has to end.
    """
    if isinstance(event, TwinMeasured):
        if orders.twin_stop is None:
            return orders
        return replace(orders, twin_stop=strike_off(orders.twin_stop, sides.twin, config))
    # An answer that was not taken in (its clock is that of the one before) must not strike anything
    # off either: who judges by the signals that were taken in would miss what it showed.
    if not isinstance(event, RealMeasured) or sides.real.flags is not event:
        return orders
    stop, stream, safety_stop = orders.stop, orders.stream, orders.safety_stop
    if stop is not None:
        real = sides.real
        stands = leads or (bool(real.history) and stands_still(real.change, real.last.time, config))
        stop = hear_stop(stop, event, stands, stop_config)
    if stream is not None:
        stream = hear_stream(stream, event)
    if sides.real.history and not moves:
        safety_stop = None
    return replace(
        orders, stop=stop, stream=stream, safety_stop=safety_stop, real_busy=event.loaded
    )


def forget_lost(orders: Orders, sides: Sides) -> Orders:
    """Drop orders to a side that is lost: they are not sent again after a reconnect.

    A stop stays: a robot that moves on behind a lost link is stopped when it answers again. The
    twin is stopped anew after a reconnect.
    """
    if sides.usable:
        return orders
    grips, speeds, stop = orders.grips, orders.speeds, orders.stop
    if stop is not None and not sides.real.history:
        stop = replace(stop, reached=False)
    twin_stop = orders.twin_stop if sides.twin.usable else None
    if grips.real is not None and not sides.real.history:
        grips = replace(grips, real=None)
    if grips.twin is not None and not sides.twin.connected:
        grips = replace(grips, twin=None)
    if speeds.twin is not None and sides.twin.motion is None:
        speeds = replace(speeds, twin=None)
    return replace(orders, grips=grips, speeds=speeds, stop=stop, twin_stop=twin_stop)


def held_there(config: Stop, orders: Orders, flags: RealMeasured | None) -> bool:
    """Return whether somebody at the robot holds it: only he lets it go, and it begins nothing.

    Its pendant says so, or it shows HELD and it is not we who took HOLD, or gave it back just now.

    Args:
        config: How long the robot may take to show that HOLD is back.
        orders: Whether HOLD is ours.
        flags: The robot's newest answer.
    """
    if flags is None:
        return False
    ours = orders.hold_away or flags.sent <= orders.hold_back + config.retry_ms * 1e-3
    return flags.held_there or (flags.held and not ours)


def told_twin(orders: Orders, motion: TwinMotion | None, now: float) -> Orders:
    """Note that the twin is sent a command now."""
    return replace(orders, told=TwinTold(orders.told.id + 1, motion, now))


def is_old(setup: Setup, told: TwinTold, motion: TwinMotion, now: float) -> bool:
    """Return whether the twin still reports what it did when our last command was sent.

    That command is on its way then, and the report says nothing about who stopped the twin.
    """
    before = told.before
    if before is None or now - told.sent > setup.config.twin.stop_quiet_ms * 1e-3:
        return False
    same = motion.state == before.state or (pauses(motion) and pauses(before))
    return same and motion.last_command_id == before.last_command_id


def pauses(motion: TwinMotion) -> bool:
    """Return whether the twin has paused or is about to."""
    return motion.state in ("pausing", "paused")
