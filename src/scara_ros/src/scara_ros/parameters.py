"""What the parameter server can hold: XML-RPC knows no null, no tuples and no large integers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LARGEST = 2**31 - 1


def as_parameter(tree: Any) -> Any:
    """Return a tree of YAML as a parameter; keys without a value are left out.

    Integers beyond 32 bits become floats, keys become texts.

    Example:
        >>> as_parameter({"joints": ({"name": "joint_1", "alias": None},), 7: 2**40})
        {'joints': [{'name': 'joint_1'}], '7': 1099511627776.0}
    """
    if isinstance(tree, Mapping):
        return {str(key): as_parameter(value) for key, value in tree.items() if value is not None}
    if isinstance(tree, (list, tuple)):
        return [as_parameter(value) for value in tree if value is not None]
    if isinstance(tree, int) and not isinstance(tree, bool) and abs(tree) > LARGEST:
        return float(tree)
    return tree
