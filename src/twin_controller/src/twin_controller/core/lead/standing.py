"""Say whether both sides were seen to stand: no stop is believed before."""

from __future__ import annotations

from twin_controller.core.events import RealMeasured
from twin_controller.core.lead.modes import Mode
from twin_controller.core.orders.state import is_old
from twin_controller.core.orders.stop import speeds_since, under_way
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState


def real_stands(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> bool:
    """Return whether the real robot has stopped: no program runs, and its joints stand."""
    return not flags.runs and change.stands_still(state.sides.real.change, now, setup.config.change)


def moves_in_stop(setup: Setup, state: CoreState, now: float) -> bool:
    """Return whether the twin of a stopped pair moves, or is about to, and must be stopped again.

    It has begun a move of its own, or it speeds up again since it was told last, or it has left the
    place where it had come to rest: a joint may be commanded past all of its nodes.
    """
    lead, twin, told, config = state.lead, state.sides.twin, state.orders.told, setup.config
    motion = twin.motion
    if lead.mode is not Mode.STOPPED or motion is None or not twin.history:
        return False
    if now - told.sent <= config.stop.heard_ms * 1e-3:
        # It slows down from now on, not before it has heard so.
        return False
    begun = motion.state in ("announcing", "moving") and not is_old(setup, told, motion, now)
    left = change.moved(twin.change, config.change)
    left = left and not change.stands_still(twin.change, now, config.change)
    slowest, fastest = speeds_since(twin, told.sent + config.stop.heard_ms * 1e-3, setup.velocity)
    return begun or left or fastest > slowest + config.stop.restart_percent * 1e-2


def moved_since(setup: Setup, sides: Sides) -> bool:
    """Return whether a side no longer stands where it was agreed to stand."""
    return any(change.moved(side.change, setup.config.change) for side in (sides.real, sides.twin))


def unshown(state: CoreState) -> bool:
    """Return whether the real robot was told to stop or to pause and has not shown that yet."""
    stop = state.orders.stop
    return under_way(stop) and not stop.order.shown


def unseen(setup: Setup, state: CoreState, since: float) -> str:
    """Return which side was not seen to stand since it was told to, in words; empty: both were.

    Args:
        setup: Profile and numbers.
        state: The state now.
        since: When both were told [s]. What a side said before shows nothing of it.
    """
    sides, found = state.sides, list[str]()
    real, twin, flags = sides.real, sides.twin, sides.real.flags
    if not real.usable or flags is None:
        found.append("the real robot does not answer")
    elif flags.sent <= since or not real_stands(setup, state, flags, real.last.time):
        found.append("the real robot is not seen to stand")
    if not twin.usable or twin.motion is None:
        found.append("the twin does not answer")
    elif (
        twin.last.time <= since
        or is_old(setup, state.orders.told, twin.motion, twin.last.time)
        or not change.stands_still(twin.change, twin.last.time, setup.config.change)
    ):
        found.append("the twin is not seen to stand")
    return ", and ".join(found)
