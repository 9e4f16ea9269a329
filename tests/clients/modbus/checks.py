"""What the scripts of the Python clients share: it needs no client and nothing of the project."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator, Mapping


def run(client: tuple[str, str], checks: Mapping[str, Callable[[], None]]) -> None:
    """Print name and version, then each check and what went wrong, null if nothing did."""
    print(json.dumps({"client": client[0], "version": client[1]}), flush=True)
    for name, check in checks.items():
        wrong = None
        try:
            check()
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        print(json.dumps({"check": name, "wrong": wrong}), flush=True)


def float32(value: float) -> list[int]:
    """Return the words of a number, the low one first."""
    return list(struct.unpack("<2H", struct.pack("<f", value)))


def entry(
    slot: int, address: int, size: int, variable: str, factor: float
) -> Iterator[tuple[str, list[int], float]]:
    """Yield the four values of an entry of $SNPX_ASG: field, its words, the factor to write it."""
    yield "$ADDRESS", [address, 0], 1.0
    yield "$SIZE", [size, 0], 1.0
    yield "$VAR_NAME", list(struct.unpack(">40H", variable.encode().ljust(80, b"\0"))), -1.0
    yield "$MULTIPLY", float32(factor), 0.0
