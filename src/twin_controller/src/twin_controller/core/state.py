"""Everything the core knows, in five parts; each step replaces what it changes."""

from __future__ import annotations

import msgspec

from twin_controller.core.follow.memory import Follow
from twin_controller.core.follow.response import assumed
from twin_controller.core.lead.state import Lead
from twin_controller.core.orders.state import Orders
from twin_controller.core.safety.watch import Safety
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Sides


class CoreState(msgspec.Struct, frozen=True):
    """The whole state of the controller.

    None of the parts has a default: the state of an older version must not pass for a new one.
    """

    # What is known of the real robot and the twin.
    sides: Sides
    # Who leads, and why.
    lead: Lead
    # What the sides were told and must still show.
    orders: Orders
    # What the pair may not do.
    safety: Safety
    # How one side follows the other.
    follow: Follow


def initial_state(setup: Setup) -> CoreState:
    """Return the state before the first input."""
    response = assumed(setup.config.response, setup.names)
    return CoreState(Sides(), Lead(), Orders(), Safety(), Follow(response))
