"""What the tests of one group share: made when first asked for, ended with the last test."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from typing import Any

_STACK = ExitStack()
_MADE: dict[str, Any] = {}


def shared(name: str, make: Callable[[], AbstractContextManager[Any]]) -> Any:
    """Return the thing of this name; ``make`` gives the context in which it lives."""
    if name not in _MADE:
        _MADE[name] = _STACK.enter_context(make())
    return _MADE[name]


def close() -> None:
    """End everything that is shared."""
    _MADE.clear()
    _STACK.close()
