"""The controller's core has five parts; imports go downwards, and only the lead sees all of it."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest
from harness.sources import nodes_of, parsed
from harness.workspace import ROOT

CORE = ROOT / "src" / "twin_controller" / "src" / "twin_controller" / "core"
PREFIX = "twin_controller.core."

# From the floor up. A module may import what stands in its own line or above it in this list; what
# stands in no line of its own belongs to its folder.
LAYERS: tuple[tuple[str, ...], ...] = (
    ("", "events"),
    ("actions",),
    ("control",),
    ("safety.fastest",),
    ("setup",),
    ("orders.order",),
    ("sides",),
    ("safety",),
    ("orders", "follow"),
    ("lead.modes", "lead.repeated", "lead.table", "lead.table_page", "lead.state"),
    ("state",),
    ("lead",),
    ("step",),
)
APART = {("orders", "follow"), ("follow", "orders")}
SEES_ALL = ("step", "lead")
MODULES = {
    ".".join(path.relative_to(CORE).with_suffix("").parts)
    .removesuffix("__init__")
    .rstrip("."): parsed(path)
    for path in sorted(CORE.rglob("*.py"))
}


def layer(module: str) -> int:
    """Return the height of a module, such as ``sides.clock``."""
    for name in (module, module.partition(".")[0]):
        for height, names in enumerate(LAYERS):
            if name in names:
                return height
    raise AssertionError(f"core/{module} stands in no layer")


def imports(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and name of each module of the core that is imported."""
    for node in nodes_of(tree):
        if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith(PREFIX):
            name = f"{node.module}.".removeprefix(PREFIX).rstrip(".")
            for alias in node.names:
                inner = f"{name}.{alias.name}".lstrip(".")
                yield node.lineno, inner if inner in MODULES else name
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith(PREFIX):
                    yield node.lineno, alias.name.removeprefix(PREFIX)


def offences(module: str, tree: ast.Module) -> Iterator[str]:
    """Yield what a module must not do."""
    folder = module.partition(".")[0]
    for line, name in imports(tree):
        target = name.partition(".")[0]
        floor = layer(name) < layer("sides")
        apart = (folder, target) in APART and not floor
        if layer(name) > layer(module) or apart:
            yield f"core/{module}:{line} imports {name}, which stands above or beside it"
    for node in nodes_of(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and folder not in SEES_ALL:
            every = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            for argument in every:
                if argument.annotation and "CoreState" in ast.unparse(argument.annotation):
                    yield f"core/{module}:{node.lineno} {node.name}() takes the whole CoreState"
        if (
            isinstance(node, ast.Call)
            and ast.unparse(node.func) in ("getattr", "setattr")
            and not isinstance(node.args[1], ast.Constant)
        ):
            yield f"core/{module}:{node.lineno} builds a name: {ast.unparse(node)}"
        if isinstance(node, ast.Call) and any(
            keyword.arg is None
            and isinstance(keyword.value, ast.Dict)
            and not all(isinstance(key, ast.Constant) for key in keyword.value.keys)
            for keyword in node.keywords
        ):
            yield f"core/{module}:{node.lineno} builds a name: {ast.unparse(node)}"


def test_parts_take_their_own_and_import_downwards() -> None:
    """All offenders at once: who sees too much, who imports upwards, who builds names."""
    found = [each for module, tree in MODULES.items() for each in offences(module, tree)]
    assert not found, "\n".join(found)


def test_walk_sees_the_whole_core() -> None:
    """An empty walk would pass for ever."""
    wanted = {"sides", "lead", "orders", "safety", "follow", "step"}
    assert {name.partition(".")[0] for name in MODULES} >= wanted


@pytest.mark.parametrize(
    ("found", "module", "source"),
    [
        (True, "sides.clock", "from twin_controller.core.safety.guard import Guard"),
        (True, "sides.clock", "from twin_controller.core.safety import guard"),
        (True, "sides.clock", "from twin_controller.core import step"),
        (True, "sides.clock", "import twin_controller.core.lead.table"),
        (True, "follow.twin", "from twin_controller.core.orders.stop import STOPPING"),
        (True, "orders.stop", "from twin_controller.core.follow.memory import Follow"),
        (True, "setup", "from twin_controller.core.sides.side import Side"),
        (True, "lead.state", "from twin_controller.core.state import CoreState"),
        (True, "orders.stop", "def f(state: CoreState) -> None: ..."),
        (True, "safety.watch", "def f(*, state: 'CoreState | None') -> None: ..."),
        (True, "sides.side", "x = getattr(state, f'grip_{side}')"),
        (True, "lead.effects", "x = getattr(state, name)"),
        (True, "lead.effects", "x = replace(state, **{f'grip_{side}': 1})"),
        (False, "lead.effects", "def f(state: CoreState) -> None: ..."),
        (False, "safety.guard", "from twin_controller.core.sides.side import Side"),
        (False, "follow.twin", "from twin_controller.core.orders.order import Order"),
        (False, "step", "x = getattr(state, 'mode')"),
    ],
)
def test_what_is_forbidden_is_found_and_nothing_else(found: bool, module: str, source: str) -> None:
    """The test that guards the parts can fail."""
    assert bool(list(offences(module, ast.parse(source)))) is found
