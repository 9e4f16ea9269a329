"""Run a node, or say with ``--help`` what it takes and offers."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from scara_ros.interface import Interface, interface_of

HELP = ("-h", "--help")
SHELL = "_node"
"""Only modules with this end declare something; what they import from others does not."""


def run(main: Callable[[], None]) -> None:
    """Run ``main`` of a node's module; with ``--help`` print its interface and do not start it.

    Raises:
        SystemExit: Code 0 after the help.
    """
    if any(word in HELP for word in sys.argv[1:]):
        print(help_of(main.__module__))
        sys.exit(0)
    main()


def help_of(module: str) -> str:
    """Return the help of the node whose module is ``PACKAGE[.FOLDER].NODE_node``.

    The types come from the sources of the module and of all modules of nodes that it imports.
    """
    package, node = module.split(".")[0], module.split(".")[-1].removesuffix(SHELL)
    sources = dict(_sources(module))
    doc = inspect.cleandoc(ast.get_docstring(ast.parse(sources[module])) or "").replace("``", "")
    return "\n".join(
        [
            doc,
            "",
            f"usage: rosrun {package} {node} [_PARAMETER:=VALUE ...] [NAME:=OTHER_NAME ...]",
            *_tables(interface_of(sources.values())),
        ]
    )


def _tables(found: Interface) -> Iterator[str]:
    """Yield the lines of all tables that are not empty."""
    defaults = {
        name: f"default: {default}" if default else "" for name, default in found.parameters.items()
    }
    yield from _table("Parameters:", defaults)
    yield from _table("Publishes:", found.publishes)
    yield from _table("Subscribes to:", found.subscribes)
    yield from _table("Offers the services:", found.offers)
    yield from _table("Serves the actions:", found.actions)
    yield from _table("Calls the services:", found.calls)


def _table(title: str, rows: Mapping[str, str]) -> Iterator[str]:
    if rows:
        yield ""
        yield title
        width = max(map(len, rows))
        yield from (f"  {name:{width}}  {what}".rstrip() for name, what in rows.items())


def _sources(module: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of a module and of all modules of nodes that it imports, once each."""
    waiting, seen = [module], {module}
    while waiting:
        name = waiting.pop()
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:
            continue
        text = Path(spec.origin).read_text(encoding="utf-8")
        yield name, text
        nodes = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom))
        for imported in [node.module or "" for node in nodes if not node.level]:
            if imported.endswith(SHELL) and imported not in seen:
                seen.add(imported)
                waiting.append(imported)
