"""Who has a place, who gets one when all are taken, and who has to go for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rosbridge_gateway.config import RoleRules


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


class NoPlaceError(RuntimeError):
    """All places are taken, and nobody goes."""


def find_place(
    visitor: Visitor, seats: Iterable[Seat], roles: Mapping[str, RoleRules], clients: int
) -> int | None:
    """Return who has to go, so that ``visitor`` has a place: a client, or nobody.

    A role with places of its own is never kept out: of its own clients the one that has been silent
    longest goes. All others share ``clients`` places. When these are taken, a client that does
    nothing goes, or a web page without a token even if it does something; of these the one that has
    been silent longest. For such a page only another one goes that does nothing.

    Raises:
        NoPlaceError: There is no place.
    """
    seats = tuple(seats)
    own = roles[visitor.role].places
    if own:
        taken = [seat for seat in seats if seat.visitor.role == visitor.role]
        if len(taken) < own:
            return None
        return min(taken, key=lambda seat: seat.heard).owner
    taken = [seat for seat in seats if not roles[seat.visitor.role].places]
    if len(taken) < clients:
        return None
    if visitor.is_page:
        may_go = [seat for seat in taken if seat.visitor.is_page and not seat.is_busy]
    else:
        may_go = [seat for seat in taken if seat.visitor.is_page or not seat.is_busy]
    if may_go:
        # A client that does nothing goes before a busy page.
        return min(may_go, key=lambda seat: (seat.is_busy, seat.heard)).owner
    raise NoPlaceError(f"{len(taken)} clients are connected: no more allowed")
