"""Who gets a place, and who goes for it."""

from __future__ import annotations

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from rosbridge_gateway.admission.places import NoPlaceError, Seat, Visitor, find_place

PROGRAM, PAGE = Visitor("operator", False), Visitor("viewer", True)
TWIN_CONTROLLER = Visitor("twin_controller", False)


def decide(visitor: Visitor, *seats: Seat, clients: int = 2) -> int | None:
    """Decide by the shipped roles."""
    return find_place(visitor, seats, SHIPPED.roles, clients)


def idle(owner: int, heard: float, visitor: Visitor = PROGRAM) -> Seat:
    """Return a client that does nothing."""
    return Seat(owner, visitor, False, heard)


def busy(owner: int, heard: float, visitor: Visitor = PROGRAM) -> Seat:
    """Return a client that has subscribed to something."""
    return Seat(owner, visitor, True, heard)


def test_free_place_is_given() -> None:
    """Nobody has to go."""
    assert decide(PROGRAM, idle(1, 0.0)) is None


def test_client_that_does_nothing_goes_the_one_silent_longest_first() -> None:
    """Idle sockets keep nobody out."""
    assert decide(PROGRAM, idle(1, 5.0), idle(2, 3.0), clients=2) == 2
    assert decide(PROGRAM, busy(1, 0.0), idle(2, 9.0), clients=2) == 2


def test_page_without_a_token_drives_no_program_out() -> None:
    """A program that gives a command now and then does nothing in between."""
    with pytest.raises(NoPlaceError):
        decide(PAGE, idle(1, 0.0), idle(2, 0.0))
    assert decide(PAGE, idle(1, 0.0), idle(2, 9.0, PAGE)) == 2


def test_busy_client_stays() -> None:
    """A listener sends nothing, and is no idler."""
    with pytest.raises(NoPlaceError, match="2 clients are connected: no more allowed"):
        decide(PROGRAM, busy(1, 0.0), busy(2, 0.0))


def test_page_without_a_token_goes_for_a_program_but_for_no_other_page() -> None:
    """Pages cannot keep an operator out, whatever they subscribe to."""
    pages = (busy(1, 4.0, PAGE), busy(2, 3.0, PAGE))
    assert decide(PROGRAM, *pages) == 2
    assert decide(PROGRAM, idle(3, 9.0), *pages, clients=3) == 3
    with pytest.raises(NoPlaceError):
        decide(PAGE, *pages)


def test_twin_controller_is_never_kept_out() -> None:
    """Its places are its own, whatever the others do."""
    others = [busy(owner, 0.0) for owner in range(100)]
    assert decide(TWIN_CONTROLLER, *others, clients=32) is None


@pytest.mark.parametrize("visitor", [PROGRAM, PAGE])
def test_place_of_the_twin_controller_is_nobody_elses(visitor: Visitor) -> None:
    """It takes none of the others either."""
    twins = [busy(owner, 0.0, TWIN_CONTROLLER) for owner in range(4)]
    assert decide(visitor, *twins, busy(9, 0.0)) is None
    with pytest.raises(NoPlaceError):
        decide(visitor, *twins, busy(8, 0.0), busy(9, 0.0))


def test_twin_controller_that_comes_again_and_again_replaces_its_lost_lines() -> None:
    """A line that was lost a moment ago looks alive until its ping fails; it sent longest ago."""
    own = [busy(owner, float(10 - owner), TWIN_CONTROLLER) for owner in range(4)]
    assert decide(TWIN_CONTROLLER, *own) == 3
