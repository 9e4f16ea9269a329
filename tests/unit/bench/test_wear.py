"""What stands beside the monitor of wear, and the tables of its page."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from harness.workspace import ROOT

if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from scara_config import load_robot
from twin_analysis.health.signs import Signs
from twin_analysis.health.trend import CONFIRMED, LEAST, WINDOW, Baseline, facts_of
from twin_analysis.health.trials import RobotRecord, judged

from bench import page
from bench.readme import with_blocks
from bench.wear.baselines import (
    ALL_RUNS,
    ALONE,
    HEALTHY_RUNS,
    RunSigns,
    features,
    monitor_of_pairs,
    pair_figures,
    told,
    trained,
    watch_of,
)
from bench.wear.table import health_blocks

JOINTS = ["joint_1", "joint_2", "joint_3", "joint_4", "table_joint"]
RANDOM = np.random.default_rng(1)


def signs(rubs: int | None = None) -> Signs:
    """Return signs of a cycle with noise; one joint may rub twice as much."""
    noise = 1.0 + 0.01 * RANDOM.standard_normal((6, 5))
    healthy = Signs(*(noise * np.array([[5.0], [6.0], [4.0], [2.0], [0.01], [0.0]])), 0.04)
    if rubs is None:
        return healthy
    more = 1.0 + (np.arange(5) == rubs)
    return replace(healthy, **{name: more * getattr(healthy, name) for name in WORN})


WORN = ("forward", "backward", "coulomb")


def run(rubs: int | None = None) -> RunSigns:
    """Return a labelled run."""
    label = ("healthy", "") if rubs is None else ("friction", JOINTS[rubs])
    return RunSigns(signs(), signs(rubs), label)


@pytest.mark.thorough
def test_a_classifier_learns_from_runs_and_is_asked_like_the_monitor() -> None:
    """Short form of ``./cell bench --health baselines``: runs by themselves, and as they come."""
    models = trained([run(k) for k in (None, 0, 1, 2, 3, 4) for _ in range(8)])
    tested = [run(k) for k in (None, 1, 2)]
    first = tuple(signs() for _ in range(LEAST))
    base = Baseline(facts_of(load_robot(ROOT / "config")), first)
    worn = tuple(signs(2) for _ in range(WINDOW + CONFIRMED))
    record = RobotRecord(base, first, first, (((), worn),))
    for name, model in models.items():
        trial = judged(record, partial(watch_of, model))
        shares = {
            each.note: each.value for each in pair_figures(name, tested, partial(told, model))
        }
        assert trial.false_alarms == () and shares[HEALTHY_RUNS] == 100.0
        if name == ALONE:
            # It knows what is usual, and neither kind nor joint.
            assert set(trial.results[0].said) <= {("unusual", "")}
            assert shares[ALL_RUNS] == pytest.approx(100.0 / 3.0)
            continue
        assert trial.results[0].said == (("friction", "joint_3"),), name
        assert trial.results[0].after == WINDOW + CONFIRMED - 1
        assert shares[ALL_RUNS] == 100.0
    assert [monitor_of_pairs()(each) for each in tested] == [each.label for each in tested]


def test_what_was_next_to_nothing_is_no_large_feature() -> None:
    """A ratio of it, or of a vacuum that nobody read, says no more than ten times."""
    first = replace(signs(), coulomb=np.zeros(5), vacuum_s=float("nan"))
    found = features(signs(), [first])
    assert np.all(np.isfinite(found)) and np.max(np.abs(found)) == 10.0


def test_the_page_has_a_row_of_each_robot_and_the_goals_above() -> None:
    """What is beyond its goal is bold; the digest of the runs stands there."""
    figure = {"what": "a robot", "unit": "%", "goal": 95.0, "value": 80.0, "at_least": True}
    figures = [
        {**figure, "note": "found", "holds": False},
        {**figure, "value": 100.0, "note": "right", "holds": True},
    ]
    at = {"date": "D", "commit": "C", "machine": "M", "seconds": 1.0}
    parts = [
        {"part": "wear", "figures": figures, **at},
        {"part": "runs", "figures": [{**figures[1], "note": "SHA-256 `12`"}], **at},
    ]
    blocks = health_blocks(parts)
    assert "| goal | ≥ 95 % | ≥ 95 % |\n| a robot | **80 %** | 100 % |" in blocks["wear"]
    assert blocks["varied"] == "Not measured yet: `./cell bench --health robots varied`."
    assert "commit C, M" in blocks["wear"] and "SHA-256 `12`" in blocks["runs"]


def test_the_page_of_wear_is_what_its_script_writes() -> None:
    """One source: ``./cell bench --page`` changes nothing."""
    text = page.HEALTH.read_text(encoding="utf-8")
    assert with_blocks(text, health_blocks(page.so_far().get("health", ())), "health.md") == text
