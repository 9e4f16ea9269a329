"""The aggregator's configuration is one that it can read, and knows every status of the cell.

Source: GenericAnalyzer's documented parameters; ``contains`` matches any part of a status's name.
"""

from __future__ import annotations

import re
from typing import Any

import pytest
import rosparam
from harness.workspace import ROOT

FILE = ROOT / "src" / "scara_bringup" / "diagnostics" / "analyzers.yaml"
KNOWN = {"type", "path", "contains", "timeout"}


def analyzers() -> dict[str, Any]:
    """Return the analyzers as ROS's own loader reads them."""
    ((read, _),) = rosparam.load_file(str(FILE), default_namespace="/")
    found: dict[str, Any] = read["analyzers"]
    return found


def told() -> set[str]:
    """Return what follows a node's name in each status that a source publishes."""
    text = "\n".join(
        path.read_text(encoding="utf-8") for path in (ROOT / "src").glob("*/src/**/*.py")
    )
    names = {
        f"/twin_controller: {name}" for name in re.findall(r'"twin_controller: ([\w ]+)', text)
    }
    names = {name.replace("link ", "link real") for name in names} | {"/twin_controller: link twin"}
    for node, name in (
        ("simulator", "physics"),
        ("simulator", "parts"),
        ("simulator", "payload"),
        ("camera", "pictures"),
        ("gateway", "web socket"),
        ("what_if", "judge"),
        ("what_if", "predictions"),
        ("health_watch", "wear"),
    ):
        assert f"get_name()}}: {name}" in text
        names.add(f"/{node}: {name}")
    count = len(re.findall(r"get_name\(\)\}: [a-z]", text))
    assert count == 8, "a status was added: name it here and in analyzers.yaml"
    return names | {"/recorder", "/motion_server/log"}


@pytest.mark.parametrize("namespace", ["", "/cell_2"])
def test_every_status_has_one_place_in_the_tree(namespace: str) -> None:
    """In each cell."""
    wrong = {
        name: places
        for name in told()
        if len(
            places := [
                key
                for key, analyzer in analyzers().items()
                if any(word in namespace + name for word in analyzer["contains"])
            ]
        )
        != 1
    }
    assert not wrong


def test_analyzers_are_generic_ones_with_known_keys() -> None:
    """A key that the aggregator does not know is ignored silently there."""
    for name, analyzer in analyzers().items():
        assert analyzer["type"] == "diagnostic_aggregator/GenericAnalyzer", name
        assert set(analyzer) == KNOWN, name
        assert len({a["path"] for a in analyzers().values()}) == len(analyzers())
