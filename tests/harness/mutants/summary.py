"""What became of a run's mutants, in a file for whoever tells of it later."""

from __future__ import annotations

import msgspec

from harness.workspace import ROOT

FILE = ROOT / "build" / "mutants.json"


class RoomSummary(msgspec.Struct, frozen=True):
    """One room.

    Attributes:
        tried: How many mutants, without equivalent ones.
        killed: How many of them were noticed.
        equivalent: How many were left out.
        seconds: How long all of it took [s].
        survivors: The others, a place, the line before and the line after each.
        sound: Whether the tests pass without a mutant; else nothing was tried.
    """

    tried: int
    killed: int
    equivalent: int
    seconds: float
    survivors: tuple[str, ...] = ()
    sound: bool = True


class Summary(msgspec.Struct, frozen=True):
    """One run: what repeats its choice, and what became of each room."""

    mutants: int
    seed: int
    rooms: dict[str, RoomSummary]
