"""What the monitor makes of violations: their order, the machine's part, the evidence."""

from __future__ import annotations

import ast
import dataclasses
import time
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import harness.storm.rules
import pytest
from harness.running.repeats import NOTES
from harness.storm import storm
from harness.storm.rules.history import Decided
from harness.storm.rules.literal import history, motion, moving, stop
from harness.storm.rules.monitor import NAMES, evidence, judge, stood_still
from harness.storm.rules.stops import TOO_LATE
from harness.storm.scenes import Step
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
    words = "sent sent decided answered position position position position"
    assert [line.split("s  ", 1)[1].split()[0] for line in lines] == words.split()
    assert "the target is cleared" in lines[2]
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


def test_machine_that_stood_still_excuses_no_death_and_nothing_that_comes_later() -> None:
    """A process that dies is none that is late, and a robot that moves long after is none."""
    gaps = [(2.0, 2.1)]
    moves = moving((1.0, 2.02, 30.0), (4.0, 5.0, 30.0))
    known: Any = {"deaths": ["gateway ended with -6"], "deeds": BROKEN.deeds, "gaps": gaps}
    late = history(moves, **known)
    scene = Scene(3, 1, [], late, judge(late))
    assert {v.rule for v in scene.violations} == {NAMES[0], NAMES[1], NAMES[-1]}
    assert scene.apart == []


def test_machine_that_stood_still_excuses_no_joint_beyond_its_range() -> None:
    """A late machine is none of its causes, as it may be of a speed."""
    for span, rule, excused in (
        ((1.0, 2.0, 115.0), "a joint beyond its range", False),
        ((1.0, 1.1, 440.0), "a joint beyond its speed", True),
    ):
        late = history(moving(span), deeds=[motion(0.9)], gaps=[(0.9, 2.0)])
        scene = Scene(3, 1, [], late, judge(late))
        assert {v.rule for v in scene.violations} == {rule}
        assert bool(scene.apart) is excused


@pytest.mark.parametrize(("said", "apart"), [("later", 0), (f"the controller {TOO_LATE}", 1)])
def test_machine_that_stood_still_excuses_no_refusal(said: str, apart: int) -> None:
    """Only what is about times: an answer may be late by it."""
    known = history(deeds=[stop(2.0, success=False, said=said)], gaps=[(1.9, 2.1)])
    scene = Scene(3, 1, [], known, judge(known))
    assert (len(scene.violations), len(scene.apart)) == (1, apart)


def test_scene_that_is_excused_by_the_machine_counts_as_a_repeat(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So that a run with many of them fails."""
    for gap, notes in (((2.1, 2.14), 1), ((8.0, 9.0), 0)):
        known = dataclasses.replace(BROKEN, gaps=[gap])
        scene = Scene(3, 0, [], known, judge(known))
        player = SimpleNamespace(play=lambda seed, number, scene=scene: scene)
        monkeypatch.setattr(storm, "Storm", lambda crew, player=player: player)
        crew: Any = None
        assert next(storm.scenes(crew, 3, 60.0)) is scene
        said = NOTES.take()
        assert len(said) == notes and all(NAMES[0] in text for text in said)


def test_rows_of_scenes_are_added_up() -> None:
    """What broke a rule twice is counted twice, and two scenes need two effects."""
    rows = {row.metric: row for row in summed(2 * Scene(0, 0, [], BROKEN, judge(BROKEN)).rows())}
    assert rows[f"{NAMES[0]} [times]"].measured == 2.0
    moves = rows["a command moves a side [times]"]
    assert moves.measured == moves.limit == 2.0


@pytest.mark.parametrize(("error", "raised"), [(TypeError, True), (ConnectionError, False)])
def test_deed_that_fails_by_itself_ends_the_storm(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception], raised: bool
) -> None:
    """A door that is broken does not: that is what a storm is for."""

    def fail(*_: object) -> None:
        raise error("a deed")

    state = SimpleNamespace(header=SimpleNamespace(stamp=SimpleNamespace(to_sec=time.time)))
    wire = SimpleNamespace(heal=lambda: None)
    crew: Any = SimpleNamespace(
        cell=SimpleNamespace(modbus=wire, web=wire, processes={}, states=[state], mode="IDLE"),
        strikes=SimpleNamespace(forget=lambda: None, done=[], births={}, down=set()),
        hands=SimpleNamespace(release_control=lambda: None),
        history=lambda begun, **known: history(),
        start_the_dead=list,
        deaths=list,
    )
    monkeypatch.setattr(storm, "draw", lambda *_: [Step(0.0, "STOP")])
    monkeypatch.setattr(storm, "WATCHED_S", 0.0)
    monkeypatch.setitem(storm.DEEDS, "STOP", fail)
    for name in ("release buttons", "pendant override"):
        monkeypatch.setitem(storm.DEEDS, name, lambda hands, attempt, *_: attempt.close(True, ""))
    monkeypatch.setitem(storm.DEEDS, "SPEED", lambda *_: None)
    with pytest.raises(error) if raised else nullcontext():
        assert storm.Storm(crew).play(0, 0).violations == []


def test_monitor_shares_no_code_with_what_it_judges() -> None:
    """It imports nothing of the product."""
    files = sorted(Path(harness.storm.rules.__path__[0]).glob("*.py"))
    assert len(files) > 5
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        nodes = [n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)]
        taken = [ast.unparse(node) for node in nodes]
        assert not [text for text in taken if "scara" in text or "twin_controller" in text]
