"""The robot's ring of set points ahead: straight from one to the next by its own clock."""

from __future__ import annotations

import numpy as np
import pytest
from fanuc_emulator.streaming.ring import EMPTY, WRAP_MS, SetpointRing
from hypothesis import given
from hypothesis import strategies as st

PLACES = 10


class Client:
    """Writes set points as a client does: rows, then times, then the newest number."""

    def __init__(self, ring: SetpointRing, first: int = 1) -> None:
        self.ring, self.number = ring, first
        self.rows: list[tuple[float, ...]] = [(0.0,)] * PLACES
        self.times = [-1] * PLACES

    def give(self, *points: tuple[int, float]) -> None:
        """Give set points (time, position) behind those before."""
        for time, position in points:
            self.put(self.number, time, position)
            self.number += 1
        self.say(self.number - 1)

    def put(self, number: int, time: int, position: float) -> None:
        """Write one place."""
        self.rows[(number - 1) % PLACES] = (position,)
        self.times[(number - 1) % PLACES] = time

    def say(self, newest: int) -> None:
        """Hand all over."""
        self.ring.write_rows(self.rows)
        self.ring.write_times(self.times)
        self.ring.write_newest(newest)


@pytest.fixture
def client() -> Client:
    """Return somebody who fills an empty ring."""
    return Client(SetpointRing(PLACES))


def test_the_robot_goes_straight_from_one_set_point_to_the_next(client: Client) -> None:
    """Before the first one it stays; none of them is left out."""
    client.give((100, 1.0), (110, 2.0), (130, 0.0))
    ring = client.ring
    assert ring.at(99) is None
    assert [ring.at(at) for at in (100, 105, 110, 120, 130)] == [
        (1.0,),
        (1.5,),
        (2.0,),
        (1.0,),
        (0.0,),
    ]
    assert ring.read == 3


def test_a_ring_that_runs_dry_holds_and_counts_it_once(client: Client) -> None:
    """What comes after goes on from there, beginning at the last moment it stood."""
    client.give((100, 1.0), (110, 2.0))
    ring = client.ring
    assert [ring.at(at) for at in (100, 112, 120)] == [(1.0,), (2.0,), (2.0,)]
    assert ring.underruns == 1
    client.give((130, 4.0))
    assert ring.at(125) == (3.0,)
    assert ring.at(130) == (4.0,) and ring.underruns == 2


def test_a_set_point_may_be_written_anew_until_it_is_taken(client: Client) -> None:
    """The way to it bends; what was taken stays."""
    client.give((100, 0.0), (110, 1.0), (120, 2.0))
    assert client.ring.at(105) == (0.5,)
    client.put(2, 110, 3.0)
    client.put(1, 100, 9.0)
    client.say(3)
    assert client.ring.at(105) == (1.5,)
    assert client.ring.at(110) == (3.0,)


def test_a_lower_newest_number_takes_those_behind_it_back(client: Client) -> None:
    """So a plan that has ended is not driven on."""
    client.give((100, 0.0), (110, 1.0), (120, 2.0))
    client.ring.at(101)
    client.say(2)
    assert client.ring.at(130) == (1.0,)
    assert client.ring.read == 2 and client.ring.underruns == 1


@pytest.mark.parametrize("how", ["empty", "zero"])
def test_an_empty_ring_has_no_set_point_left(client: Client, how: str) -> None:
    """Neither those that waited nor the one on the way; and its number goes on."""
    client.give((100, 0.0), (110, 1.0), (120, 2.0))
    client.ring.at(105)
    if how == "empty":
        client.ring.empty()
    else:
        client.ring.write_newest(0)
    assert not client.ring.fed and client.ring.at(120) is None
    assert client.ring.read == 3 and client.ring.underruns == 0
    client.times = [EMPTY] * PLACES
    client.give((200, 5.0), (210, 6.0))
    assert client.ring.at(150) is None and client.ring.at(205) == (5.5,)


def test_set_points_that_come_too_late_are_not_driven_one_by_one(client: Client) -> None:
    """The newest of them counts."""
    client.give((100, 1.0), (110, 2.0), (120, 3.0), (130, 4.0))
    assert client.ring.at(125) == (3.5,)
    assert client.ring.read == 3


@pytest.mark.parametrize("first", [1, 7, 32755, 32760])
@pytest.mark.parametrize("clock", [0, WRAP_MS - 60])
def test_numbers_and_the_clock_begin_again(first: int, clock: int) -> None:
    """A client that begins at any number, across both wraps."""
    client = Client(SetpointRing(PLACES))
    for k in range(30):
        number = (first - 1 + k) % 32760 + 1
        client.put(number, (clock + 10 * k) % WRAP_MS, float(k))
        client.say(number)
        if k:
            seen = client.ring.at((clock + 10 * k - 5) % WRAP_MS)
            assert seen == (k - 0.5,)
    assert client.ring.underruns == 0


@given(
    st.lists(st.tuples(st.integers(2, 40), st.floats(-3.0, 3.0)), min_size=2, max_size=10),
    st.integers(0, 400),
)
def test_the_way_is_the_straight_line_through_all_points(
    steps: list[tuple[int, float]], late: int
) -> None:
    """As numpy draws it, whenever it is asked."""
    client, time = Client(SetpointRing(PLACES)), 1000
    points = []
    for step, position in steps:
        time += step
        points.append((time, position))
    client.give(*points)
    at = points[0][0] + late
    seen = client.ring.at(at)
    times, places = zip(*points, strict=True)
    assert seen is not None and seen[0] == pytest.approx(np.interp(at, times, places), abs=1e-12)
