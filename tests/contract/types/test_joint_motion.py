"""Joint motion has one type for an instant and one over time; whatever else has its own is known.

The list with the reason of each stands in docs/architecture.md.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from harness.sources import nodes_of, parsed
from harness.workspace import ROOT

POSITIONS = {"q", "positions", "real_positions", "start", "asked"}
BESIDE = {"qdot", "velocities", "real_velocities", "t", "time", "times", "stamp", "stamps", "way"}
BESIDE |= {"at", "send_at", "clock_ms", "instants", "remote", "arrived", "limited", "points"}
VECTOR = re.compile(r"tuple\[(float|Joints|Vector|JointMotion), \.\.\.\]|Joints|Vector|_Rows|Array")
LISTS = {"list[float]", "FloatArray"}
OVER_TIME = {"names", "points"}
APART = ("fanuc_emulator", "reporting")
"""The stand-in shares nothing with the twin; a report is no motion."""


def fields(node: ast.ClassDef) -> dict[str, str]:
    """Return the fields of a class with their types; slots count as vectors."""
    found = {}
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            found[part.target.id] = ast.unparse(part.annotation)
        elif isinstance(part, ast.Assign) and ast.unparse(part.targets[0]) == "__slots__":
            found |= {name.strip("_"): "Vector" for name in ast.literal_eval(part.value)}
    return found


def own_types(tree: ast.Module) -> Iterator[str]:
    """Yield the classes that have joint positions of their own at an instant or over time."""
    for node in nodes_of(tree):
        if not isinstance(node, ast.ClassDef):
            continue
        has = fields(node)
        vectors = {name for name, kind in has.items() if VECTOR.fullmatch(kind) or kind in LISTS}
        instant = vectors & POSITIONS and set(has) & BESIDE
        if instant or set(has) == OVER_TIME:
            yield node.name


def documented() -> set[str]:
    """Return the types in the page's table."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    part = page.partition("## One currency for joint motion")[2].partition("\n## ")[0]
    return set(re.findall(r"^\| `(\w+)` \|", part, re.MULTILINE))


def test_each_type_of_joint_motion_is_in_the_table() -> None:
    """A second way to say the same is a converter more, and a place where they differ."""
    found = {
        name
        for path in sorted((ROOT / "src").rglob("*.py"))
        if not set(APART) & set(path.parts)
        for name in own_types(parsed(path))
    }
    assert sorted(found) == sorted(documented())


def test_a_type_of_its_own_is_found() -> None:
    """The test of the test: a struct, a class with slots, points over time; no target."""
    sources = (
        "class A:\n    q: Joints\n    t: float = 0.0",
        'class B:\n    __slots__ = ("_positions", "_times")',
        "class C:\n    names: tuple[str, ...]\n    points: Vector",
        "class D:\n    q: Joints\n    speed_percent: float",
        "class E:\n    motion: JointMotion\n    t: float",
    )
    assert [[*own_types(ast.parse(each))] for each in sources] == [["A"], ["B"], ["C"], [], []]
