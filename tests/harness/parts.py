"""A state of the core with something changed in one of its parts."""

from __future__ import annotations

from typing import TypeVar

import msgspec

State = TypeVar("State", bound=msgspec.Struct)


def changed(state: State, /, **values: object) -> State:
    """Return ``state`` with fields changed; two underscores lead into a part: ``lead__mode``."""
    for path, value in values.items():
        name, _, rest = path.partition("__")
        inner = changed(getattr(state, name), **{rest: value}) if rest else value
        state = msgspec.structs.replace(state, **{name: inner})
    return state
