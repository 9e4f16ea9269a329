"""What a node takes and offers, read from the calls by which its source declares it.

A declaration is a call with a name and, right after it, a type that was imported from ``msg`` or
``srv``: ``rospy.Publisher("twin/joint_states", JointState, ...)``. So there is no second list.
Names that are only known while the node runs are left out; its docstring tells them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

PARAMETER_CALLS = ("get_param", "has_param")
CLIENTS = ("ServiceClient", "ServiceProxy", "Lane")
"""Calls by which a service is called; every other call with a service's type offers it."""

Declared = tuple[str, str, str]
Texts = Mapping[str, list[str]]
"""What variables stand for, where that is written in the source."""


@dataclass(frozen=True)
class Interface:
    """Parameters with their defaults as source, names with their types.

    Attributes:
        parameters: By private name (``~rate``); an empty text: the source holds no plain default.
        publishes: Topics; ``<joint>`` stands for what is known while the node runs.
        subscribes: Topics.
        offers: Services.
        calls: Services.
        actions: That it serves: the topics ``goal``, ``cancel``, ``status``, ``feedback`` and
            ``result`` below the name.
    """

    parameters: Mapping[str, str] = field(default_factory=dict)
    publishes: Mapping[str, str] = field(default_factory=dict)
    subscribes: Mapping[str, str] = field(default_factory=dict)
    offers: Mapping[str, str] = field(default_factory=dict)
    calls: Mapping[str, str] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)


def interface_of(sources: Iterable[str]) -> Interface:
    """Return what the modules of one node declare.

    Args:
        sources: Their texts.

    Example:
        >>> interface_of(['''
        ... from std_msgs.msg import String
        ... rospy.Publisher("shout", String, queue_size=1)
        ... rospy.get_param("~rate", 25.0)
        ... ''']).publishes
        {'shout': 'std_msgs/String'}
    """
    found: dict[str, dict[str, str]] = {
        name: {} for name in ("parameters", "publishes", "subscribes", "offers", "calls", "actions")
    }
    for source in sources:
        for group, name, what in _Module(ast.parse(source)).declarations():
            if what or name not in found[group]:
                found[group][name] = what
    return Interface(**{group: dict(sorted(names.items())) for group, names in found.items()})


class _Module:
    """One module: the types that it imports, its constants, and its calls."""

    def __init__(self, tree: ast.Module) -> None:
        self._tree = tree
        self._types = dict(_types(tree))
        self._constants = dict(_assigned(tree.body))

    def declarations(self) -> Iterator[Declared]:
        """Yield (group, name, type or default)."""
        yield from self._look(self._tree, {})

    def _look(self, node: ast.AST, bound: Texts) -> Iterator[Declared]:
        bound = {**bound, **self._bound_by(node, bound)}
        if isinstance(node, ast.Call):
            yield from self._declared(node, bound)
        for child in ast.iter_child_nodes(node):
            yield from self._look(child, bound)

    def _declared(self, call: ast.Call, bound: Texts) -> Iterator[Declared]:
        callee = getattr(call.func, "attr", getattr(call.func, "id", ""))
        if callee in PARAMETER_CALLS and call.args:
            default = self._literal(call.args[1]) if len(call.args) > 1 else ""
            for name in self._texts(call.args[0], bound):
                if name.startswith("~") and "<" not in name:
                    yield "parameters", name, default
            return
        for first, second in zip(call.args, call.args[1:]):
            kind = self._types.get(second.id) if isinstance(second, ast.Name) else None
            if kind is None:
                continue
            for name in self._texts(first, bound):
                yield _group(callee, kind[0]), name, kind[1]

    def _literal(self, node: ast.expr) -> str:
        """Return a default as it is written; empty if it is no plain value, or none at all."""
        if isinstance(node, ast.Name):
            node = self._constants.get(node.id, node)
        try:
            value = ast.literal_eval(node)
        except ValueError:
            return ""
        return "" if value in (None, "") else repr(value)

    def _texts(self, node: ast.AST, bound: Texts) -> list[str]:
        """Return the texts that an expression can stand for; none if it is no text."""
        if isinstance(node, ast.Name):
            if node.id in bound:
                return bound[node.id]
            node = self._constants.get(node.id, node)
        if isinstance(node, ast.Constant):
            return [node.value] if isinstance(node.value, str) else []
        if not isinstance(node, ast.JoinedStr):
            return []
        parts = []
        for part in node.values:
            if isinstance(part, ast.Constant):
                parts.append([str(part.value)])
            else:
                assert isinstance(part, ast.FormattedValue)
                word = ast.unparse(part.value)
                known = bound.get(word) or self._texts(part.value, bound)
                parts.append(known or [f"<{word.removeprefix('self._')}>"])
        return ["".join(words) for words in product(*parts)]

    def _bound_by(self, node: ast.AST, outer: Texts) -> dict[str, list[str]]:
        """Return the texts of variables: of loops over written lists, and of what is assigned."""
        loops: list[tuple[ast.expr, ast.expr]] = []
        bound: dict[str, list[str]] = {}
        if isinstance(node, ast.For):
            loops = [(node.target, node.iter)]
        elif isinstance(node, (ast.ListComp, ast.SetComp, ast.GeneratorExp, ast.DictComp)):
            loops = [(each.target, each.iter) for each in node.generators]
        for target, given in loops:
            if isinstance(given, ast.Name):
                given = self._constants.get(given.id, given)
            if isinstance(target, ast.Name) and isinstance(given, (ast.Tuple, ast.List)):
                texts = [text for item in given.elts for text in self._texts(item, {})]
                bound[target.id] = texts
        if isinstance(node, (ast.FunctionDef, ast.For, ast.With)):
            for name, value in _assigned(node.body):
                if texts := self._texts(value, {**outer, **bound}):
                    bound[name] = texts
        return bound


def _assigned(body: Iterable[ast.stmt]) -> Iterator[tuple[str, ast.expr]]:
    """Yield the names that statements assign, one by one."""
    for node in body:
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            if isinstance(target, ast.Name):
                yield target.id, node.value
            elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                for name, value in zip(target.elts, node.value.elts):
                    if isinstance(name, ast.Name):
                        yield name.id, value


def _types(tree: ast.Module) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield (name in the module, (msg or srv, type)) of all imported messages and services."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            package, _, kind = node.module.rpartition(".")
            if kind in ("msg", "srv"):
                for name in node.names:
                    yield name.asname or name.name, (kind, f"{package}/{name.name}")


def _group(callee: str, kind: str) -> str:
    if callee.endswith("ActionServer"):
        return "actions"
    if kind == "msg":
        return "publishes" if callee == "Publisher" else "subscribes"
    return "calls" if callee in CLIENTS else "offers"
