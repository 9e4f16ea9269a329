"""Long packets in pieces, both ways."""

from __future__ import annotations

from dataclasses import dataclass, field

import msgspec

from rosbridge_gateway.protocol.packets import Fragment, PacketId

_MOST = 10_000  # our choice: pieces of one packet; they become longer rather than more
_PARTIAL = 16  # our choice: packets of which pieces are waited for at once
_LIFE = 60.0  # our choice: [s] that the next piece of a packet may take


class FragmentError(ValueError):
    """A piece that fits nowhere; the text says why."""


def split(packet: bytes, size: int | None, packet_id: PacketId) -> tuple[bytes, ...]:
    """Return a packet whole, or as ``fragment`` packets if it is longer than ``size``.

    Args:
        packet: JSON text.
        size: Most characters of it in one fragment; None: any.
        packet_id: What its fragments have in common.
    """
    if size is None or len(packet) <= size:
        return (packet,)
    text = packet.decode("utf-8")
    size = max(size, -(-len(text) // _MOST))
    pieces = [text[start : start + size] for start in range(0, len(text), size)]
    if len(pieces) == 1:
        return (packet,)
    return tuple(
        msgspec.json.encode(Fragment(id=packet_id, data=piece, num=number, total=len(pieces)))
        for number, piece in enumerate(pieces)
    )


@dataclass(slots=True)
class _Partial:
    total: int
    at: float
    pieces: dict[int, str] = field(default_factory=dict)

    def size(self) -> int:
        return sum(map(len, self.pieces.values()))


class Assembly:
    """The packets of which one client has sent some pieces; bounded whatever it does."""

    def __init__(self, max_size: int) -> None:
        """Take how many characters may wait altogether."""
        self._max_size = max_size
        self._partial: dict[str | int, _Partial] = {}

    def add(self, fragment: Fragment, now: float) -> bytes | None:
        """Take a piece; return the packet when it was the last one that was missing.

        Args:
            fragment: The piece; pieces may come in any order.
            now: Monotonic [s].

        Raises:
            FragmentError: No id, a number beyond the total, another total than before, a piece
                that came before, or too much waits; what there is of the packet is forgotten.
        """
        self._partial = {
            name: partial for name, partial in self._partial.items() if now - partial.at <= _LIFE
        }
        name = fragment.id
        if not isinstance(name, str | int):
            raise FragmentError("a fragment needs an id: all of one packet have the same")
        partial = self._partial.pop(name, None) or _Partial(fragment.total, now)
        if fragment.total != partial.total or fragment.num >= partial.total:
            raise FragmentError(
                f"fragment {fragment.num} of {fragment.total}: allowed: 0..{partial.total - 1} of "
                f"{partial.total}"
            )
        if fragment.num in partial.pieces:
            raise FragmentError(f"fragment {fragment.num} of {name!r} came twice")
        partial.pieces[fragment.num], partial.at = fragment.data, now
        waiting = sum(other.size() for other in self._partial.values()) + partial.size()
        if waiting > self._max_size or len(self._partial) >= _PARTIAL:
            raise FragmentError(
                f"{waiting} characters of {len(self._partial) + 1} packets wait for more: allowed: "
                f"{self._max_size} of {_PARTIAL}"
            )
        if len(partial.pieces) < partial.total:
            self._partial[name] = partial
            return None
        return "".join(partial.pieces[number] for number in range(partial.total)).encode("utf-8")
