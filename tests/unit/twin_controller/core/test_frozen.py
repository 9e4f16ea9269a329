"""The core's state, inputs and actions are values: a step that went wrong has changed nothing."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import is_dataclass
from typing import Any

import msgspec

from twin_controller import core


def structs() -> set[type[Any]]:
    """Return all structs and dataclasses that the core's modules define."""
    names = [module.name for module in pkgutil.walk_packages(core.__path__, f"{core.__name__}.")]
    found = [thing for name in names for thing in vars(importlib.import_module(name)).values()]
    return {
        thing
        for thing in found
        if isinstance(thing, type)
        and thing.__module__.startswith(core.__name__)
        and (issubclass(thing, msgspec.Struct) or is_dataclass(thing))
    }


def test_every_struct_of_the_core_is_frozen() -> None:
    """A replay and a second thread that publishes see what was, not what is being changed."""
    found = structs()
    assert len(found) > 30
    frozen = {
        thing
        for thing in found
        if (
            thing.__struct_config__.frozen
            if issubclass(thing, msgspec.Struct)
            else thing.__dataclass_params__.frozen
        )
    }
    assert {thing.__name__ for thing in found - frozen} == set()
