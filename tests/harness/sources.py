"""The workspace's packages and modules, read as text and syntax trees, never imported."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from harness.workspace import ROOT

SHELLS = ("_io", "_node")
"""How the names of modules end that touch the world; all others are pure."""
PACKAGES = [
    ROOT / "config",
    *sorted(file.parent for file in (ROOT / "src").glob("*/package.xml")),
]


@cache
def parsed(path: Path) -> ast.Module:
    """Parse a file once for all rules: the rules of one worker share it (running/lanes.py)."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@cache
def nodes_of(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return all nodes of a tree, walked once for all rules: that takes longer than to parse it."""
    return tuple(ast.walk(tree))


@dataclass(frozen=True)
class Module:
    """One Python file of a package."""

    package: str
    path: Path

    @property
    def tree(self) -> ast.Module:
        """Its syntax tree."""
        return parsed(self.path)

    @property
    def nodes(self) -> tuple[ast.AST, ...]:
        """All nodes of the tree."""
        return nodes_of(self.tree)

    @property
    def relative(self) -> str:
        """Its path below the root."""
        return str(self.path.relative_to(ROOT))

    @property
    def is_pure(self) -> bool:
        """Whether its name ends with neither _io nor _node, and it is no program of its own."""
        return self.path.name != "__main__.py" and not self.path.stem.endswith(SHELLS)


def package_name(folder: Path) -> str:
    """Return the name of the package in a folder."""
    return "scara_config" if folder == ROOT / "config" else folder.name


def started_by(script: Path) -> str:
    """Return the module whose main an executable starts; an empty text if it starts none."""
    found = re.search(r"^ *from (\S+) import main\b", script.read_text("utf-8"), re.M)
    return found[1] if found else ""


def modules() -> list[Module]:
    """List every Python module of every package, and what marks each exercise of the course."""
    return [
        Module(package_name(folder), path)
        for folder in PACKAGES
        for part in ("src", "exercises")
        for path in sorted((folder / part).rglob("*.py"))
        if "__pycache__" not in path.parts
    ]


def imported_names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield (absolute dotted name, line) of every import; ``from a import b`` yields ``a.b``."""
    for node in nodes_of(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                yield f"{node.module}.{alias.name}", node.lineno


def dotted(node: ast.AST) -> str:
    """Return ``np.random.normal`` for such an expression, an empty text for any other."""
    if isinstance(node, ast.Attribute):
        left = dotted(node.value)
        return f"{left}.{node.attr}" if left else ""
    return node.id if isinstance(node, ast.Name) else ""
