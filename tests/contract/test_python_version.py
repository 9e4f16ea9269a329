"""Nothing in the project needs a Python newer than 3.10.

Newer syntax is refused by ruff (``target-version`` in pyproject.toml); this test looks at names of
the standard library that came later, and at what changed its meaning.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from harness.sources import nodes_of, parsed
from harness.workspace import ROOT

NEWER = {
    "ast": {"TryStar"},
    "asyncio": {"Barrier", "Runner", "TaskGroup", "timeout", "timeout_at"},
    "calendar": {"Day", "Month"},
    "contextlib": {"chdir"},
    "copy": {"replace"},
    "datetime": {"UTC"},
    "enum": {
        *("EnumCheck", "EnumType", "FlagBoundary", "ReprEnum", "StrEnum"),
        *("global_enum", "member", "nonmember", "property", "show_flag_values", "verify"),
    },
    "functools": {"Placeholder"},
    "hashlib": {"file_digest"},
    "inspect": {"getmembers_static", "markcoroutinefunction"},
    "itertools": {"batched"},
    "logging": {"getHandlerByName", "getHandlerNames", "getLevelNamesMapping"},
    "math": {"cbrt", "exp2", "fma", "sumprod"},
    "operator": {"call", "is_none", "is_not_none"},
    "os": {"EFD_CLOEXEC", "listdrives", "process_cpu_count"},
    "sys": {"exception", "activate_stack_trampoline"},
    "threading": {"setprofile_all_threads", "settrace_all_threads"},
    "types": {"get_original_bases", "CapsuleType"},
    "typing": {
        *("LiteralString", "Never", "NoDefault", "NotRequired", "ReadOnly", "Required", "Self"),
        *("TypeAliasType", "TypeIs", "TypeVarTuple", "Unpack", "assert_never", "assert_type"),
        *("clear_overloads", "dataclass_transform", "get_overloads", "override", "reveal_type"),
    },
    "warnings": {"deprecated"},
    "": {"BaseExceptionGroup", "ExceptionGroup", "PythonFinalizationError"},
}
"""Names by module that the standard library has since 3.11 or later; "": built in."""
MODULES = {"tomllib", "wsgiref.types", "annotationlib", "string.templatelib", "compression"}
METHODS = {"add_note", "from_uri", "full_match", "walk_up", "with_segments"}
SEPARATE = {"asyncio.wait_for", "asyncio.wait", "asyncio.timeout"}
"""What they raise is TimeoutError since 3.11 only; before, it was ``asyncio.TimeoutError``."""
FILES = sorted(
    path
    for folder in ("config", "src", "tests", "bench", "setup", "examples", "docs")
    for path in (ROOT / folder).rglob("*.py")
    if ".venv" not in path.parts
)


def newer(text: str, tree: ast.Module) -> Iterator[str]:
    """Yield what a source, whose tree this is, uses that Python 3.10 does not have."""
    waits = any(name in text for name in SEPARATE)
    for node in nodes_of(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            if node.module in MODULES:
                yield node.module
            names = NEWER.get(node.module, set())
            yield from (f"{node.module}.{a.name}" for a in node.names if a.name in names)
        elif isinstance(node, ast.Attribute):
            module = node.value.id if isinstance(node.value, ast.Name) else ""
            if module and node.attr in NEWER.get(module, set()):
                yield f"{module}.{node.attr}"
            if node.attr in METHODS:
                yield f".{node.attr}"
        elif isinstance(node, ast.Name) and node.id in NEWER[""]:
            yield node.id
        elif waits and isinstance(node, (ast.Try, ast.With)) and catches_too_little(node):
            yield "TimeoutError of asyncio"


def catches_too_little(node: ast.Try | ast.With) -> bool:
    """Return whether asyncio's time-out is waited for under the built-in name."""
    parts = (each for part in node.body for each in ast.walk(part))
    if not {ast.unparse(each.func) for each in parts if isinstance(each, ast.Call)} & SEPARATE:
        return False
    if isinstance(node, ast.Try):
        caught = " ".join(ast.unparse(h.type) for h in node.handlers if h.type is not None)
    else:
        caught = " ".join(ast.unparse(item.context_expr) for item in node.items)
    return re.search(r"(?<![\w.])TimeoutError", caught) is not None


@pytest.mark.thorough
def test_no_source_needs_a_newer_python() -> None:
    """Each file, and exactly what is owed."""
    found = {path: set(newer(path.read_text("utf-8"), parsed(path))) for path in FILES}
    assert {str(path): names for path, names in found.items() if names} == {}


def test_ruff_refuses_newer_syntax() -> None:
    """Its target is the oldest Python that counts."""
    assert 'target-version = "py310"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("found", "source"),
    [
        (True, "import tomllib"),
        (True, "from typing import Self"),
        (True, "import datetime\nnow = datetime.UTC"),
        (True, "from asyncio import TaskGroup"),
        (True, "raise ExceptionGroup('', [])"),
        (True, "error.add_note('x')"),
        (True, "try:\n    await asyncio.wait_for(f(), 1)\nexcept TimeoutError:\n    pass"),
        (True, "with contextlib.suppress(TimeoutError):\n    await asyncio.wait_for(f(), 1)"),
        (False, "from typing_extensions import Self"),
        (False, "import ast\nast.walk(tree)"),
        (False, "try:\n    await asyncio.wait(f())\nexcept asyncio.TimeoutError:\n    pass"),
        (False, "try:\n    line.recv(1)\nexcept TimeoutError:\n    pass"),
    ],
)
def test_what_is_newer_is_found_and_nothing_else(found: bool, source: str) -> None:
    """The rule can fail; a name of another module, or of another package, is none of these."""
    assert bool(list(newer(source, ast.parse(source)))) is found
