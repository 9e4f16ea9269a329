"""Every process of the cell that becomes a node outlives a full disk and refuses web pages."""

from __future__ import annotations

import ast

from harness.sources import Module, modules

BECOMES = {"become_node", "init_node", "starting"}
HARDENS = {"become_node", "starting", "keep_registered", "harden_process"}
BRINGUP = "src/scara_bringup/src/scara_bringup/"
ELSEWHERE = {
    # The bring-up's main hardens the process before it makes the watch or shows the status.
    f"{BRINGUP}processes/controller_watch_node.py": "scara_bringup.cell_node",
    f"{BRINGUP}status/status_node.py": "scara_bringup.cell_node",
}


def called(module: Module) -> set[str]:
    """Return the names of all functions that a module calls, without what they belong to."""
    calls = (node.func for node in module.nodes if isinstance(node, ast.Call))
    return {
        func.attr if isinstance(func, ast.Attribute) else getattr(func, "id", "") for func in calls
    }


def test_every_module_that_becomes_a_node_hardens_its_process() -> None:
    """A node that forgets it can be ended by any page of a browser."""
    calls = {module.relative: called(module) for module in modules()}
    nodes = {name for name, names in calls.items() if names & BECOMES}
    assert len(nodes) > 10
    bare = {name for name in nodes if not calls[name] & HARDENS}
    assert bare == set(ELSEWHERE)
    for name in ELSEWHERE.values():
        (main,) = [each for each in calls if each.endswith(name.replace(".", "/") + ".py")]
        assert "harden_process" in calls[main]
