"""How big the house is: counts that may only fall, with their budgets in budget.yaml.

A statement is what runs: neither an import nor a docstring. A struct is a dataclass or a subclass
of NamedTuple, TypedDict or msgspec's Struct. A fragment is a module of 11 to 39 lines. A helper
counts whose body has at most six lines and that one place calls.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import msgspec
from ruamel.yaml import YAML

from harness.sources import modules, nodes_of
from harness.workspace import ROOT

BUDGET = ROOT / "tests" / "contract" / "budget.yaml"
STRUCTS = {"NamedTuple", "TypedDict", "Struct"}
FRAGMENT = range(11, 40)
HELPER = 6
NO_DOCS = {".venv", ".pytest_cache", "build", "runs", "exercises"}
"""What holds no documents; the cards of the course's exercises are counted apart."""


class Budget(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The most of each that may be.

    Attributes:
        statements: For each package.
        house: For each other count, over all packages, tests and documents.
    """

    statements: dict[str, int]
    house: dict[str, int]


def load_budget() -> Budget:
    """Read budget.yaml."""
    return msgspec.convert(YAML(typ="safe").load(BUDGET), Budget)


@cache
def measure() -> Budget:
    """Count the project as it is."""
    of_packages = modules()
    named = [each.path for each in of_packages if each.path.name != "__init__.py"]
    classes = [
        node
        for each in of_packages
        for node in nodes_of(each.tree)
        if isinstance(node, ast.ClassDef)
    ]
    statements: Counter[str] = Counter()
    for each in of_packages:
        statements[each.package] += sum(1 for _ in statements_of(each.tree))
    return Budget(
        dict(sorted(statements.items())),
        {
            "fragments": len(fragments(named)),
            "folders with one module": len(lonely(named)),
            "helpers with one caller": sum(len(helpers_of(each.tree)) for each in of_packages),
            "structs": len(structs(classes)),
            "class names used twice": sum(n > 1 for n in Counter(c.name for c in classes).values()),
            "lines of tests": sum(
                len(path.read_text("utf-8").splitlines()) for path in ROOT.glob("tests/**/*.py")
            ),
            "words of documents": sum(
                len(path.read_text("utf-8").split())
                for path in ROOT.glob("**/*.md")
                if not NO_DOCS & set(path.relative_to(ROOT).parts)
            ),
            "words of cards": sum(
                len(path.read_text("utf-8").split())
                for path in ROOT.glob("src/scara_course/exercises/*/card.md")
            ),
        },
    )


def statements_of(tree: ast.Module) -> Iterator[ast.stmt]:
    """Yield the statements of a module that are neither imports nor docstrings."""
    for node in nodes_of(tree):
        text = node.value if isinstance(node, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            continue
        if isinstance(node, ast.stmt) and not isinstance(node, (ast.Import, ast.ImportFrom)):
            yield node


def fragments(paths: list[Path]) -> list[str]:
    """Return the modules of 11 to 39 lines, from the name of their package on."""
    sized = {path: len(path.read_text("utf-8").splitlines()) for path in paths}
    return [str(path).rpartition("/src/")[2] for path, n in sized.items() if n in FRAGMENT]


def lonely(paths: list[Path]) -> list[Path]:
    """Return the folders that hold one module and nothing else."""
    counts = Counter(path.parent for path in paths)
    beside = {"__pycache__", "__init__.py"}
    return [
        folder
        for folder, n in counts.items()
        if n == 1 and len({entry.name for entry in folder.iterdir()} - beside) == 1
    ]


def structs(found: list[ast.ClassDef]) -> list[str]:
    """Return the names of the structs among classes, those of structs' subclasses too."""
    names, before = set(STRUCTS), 0
    while len(names) > before:
        before = len(names)
        names |= {node.name for node in found if names & set(map(_last_name, node.bases))}
    return [
        node.name
        for node in found
        if node.name in names
        or any("dataclass" in ast.unparse(each) for each in node.decorator_list)
    ]


def _last_name(base: ast.expr) -> str:
    return ast.unparse(base).split("[")[0].split(".")[-1]


def helpers_of(tree: ast.Module) -> list[str]:
    """Return the private functions of at most six lines that one place calls."""
    uses: Counter[str] = Counter()
    calls: Counter[str] = Counter()
    nodes = nodes_of(tree)
    for node in nodes:
        if isinstance(node, (ast.Name, ast.Attribute)):
            uses[node.id if isinstance(node, ast.Name) else node.attr] += 1
        if isinstance(node, ast.Call):
            calls[getattr(node.func, "id", getattr(node.func, "attr", ""))] += 1
    return [
        node.name
        for node in nodes
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and node.name.startswith("_")
        and not node.name.startswith("__")
        and uses[node.name] == calls[node.name] == 1
        and not node.decorator_list
        and _body_lines(node) <= HELPER
    ]


def _body_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines a function's body has beside its docstring."""
    first = node.body[0]
    told = (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(node) else 0
    return (node.end_lineno or 0) - first.lineno + 1 - told


if __name__ == "__main__":
    YAML().dump(msgspec.to_builtins(measure()), sys.stdout)
