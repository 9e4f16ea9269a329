"""What several tests share: made when first asked for, ended by the run (plugin.py)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from typing import Any


class Shared:
    """Things by their names, ended together in reverse order."""

    def __init__(self) -> None:
        """Share nothing yet."""
        self._stack = ExitStack()
        self._made: dict[str, Any] = {}

    def get(self, name: str, make: Callable[[], AbstractContextManager[Any]]) -> Any:
        """Return the thing of this name; ``make`` gives the context in which it lives."""
        if name not in self._made:
            self._made[name] = self._stack.enter_context(make())
        return self._made[name]

    def __contains__(self, name: str) -> bool:
        """Return whether the thing of this name is made."""
        return name in self._made

    def close(self) -> None:
        """End everything that is shared."""
        self._made.clear()
        self._stack.close()


GROUP = Shared()
"""What the tests of one group share: it ends with the last of them."""
BROWSERS = Shared()
"""What a worker keeps as long as its tests drive a browser: Playwright's loop lets no other run."""
