"""One mutant: a module whose source differs in one place."""

from __future__ import annotations

import ast
import difflib
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code

from harness.mutants.operators import operators


@dataclass(frozen=True)
class Mutant:
    """A fault in one module.

    Attributes:
        path: The module, from the root.
        operator: What was done,
        occurrence: at which of the places where it can be done.
        line: Number of the line.
        before: The line without the fault, after it, both without blanks around them.
        source: The whole module with the fault.
    """

    path: str
    operator: str
    occurrence: int
    line: int
    before: str
    after: str
    source: str

    @property
    def words(self) -> str:
        """Return one line for a person."""
        return f"{self.path}:{self.line} {self.operator}\n    - {self.before}\n    + {self.after}"


@dataclass(frozen=True)
class Place:
    """Where a fault can be made; most of them make a mutant."""

    path: Path
    operator: str
    occurrence: int

    def make(self, root: Path) -> Mutant | None:
        """Make the fault; None if it changes nothing that runs, or cannot be compiled."""
        source = _text(self.path)
        mutated = mutate_code(source, operators()[self.operator], self.occurrence)
        meaning = _meaning(mutated) if mutated is not None else None
        if mutated is None or meaning is None or meaning == _meaning(source):
            return None
        line, before, after = _difference(source, mutated)
        relative = str(self.path.relative_to(root))
        return Mutant(relative, self.operator, self.occurrence, line, before, after, mutated)


def places_of(path: Path) -> list[Place]:
    """Return all places of one module, in an order that never changes."""
    nodes = list(ast_nodes(get_ast(_text(path))))
    return [
        Place(path, name, occurrence)
        for name, operator in operators().items()
        for occurrence in range(sum(len(list(operator.mutation_positions(node))) for node in nodes))
    ]


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _meaning(source: str) -> str | None:
    """Return what a module says without texts about it and types; None if it cannot be compiled."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return None
    return ast.dump(_Bare().visit(tree))


_OF_A_CLASS = {"frozen", "slots", "kw_only"}
"""What a type checker needs to know of a dataclass or struct, and no test."""


class _Bare(ast.NodeTransformer):
    """Removes annotations, which never run here, and type aliases of unions."""

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """Drop how its instances are made and kept."""
        calls = [each for each in node.decorator_list if isinstance(each, ast.Call)]
        for each in (node, *calls):
            each.keywords = [word for word in each.keywords if word.arg not in _OF_A_CLASS]
        self.generic_visit(node)
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        """Drop an argument's type."""
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        """Drop a variable's type; a field of a struct keeps its place by its name."""
        node.annotation = ast.Name("_", ast.Load())
        self.generic_visit(node)
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Drop the type of what comes back."""
        node.returns = None
        self.generic_visit(node)
        return node


def _difference(source: str, mutated: str) -> tuple[int, str, str]:
    """Return the first line that differs, and both versions of it."""
    old, new = source.splitlines(), mutated.splitlines()
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    for tag, first, last, begin, end in matcher.get_opcodes():
        if tag != "equal":
            return first + 1, _joined(old[first:last]), _joined(new[begin:end])
    return 0, "", ""


def _joined(lines: list[str]) -> str:
    return " ".join(line.strip() for line in lines)
