"""Who has a place, who gets one when all are taken, and who has to go for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rosbridge_gateway.config import Role


@dataclass(frozen=True, slots=True)
class Visitor:
    """Who comes: the role, whether it is a web page without a token, and the person, if known."""

    role: str
    is_page: bool
    person: str = ""
    token: str = field(default="", repr=False)


@dataclass(frozen=True, slots=True)
class Seat:
    """A client that is connected.

    ``is_busy``: it has a subscription, an advertised topic or service, or a running call.
    ``heard`` is when its last packet came (monotonic, [s]), at first when it connected.
    """

    owner: int
    visitor: Visitor
    is_busy: bool
    heard: float


@dataclass(frozen=True, slots=True)
class FreePlace:
    """There is a place; the client ``leaves`` has to go for it, nobody if None."""

    leaves: int | None = None


@dataclass(frozen=True, slots=True)
class NoPlace:
    """There is none; ``reason`` says so."""

    reason: str


def find_place(
    visitor: Visitor, seats: Iterable[Seat], roles: Mapping[str, Role], clients: int
) -> FreePlace | NoPlace:
    """Return whether there is a place for ``visitor``.

    A role with places of its own is never kept out: of its own clients the one that has been silent
    longest goes. All others share ``clients`` places. When these are taken, a client that does
    nothing goes, or a web page without a token even if it does something; of these the one that has
    been silent longest. For such a page only another one goes that does nothing.
    """
    seats = tuple(seats)
    own = roles[visitor.role].places
    if own:
        taken = [seat for seat in seats if seat.visitor.role == visitor.role]
        if len(taken) < own:
            return FreePlace()
        return FreePlace(min(taken, key=lambda seat: seat.heard).owner)
    taken = [seat for seat in seats if not roles[seat.visitor.role].places]
    if len(taken) < clients:
        return FreePlace()
    if visitor.is_page:
        may_go = [seat for seat in taken if seat.visitor.is_page and not seat.is_busy]
    else:
        may_go = [seat for seat in taken if seat.visitor.is_page or not seat.is_busy]
    if may_go:
        # A client that does nothing goes before a busy page.
        return FreePlace(min(may_go, key=lambda seat: (seat.is_busy, seat.heard)).owner)
    return NoPlace(f"{len(taken)} clients are connected: no more allowed")
