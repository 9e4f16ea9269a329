"""What the monitor makes of violations: their order, the machine's part, the evidence."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import harness.storm.rules
from harness.storm.rules.history import Decided
from harness.storm.rules.literal import history, motion, moving, stop
from harness.storm.rules.monitor import NAMES, evidence, judge, stood_still
from harness.storm.storm import MACHINE, STORM, Scene, summed

BROKEN = history(
    moving((1.0, 4.0, 30.0)),
    deeds=[motion(0.9), stop(2.0)],
    decisions=[Decided(2.005, "OPERATOR_LEADS", "STOP", "STOPPED", "", "the target is cleared")],
)


def test_quiet_history_breaks_no_rule() -> None:
    """Nothing was done, nothing moved."""
    assert judge(history()) == []


def test_violation_shows_what_was_sent_decided_and_where_both_were() -> None:
    """In the order of time, from the scene's begin on."""
    (found,) = judge(BROKEN)
    lines = evidence(BROKEN, found)
    words = "sent position position sent decided answered position position"
    assert [line.split("s  ", 1)[1].split()[0] for line in lines] == words.split()
    assert "the target is cleared" in lines[4]
    assert lines == sorted(lines)


def test_machine_that_stood_still_is_told_apart_and_never_hidden() -> None:
    """Longer than 30 ms, and around the violation."""
    for gap, apart in (((2.1, 2.14), 1), ((2.1, 2.12), 0), ((8.0, 9.0), 0)):
        known = dataclasses.replace(BROKEN, gaps=[gap])
        scene = Scene(3, 1, [], known, judge(known))
        assert len(scene.apart) == apart and len(scene.violations) == 1
        rows = {(row.fault, row.metric, row.measured) for row in scene.rows()}
        assert (MACHINE if apart else STORM, f"{NAMES[0]} [times]", 1.0) in rows
        assert "seed 3, scene 1" in scene.text()
        assert stood_still(known, scene.violations[0]) > 0.0 or not apart


def test_rows_of_scenes_are_added_up() -> None:
    """What broke a rule twice is counted twice."""
    rows = summed(2 * Scene(0, 0, [], BROKEN, judge(BROKEN)).rows())
    counted = {row.metric: row.measured for row in rows}
    assert counted[f"{NAMES[0]} [times]"] == 2.0 and counted["deeds sent"] == 4.0
    assert [row.metric for row in rows if not row.holds] == [f"{NAMES[0]} [times]"]


def test_monitor_shares_no_code_with_what_it_judges() -> None:
    """It imports nothing of the product."""
    files = sorted(Path(harness.storm.rules.__path__[0]).glob("*.py"))
    assert len(files) > 5
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        nodes = [n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)]
        taken = [ast.unparse(node) for node in nodes]
        assert not [text for text in taken if "scara" in text or "twin_controller" in text]
