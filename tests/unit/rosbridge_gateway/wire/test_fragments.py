"""Fragments: any packet comes out as it went in, and nobody can make us keep much."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.protocol.packets import Fragment
from rosbridge_gateway.wire.fragments import Assembly, FragmentError, split


def fragment(num: int, total: int, data: str = "x", name: Any = "f") -> Fragment:
    """Return a piece."""
    return Fragment(id=name, data=data, num=num, total=total)


@given(st.text(min_size=1), st.integers(1, 100), st.randoms())
def test_packet_comes_out_as_it_went_in(text: str, size: int, chance: Any) -> None:
    """Whatever is in it and in whatever order its pieces come; none is longer than asked for."""
    packet = json.dumps({"op": "x", "data": text * 5}, ensure_ascii=False).encode()
    parts = list(split(packet, size, "f"))
    if len(parts) == 1:
        assert parts == [packet] and len(packet.decode()) <= size
        return
    pieces = [msgspec.json.decode(part, type=Fragment) for part in parts]
    assert all(len(piece.data) <= size for piece in pieces)
    chance.shuffle(pieces)
    assembly = Assembly(10_000)
    found = [assembly.add(piece, 0.0) for piece in pieces]
    assert found[-1] == packet and set(found[:-1]) == {None}


def test_short_packet_stays_whole() -> None:
    """So does any that nobody wants in pieces."""
    assert split(b"x" * 64, 64, "f") == (b"x" * 64,)
    assert split(b"x" * 1000, None, "f") == (b"x" * 1000,)


def test_tiny_pieces_are_never_more_than_ten_thousand() -> None:
    """A megabyte in pieces of one character would be fifty."""
    assert len(split(b"x" * 1_000_000, 1, "f")) == 10_000
    assert len(split(b"x" * 9_999, 1, "f")) == 9_999


def test_fragments_name_their_packet() -> None:
    """As rosbridge_server writes them: numbers from 0."""
    first, second = map(json.loads, split(b"a" * 65, 64, "publish:1"))
    assert first == {"op": "fragment", "id": "publish:1", "data": "a" * 64, "num": 0, "total": 2}
    assert (second["data"], second["num"]) == ("a", 1)


def test_pieces_of_several_packets_may_be_mixed() -> None:
    """Each id is a packet of its own."""
    assembly = Assembly(100)
    assert assembly.add(fragment(0, 2, "a", 1), 0.0) is None
    assert assembly.add(fragment(0, 2, "b", "1"), 0.0) is None
    assert assembly.add(fragment(1, 2, "c", 1), 0.0) == b"ac"
    assert assembly.add(fragment(1, 2, "d", "1"), 0.0) == b"bd"


@pytest.mark.parametrize(
    ("second", "text"),
    [
        (fragment(0, 3), "fragment 0 of 'f' came twice"),
        (fragment(3, 3), "fragment 3 of 3: allowed: 0..2 of 3"),
        (fragment(1, 4), "fragment 1 of 4: allowed: 0..2 of 3"),
        (fragment(1, 3, "x" * 100), "101 characters of 1 packets wait for more: allowed: 100"),
    ],
)
def test_piece_that_does_not_fit_ends_its_packet(second: Fragment, text: str) -> None:
    """What is there of it is forgotten, so it costs nothing."""
    assembly = Assembly(100)
    assembly.add(fragment(0, 3), 0.0)
    with pytest.raises(FragmentError, match=text):
        assembly.add(second, 0.0)
    assert assembly.add(fragment(0, 3), 0.0) is None


def test_pieces_of_all_packets_together_are_bounded() -> None:
    """Several packets of which each alone is short enough; what fits still comes in."""
    assembly = Assembly(100)
    for number in range(3):
        assembly.add(fragment(0, 2, "x" * 30, number), 0.0)
    with pytest.raises(FragmentError, match="101 characters of 4 packets wait for more: allowed"):
        assembly.add(fragment(0, 2, "x" * 11, 3), 0.0)
    assert assembly.add(fragment(0, 2, "x" * 10, 4), 0.0) is None


def test_many_packets_at_once_are_refused() -> None:
    """However short their pieces are."""
    assembly = Assembly(1000)
    for number in range(16):
        assembly.add(fragment(0, 2, "", number), 0.0)
    with pytest.raises(FragmentError, match="of 17 packets wait for more: allowed: 1000 of 16"):
        assembly.add(fragment(0, 2, "", 16), 0.0)


def test_packet_whose_pieces_stop_coming_is_forgotten() -> None:
    """After a minute; its next piece begins anew."""
    assembly = Assembly(10)
    assembly.add(fragment(0, 2, "x" * 10), 0.0)
    assert assembly.add(fragment(1, 2, "y" * 10), 61.0) is None
    assert assembly.add(fragment(0, 2, ""), 62.0) == b"y" * 10
