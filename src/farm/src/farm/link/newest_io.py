"""A place for one value: who puts never waits, who takes gets the newest."""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Newest(Generic[T]):
    """Holds the newest value of each name until somebody takes all of them."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._changed = threading.Condition()
        self._values: dict[str, T] = {}
        self._replaced = 0
        self._closed = False

    @property
    def replaced(self) -> int:
        """How many values a newer one has replaced before anybody took them."""
        return self._replaced

    @property
    def closed(self) -> bool:
        """Whether nobody shall wait any more."""
        return self._closed

    def put(self, name: str, value: T) -> None:
        """Put a value in the place of the last one of this name; this never waits."""
        with self._changed:
            self._replaced += name in self._values
            self._values[name] = value
            self._changed.notify()

    def take(self, timeout: float) -> dict[str, T]:
        """Return what has come, by name, after at most ``timeout`` [s]; empty: nothing has."""
        with self._changed:
            if not self._values and not self._closed:
                self._changed.wait(timeout)
            values, self._values = self._values, {}
            return values

    def close(self) -> None:
        """Wake who waits."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
