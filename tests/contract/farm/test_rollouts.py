"""What protects people and stops robots cannot be rolled out; the code says what that is.

The rooms of the twin controller that judge safety, give orders, detect changes and decide the lead
are read as text: each section of twin_controller.yaml from which one of them reads anything is
protected as a whole. So a number that somebody adds to such a section is protected by default.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec
import pytest
from harness.workspace import ROOT
from scara_config.rollout.change import ALLOWED, Change
from twin_controller.config import TwinControllerConfig

FILE = "twin_controller.yaml"
CORE = ROOT / "src/twin_controller/src/twin_controller/core"
ROOMS = (
    *sorted((CORE / "safety").rglob("*.py")),
    *sorted((CORE / "orders").rglob("*.py")),
    *sorted((CORE / "lead").rglob("*.py")),
    *sorted((CORE / "authority").rglob("*.py")),
    CORE / "sides" / "change.py",
    # Its properties are how the others read cell and align.
    CORE / "setup.py",
)
FIELDS = {field.name: field.type for field in msgspec.structs.fields(TwinControllerConfig)}


def structs_in(kind: object) -> Iterator[type[msgspec.Struct]]:
    """Yield the structs that a type is or may hold."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        yield kind
    for part in getattr(kind, "__args__", ()):
        yield from structs_in(part)


SECTIONS = {name: [*structs_in(kind)] for name, kind in FIELDS.items()}
BY_STRUCT = {kind.__name__: name for name, kinds in SECTIONS.items() for kind in kinds}


def read_by(texts: Iterable[str]) -> set[str]:
    """Return the fields of TwinControllerConfig that modules read.

    A field counts where it is taken from something that is a configuration, also under another
    name, and where the type of a section is imported to be handed in.
    """
    found: set[str] = set()
    for text in texts:
        tree = ast.parse(text)
        names = {"config"} | {
            name for node in ast.walk(tree) for name in aliases(node, "TwinControllerConfig")
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module == "twin_controller.config":
                found |= {BY_STRUCT[a.name] for a in node.names if a.name in BY_STRUCT}
            elif isinstance(node, ast.Attribute) and node.attr in FIELDS:
                holder = node.value
                named = isinstance(holder, ast.Name) and holder.id in names
                if named or (isinstance(holder, ast.Attribute) and holder.attr == "config"):
                    found.add(node.attr)
    return found


def aliases(node: ast.AST, annotation: str) -> Iterator[str]:
    """Yield the names under which a node makes a configuration known."""
    if isinstance(node, ast.arg) and node.annotation is not None:
        if ast.unparse(node.annotation) == annotation:
            yield node.arg
    elif isinstance(node, ast.Assign):
        for target in node.targets:
            pairs = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts))
            for name, value in pairs:
                taken = isinstance(value, ast.Attribute) and value.attr == "config"
                if isinstance(name, ast.Name) and taken:
                    yield name.id


READ = read_by(path.read_text() for path in ROOMS)
KEYS = sorted(
    key
    for name in READ
    for key in (
        [
            f"{name}.{field.name}"
            for kind in SECTIONS[name]
            for field in msgspec.structs.fields(kind)
        ]
        or [name]
    )
)


@pytest.mark.parametrize("key", [*KEYS, *(f"{name}.a_number_of_tomorrow" for name in sorted(READ))])
def test_what_the_core_judges_by_cannot_be_rolled_out(key: str) -> None:
    """Each number of each section that safety, orders, lead or change detection read."""
    (fault,) = Change("x", {FILE: {key: 1000}}).faults()
    assert "is decided at the cell" in fault


def test_what_may_be_rolled_out_is_read_by_none_of_them() -> None:
    """The rule in force and the list from the code have nothing in common."""
    allowed = {each.partition(".")[0] for each in ALLOWED[FILE]}
    assert allowed <= set(FIELDS) and not allowed & READ, f"{allowed & READ} protect somebody"


def test_the_list_from_the_code_is_no_empty_one() -> None:
    """What these rooms are known to read is found, each by another way."""
    assert {"change", "stop", "estop", "separation", "cell", "divergence", "settle"} <= READ
    assert {"align", "gripper", "stream", "speed", "limit", "reset", "control", "home"} <= READ
    assert Path(ROOMS[0]).is_file() and len(ROOMS) > 30


@pytest.mark.parametrize(
    "text",
    [
        "def f(setup): return setup.config.response.first_ms",
        "def f(setup):\n    lead, numbers = 1, setup.config\n    return numbers.response",
        "def f(setup):\n    mine = setup.config\n    return mine.response.known_ms",
        "def f(given: TwinControllerConfig): return given.response",
        "from twin_controller.config import ResponseConfig",
        "def f(config): return config.response",
    ],
)
def test_a_number_that_is_read_tomorrow_is_found(text: str) -> None:
    """Whatever a module calls its configuration."""
    assert read_by([text]) == {"response"}
