"""Which faults are made: a choice of cosmic-ray's operators, and calls that are dropped or swapped.

Left out are those of cosmic-ray that make the same mutant again and again (a comparison has seven
replacements) and those that nearly always end in a TypeError. ``<`` becomes ``<=`` where things
are counted: two measured numbers are never equal, so there it changes nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator
from parso.python.tree import Name, Node

PAIRS = {
    "ReplaceBinaryOperator": ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul"),
    "ReplaceComparisonOperator": (
        *("Lt_GtE", "LtE_Gt", "Gt_LtE", "GtE_Lt"),
        *("Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is"),
    ),
    "ReplaceUnaryOperator": ("Delete_USub", "Delete_Not"),
}
ALONE = (
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "NumberReplacer"),
    *("ZeroIterationForLoop", "AddNot"),
)
SWAPS = {"min": "max", "max": "min", "ceil": "floor", "floor": "ceil", "any": "all", "all": "any"}
DROPPED = ("abs",)
EDGES = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
WHOLE = re.compile(r"\d+|len\(.*\)|.*(attempts|count|confirm|window|refused|agreeing)\)?")
"""Words of a quantity that is counted."""


class _OnNodes(Operator):  # type: ignore[misc]
    """Base of our own operators: one mutant for each node that :meth:`fits`."""

    def mutation_positions(self, node: Node) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
        """Give the place of a node that fits."""
        if self.fits(node):
            yield node.start_pos, node.end_pos

    def fits(self, node: Node) -> bool:
        """Return whether the node is mutated."""
        raise NotImplementedError

    @classmethod
    def examples(cls) -> tuple[object, ...]:
        """Give no examples; tests/unit/harness has them."""
        return ()


class SwapCall(_OnNodes):
    """``min`` for ``max``, ``floor`` for ``ceil``, ``any`` for ``all``, and back."""

    def fits(self, node: Node) -> bool:
        """Return whether it is the name of such a call."""
        if not isinstance(node, Name) or node.value not in SWAPS:
            return False
        follows = node.get_next_leaf()
        return follows is not None and follows.value in ("(", ",")

    def mutate(self, node: Node, index: int) -> Node:
        """Swap the name."""
        node.value = SWAPS[node.value]
        return node


class DropCall(_OnNodes):
    """``abs(x)`` becomes ``(x)``."""

    def fits(self, node: Node) -> bool:
        """Return whether it is the name of such a call."""
        if not isinstance(node, Name) or node.value not in DROPPED:
            return False
        follows = node.get_next_leaf()
        return follows is not None and follows.value == "("

    def mutate(self, node: Node, index: int) -> Node:
        """Leave the brackets alone."""
        node.value = ""
        return node


class LeftAlone(_OnNodes):
    """``a - b`` becomes ``a``: the whole right side is lost."""

    def fits(self, node: Node) -> bool:
        """Return whether it is a difference or a sum of two terms."""
        if getattr(node, "type", "") != "arith_expr":
            return False
        return bool(node.children[-2].value in "+-")

    def mutate(self, node: Node, index: int) -> Node:
        """Drop the last term."""
        del node.children[-2:]
        return node


class MoveEdge(_OnNodes):
    """``<`` becomes ``<=``, and so on, where one side is a count."""

    def fits(self, node: Node) -> bool:
        """Return whether it is a comparison of a count."""
        if getattr(node, "type", "") != "comparison" or len(node.children) != 3:
            return False
        left, sign, right = node.children
        if getattr(sign, "value", "") not in EDGES:
            return False
        return any(WHOLE.fullmatch(side.get_code().strip()) for side in (left, right))

    def mutate(self, node: Node, index: int) -> Node:
        """Let the edge belong to the other side."""
        node.children[1].value = EDGES[node.children[1].value]
        return node


@cache
def operators() -> dict[str, Operator]:
    """Return all operators by name, in an order that never changes."""
    names = [f"{base}_{pair}" for base, pairs in PAIRS.items() for pair in pairs]
    found = {name: get_operator(f"core/{name}")() for name in (*names, *ALONE)}
    classes = (SwapCall, DropCall, LeftAlone, MoveEdge)
    own = {kind.__name__: kind() for kind in classes}
    return dict(sorted((found | own).items()))
